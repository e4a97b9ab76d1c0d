"""Floors from above, and the graph of rooms drawn over them.

Every panel is in metres, north is up.
"""

from itertools import combinations_with_replacement

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.text import Text
from numpy.typing import ArrayLike

from reference.building import Area, Building, Kind, Landmark
from reference.navigation import navigation_of
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Picture, Style

HALO: Style = {"path_effects": [withStroke(linewidth=2.2, foreground="white")]}
_BOX: Style = {"boxstyle": "round,pad=0.3", "fc": "white", "ec": page.TEXT, "lw": 0.8}
_OVER_NAMES: Style = {"zorder": 4, "clip_on": False, "in_layout": False}
_NUMBER_TEXT = 8.0
_SMALL_TEXT, _SMALLEST_TEXT = 6.0, 4.0
_CORNER_TEXT = 6.5
_MARGIN = 1.5  # points, of a name in a corner
_LETTER = 0.62  # width of a letter, in heights


def _way(marker: str, size: float, colour: str) -> Style:
    return {"color": colour, "lw": 1.8, "marker": marker, "ms": size}


WAYS: dict[Kind, Style] = {
    Kind.DOOR: _way("s", 4, COLOURS[Kind.DOOR]),
    Kind.ENTRANCE: _way("s", 4, COLOURS[Kind.ENTRANCE]),
    Kind.EXIT: _way("*", 11, COLOURS[Kind.EXIT]),
}
"""Edges of the graph: a mark at the door, lines to the rooms on its sides."""

LANES = {Kind.DOOR: 0, Kind.ENTRANCE: 1, Kind.EXIT: -1}
"""Where ways of a kind run beside those of others that go the same way."""
LANE = 2.0  # points from one to the next
WIDEST_LANE = 0.3  # metres: lines stay in the cells that one walks in

NODES: dict[str, Style] = {
    "room": {"ls": "", "marker": "s", "ms": 7, "color": page.TEXT, "mfc": "white"},
    "stairwell": {"ls": "", "marker": "s", "ms": 12, "color": COLOURS[Kind.ENTRANCE]},
}


def top(building: Building, floor: int | None = None) -> Picture:
    """Draw all floors from above, or one (0 is the first) [A8, Figs. 4-6]."""
    floors = [*range(building.floors)] if floor is None else [floor]
    figure, panels = page.floor_page(building, building.title, floors)
    page.legend(figure, page.swatches(building.kind[floors]))
    page.lay_out(figure, building, panels)
    for area in building.areas:
        if area.floor in panels:
            write_name(panels[area.floor], building, area)
    return figure


def graph(building: Building) -> Figure:
    """Draw the graph over the floors: rooms are nodes, ways through are edges [A2].

    A node stands in the widest part of its room; lines lead to its doors as one walks,
    those of doors, entrances and exits beside each other.  A number in the wall is that
    of the way beside it: by a door, 7 is 1/door-7.
    """
    floors = range(building.floors)
    figure, panels = page.floor_page(
        building, building.title, floors, ": the graph", alpha=0.28
    )
    kinds = {a.kind for a in building.areas} | {m.kind for m in building.landmarks}
    nodes = {kind: look for kind, look in NODES.items() if kind in kinds}
    ways = {page.MEANINGS[kind]: look for kind, look in WAYS.items() if kind in kinds}
    numbers = "numbers: of doors, entrances and exits on their floor, as in"
    look = {"title": f"{numbers} {building.landmarks[-1].id}", "title_fontsize": 9}
    page.legend(figure, page.samples(nodes | ways), **look)
    page.lay_out(figure, building, panels)

    for *sides, key in building.graph.edges(keys=True):
        mark = building.landmark_of.get(key)
        if mark is None:  # stairs
            continue
        axes = panels[mark.floor]
        lane = min(LANE / points_per_metre(axes), WIDEST_LANE)
        for side in sides:
            if side in building.area_of:  # the outside is no room
                way = _way_from(mark, building.area_of[side], building)
                x, y = beside(way, lane * LANES[mark.kind])
                axes.plot(x, y, **WAYS[mark.kind], markevery=[0])
    for area in building.areas:
        axes = panels[area.floor]
        axes.plot(*node_of(building, area), **NODES[area.kind])
        box: Style = {"bbox": _BOX} if area.kind == "room" else {"color": "white"}
        write_name(axes, building, area, 8.0, look=box)
    for mark in building.landmarks:
        if mark.kind is Kind.EXIT:  # once more, over names
            panels[mark.floor].plot(*mark.position, **WAYS[mark.kind] | _OVER_NAMES)
    numbered = [_write_numbers(axes, building, k) for k, axes in panels.items()]
    if not any(numbered):
        figure.legends[0].set_title("")
    return figure


def _write_numbers(axes: Axes, building: Building, floor: int) -> bool:
    """Write each way's number in the nearest wall cell that has none, if it fits.

    Returns whether any is written.
    """
    size = min(0.8 * points_per_metre(axes), _NUMBER_TEXT)
    cells = np.argwhere(building.kind[floor] == Kind.WALL).tolist()
    if size < _SMALLEST_TEXT or not cells:
        return False
    walls = np.array([building.metres(*cell) for cell in cells])
    look: Style = {"ha": "center", "va": "center_baseline", "fontsize": size}
    for mark in building.landmarks:
        if mark.floor == floor:
            k = np.hypot(*(walls - mark.position).T).argmin()
            x, y = walls[k]
            if np.isinf(x):  # all are taken
                break
            axes.text(x, y, mark.id.rpartition("-")[2], **look)
            walls[k] = np.inf  # taken
    return bool(np.isinf(walls).any())


def _way_from(mark: Landmark, area: Area, building: Building) -> np.ndarray:
    """Find the corners of the way from a door to its room's node: (2, k) metres."""
    nav = navigation_of(building)
    node = node_of(building, area)
    start = nav.place(area.floor, *node)
    door = int(nav.goals[mark.index][0])
    inside = (building.area == area.index) | (building.landmark == mark.index)
    costs = np.where(inside, 1.0, np.inf)  # no way leads through another room
    chain = [start, *nav.way(start, door, costs)]
    corners = nav.centres[nav.corners(chain)]
    way = np.vstack([node, corners, mark.position])[::-1]
    moves = np.diff(way, axis=0, prepend=np.inf).any(axis=1)  # an exit may be a corner
    return way[moves].T


def beside(way: np.ndarray, metres: float) -> np.ndarray:
    """Move a line to its left, as one walks along it; its ends stay; all (2, k).

    Corners are cut off where they would be farther out than a right angle's.
    """
    forward = np.diff(way)
    forward = forward / np.hypot(*forward)
    left = np.stack([-forward[1], forward[0]])
    before, after = left[:, :-1], left[:, 1:]
    turn = np.maximum(1 + (before * after).sum(axis=0), 1.0)  # 1 at a right angle
    moved = way.copy()
    moved[:, 1:-1] += metres * (before + after) / turn
    return moved


# -- Names that fit into their rooms ------------------------------------------------


def widest(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Find a room's largest rectangle: middle (row, column), size (rows, columns).

    cells: (k, 2) rows and columns of the room
    """
    first = cells.min(axis=0)
    room = np.zeros(np.ptp(cells, axis=0) + 1, dtype=bool)
    room[tuple((cells - first).T)] = True

    # All spans of rows: the widest run of columns that is room in every one of them.
    rectangles = []
    for top, last in combinations_with_replacement(range(len(room)), 2):
        inside = room[top : last + 1].all(axis=0)
        borders = np.flatnonzero(np.diff(inside, prepend=False, append=False))
        for left, right in borders.reshape(-1, 2):
            rectangles.append((top, left, last + 1 - top, right - left))

    *corner, height, width = max(rectangles, key=lambda box: box[2] * box[3])
    size = np.array((height, width))
    return first + corner + (size - 1) / 2, size


def node_of(building: Building, area: Area) -> tuple[float, float]:
    """Find the middle of the widest part of a room, metres."""
    return building.metres(*widest(area.cells)[0])


def write_name(
    axes: Axes,
    building: Building,
    area: Area,
    largest: float = 10.0,
    move: np.ndarray | None = None,
    look: Style = HALO,
) -> Text | None:
    """Write a room's name, if the map has one and it fits; upright in a narrow room.

    largest: font size, points;  move: of the building on the axes, metres
    """
    size, upright = lettering(area, points_per_metre(axes), largest)
    if not size:
        return None
    x, y = node_of(building, area)
    if move is not None:
        x, y = np.add((x, y), move)
    place: Style = {"ha": "center", "va": "center", "rotation": 90 if upright else 0}
    return axes.text(x, y, area.name, fontsize=size, **place, **look)


def write_in_corner(
    axes: Axes, building: Building, area: Area, move: ArrayLike = (0.0, 0.0)
) -> Text | None:
    """Write a room's name small and grey into its north-west, below other marks.

    move: of the building on the axes, metres
    """
    metre = points_per_metre(axes)
    size, upright = lettering(area, metre, _CORNER_TEXT)
    if not size:
        return None
    middle, size_of_room = widest(area.cells)
    corner = building.metres(*(middle - size_of_room / 2))
    margin = np.array((_MARGIN, -_MARGIN)) / metre
    x, y = np.array(corner) + margin + np.asarray(move)
    place: Style = {"ha": "left", "va": "top", "rotation": 90 if upright else 0}
    look: Style = {"size": size, "color": page.FAINT, "zorder": 2.5, **HALO}
    return axes.text(x, y, area.name, **place, **look)


def north_end(area: Area) -> np.ndarray:
    """Find the middle of a stairwell's northern row: (row, column)."""
    first = area.cells[area.cells[:, 0] == area.cells[0, 0]]
    return np.asarray(first.mean(axis=0))


def lettering(area: Area, metre: float, largest: float) -> tuple[float, bool]:
    """Choose the size of a room's name, 0 where it has no place; and if it is upright.

    metre, largest: points
    """
    high, wide = metre * widest(area.cells)[1]
    upright = bool(_fitting(area, wide) < _SMALL_TEXT < _fitting(area, high))
    return level_size(area, high if upright else wide, largest), upright


def level_size(area: Area, wide: float, largest: float) -> float:
    """Choose the size of a room's name in so much space, 0 where it has no place.

    wide, largest: points
    """
    size = min(_fitting(area, wide), largest)
    if size < _SMALLEST_TEXT or area.name.startswith("room-"):
        return 0.0
    return size


def _fitting(area: Area, wide: float) -> float:
    """The size in which a room's name fills so much space; points."""
    return 0.9 * wide / _LETTER / len(area.name)


def points_per_metre(axes: Axes) -> float:
    """Measure how many points on the page, once it is laid out, show a metre."""
    (left, _), (right, _) = axes.transData.transform([(0, 0), (72, 0)])
    return float(right - left) / axes.figure.dpi
