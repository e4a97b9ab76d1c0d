"""Pictures of buildings and evacuations: figures, and films that end in a file.

Clause: A8, each of the paper's figures has a counterpart here; none needs a display.
Read `page` (ink and paper) first, then `plans`, `relief` and `details` (buildings),
then `evacuation` (one instant), `player` and `film` (all of them), and last `senses`
(what an agent sees) and `curves` (how a training went).
"""

from reference.drawing.details import closeup
from reference.drawing.evacuation import Tally, frame, tally
from reference.drawing.film import animate
from reference.drawing.page import save
from reference.drawing.plans import graph, top
from reference.drawing.relief import oblique, walkable
from reference.drawing.senses import fire_senses, robot_senses

__all__ = [
    "Tally",
    "animate",
    "closeup",
    "fire_senses",
    "frame",
    "graph",
    "oblique",
    "robot_senses",
    "save",
    "tally",
    "top",
    "walkable",
]
