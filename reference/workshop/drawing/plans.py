"""Floors from above, and the graph of rooms drawn over them.

Clauses: A8 (Figs. 4-6), A2 for the graph.  Every panel is in metres, north is up.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patheffects import withStroke

from reference.building import Area, Building, Kind, Landmark
from reference.navigation import navigation_of
from reference.workshop.drawing.page import (
    COLOURS,
    MEANINGS,
    TEXT,
    chosen_floors,
    floor_pages,
    foot,
    frame_of,
    paint,
    swatches,
    text_size,
)

Point = tuple[float, float]

_HALO = [withStroke(linewidth=2.2, foreground="white")]
_POINTS = 72  # to the inch
_LARGEST_TEXT, _SMALL_TEXT, _SMALLEST_TEXT = 10.0, 6.0, 4.0


def top(building: Building, floor: int | None = None) -> Figure:
    """All floors from above side by side, or one (0 is the first) [A8, Figs. 4-6]."""
    floors = chosen_floors(building, floor)
    figure, panels = floor_pages(building, building.title, floors)
    for axes, index in zip(panels, floors, strict=True):
        _ground(axes, building, index)
        _mark_exits(axes, building, index)
        for area in _areas_on(building, index):
            _write_name(axes, building, area)
    foot(figure, swatches())
    return figure


def graph(building: Building, floor: int | None = None) -> Figure:
    """The building graph over its floors: rooms are nodes, ways through are edges [A2].

    A node stands in the widest part of its room; an edge goes through the middle of
    its door, round the corners of the room if need be.
    """
    floors = chosen_floors(building, floor)
    figure, panels = floor_pages(building, f"{building.title}: the graph", floors)
    for axes, index in zip(panels, floors, strict=True):
        _ground(axes, building, index, fade=0.72)
        nodes = {
            a.id: building.metres(*widest(a.cells).middle)
            for a in _areas_on(building, index)
        }
        for mark in building.landmarks:
            if mark.floor == index:
                _draw_edge(axes, building, mark, nodes)
        for area in _areas_on(building, index):
            _draw_node(axes, area, nodes[area.id])
    foot(figure, _graph_legend())
    return figure


def _areas_on(building: Building, floor: int) -> list[Area]:
    return [a for a in building.areas if a.floor == floor]


def _ground(axes: Axes, building: Building, floor: int, fade: float = 0.0) -> None:
    axes.imshow(
        paint(building.kind[floor], fade),
        extent=frame_of(building).extent,
        interpolation="nearest",
        zorder=0,
    )


def _mark_exits(axes: Axes, building: Building, floor: int) -> None:
    """A white arrowhead that points the way out, for readers who see no green."""
    size = 0.6 * _points_per_metre(axes)
    for mark in building.landmarks:
        if mark.floor == floor and mark.kind is Kind.EXIT:
            head = _arrowhead(building, mark)
            axes.plot(*mark.position, marker=head, ms=size, color="white", mew=0)


def _arrowhead(building: Building, exit: Landmark) -> tuple[int, int, float]:
    east, north = outward(building, exit)
    return 3, 0, float(np.degrees(np.arctan2(-east, north)))


def outward(building: Building, exit: Landmark) -> tuple[int, int]:
    """Which way an exit leaves the building: one step east (x) and north (y) [A4]."""
    rows, cols = building.kind.shape[1:]
    for row, col in exit.cells:
        for x, y in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            r, c = row - y, col + x
            if not (0 <= r < rows and 0 <= c < cols):
                return x, y
            if building.kind[exit.floor, r, c] == Kind.OUTSIDE:
                return x, y
    return 0, 0


# -- Names that fit into their rooms ------------------------------------------------


@dataclass(frozen=True)
class Box:
    """A rectangle of cells: its first row and column, height and width."""

    row: int
    col: int
    height: int
    width: int

    @property
    def middle(self) -> tuple[float, float]:
        """Row and column, as `Building.metres` takes them."""
        return self.row + (self.height - 1) / 2, self.col + (self.width - 1) / 2


def widest(cells: np.ndarray) -> Box:
    """The largest rectangle of cells inside a room; cells: (k, 2) rows and columns."""
    corner = cells.min(axis=0)
    room = np.zeros(np.ptp(cells, axis=0) + 1, dtype=bool)
    room[tuple((cells - corner).T)] = True
    best = max(_boxes(room), key=lambda box: box.height * box.width)
    row, col = corner.tolist()
    return replace(best, row=best.row + row, col=best.col + col)


def _boxes(room: np.ndarray) -> Iterator[Box]:
    """For every stretch of rows the widest box that is inside the room all along."""
    for first in range(len(room)):
        inside = room[first].copy()
        for last in range(first, len(room)):
            inside &= room[last]
            borders = np.flatnonzero(np.diff(inside, prepend=False, append=False))
            if not len(borders):
                break
            starts, ends = borders[::2], borders[1::2]
            k = int(np.argmax(ends - starts))
            width = int(ends[k] - starts[k])
            yield Box(first, int(starts[k]), last - first + 1, width)


def _write_name(axes: Axes, building: Building, area: Area) -> None:
    """The name as large as it fits, upright where a room is narrow; or nothing."""
    if area.name.startswith("room-"):
        return
    box = widest(area.cells)
    inches = 0.9 * _points_per_metre(axes) / _POINTS
    level, steep = (
        text_size(area.name, cells * inches, _LARGEST_TEXT)
        for cells in (box.width, box.height)
    )
    upright = level < _SMALL_TEXT < steep
    size = steep if upright else level
    if size >= _SMALLEST_TEXT:
        axes.text(
            *building.metres(*box.middle),
            area.name,
            rotation=90 if upright else 0,
            fontsize=size,
            color=TEXT,
            ha="center",
            va="center",
        )


def _points_per_metre(axes: Axes) -> float:
    figure = axes.get_figure(root=True)
    assert figure is not None
    inches = axes.get_position().width * figure.get_size_inches()[0]
    return inches * _POINTS / float(np.ptp(axes.get_xlim()))


# -- Nodes and edges ----------------------------------------------------------------


def _draw_node(axes: Axes, area: Area, spot: Point) -> None:
    """A dot with its room's name above; a square with its stairwell's letter inside."""
    stairs = area.kind == "stairwell"
    axes.plot(
        *spot,
        marker="s" if stairs else "o",
        markersize=12 if stairs else 7,
        color=COLOURS[Kind.ENTRANCE] if stairs else TEXT,
        markeredgecolor="white",
        zorder=4,
    )
    axes.annotate(
        area.name.removeprefix("room-"),
        spot,
        xytext=(0, 0 if stairs else 5),
        textcoords="offset points",
        ha="center",
        va="center_baseline" if stairs else "bottom",
        fontsize=8,
        color="white" if stairs else TEXT,
        path_effects=None if stairs else _HALO,
        zorder=5,
    )


def _draw_edge(
    axes: Axes, building: Building, mark: Landmark, nodes: dict[str, Point]
) -> None:
    """From node to node through the door; an exit's edge ends in an arrowhead."""
    for area in (a for a in building.areas if a.id in mark.sides):
        axes.plot(
            *np.transpose(_way(building, area, mark, nodes[area.id])),
            color=COLOURS[mark.kind],
            linewidth=1.8,
            solid_joinstyle="round",
            zorder=2,
        )
    leads_out = mark.kind is Kind.EXIT
    axes.plot(
        *mark.position,
        marker=_arrowhead(building, mark) if leads_out else "s",
        markersize=10 if leads_out else 4,
        color=COLOURS[mark.kind],
        zorder=3,
    )


def _way(building: Building, area: Area, mark: Landmark, start: Point) -> list[Point]:
    """From a room's node to its door: straight, or round the room's corners."""
    if _straight(building, area, mark, start, mark.position):
        return [start, mark.position]
    ways = navigation_of(building)
    mine = (building.area == area.index) | (building.landmark == mark.index)
    cost = np.where(mine.ravel(), 1.0, np.inf)
    first = ways.place(area.floor, *start)
    door = int(ways.places_of(area.floor, mark.cells)[0])
    chain = [start, *map(tuple, ways.centres[ways.way(first, door, cost)[1]])]
    corners = [start]
    for here, there in pairwise([*chain[:-1], mark.position]):
        if not _straight(building, area, mark, corners[-1], there):
            corners.append(here)
    return [*corners, mark.position]


def _straight(
    building: Building, area: Area, mark: Landmark, start: Point, end: Point
) -> bool:
    """Does the straight line stay in the room, or its door?"""
    steps = int(4 * np.hypot(end[0] - start[0], end[1] - start[1])) + 2
    for point in np.linspace(start, end, steps):
        cell = (area.floor, *building.cell(*point))
        if building.area[cell] != area.index and building.landmark[cell] != mark.index:
            return False
    return True


def _graph_legend() -> list[Line2D]:
    def line(label: str, **look: object) -> Line2D:
        return Line2D([], [], label=label, markersize=7, **look)  # type: ignore[arg-type]

    nodes = [
        line("room", marker="o", color=TEXT, linestyle=""),
        line("stairwell", marker="s", color=COLOURS[Kind.ENTRANCE], linestyle=""),
    ]
    edges = [
        line(MEANINGS[kind], color=COLOURS[kind], linewidth=2)
        for kind in (Kind.DOOR, Kind.ENTRANCE, Kind.EXIT)
    ]
    return [*nodes, *edges]
