"""Pictures of buildings, evacuations and results: figures, and films.

Each of the paper's figures has a counterpart here [A8]; none needs a display.  Read
`page` first, then `plans` and `relief` (buildings), `choices` (what robots choose
between), `evacuation`, `web_film` and `film`.  A notebook shows what `draw` returns;
with `%load_ext reference.workshop.drawing` it shows buildings and simulations, too.
"""

from os import PathLike
from pathlib import Path
from typing import Any

from reference.building import Building
from reference.paper import InputError
from reference.simulation import Simulation
from reference.workshop.drawing.choices import anchors
from reference.workshop.drawing.crowding import crowding_map
from reference.workshop.drawing.evacuation import Tally, frame, history_of, tally
from reference.workshop.drawing.film import animate
from reference.workshop.drawing.page import Picture, pause, save, show
from reference.workshop.drawing.plans import graph, top
from reference.workshop.drawing.relief import closeup, oblique, walkable
from reference.workshop.drawing.senses import fire_senses, robot_senses
from reference.workshop.maps import load

__all__ = [
    "Picture",
    "Tally",
    "anchors",
    "animate",
    "closeup",
    "crowding_map",
    "draw",
    "fire_senses",
    "frame",
    "graph",
    "history_of",
    "load_ipython_extension",
    "oblique",
    "pause",
    "robot_senses",
    "save",
    "show",
    "tally",
    "top",
    "walkable",
]


def draw(
    shown: Building | Simulation | str | PathLike[str], path: str | Path | None = None
) -> Picture:
    """Draw a building from above, or a simulation as it is now; save it at the path.

    shown: also a map's path, name or text.  A notebook shows what comes back.
    Raises InputError for anything else, and what `load` and `save` raise.
    """
    if isinstance(shown, str | PathLike):
        shown = load(shown)
    if isinstance(shown, Building):
        figure = top(shown)
    elif isinstance(shown, Simulation):
        figure = frame(shown.world, history_of(shown))
    else:
        raise InputError(f"draw takes a map, a building or a simulation: {shown!r:.60}")
    if path:
        save(figure, path)
    return figure


def load_ipython_extension(shell: Any) -> None:
    """Let a notebook show buildings and simulations; IPython calls this."""
    shown = shell.display_formatter.formatters["image/png"].for_type
    shown(Building, _png)
    shown(Simulation, _png)


def _png(thing: Building | Simulation) -> bytes:
    return draw(thing)._repr_png_()
