"""Pictures of buildings and evacuations: figures, and films that end in a file.

Clause: A8, each of the paper's figures has a counterpart here; none needs a display.
Read `page` (ink and paper) first, then `plans`, `relief` and `details` (buildings),
then `evacuation` (one instant), `film` (all of them), and last `senses`
(what an agent sees) and `curves` (how a training went).
"""

from reference.workshop.drawing.evacuation import Tally, frame, tally
from reference.workshop.drawing.film import animate
from reference.workshop.drawing.page import save
from reference.workshop.drawing.plans import graph, top
from reference.workshop.drawing.relief import closeup, oblique, walkable
from reference.workshop.drawing.senses import fire_senses, robot_senses

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
