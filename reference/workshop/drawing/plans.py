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

from reference.building import Area, Building, Kind, Landmark
from reference.navigation import navigation_of
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Style

Point = tuple[float, float]

_HALO: Style = {"path_effects": [withStroke(linewidth=2.2, foreground="white")]}
_BOX: Style = {"boxstyle": "round,pad=0.3", "fc": "white", "ec": page.TEXT, "lw": 0.8}
_LARGEST_TEXT, _SMALL_TEXT, _SMALLEST_TEXT = 10.0, 6.0, 4.0


def top(building: Building, floor: int | None = None) -> Figure:
    """Draw all floors from above, or one (0 is the first) [A8, Figs. 4-6]."""
    floors = page.chosen_floors(building, floor)
    figure, panels = page.floor_page(building, building.title, floors)
    page.foot(figure, page.swatches(page.present(building.kind[list(floors)])))
    figure.draw_without_rendering()
    for axes, index in zip(panels, floors, strict=True):
        _mark_exits(axes, building, index)
        for area in building.areas:
            if area.floor == index:
                write_name(axes, building, area)
    return figure


def graph(building: Building, floor: int | None = None) -> Figure:
    """Draw the graph over the floors: rooms are nodes, ways through are edges [A2].

    A node stands in the widest part of its room; an edge is the shortest way from there
    to the middle of the door, round the corners of the room if need be.
    """
    floors = page.chosen_floors(building, floor)
    title = f"{building.title}: the graph"
    figure, panels = page.floor_page(building, title, floors, fade=0.72)
    page.foot(figure, _graph_legend(building, floors))
    figure.draw_without_rendering()
    for axes, index in zip(panels, floors, strict=True):
        rooms = building.graph.nodes(data="floor")
        here = {name: building.area_of[name] for name, where in rooms if where == index}
        for *sides, key in building.graph.edges(here, keys=True):
            if key in building.landmark_of:  # not the stairs, which join two floors
                for side in (side for side in sides if side in here):
                    _draw_edge(axes, building, building.landmark_of[key], here[side])
        for area in here.values():
            _draw_node(axes, building, area)
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
    look: Style = _HALO,
) -> None:
    """Write a room's name, if the map has one and it fits; upright in a narrow room.

    offset: metres, from the building to the axes;  largest: font size, points
    look: by default so that one can draw beneath
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
        x, y = np.add(building.metres(*middle), offset)
        place: Style = {"rotation": 90 * upright, "ha": "center", "va": "center"}
        axes.text(x, y, area.name, fontsize=fits, **place, **look)


def _points_per_metre(axes: Axes) -> float:
    figure = axes.get_figure(root=True)
    assert figure is not None
    return axes.bbox.width / figure.dpi * 72 / float(np.ptp(axes.get_xlim()))


# -- Nodes and edges ----------------------------------------------------------------


def _draw_node(axes: Axes, building: Building, area: Area) -> None:
    """Draw a dot, or a square for a stairwell, and over it the name in a box."""
    stairs = area.kind == "stairwell"
    dot: Style = {"marker": "o", "ms": 7, "mfc": "white", "mec": page.TEXT}
    square: Style = {"marker": "s", "ms": 12, "color": COLOURS[Kind.ENTRANCE]}
    axes.plot(*building.metres(*widest(area.cells)[0]), **(square if stairs else dot))
    look: Style = {"color": "white"} if stairs else {"bbox": _BOX}
    write_name(axes, building, area, largest=8.0, look=look | {"zorder": 5})


def _draw_edge(axes: Axes, building: Building, mark: Landmark, area: Area) -> None:
    """Draw the way from a room's node to a door, with an arrowhead at an exit."""
    nav, ink = navigation_of(building), COLOURS[mark.kind]
    node = building.metres(*widest(area.cells)[0])
    inside = (building.area == area.index) | (building.landmark == mark.index)
    cost = np.where(inside.ravel(), 1.0, np.inf)
    start, door = nav.place(area.floor, *node), int(nav.goals[mark.index][0])
    corners = [start]
    for here, there in pairwise([start, *nav.way(start, door, cost)]):
        if not nav.clear.reaches(corners[-1], there):
            corners.append(here)
    way = np.vstack([node, nav.centres[corners[1:]], mark.position])
    axes.plot(*way.T, color=ink, lw=1.8, solid_joinstyle="round")
    exit = mark.kind is Kind.EXIT
    head: Style = {"marker": _arrowhead(building, mark) if exit else "s"}
    axes.plot(*mark.position, ms=10 if exit else 4, color=ink, **head)


def _graph_legend(building: Building, floors: Sequence[int]) -> list[Artist]:
    """Legend entries of the nodes and edges that occur on these floors."""
    there = page.present(building.kind[list(floors)])
    dot: Style = {"ls": "", "ms": 7}
    looks: dict[str, Style] = {
        "room": {"marker": "o", "color": page.TEXT, "mfc": "white", **dot}
    }
    if Kind.STAIRS in there:
        square: Style = {"marker": "s", "color": COLOURS[Kind.ENTRANCE], **dot}
        looks["stairwell"] = square
    for kind in (Kind.DOOR, Kind.ENTRANCE, Kind.EXIT):
        if kind in there:
            looks[page.MEANINGS[kind]] = {"color": COLOURS[kind], "lw": 2}
    return page.samples(looks)
