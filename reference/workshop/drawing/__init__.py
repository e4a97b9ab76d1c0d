"""Pictures of buildings, evacuations and results: figures, and films.

Each of the paper's figures has a counterpart here [A8]; none needs a display.  Read
`page` first, then `plans` and `relief` (buildings), `choices` (what robots choose
between), `evacuation`, `web_film` and `film`.  In a notebook, `%load_ext
reference.workshop.drawing` shows buildings and simulations.
"""

from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from reference.building import Building
from reference.simulation import Simulation
from reference.workshop.drawing.choices import anchors
from reference.workshop.drawing.crowding import crowding_map
from reference.workshop.drawing.evacuation import Tally, frame, history_of, tally
from reference.workshop.drawing.film import animate
from reference.workshop.drawing.page import pause, save, show
from reference.workshop.drawing.plans import graph, top
from reference.workshop.drawing.relief import closeup, oblique, walkable
from reference.workshop.drawing.senses import fire_senses, robot_senses


def draw(shown: Building | Simulation, path: str | Path | None = None) -> Figure:
    """Draw a building from above, or a simulation as it is now; save it at the path."""
    if isinstance(shown, Building):
        figure = top(shown)
    else:
        figure = frame(shown.world, history_of(shown))
    if path:
        save(figure, path)
    return figure


def load_ipython_extension(shell: Any) -> None:
    """Let a notebook show buildings and simulations; IPython calls this."""
    shown = shell.display_formatter.formatters["image/png"].for_type
    shown(Building, _png)
    shown(Simulation, _png)


def _png(thing: Building | Simulation) -> bytes:
    content = BytesIO()
    draw(thing).savefig(content, format="png")
    return content.getvalue()
