"""What an agent observes: its grid, channel by channel, and what its numbers say.

Clauses: C1, C2, C3, C4, D1.  The pages decode the very arrays that the networks are
given; they show nothing else of the world.

    vector  (V,) numbers of one agent;  cells  (channels, height, width), 0 or 1
    point   x and y in metres, and the storey; below the ground: gone
"""

from collections.abc import Iterable, Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure

from reference.building import Building, Kind
from reference.game.observations import (
    GRID_KINDS,
    Block,
    fire_vector,
    grid,
    robot_vectors,
    vector_layout,
)
from reference.paper import Scenario
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import DROP, FLAME, INK, SOURCE, STEPS
from reference.workshop.drawing.page import COLOURS, Style
from reference.world import World

_PANEL, _APART, _LINE, _EDGES = 2.7, (0.5, 0.75), 0.21, 1.3  # inches
_LOOKS: dict[str, Style] = {
    "human": {"marker": "o", "ms": 4.5, "mfc": STEPS[-1], "mec": INK, "mew": 0.6},
    "robot": {"marker": "D", "ms": 6, "mfc": "white", "mec": INK, "mew": 1.3},
    "the observer": {"marker": "D", "ms": 6, "mfc": INK, "mec": INK, "mew": 1.3},
    "fire source": {"marker": DROP, "ms": 9, "mfc": SOURCE, "mec": "white", "mew": 0.6},
}


def robot_senses(world: World, scenario: Scenario, robot: int = 0) -> Figure:
    """Draw what a robot observes; scenario: the simulation's own [C1] [C3] [C4].

    Human 1 is the nearest on its own floor. Raises ValueError where there is no such
    robot.
    """
    robots = len(world.robots)
    if not 0 <= robot < robots:
        raise ValueError(
            f"there is no robot {robot} among {robots}. Count from 0, as the agents' "
            "names robot_0, robot_1, ... do."
        )
    vector = robot_vectors(world, scenario)[robot]
    return _page(f"robot_{robot}", world, scenario, vector, observers=1)


def fire_senses(world: World, scenario: Scenario) -> Figure:
    """Draw what the fire agent observes; scenario: the simulation's own [D1].

    People and robots are numbered as they always are.
    """
    return _page("fire_0", world, scenario, fire_vector(world, scenario), observers=0)


def _page(
    agent: str, world: World, scenario: Scenario, vector: np.ndarray, observers: int
) -> Figure:
    """Draw a row for each floor, points and channels, and below them a table.

    observers: how many of the first robots observe themselves
    """
    building, cells = world.building, grid(world)
    layout = vector_layout(building, scenario)
    robots = layout.read(vector, "robots")
    points = {
        "human": layout.read(vector, "humans"),
        "robot": robots[observers:],
        "the observer": robots[:observers],
        "fire source": layout.read(vector, "fires"),
    }
    lines = table(vector, layout.blocks.values())
    floors, (wide, high) = building.floors, page.frame_of(building).size
    tall = _PANEL * max(high / wide, cells.shape[1] / cells.shape[2]) + _APART[1]
    columns, low = 1 + len(GRID_KINDS), (len(lines) + 2) * _LINE
    size = columns * (_PANEL + _APART[0]), floors * tall + low + _EDGES
    figure = page.sheet(f"{building.title}: what {agent} sees", *size)
    spec = figure.add_gridspec(
        floors + 1, columns, height_ratios=[*[tall] * floors, low]
    )
    for floor in range(floors):
        row = [figure.add_subplot(spec[floor, column]) for column in range(columns)]
        page.paint_floor(row[0], building, floor, _PANEL, fade=0.75)
        _draw_points(row[0], points, floor)
        for kind, axes in enumerate(row[1:]):
            _draw_channel(axes, building, cells, kind * floors + floor)
    shape = " x ".join(map(str, cells.shape))
    words = f"{len(vector)} numbers, human 1 marked, and a grid of {shape}, 0 or 1"
    _write_table(figure.add_subplot(spec[-1, :]), words, lines)
    page.foot(figure, _legend(building, cells, points))
    return figure


def _draw_points(axes: Axes, points: dict[str, np.ndarray], floor: int) -> None:
    """Draw the points on a floor, and number human 1."""
    for name, spots in points.items():
        here = spots[spots[:, 2] == floor]
        if len(here):
            look: Style = {"ls": "", "clip_on": False, "label": name}
            axes.plot(*here[:, :2].T, **look, **_LOOKS[name])
    for x, y, storey in points["human"][:1]:
        if storey == floor:
            look = {"textcoords": "offset points", "fontsize": 8, "weight": "bold"}
            axes.annotate("1", (x, y), (4, 3), **look)


def _draw_channel(
    axes: Axes, building: Building, cells: np.ndarray, channel: int
) -> None:
    """Draw a channel of the grid, row 0 and column 0 at the upper left."""
    kind, floor = divmod(channel, building.floors)
    inks = COLOURS[Kind.WALL], FLAME, COLOURS[_way_out(building, floor)]
    colours = ListedColormap([COLOURS[Kind.FLOOR], inks[kind]])
    axes.imshow(cells[channel], colours, vmin=0, vmax=1)
    axes.set_title(f"{channel}: {GRID_KINDS[kind]}, floor {floor + 1}", fontsize=9)
    axes.spines[:].set_visible(True)
    axes.locator_params(integer=True)


def _way_out(building: Building, floor: int) -> Kind:
    """Kind of cell that the exits' channel shows on a floor [C3, chosen]."""
    exits = (building.kind[floor] == Kind.EXIT).any()
    return Kind.EXIT if exits else Kind.ENTRANCE


def _legend(
    building: Building, cells: np.ndarray, points: dict[str, np.ndarray]
) -> list[Artist]:
    """Legend entries of the marks and colours on this page."""
    shown = [name for name, spots in points.items() if (spots[:, 2] >= 0).any()]
    marks = {name: {"ls": "", **_LOOKS[name]} for name in shown}
    ways = {_way_out(building, floor) for floor in range(building.floors)}
    burns = cells.reshape(len(GRID_KINDS), -1)[GRID_KINDS.index("fires")].any()
    flames = {"in flames": FLAME} if burns else {}
    walls = page.swatches([Kind.WALL], **flames)
    return [*page.samples(marks), *walls, *page.swatches(sorted(ways, reverse=True))]


# -- The table ----------------------------------------------------------------------

_HEADS = ("numbers", "what they say", "now")


def table(vector: np.ndarray, blocks: Iterable[Block]) -> list[tuple[str, str, str]]:
    """Explain all numbers of a vector: which, what, and the first values of a kind."""
    rows = []
    for block in blocks:
        last = block.stop - 1
        numbers = f"{block.start} to {last}" if last > block.start else f"{last}"
        times = f"{block.rows} × " if block.rows > 1 else ""
        unit = "" if block.unit == "1" else f" ({block.unit})"
        values = vector[block.start : block.stop].reshape(-1, len(block.low))
        if block.rows:
            rows.append((numbers, f"{times}{block.what}{unit}", _values(values)))
    return rows


def _values(values: np.ndarray) -> str:
    """Write all of (k, 1) numbers; of (k, 3) points the first two, and how many gone.

    Below the ground is who is gone.
    """
    words = [", ".join(page.number(v, 3) for v in value) for value in values]
    if values.shape[1] == 1:
        return ", ".join(words)
    gone = int((values[:, -1] < 0).sum())
    more = " …" * (len(words) > 2) + f", {gone} not there" * bool(gone)
    return " ".join(f"({point})" for point in words[:2]) + more


def _write_table(axes: Axes, title: str, lines: Sequence[tuple[str, str, str]]) -> None:
    """Write the lines under their heads, in columns as wide as their words."""
    axes.set_axis_off()
    axes.set_title(title, loc="center")
    look: Style = {"edges": "open", "cellLoc": "left", "colLoc": "left"}
    cells = axes.table(lines, colLabels=_HEADS, loc="upper center", **look)
    cells.auto_set_font_size(False)
    cells.set_fontsize(8)
    cells.auto_set_column_width(range(len(_HEADS)))
