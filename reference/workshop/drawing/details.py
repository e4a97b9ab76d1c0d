"""Exits, stairwell entrances and doors up close, with their names.

Clauses: A8 (Fig. 3), A2, A3 and A4 for what is shown.

    u, v  metres right and up on the page
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from reference.building import Building, Kind, Landmark
from reference.workshop.drawing.page import (
    COLOURS,
    FAINT,
    MEANINGS,
    TEXT,
    floor_title,
    foot,
    swatches,
)
from reference.workshop.drawing.relief import STANDING, canvas, paint, project

WINDOW = np.array((12, 15))  # rows and columns that a close-up shows
_ROOM = (11.5, 5.6)  # inches for all close-ups
_ABOVE, _BELOW, _APART = 3.2, 2.6, 1.5  # metres: for names, for titles, between two


@dataclass(frozen=True)
class Piece:
    """A window on one floor: (rows, cols) kinds, and what there is to point at.

    marks: the landmark of each kind, as row and column of its middle in the window.
    """

    title: str
    kind: np.ndarray
    marks: dict[Kind, np.ndarray]


def closeup(building: Building) -> Figure:
    """An exit, a stairwell entrance and doors up close [A8, Fig. 3].

    The places are chosen so that few pieces of the building show all the kinds it has.
    """
    pieces = _pieces(building)
    low, high = _ends(pieces[0])
    step = high[0] - low[0] + _APART
    end = high + np.array(((len(pieces) - 1) * step, _ABOVE))
    title = f"{building.title}: ways through, up close"
    figure, axes = canvas(low - np.array((0, _BELOW)), end, _ROOM, title)
    for number, piece in enumerate(pieces):
        shift = np.array((number * step, 0.0))
        paint(axes, piece.kind, STANDING, np.zeros(2), shift)
        _write(axes, piece, low + shift, high + shift)
    foot(figure, swatches([k for k in MEANINGS if k is not Kind.OUTSIDE]))
    return figure


def _pieces(building: Building) -> list[Piece]:
    """Windows that together show every kind of landmark there is, the richest first."""
    pieces = [_piece(building, mark) for mark in building.landmarks]
    missing, chosen = {mark.kind for mark in building.landmarks}, []
    while missing:
        best = max(
            pieces,
            key=lambda piece: (
                len(missing & piece.marks.keys()),
                len(np.unique(piece.kind)),
            ),
        )
        chosen.append(best)
        missing -= best.marks.keys()
    return chosen


def _piece(building: Building, centre: Landmark) -> Piece:
    """The window around a landmark, moved to stay on the page of its floor."""
    page = building.kind[centre.floor]
    size = np.minimum(WINDOW, page.shape)
    first = np.clip(centre.cells[0] - size // 2, 0, page.shape - size)
    (top, left), (bottom, right) = first, first + size
    marks = {
        mark.kind: mark.cells.mean(axis=0) + 0.5 - first
        for mark in (*building.landmarks, centre)
        if mark.floor == centre.floor and _within(mark.cells - first, size)
    }
    kind = page[top:bottom, left:right]
    return Piece(floor_title(building, centre.floor), kind, marks)


def _within(cells: np.ndarray, size: np.ndarray) -> bool:
    return bool((cells >= 0).all() and (cells < size).all())


def _ends(piece: Piece) -> tuple[np.ndarray, np.ndarray]:
    """Lower left and upper right corner of a piece on the page."""
    rows, cols = piece.kind.shape
    x, y = np.array([0, cols, cols, 0]), np.array([0, 0, -rows, -rows])
    corners = project(x, y, np.zeros(4))
    return corners.min(axis=0), corners.max(axis=0)


def _write(axes: Axes, piece: Piece, low: np.ndarray, high: np.ndarray) -> None:
    """The floor below the piece; names above, from left to right, with lines down."""
    middle = (low[0] + high[0]) / 2
    axes.text(
        middle,
        low[1] - 0.8,
        piece.title,
        parse_math=False,
        color=TEXT,
        fontsize=11,
        ha="center",
        va="top",
    )
    origin = low - _ends(piece)[0]
    tips = {kind: origin + _tip(kind, place) for kind, place in piece.marks.items()}
    order = sorted(tips, key=lambda kind: float(tips[kind][0]))
    places = np.linspace(low[0], high[0], 2 * len(order) + 1)[1::2]
    for place, kind in zip(places, order, strict=True):
        axes.annotate(
            MEANINGS[kind],
            tips[kind],
            xytext=(place, high[1] + _ABOVE / 2),
            arrowprops={"arrowstyle": "-", "color": FAINT, "shrinkB": 0},
            fontsize=11,
            fontweight="bold",
            color=COLOURS[kind],
            ha="center",
        )


def _tip(kind: Kind, place: np.ndarray) -> np.ndarray:
    row, col = place
    return project(col, -row, np.array(STANDING.height[kind]))
