"""The building seen obliquely from above: whole, where one may walk, and up close.

A cell is a cube of 1 m [A1].  The view is our own parallel projection, from the
south-west; boxes are painted back to front.

    x, y, z  metres east, north and up;  u, v  metres right and up on the page
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from reference.building import Area, Building, Kind
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Style
from reference.workshop.drawing.plans import (
    HALO,
    WAYS,
    level_size,
    points_per_metre,
    widest,
)

TURN = np.radians(28)  # of the view, from south
TILT = np.radians(34)  # of the view, above the flat
SLAB = 0.6  # metres of ceiling below a floor
GAP = 4.0  # metres of page between two storeys, the lower one's walls included
ROWS_IN_A_FLIGHT = 5  # rows of stairs, from one foot to the next
STEP_RISE = 0.15  # metres that a row of stairs is higher than the one before
WINDOW = np.array((12, 15))  # rows and columns that a close-up shows
TWO_LINES = 0.5  # inches a storey, if its number and name stand one above the other
LARGEST_NAME = 7.0  # points, of a room's
_LINK: Style = {"color": COLOURS[Kind.ENTRANCE], "lw": 1.4, "ls": (0, (4, 3))}


@dataclass(frozen=True)
class Look:
    """How boxes are drawn: heights in metres, 0 by default, colours, edges."""

    heights: dict[Kind, float]
    inks: dict[Kind, str]
    edges: str | None = None


SOLID = Look(
    {Kind.OUTSIDE: -SLAB, Kind.WALL: 0.8} | dict.fromkeys(WAYS, 0.6),
    COLOURS | {Kind.WALL: "#59616d"},
)
"""Walls as low as these hide 1.2 m of floor behind them: a room of two rows is seen."""

WALKABLE = Look(
    {Kind.OUTSIDE: -SLAB, Kind.WALL: 0.4},
    dict.fromkeys(Kind, "#4db5ee") | {Kind.WALL: "#9aa3ac"},
    "#2587c2",
)


def oblique(building: Building) -> Figure:
    """Draw the whole building, its storeys lifted off each other [A8, Fig. 1]."""
    figure = _storeys(building, ", seen from the south-west", SOLID)
    cells = page.swatches(building.kind, SOLID.inks)
    page.legend(figure, [*cells, *_links(building)])
    figure.draw_without_rendering()
    for area in building.areas:
        _write_name(figure.axes[0], building, area)
    return figure


def walkable(building: Building) -> Figure:
    """Draw every walkable cell, storey by storey [A8, Fig. 2] [A7]."""
    about = f": where one may walk, {building.walkable.sum()} m²"
    figure = _storeys(building, about, WALKABLE)
    inks = {"walkable": WALKABLE.inks[Kind.FLOOR], "wall": WALKABLE.inks[Kind.WALL]}
    page.legend(figure, [*page.patches(inks), *_links(building)])
    return figure


def closeup(building: Building) -> Figure:
    """Draw an exit, a stairwell entrance and a door up close [A8, Fig. 3].

    Each stands in the middle of its panel.
    """
    first = {mark.kind: mark for mark in reversed(building.landmarks)}
    kinds = [kind for kind in WAYS if kind in first]
    figure = page.sheet(building.title, 12, 3.8, ": ways through, up close")
    panels = figure.subplots(1, len(kinds), squeeze=False)[0]
    for axes, kind in zip(panels, kinds, strict=True):
        mark = first[kind]
        around = np.pad(building.kind[mark.floor], WINDOW.max())  # it is outside
        top, left = mark.cells[0] - WINDOW // 2 + WINDOW.max()
        rows, columns = WINDOW
        piece = around[top : top + rows, left : left + columns]
        add_boxes(axes, piece, SOLID)
        look: Style = {"color": COLOURS[kind], "weight": "bold", "loc": "center"}
        axes.set_title(page.MEANINGS[kind], **look)
    page.legend(figure, page.swatches(building.kind, SOLID.inks))
    return figure


def _links(building: Building) -> list[Artist]:
    """Make the legend entry of the lines that join storeys, if there are any."""
    links = {"stairwell, floor to floor": _LINK}
    return page.samples(links if building.stairwells else {})


def _storeys(building: Building, about: str, look: Look) -> Figure:
    """Draw all storeys, joined by dashed lines through their stairwells [A3].

    about: the end of the title
    """
    lift = lift_of(building)
    high = min(2.5 + 2.2 * building.floors, 9)
    figure = page.sheet(building.title, 9, high, about)
    axes = figure.subplots()

    for floor in range(building.floors):
        add_boxes(axes, building.kind[floor], look, floor * lift)
        name = page.floor_title(building, floor)
        if high > TWO_LINES * building.floors:
            name = name.replace(": ", "\n")
        axes.text(-1, floor * lift, name, ha="right", va="center", fontsize=10)
        for shaft in building.stairwells:
            if shaft.leads_down(floor + 1):
                u, v = _on_ground(building, shaft.centre)
                ends = np.array((floor, floor + 1)) * lift
                axes.plot([u, u], v + ends, **_LINK)
    return figure


def lift_of(building: Building) -> float:
    """How far above the one below a storey is drawn, metres on the page."""
    rows, cols = building.kind.shape[1:]
    away = min(cols / np.sin(TURN), rows / np.cos(TURN))  # across a floor, as one looks
    return float(GAP + np.sin(TILT) * away)


def _on_ground(building: Building, place: tuple[float, float]) -> np.ndarray:
    """Find where a place of the lowest floor, metres, is on the page."""
    left, *_, north = page.extent_of(building)
    x, y = np.subtract(place, (left, north))
    return project(np.array((x, y, 0)))


def _write_name(axes: Axes, building: Building, area: Area) -> None:
    """Write a room's name level over its widest part, if the map has one and it fits.

    The part is seen as a parallelogram, whose lower edge a wall hides; the name has its
    width half way up.
    """
    middle, (high, wide) = widest(area.cells)
    across = min(wide / np.cos(TURN), high / np.sin(TURN))
    size = level_size(area, points_per_metre(axes) * across, LARGEST_NAME)
    if size:
        u, v = _on_ground(building, building.metres(*middle))
        v += (
            area.floor * lift_of(building) + SOLID.heights[Kind.WALL] * np.cos(TILT) / 2
        )
        look: Style = {"ha": "center", "va": "center", "fontsize": size, **HALO}
        axes.text(u, v, area.name, **look)


def project(points: np.ndarray) -> np.ndarray:
    """Project metres in the building (..., 3) to metres on the page (..., 2)."""
    x, y, z = np.moveaxis(points, -1, 0)
    across = x * np.cos(TURN) - y * np.sin(TURN)
    away = x * np.sin(TURN) + y * np.cos(TURN)
    return np.stack([across, away * np.sin(TILT) + z * np.cos(TILT)], axis=-1)


BOX_FACES = np.array(
    [
        [(0, -1, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1)],  # south
        [(0, 0, 0), (0, -1, 0), (0, -1, 1), (0, 0, 1)],  # west
        [(0, 0, 1), (1, 0, 1), (1, -1, 1), (0, -1, 1)],  # lid
    ]
)
"""Corners of the sides that the eye sees, of a box whose north-west corner is at 0."""

SHADES = np.array((0.62, 0.8, 1.0))


def add_boxes(axes: Axes, kind: np.ndarray, look: Look, up: float = 0.0) -> None:
    """Paint (rows, cols) cells as boxes, back to front; up: metres on the page."""
    # Heights of all cells, with a rim around them.
    top = np.array([look.heights.get(each, 0.0) for each in Kind])[kind]
    steps = np.arange(len(kind), 0, -1)[:, None] % ROWS_IN_A_FLIGHT * STEP_RISE
    heights = np.where(kind == Kind.STAIRS, steps, top)
    around = np.pad(heights, 1, constant_values=-SLAB)

    # Boxes from the north, in a row from the east: what is nearer is painted later.
    row, col = np.nonzero(kind[:, ::-1])
    col = kind.shape[1] - 1 - col
    own = around[row + 1, col + 1]
    south = around[row + 2, col + 1]
    west = around[row + 1, col]
    ground = np.full_like(own, -SLAB)
    low = np.stack([south, west, ground], axis=1)  # where each face begins
    rise = own[:, None] - low
    corner = np.stack(np.broadcast_arrays(col[:, None], -row[:, None], low), axis=2)
    size = np.stack(np.broadcast_arrays(1.0, 1.0, rise), axis=2)
    corners = corner[:, :, None] + BOX_FACES * size[:, :, None]  # (k, 3, 4, 3)

    # Only sides that rise above the neighbour are seen.
    seen = rise > 0
    places = project(corners[seen]) + np.array((0.0, up))
    colours = page.paint(kind[row, col], look.inks)[:, None] * SHADES[:, None]
    fill = colours[seen]
    line: Style = {"ec": look.edges or fill, "lw": 0.3 if look.edges else 0.5}
    axes.add_collection(PolyCollection(places, fc=fill, zorder=2, **line))
    axes.set(aspect="equal")
    axes.set_axis_off()
