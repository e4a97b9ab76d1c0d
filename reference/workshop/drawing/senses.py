"""What an agent sees: its grid, channel by channel, and beside it what its numbers say.

Clauses: C1, C2, C3, C4, D1.  The pages show the very arrays that the networks are
given, decoded again; nothing of the world goes past them.

    vector  (V,) numbers of one agent;  cells  (channels, height, width), 0 or 1
    point   x and y in metres, and the storey; below the ground: gone
    mark    1, 2, ... a human, R1, ... a robot, F1, ... a fire source, as in the vector
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import MultipleLocator

from reference.building import Building, Kind
from reference.game.observations import (
    GRID_KINDS,
    Scene,
    Slot,
    decode,
    decode_fire,
    fire_layout,
    fire_vector,
    grid,
    robot_layout,
    robot_vectors,
)
from reference.paper import Scenario
from reference.workshop.drawing.evacuation import DROP, FLAME, INK, SOURCE, STEPS
from reference.workshop.drawing.page import (
    COLOURS,
    FAINT,
    MEANINGS,
    TEXT,
    arrange,
    blank,
    floor_title,
    foot,
    frame_of,
    heading,
    paint,
    text_size,
)
from reference.world import World


@dataclass(frozen=True)
class Senses:
    """What an agent is given, the vector decoded, and the meaning of its numbers."""

    title: str
    building: Building
    cells: np.ndarray
    vector: np.ndarray
    scene: Scene
    slots: tuple[Slot, ...]

    @property
    def observer(self) -> bool:
        """Is the first robot the one who sees this?"""
        return any(slot.what.startswith("the observer") for slot in self.slots)


def robot_senses(world: World, scenario: Scenario, robot: int = 0) -> Figure:
    """What a robot sees at this instant; scenario: the simulation's own [C1] [C3] [C4].

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
    scene = decode(vector, building, scenario)
    slots = robot_layout(building, scenario).slots
    title = f"{building.title}: what robot_{robot} sees"
    return _page(Senses(title, building, grid(world), vector, scene, slots))


def fire_senses(world: World, scenario: Scenario) -> Figure:
    """What the fire agent sees at this instant; scenario: the simulation's own [D1].

    People and robots are numbered as they always are.
    """
    building, vector = world.building, fire_vector(world, scenario)
    scene = decode_fire(vector, building, scenario)
    slots = fire_layout(building, scenario).slots
    title = f"{building.title}: what fire_0 sees"
    return _page(Senses(title, building, grid(world), vector, scene, slots))


# -- The page -----------------------------------------------------------------------

_GRIDS, _LARGEST = 5.7, 1.75  # inches for the grids of all floors; of one
_APART, _ABOVE = 0.2, 0.3  # inches beside a grid; above it, for its name
_ROOM, _SPARE = (8.4, 4.4), (0.5, 0.8)  # inches for all floors; around one
_TABLE, _LINE = 8.4, 0.19  # inches: width of the table, height of a line in it
_TITLE, _HEAD, _FOOT, _MARGIN = 0.6, 0.3, 0.7, 0.45


class Sheet:
    """An empty page with places for grids, floors and a table, in inches.

    right  where floors and table begin;  top  where all of them do;  table  its top
    """

    def __init__(self, building: Building, cells: np.ndarray, lines: int):
        floors, size = building.floors, frame_of(building).size
        high, wide = cells.shape[1:]
        side = min(_LARGEST, _GRIDS / floors - _APART)
        self.grid = np.array((wide, high)) * side / max(wide, high)
        self.columns, scale = arrange(floors, size, _ROOM, _SPARE)
        self.floor = np.array(size) * scale
        self.right = _MARGIN + max(floors * (self.grid[0] + _APART), 2.6) + 0.3
        panels = ceil(floors / self.columns) * (self.floor[1] + _SPARE[1])
        rest = max(
            len(GRID_KINDS) * (self.grid[1] + _ABOVE), panels + (lines + 2) * _LINE
        )
        self.top = _FOOT + rest
        self.table = self.top - panels - 0.05
        width = max(_TABLE, self.columns * (self.floor[0] + _SPARE[0]))
        self.page = blank(self.right + width + 0.1, self.top + _HEAD + _TITLE)

    def grid_of(self, kind: int, floor: int) -> Axes:
        """The place of a channel: kinds downwards, floors to the right."""
        x = _MARGIN + floor * (self.grid[0] + _APART)
        y = self.top - (kind + 1) * (self.grid[1] + _ABOVE)
        return self._axes(x, y, self.grid)

    def points_of(self, floor: int) -> Axes:
        """The place of a floor with points on it."""
        row, column = divmod(floor, self.columns)
        x = self.right + 0.3 + column * (self.floor[0] + _SPARE[0])
        y = self.top - (row + 1) * (self.floor[1] + _SPARE[1]) + _SPARE[1] - _ABOVE
        return self._axes(x, y, self.floor)

    def _axes(self, x: float, y: float, size: np.ndarray) -> Axes:
        width, height = self.page.get_size_inches()
        place = (x / width, y / height, size[0] / width, size[1] / height)
        return self.page.add_axes(place)

    def write(self, x: float, y: float, words: str, **look: Any) -> None:
        """Words at a place, as large as they should be."""
        width, height = self.page.get_size_inches()
        text = self.page.text(x / width, y / height, words, fontsize=8, color=TEXT)
        text.set(parse_math=False, **look)


def _page(senses: Senses) -> Figure:
    """Grids at the left, floors with points and a table at the right."""
    lines = table(senses)
    sheet = Sheet(senses.building, senses.cells, len(lines))
    heading(sheet.page, senses.title)
    shape = " x ".join(map(str, senses.cells.shape))
    says = f"the grid: {shape} numbers, 0 or 1"
    sheet.write(_MARGIN, sheet.top + 0.1, says, fontsize=10)
    size = len(senses.vector)
    says = f"the vector: {size} numbers; its points, marked where there is room"
    sheet.write(sheet.right, sheet.top + 0.1, says, fontsize=10)
    for channel in range(len(senses.cells)):
        kind, floor = divmod(channel, senses.building.floors)
        _draw_channel(sheet.grid_of(kind, floor), senses, channel)
    for floor in range(senses.building.floors):
        _draw_points(sheet.points_of(floor), senses, floor)
    _write_table(sheet, lines)
    foot(sheet.page, _legend(senses), columns=10)
    return sheet.page


# -- The grid -----------------------------------------------------------------------


def _draw_channel(axes: Axes, senses: Senses, channel: int) -> None:
    """One channel as an image, row 0 and column 0 at the upper left."""
    kind, floor = divmod(channel, senses.building.floors)
    inks = (COLOURS[Kind.WALL], FLAME, COLOURS[_way_out(senses.building, floor)])
    colours = ListedColormap([COLOURS[Kind.FLOOR], inks[kind]])
    axes.imshow(senses.cells[channel], colours, vmin=0, vmax=1, interpolation="nearest")
    title = f"{channel}: {GRID_KINDS[kind]}, floor {floor + 1}"
    axes.set_title(title, fontsize=8, color=TEXT, loc="left", pad=3)
    axes.spines[:].set_color(FAINT)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(10))
    last = kind == len(GRID_KINDS) - 1
    axes.tick_params(labelsize=6, color=FAINT, labelcolor=FAINT, length=2, pad=1)
    axes.tick_params(labelleft=floor == 0, labelbottom=last)
    if floor == 0:
        axes.set_ylabel("row", fontsize=7, color=FAINT, labelpad=1)
    if last:
        axes.set_xlabel("column", fontsize=7, color=FAINT, labelpad=1)


def _way_out(building: Building, floor: int) -> Kind:
    """What the exits' channel shows on a floor [C3, chosen]."""
    exits = (building.kind[floor] == Kind.EXIT).any()
    return Kind.EXIT if exits else Kind.ENTRANCE


# -- The points ---------------------------------------------------------------------

_LOOKS: dict[str, dict[str, Any]] = {
    "human": {"marker": "o", "ms": 4.5, "mfc": STEPS[-1], "mec": INK, "mew": 0.6},
    "robot": {"marker": "D", "ms": 6, "mfc": "white", "mec": INK, "mew": 1.3},
    "the observer": {"marker": "D", "ms": 6, "mfc": INK, "mec": INK, "mew": 1.3},
    "fire source": {"marker": DROP, "ms": 9, "mfc": SOURCE, "mec": "white", "mew": 0.6},
}
_REACH = {"human": 2.6, "robot": 5.0, "the observer": 5.0, "fire source": 5.0}
"""Points from the middle of what is drawn to its edge."""
_SIZE = 6.0  # points, of a mark


class Dot(NamedTuple):
    """A point of a vector: what stands there, its mark, and where, metres."""

    look: str
    mark: str
    x: float
    y: float


def dots(senses: Senses, floor: int) -> list[Dot]:
    """All points of a vector on a floor: robots first, then fires, then people."""
    scene = senses.scene
    groups = (
        ("robot", "R", scene.robots),
        ("fire source", "F", scene.fires),
        ("human", "", scene.humans),
    )
    found = [
        Dot(look, f"{letter}{k}", x, y)
        for look, letter, points in groups
        for k, (x, y, storey) in enumerate(points.tolist(), start=1)
        if storey == floor
    ]
    if senses.observer and found and found[0].mark == "R1":
        found[0] = found[0]._replace(look="the observer")
    return found


def _draw_points(axes: Axes, senses: Senses, floor: int) -> None:
    """A floor in faint colours, what the vector has there, and marks where they fit."""
    building = senses.building
    frame = frame_of(building)
    ground = paint(building.kind[floor], 0.75)
    axes.imshow(ground, extent=frame.extent, interpolation="nearest", aspect="auto")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(MultipleLocator(frame.step))
    axes.tick_params(labelsize=6, color=FAINT, labelcolor=FAINT, length=2, pad=1)
    axes.spines[:].set_visible(False)
    axes.set_xlabel("x, metres east", fontsize=7, color=FAINT, labelpad=1)
    if floor == 0:
        axes.set_ylabel("y, metres north", fontsize=7, color=FAINT, labelpad=0)
    title = floor_title(building, floor)
    size = text_size(title, axes.get_window_extent().width / axes.figure.dpi, 9)
    axes.set_title(
        title, fontsize=size, color=TEXT, loc="left", pad=3, parse_math=False
    )
    here = dots(senses, floor)
    for dot in here:
        axes.plot(dot.x, dot.y, ls="", **_LOOKS[dot.look])
    _write_marks(axes, here)


def _write_marks(axes: Axes, here: Sequence[Dot]) -> None:
    """Each mark beside its dot; none where a crowd leaves no room."""
    inches = axes.figure.dpi / 72
    spots = axes.transData.transform([(d.x, d.y) for d in here] or np.empty((0, 2)))
    (left, bottom), (right, top) = axes.get_window_extent().get_points() / inches
    places = beside(
        spots / inches,
        [_REACH[dot.look] for dot in here],
        [dot.mark for dot in here],
        (left, bottom, right, top),
    )
    for dot, spot, place in zip(here, spots / inches, places, strict=True):
        if place is not None:
            axes.annotate(
                dot.mark,
                (dot.x, dot.y),
                xytext=tuple(place - spot),
                textcoords="offset points",
                fontsize=_SIZE,
                color=TEXT,
                ha="center",
                va="center",
            )


Box = tuple[float, float, float, float]
"""Left, bottom, right, top."""


def beside(
    spots: np.ndarray, radii: Sequence[float], words: Sequence[str], room: Box
) -> list[np.ndarray | None]:
    """Middles of words that touch neither each other nor any spot; None: no room.

    spots (k, 2) and radii (k,) of what stands there, room: all in points. Those that
    come first choose first: right, left, above, below, askew; near, then further off.
    """
    taken = [_box(spot, r, r) for spot, r in zip(spots, radii, strict=True)]
    chosen: list[np.ndarray | None] = []
    for spot, radius, word in zip(spots, radii, words, strict=True):
        half = np.array((0.31 * len(word), 0.4)) * _SIZE
        chosen.append(None)
        for place in _around(spot, half + radius):
            box = _box(place, *half)
            if _within(box, room) and not any(_touch(box, other) for other in taken):
                chosen[-1] = place
                taken.append(box)
                break
    return chosen


def _around(spot: np.ndarray, reach: np.ndarray) -> list[np.ndarray]:
    """Places beside a spot that far to the side or up, then a bit further off."""
    sides = ((1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1))
    return [
        spot + np.array(side) * (reach + more) for more in (0.6, 3) for side in sides
    ]


def _box(middle: np.ndarray, wide: float, high: float) -> Box:
    x, y = middle.tolist()
    return x - wide, y - high, x + wide, y + high


def _touch(a: Box, b: Box) -> bool:
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def _within(a: Box, b: Box) -> bool:
    return b[0] <= a[0] and b[1] <= a[1] and a[2] <= b[2] and a[3] <= b[3]


# -- The table ----------------------------------------------------------------------


class Line(NamedTuple):
    """Numbers of a vector that mean the same: which, their marks, what, values."""

    numbers: str
    marks: str
    what: str
    values: str


_COLUMNS = (0.0, 0.75, 1.4, 5.5, _TABLE)  # inches from the left edge of the table


def table(senses: Senses) -> list[Line]:
    """What all numbers of a vector are, and what the first of each kind say now."""
    lines, counts = [], {"R": 0, "F": 0, "": 0}
    for what, members in groupby(senses.slots, _meaning):
        slots = list(members)
        marks, letter = "", _letter(what)
        if letter is not None:
            marks = _span(counts[letter] + 1, counts[letter] + len(slots), letter)
            counts[letter] += len(slots)
        numbers = _span(slots[0].start, slots[-1].stop - 1)
        says = what if letter is not None else slots[0].what
        says += ", …" if letter is None and len(slots) > 1 else ""
        unit = "" if slots[0].unit == "1" else f" ({slots[0].unit})"
        lines.append(
            Line(numbers, marks, f"{says}{unit}", _values(senses.vector, slots))
        )
    return lines


def _meaning(slot: Slot) -> str:
    """ "human: x, y, storey" for human 7 as for all others."""
    return re.sub(r" \d+(?=:|$)", "", slot.what)


def _letter(what: str) -> str | None:
    """Of the marks of points, None for numbers that are no point."""
    name, _, point = what.partition(":")
    return {"human": "", "fire source": "F"}.get(name, "R") if point else None


def _span(first: int, last: int, letter: str = "") -> str:
    """ "R3" or "R3 to R6"."""
    ends = (f"{letter}{first}", f"{letter}{last}")
    return ends[0] if first == last else " to ".join(ends)


def _values(vector: np.ndarray, slots: Sequence[Slot]) -> str:
    """All single numbers; of points the first two, and how many are gone."""
    values = [vector[slot.start : slot.stop].tolist() for slot in slots]
    if len(values[0]) == 1:
        return ", ".join(_number(value) for (value,) in values)
    points = [f"({', '.join(map(_number, value))})" for value in values[:2]]
    gone = sum(storey < 0 for *_, storey in values)
    words = " ".join([*points, "…"] if len(values) > 2 else points)
    return f"{words}, {gone} not there" if gone else words


def _number(value: float) -> str:
    """Three digits are enough to find it on the page."""
    return f"{value:.3g}".replace("-", "−")


def _write_table(sheet: Sheet, lines: Sequence[Line]) -> None:
    head = Line("numbers", "marks", "what they say", "now")
    for number, line in enumerate([head, *lines]):
        look: dict[str, Any] = {"color": FAINT if line is head else TEXT, "va": "top"}
        y = sheet.table - number * _LINE
        for words, left, right in zip(line, _COLUMNS, _COLUMNS[1:], strict=False):
            size = text_size(words or " ", right - left - 0.1, 8)
            sheet.write(sheet.right + left, y, words, fontsize=size, **look)


def _legend(senses: Senses) -> list[Any]:
    """What marks and colours mean on this page."""
    shown = {dot.look for f in range(senses.building.floors) for dot in dots(senses, f)}
    marks = [
        Line2D([], [], ls="", label=name, **look)
        for name, look in _LOOKS.items()
        if name in shown
    ]
    ways = {_way_out(senses.building, f) for f in range(senses.building.floors)}
    colours = {"wall": COLOURS[Kind.WALL], "in flames": FLAME}
    colours |= {MEANINGS[kind]: COLOURS[kind] for kind in sorted(ways, reverse=True)}
    patches = [
        Patch(facecolor=colour, edgecolor=FAINT, linewidth=0.5, label=name)
        for name, colour in colours.items()
    ]
    return [*marks, *patches]
