"""Pictures of buildings, evacuations and results: figures, and films.

Clause: A8, each of the paper's figures has a counterpart here; none needs a display.
Read `page` (style, legends, labels) first, then `plans` and `relief` (buildings),
`evacuation` (one instant), `film` (all of them), `crowding` (what they leave), `senses`
(what an agent observes) and `curves` (how a training went).
"""

from reference.workshop.drawing.crowding import crowded
from reference.workshop.drawing.evacuation import Tally, frame, tally
from reference.workshop.drawing.film import animate
from reference.workshop.drawing.page import save
from reference.workshop.drawing.plans import graph, top
from reference.workshop.drawing.relief import closeup, oblique, walkable
from reference.workshop.drawing.senses import fire_senses, robot_senses
