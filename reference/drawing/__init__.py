"""Pictures of buildings and evacuations: figures, and films that end in a file.

Clause: A8, each of the paper's figures has a counterpart here; none needs a display.
Read `page` (ink and paper) first, then `plans`, `relief` and `details` (buildings),
then `evacuation` (one instant), `player` and `film` (all of them).
"""

from reference.drawing.details import closeup
from reference.drawing.evacuation import Tally, frame, tally
from reference.drawing.film import animate
from reference.drawing.page import save
from reference.drawing.plans import graph, top
from reference.drawing.relief import oblique, walkable

__all__ = [
    "Tally",
    "animate",
    "closeup",
    "frame",
    "graph",
    "oblique",
    "save",
    "tally",
    "top",
    "walkable",
]
