"""What an agent observes: its grid, channel by channel, and what its numbers say.

Clauses: C1, C2, C3, C4, D1.  The pages decode the very arrays that the networks are
given; they show nothing else of the world.

    vector  (V,) numbers of one agent;  cells  (channels, height, width), 0 or 1
    point   x and y in metres, and the storey; below the ground: gone
    mark    1, 2, ... a human, R1, ... a robot, F1, ... a fire source, as in the vector
"""

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import ceil
from typing import NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure, SubFigure
from matplotlib.ticker import MultipleLocator
from matplotlib.transforms import Affine2D, Bbox

from reference.building import Building, Kind
from reference.game.observations import (
    GRID_KINDS,
    Slot,
    channels,
    fire_vector,
    grid,
    robot_vectors,
    vector_layout,
)
from reference.paper import Scenario
from reference.workshop.decoding import Decoded, decode
from reference.workshop.drawing import page
from reference.workshop.drawing.evacuation import DROP, FLAME, INK, SOURCE, STEPS
from reference.workshop.drawing.page import COLOURS, Style
from reference.world import World


@dataclass(frozen=True)
class Senses:
    """What an agent is given, the vector decoded, and the meaning of its numbers.

    observed_by  the mark of the robot that observes, "" for the fire
    """

    title: str
    observed_by: str
    building: Building
    cells: np.ndarray
    vector: np.ndarray
    decoded: Decoded
    slots: tuple[Slot, ...]


def robot_senses(world: World, scenario: Scenario, robot: int = 0) -> Figure:
    """Draw what a robot observes; scenario: the simulation's own [C1] [C3] [C4].

    People are numbered as the robot has them, its own floor's first and the nearest
    first; so are robots, itself first. Raises ValueError where there is no such robot.
    """
    robots = len(world.robots)
    if not 0 <= robot < robots:
        raise ValueError(
            f"there is no robot {robot} among {robots}. Count from 0, as the agents' "
            "names robot_0, robot_1, ... do."
        )
    building, vector = world.building, robot_vectors(world, scenario)[robot]
    decoded = decode(vector, building, scenario)
    slots = vector_layout(building, scenario).slots
    title = f"{building.title}: what robot_{robot} sees"
    return _page(Senses(title, "R1", building, grid(world), vector, decoded, slots))


def fire_senses(world: World, scenario: Scenario) -> Figure:
    """Draw what the fire agent observes; scenario: the simulation's own [D1].

    People and robots are numbered as they always are.
    """
    building, vector = world.building, fire_vector(world, scenario)
    decoded = decode(vector, building, scenario)
    slots = vector_layout(building, scenario).slots
    title = f"{building.title}: what fire_0 sees"
    return _page(Senses(title, "", building, grid(world), vector, decoded, slots))


# -- The page -----------------------------------------------------------------------

_GRIDS, _LARGEST, _APART = 5.7, 1.75, 0.35  # inches: of all grids, one, between two
_ROOM, _SPARE = (8.4, 4.4), (0.5, 0.8)  # inches for all floors; around one
_TABLE, _LINE = 8.4, 0.2  # inches: width of the table, height of a line in it
_EDGES = 1.6  # inches for title, headings and legend


def _page(senses: Senses) -> Figure:
    """Lay out grids at the left, floors with points and a table at the right."""
    building, lines = senses.building, table(senses)
    floors, size = building.floors, page.frame_of(building).size
    columns, scale = page.arrange(floors, size, _ROOM, _SPARE)
    high, wide = senses.cells.shape[1:]
    side = min(_LARGEST, _GRIDS / floors) / max(wide, high)
    left = max(floors * (side * wide + 0.15), 2.6) + _APART
    right = max(_TABLE, columns * (size[0] * scale + _SPARE[0]))
    panels = ceil(floors / columns) * (size[1] * scale + _SPARE[1])
    written = (len(lines) + 2) * _LINE
    tall = max(len(GRID_KINDS) * (side * high + _APART), panels + written)
    figure = page.sheet(senses.title, left + right, tall + _EDGES)
    grids, rest = figure.subfigures(1, 2, False, width_ratios=(left, right)).flat
    shares = (tall - written, written)
    points, words = rest.subfigures(2, 1, False, height_ratios=shares).flat
    _draw_grid(grids, senses)
    axes = page.floor_panels(points, building, range(floors), columns, scale)
    _write_table(words, lines)
    count = f"{len(senses.vector)} numbers; its points, marked where there is room"
    points.suptitle(f"the vector: {count}", fontsize=10)
    page.foot(figure, _legend(senses))
    figure.draw_without_rendering()
    for floor in range(floors):
        _draw_points(axes[floor], senses, floor)
    return figure


# -- The grid -----------------------------------------------------------------------


def _draw_grid(area: SubFigure, senses: Senses) -> None:
    """Draw each channel as an image, row 0 and column 0 at the upper left."""
    building = senses.building
    shape = " x ".join(map(str, senses.cells.shape))
    area.suptitle(f"the grid: {shape} numbers, 0 or 1", fontsize=10)
    area.supxlabel("column", fontsize=8, color=page.FAINT)
    area.supylabel("row", fontsize=8, color=page.FAINT)
    panels = area.subplots(
        len(GRID_KINDS), building.floors, sharex=True, sharey=True, squeeze=False
    )
    for channel, axes in enumerate(panels.flat):
        kind, floor = divmod(channel, building.floors)
        inks = (COLOURS[Kind.WALL], FLAME, COLOURS[_way_out(building, floor)])
        colours = ListedColormap([COLOURS[Kind.FLOOR], inks[kind]])
        axes.imshow(senses.cells[channel], colours, vmin=0, vmax=1)
        name = f"{channel}: {GRID_KINDS[kind]}, floor {floor + 1}"
        axes.set_title(name, fontsize=8, pad=3)
        axes.spines[:].set_visible(True)
        axes.tick_params(labelsize=6, length=2, pad=1)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(MultipleLocator(10))


def _way_out(building: Building, floor: int) -> Kind:
    """Kind of cell that the exits' channel shows on a floor [C3, chosen]."""
    exits = (building.kind[floor] == Kind.EXIT).any()
    return Kind.EXIT if exits else Kind.ENTRANCE


# -- The points ---------------------------------------------------------------------

_LOOKS: dict[str, Style] = {
    "human": {"marker": "o", "ms": 4.5, "mfc": STEPS[-1], "mec": INK, "mew": 0.6},
    "robot": {"marker": "D", "ms": 6, "mfc": "white", "mec": INK, "mew": 1.3},
    "the observer": {"marker": "D", "ms": 6, "mfc": INK, "mec": INK, "mew": 1.3},
    "fire source": {"marker": DROP, "ms": 9, "mfc": SOURCE, "mec": "white", "mew": 0.6},
}


class Dot(NamedTuple):
    """A point of a vector: how it looks, its mark, and where it is, metres."""

    look: str
    mark: str
    x: float
    y: float
    storey: float


_LETTERS = {"human": "", "robot": "R", "fire source": "F"}
"""First letter of a mark, by what a slot says first; other slots are robots."""


def _points(senses: Senses) -> list[Dot]:
    """List all points in the order of the vector, also of those who are gone."""
    decoded, counts = senses.decoded, Counter[str]()
    points = np.concatenate([decoded.humans, decoded.robots, decoded.fires]).tolist()
    names = [slot.what for slot in senses.slots if ":" in slot.what]
    found = []
    for what, point in zip(names, points, strict=True):
        look = next(name for name in _LETTERS if what.startswith(name))
        letter = _LETTERS[look]
        counts[letter] += 1
        mark = f"{letter}{counts[letter]}"
        if mark == senses.observed_by:
            look = "the observer"
        found.append(Dot(look, mark, *point))
    return found


def dots(senses: Senses, floor: int) -> list[Dot]:
    """List all points on a floor: robots first, then fires, then people."""
    here = [dot for dot in _points(senses) if dot.storey == floor]
    return sorted(here, key=lambda dot: dot.look == "human")


def _draw_points(axes: Axes, senses: Senses, floor: int) -> None:
    """Draw a floor in faint colours, its points, and marks where they fit."""
    page.paint_floor(axes, senses.building, floor, 0.75)
    here = dots(senses, floor)
    for dot in here:
        axes.plot(dot.x, dot.y, ls="", clip_on=False, **_LOOKS[dot.look])
    write_marks(axes, [(dot.x, dot.y) for dot in here], [dot.mark for dot in here])


def write_marks(
    axes: Axes, spots: Sequence[tuple[float, float]], marks: Sequence[str]
) -> None:
    """Write a mark right of its point, left, above or below: where there is room.

    The page must be laid out.  spots: in data
    """
    figure = axes.get_figure(root=True)
    assert figure is not None
    points = axes.transData.transform(np.reshape(spots, (-1, 2))) * 72 / figure.dpi
    taken = [Bbox.from_bounds(x - 2, y - 2, 4, 4) for x, y in points]
    inside = axes.bbox.transformed(Affine2D().scale(72 / figure.dpi))
    small: Style = {"textcoords": "offset points", "fontsize": 6}
    for spot, point, mark in zip(spots, points, marks, strict=True):
        half = np.array((2.2 * len(mark), 3.2))
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)) * (half + 4.5):
            box = Bbox(np.add((-half, half), point)).translated(x, y)
            free = not box.count_overlaps(taken)
            if free and inside.count_contains(box.get_points()) == 2:
                axes.annotate(mark, spot, (x, y), ha="center", va="center", **small)
                taken.append(box)
                break


# -- The table ----------------------------------------------------------------------


class Row(NamedTuple):
    """Numbers of a vector that mean the same: which, their marks, what, values."""

    numbers: str
    marks: str
    what: str
    values: str


def table(senses: Senses) -> list[Row]:
    """Explain all numbers of a vector; the values of the first of each kind."""
    marks, rows = (dot.mark for dot in _points(senses)), []
    for what, members in groupby(senses.slots, _meaning):
        slots = list(members)
        first, last = slots[0], slots[-1]
        values = senses.vector[first.start : last.stop].reshape(len(slots), -1)
        numbers = _span(f"{first.start}", f"{last.stop - 1}")
        unit = "" if first.unit == "1" else f" ({first.unit})"
        if ":" in what:
            mine = [next(marks) for _ in slots]
            row = numbers, _span(mine[0], mine[-1]), f"{what}{unit}", _places(values)
        else:
            more = ", …" if len(slots) > 1 else ""
            now = ", ".join(page.number(value, 3) for value in values.ravel())
            row = numbers, "", f"{first.what}{more}{unit}", now
        rows.append(Row(*row))
    return rows


def _meaning(slot: Slot) -> str:
    """Drop a slot's own number: "human: x, y, storey" for human 7."""
    return re.sub(r" \d+(?=:|$)", "", slot.what)


def _span(first: str, last: str) -> str:
    return first if first == last else f"{first} to {last}"


def _places(points: np.ndarray) -> str:
    """Write the first two of (k, 3) points, and how many are gone."""
    words = [f"({', '.join(page.number(v, 3) for v in point)})" for point in points[:2]]
    words += ["…"] * (len(points) > 2)
    gone = int((points[:, 2] < 0).sum())
    return " ".join(words) + f", {gone} not there" * bool(gone)


def _write_table(area: SubFigure, lines: Sequence[Row]) -> None:
    """Write four columns, each as wide as its longest line."""
    axes = area.add_subplot()
    axes.set_axis_off()
    columns = list(zip(*lines, strict=True))
    widths = np.array([max(map(len, column)) + 3 for column in columns])
    size = page.text_size(" " * widths.sum(), _TABLE, 8)
    look: Style = {"fontsize": size, "linespacing": 1.6}
    heads = ("numbers", "marks", "what they say", "now")
    starts = (np.cumsum(widths) - widths) / widths.sum()
    for x, head, column in zip(starts, heads, columns, strict=True):
        axes.text(x, 1, head, va="bottom", color=page.FAINT, **look)
        axes.text(x, 1, "\n".join(column), va="top", **look)


def _legend(senses: Senses) -> list[Artist]:
    """Legend entries of the marks and colours on this page."""
    shown = {dot.look for f in range(senses.building.floors) for dot in dots(senses, f)}
    marks = {name: {"ls": "", **_LOOKS[name]} for name in _LOOKS if name in shown}
    ways = {_way_out(senses.building, f) for f in range(senses.building.floors)}
    burns = channels(senses.cells, senses.building, "fires").any()
    flames = {"in flames": FLAME} if burns else {}
    cells = page.swatches([Kind.WALL], **flames)
    return [*page.samples(marks), *cells, *page.swatches(sorted(ways, reverse=True))]
