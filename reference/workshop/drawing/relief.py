"""The building seen obliquely from above: whole, where one may walk, and up close.

Clauses: A1 for the unit cubes, A2, A3 and A4 for what is shown up close, A7 for the
walkable cells, A8 (Figs. 1 to 3).  The view is our own parallel projection, from the
south-west; boxes are painted back to front.

    x, y, z  metres east, north and up;  u, v  metres right and up on the page
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure

from reference.building import Building, Kind
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Style
from reference.workshop.drawing.plans import WAYS

TURN, TILT = np.radians(28), np.radians(34)  # of the view: from south, above the flat
SLAB = 0.6  # metres of ceiling below a floor
GAP = 4.0  # metres of page between two storeys, the lower one's walls included
WINDOW = np.array((12, 15))  # rows and columns that a close-up shows
_LINK: Style = {"color": COLOURS[Kind.ENTRANCE], "lw": 1.4, "ls": (0, (4, 3))}


@dataclass(frozen=True)
class Look:
    """How boxes are drawn: heights in metres, 0 by default, colours, edges."""

    heights: dict[Kind, float]
    inks: dict[Kind, str]
    edges: str | None = None


SOLID = Look(
    {Kind.OUTSIDE: -SLAB, Kind.WALL: 1.5} | dict.fromkeys(WAYS, 1.2),
    COLOURS | {Kind.WALL: "#59616d"},
)
WALKABLE = Look(
    {Kind.OUTSIDE: -SLAB, Kind.WALL: 0.4},
    dict.fromkeys(Kind, "#4db5ee") | {Kind.WALL: "#9aa3ac"},
    "#2587c2",
)


def oblique(building: Building) -> Figure:
    """Draw the whole building, its storeys lifted off each other [A8, Fig. 1]."""
    figure = _storeys(building, f"{building.title}, seen from the south-west", SOLID)
    page.legend(figure, page.swatches(building.kind))
    return figure


def walkable(building: Building) -> Figure:
    """Draw every walkable cell, storey by storey [A8, Fig. 2] [A7]."""
    title = f"{building.title}: where one may walk, {building.walkable.sum()} m²"
    figure = _storeys(building, title, WALKABLE)
    inks = {"walkable": WALKABLE.inks[Kind.FLOOR], "wall": WALKABLE.inks[Kind.WALL]}
    page.legend(figure, page.swatches([], **inks))
    return figure


def closeup(building: Building) -> Figure:
    """Draw an exit, a stairwell entrance and a door up close [A8, Fig. 3]."""
    first = {mark.kind: mark for mark in reversed(building.landmarks)}
    kinds = [kind for kind in WAYS if kind in first]
    figure = page.sheet(f"{building.title}: ways through, up close", 12, 3.8)
    panels = figure.subplots(1, len(kinds), squeeze=False)[0]
    for axes, kind in zip(panels, kinds, strict=True):
        cells, middle = building.kind[first[kind].floor], first[kind].cells[0]
        top, left = np.clip(middle - WINDOW // 2, 0, None)
        piece = cells[top : top + WINDOW[0], left : left + WINDOW[1]]
        add_boxes(axes, piece, SOLID)
        look: Style = {"color": COLOURS[kind], "weight": "bold", "loc": "center"}
        axes.set_title(page.MEANINGS[kind], **look)
    page.legend(figure, page.swatches(building.kind))
    return figure


def _storeys(building: Building, title: str, look: Look) -> Figure:
    """Draw all storeys, joined by dashed lines through their stairwells [A3]."""
    rows, cols = building.kind.shape[1:]
    left, *_, north = page.extent_of(building)
    lift = GAP + np.sin(TILT) * min(cols / np.sin(TURN), rows / np.cos(TURN))
    figure = page.sheet(title, 9, min(2.5 + 2.2 * building.floors, 9))
    axes = figure.subplots()
    for floor in range(building.floors):
        add_boxes(axes, building.kind[floor], look, floor * lift)
        name = page.floor_title(building, floor).replace(": ", "\n")
        axes.text(-1, floor * lift, name, ha="right", va="center", fontsize=10)
        for shaft in building.stairwells:
            if shaft.leads_down(floor + 1):
                x, y = np.subtract(shaft.centre, (left, north))
                u, v = project(np.array((x, y, 0)))
                axes.plot([u, u], v + np.array((floor, floor + 1)) * lift, **_LINK)
    return figure


def project(points: np.ndarray) -> np.ndarray:
    """(..., 3) metres in the building -> (..., 2) metres on the page."""
    x, y, z = np.moveaxis(points, -1, 0)
    across = x * np.cos(TURN) - y * np.sin(TURN)
    away = x * np.sin(TURN) + y * np.cos(TURN)
    return np.stack([across, away * np.sin(TILT) + z * np.cos(TILT)], axis=-1)


SIDES = np.array(
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
    top = np.array([look.heights.get(each, 0.0) for each in Kind])[kind]
    steps = np.arange(len(kind), 0, -1)[:, None] % 5 * 0.25
    around = np.pad(np.where(kind == Kind.STAIRS, steps, top), 1, constant_values=-SLAB)
    row, col = np.nonzero(kind[:, ::-1])  # from the north, in a row from the east
    col = kind.shape[1] - 1 - col
    rise = around[row + 1, col + 1]
    low = np.stack([around[row + 2, col + 1], around[row + 1, col], 0 * rise - SLAB], 1)
    rise = rise[:, None] - low  # (k, 3) of each side, above its neighbour's top
    corner = np.stack(np.broadcast_arrays(col[:, None], -row[:, None], low), axis=2)
    size = np.stack(np.broadcast_arrays(1.0, 1.0, rise), axis=2)
    corners = corner[:, :, None] + SIDES * size[:, :, None]  # (k, 3, 4, 3)
    seen = rise > 0
    fill = page.paint(kind[row, col], look.inks)[:, None] * SHADES[:, None]
    line: Style = {"ec": look.edges or fill[seen], "lw": 0.3 if look.edges else 0.5}
    places = project(corners[seen]) + np.array((0.0, up))
    axes.add_collection(PolyCollection(places, fc=fill[seen], zorder=2, **line))
    axes.set(aspect="equal")
    axes.set_axis_off()
