"""Floors from above, and the graph of rooms drawn over them.

Clauses: A2 for the graph, A4, A8 (Figs. 4-6).  Every panel is in metres, north is up.
"""

from collections.abc import Sequence
from itertools import combinations_with_replacement, pairwise

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Annotation

from reference.building import Area, Building, Kind, Landmark
from reference.navigation import navigation_of
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Style

Point = tuple[float, float]

_HALO = [withStroke(linewidth=2.2, foreground="white")]
_LARGEST_TEXT, _SMALL_TEXT, _SMALLEST_TEXT = 10.0, 6.0, 4.0


def top(building: Building, floor: int | None = None) -> Figure:
    """Draw all floors from above, or one (0 is the first) [A8, Figs. 4-6]."""
    floors = page.chosen_floors(building, floor)
    figure, panels = page.floor_page(building, building.title, floors)
    page.foot(figure, page.swatches(page.present(building.kind[list(floors)])))
    figure.draw_without_rendering()
    for axes, index in zip(panels, floors, strict=True):
        page.paint_floor(axes, building, index)
        _mark_exits(axes, building, index)
        for area in building.areas:
            if area.floor == index:
                write_name(axes, building, area)
    return figure


def graph(building: Building, floor: int | None = None) -> Figure:
    """Draw the graph over the floors: rooms are nodes, ways through are edges [A2].

    A node stands in the widest part of its room; an edge goes through the middle of
    its door, round the corners of the room if need be.
    """
    floors = page.chosen_floors(building, floor)
    figure, panels = page.floor_page(building, f"{building.title}: the graph", floors)
    page.foot(figure, _graph_legend(building, floors))
    figure.draw_without_rendering()
    for axes, index in zip(panels, floors, strict=True):
        page.paint_floor(axes, building, index, fade=0.72)
        rooms = building.graph.nodes(data="floor")
        here = {name: building.area_of[name] for name, where in rooms if where == index}
        node = {name: building.metres(*widest(here[name].cells)[0]) for name in here}
        for *sides, key in building.graph.edges(here, keys=True):
            for side in node.keys() & set(sides):
                if key in building.landmark_of:  # not the stairs, which join two floors
                    mark = building.landmark_of[key]
                    _draw_edge(axes, building, mark, here[side], node[side])
        for name, area in here.items():
            _draw_node(axes, building, area, node[name])
    return figure


def _mark_exits(axes: Axes, building: Building, floor: int) -> None:
    """Draw a white arrowhead that points out, for readers who see no green."""
    size = 0.6 * _points_per_metre(axes)
    for mark in building.landmarks:
        if mark.floor == floor and mark.kind is Kind.EXIT:
            head = _arrowhead(building, mark)
            axes.plot(*mark.position, marker=head, ms=size, color="white", mew=0)


def _arrowhead(building: Building, exit: Landmark) -> tuple[int, int, float]:
    """Marker: a triangle that points out of the house."""
    east, north = outward(building, exit)
    return 3, 0, float(np.degrees(np.arctan2(-east, north)))


def outward(building: Building, exit: Landmark) -> tuple[int, int]:
    """Direction in which an exit leads out: a step east (x) and north (y) [A4]."""
    outside = np.pad(building.kind[exit.floor] == Kind.OUTSIDE, 1, constant_values=True)
    for row, col in exit.cells + 1:
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            if outside[row - y, col + x]:
                return x, y
    return 0, 0


# -- Names that fit into their rooms ------------------------------------------------


def widest(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Middle (row, column) and size (rows, columns) of a room's largest rectangle.

    cells: (k, 2) rows and columns of the room
    """
    first = cells.min(axis=0)
    room = np.zeros(np.ptp(cells, axis=0) + 1, dtype=bool)
    room[tuple((cells - first).T)] = True
    found = []
    for top, last in combinations_with_replacement(range(len(room)), 2):
        inside = room[top : last + 1].all(axis=0)
        borders = np.flatnonzero(np.diff(inside, prepend=False, append=False))
        for left, right in borders.reshape(-1, 2):
            found.append((top, left, last + 1 - top, right - left))
    *corner, height, width = max(found, key=lambda box: box[2] * box[3])
    size = np.array((height, width))
    return first + corner + (size - 1) / 2, size


def write_name(
    axes: Axes,
    building: Building,
    area: Area,
    offset: Point = (0.0, 0.0),
    largest: float = _LARGEST_TEXT,
) -> None:
    """Write a room's name, if the map has one and it fits; upright in a narrow room.

    offset: metres, from the building to the axes;  largest: font size, points
    """
    if area.name.startswith("room-"):
        return
    middle, size = widest(area.cells)
    steep, level = (
        page.text_size(area.name, inches, largest)
        for inches in 0.9 / 72 * _points_per_metre(axes) * size
    )
    upright = level < _SMALL_TEXT < steep
    fits = steep if upright else level
    if fits >= _SMALLEST_TEXT:
        look: Style = {"rotation": 90 * upright, "ha": "center", "va": "center"}
        look["path_effects"] = _HALO  # so that one can draw beneath
        x, y = np.add(building.metres(*middle), offset)
        axes.text(x, y, area.name, fontsize=fits, **look)


def _points_per_metre(axes: Axes) -> float:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return axes.bbox.width / figure.dpi * 72 / float(np.ptp(axes.get_xlim()))


# -- Nodes and edges ----------------------------------------------------------------


def _draw_node(axes: Axes, building: Building, area: Area, spot: Point) -> None:
    """Draw a room as a dot beside its name, a stairwell as a square with its letter."""
    stairs = area.kind == "stairwell"
    ink = COLOURS[Kind.ENTRANCE] if stairs else page.TEXT
    marker, size = ("s", 12) if stairs else ("o", 7)
    axes.plot(*spot, marker=marker, ms=size, color=ink, mec="white", zorder=4)
    words = area.name.removeprefix("room-")
    look: Style = {"textcoords": "offset points", "fontsize": 8, "zorder": 5}
    if stairs:
        look |= {"ha": "center", "va": "center_baseline", "color": "white"}
        axes.annotate(words, spot, (0, 0), **look)
        return
    name = axes.annotate(words, spot, (0, 0), path_effects=_HALO, **look)
    name.set(**min(_BESIDE, key=lambda side: _faults(building, area, name, side)))


_BESIDE: tuple[Style, ...] = tuple(
    {"position": (5 * x, 5 * y), "ha": ha, "va": va}
    for x, ha in ((0, "center"), (1, "left"), (-1, "right"))
    for y, va in ((1, "bottom"), (-1, "top"), (0, "center"))
    if x or y
)
"""Where a name can stand beside its node, in points, the best places first."""


def _faults(building: Building, area: Area, name: Annotation, side: Style) -> int:
    """Count a name's faults on a side: edges and names crossed, corners outside."""
    name.set(**side)
    axes = name.axes
    assert axes is not None
    box = name.get_window_extent()
    edges = [line for line in axes.lines if np.size(line.get_xdata()) > 1]
    paths = [axes.transData.transform_path(line.get_path()) for line in edges]
    crossed = sum(path.intersects_bbox(box, filled=False) for path in paths)
    others = [text.get_window_extent() for text in axes.texts if text is not name]
    crossed += 4 * box.count_overlaps(others)
    corners = axes.transData.inverted().transform(box.corners())
    room = {*map(tuple, area.cells.tolist())}
    return crossed + sum(building.cell(*corner) not in room for corner in corners)


def _draw_edge(
    axes: Axes, building: Building, mark: Landmark, area: Area, node: Point
) -> None:
    """Draw a line from a node to a door, with an arrowhead at an exit."""
    ink = COLOURS[mark.kind]
    way = np.transpose(_way(building, area, mark, node))
    axes.plot(*way, color=ink, lw=1.8, zorder=2, solid_joinstyle="round")
    exit = mark.kind is Kind.EXIT
    head: Style = {"marker": _arrowhead(building, mark) if exit else "s"}
    axes.plot(*mark.position, ms=10 if exit else 4, color=ink, zorder=3, **head)


def _way(building: Building, area: Area, mark: Landmark, start: Point) -> list[Point]:
    """Corners of the way from a room's node to its door."""
    ways = navigation_of(building)
    mine = (building.area == area.index) | (building.landmark == mark.index)
    cost = np.where(mine.ravel(), 1.0, np.inf)
    first = ways.place(area.floor, *start)
    door = int(ways.goals[mark.index][0])
    chain = [start, *map(tuple, ways.centres[ways.way(first, door, cost)[1]])]
    corners = [start]
    for here, there in pairwise([*chain[:-1], mark.position]):
        if not _straight(building, area, mark, corners[-1], there):
            corners.append(here)
    return [*corners, mark.position]


def _straight(
    building: Building, area: Area, mark: Landmark, start: Point, end: Point
) -> bool:
    """Check that a straight line stays in the room and its door."""
    steps = int(4 * np.hypot(end[0] - start[0], end[1] - start[1])) + 2
    for point in np.linspace(start, end, steps):
        cell = (area.floor, *building.cell(*point))
        if building.area[cell] != area.index and building.landmark[cell] != mark.index:
            return False
    return True


def _graph_legend(building: Building, floors: Sequence[int]) -> list[Artist]:
    """Legend entries of the nodes and edges that occur on these floors."""
    there = page.present(building.kind[list(floors)])
    dot: Style = {"ls": "", "ms": 7}
    looks: dict[str, Style] = {"room": {"marker": "o", "color": page.TEXT, **dot}}
    if Kind.STAIRS in there:
        square: Style = {"marker": "s", "color": COLOURS[Kind.ENTRANCE], **dot}
        looks["stairwell"] = square
    for kind in (Kind.DOOR, Kind.ENTRANCE, Kind.EXIT):
        if kind in there:
            looks[page.MEANINGS[kind]] = {"color": COLOURS[kind], "lw": 2}
    return page.samples(looks)
