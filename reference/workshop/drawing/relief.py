"""The building seen obliquely from above: whole, where one may walk, and up close.

Clauses: A1 for the unit cubes, A2, A3 and A4 for what is shown up close, A7 for the
walkable cells, A8 (Figs. 1 to 3).  The view is our own parallel projection, from the
south-west; boxes are painted back to front.

    x, y, z  metres east, north and up in the building
    u, v     metres right and up on the page
"""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.transforms import Bbox
from scipy import ndimage

from reference.building import Building, Kind, Landmark
from reference.workshop.drawing import page
from reference.workshop.drawing.page import COLOURS, Style

TURN, TILT = np.radians(28), np.radians(34)  # of the view: from south, above the flat
SLAB = 0.6  # metres of ceiling below a floor
STEPS = 1.1  # metres from the first step to the last
GAP = 4.0  # metres of page between two storeys, the lower one's walls included
WINDOW = np.array((12, 15))  # rows and columns that a close-up shows
_ROOM = (8.0, 7.0)  # inches for the building
_MARGIN, _NARROWEST, _PIECE = (2.8, 1.0), 8.6, (4.2, 3.6)  # inches


@dataclass(frozen=True)
class Look:
    """How a storey is drawn: heights in metres, colours, edges between cells."""

    height: dict[Kind, float]
    standing: dict[Kind, str]
    ground: str = COLOURS[Kind.FLOOR]
    edges: str | None = None


STANDING = Look(
    {Kind.WALL: 1.5, Kind.DOOR: 1.2, Kind.ENTRANCE: 1.2, Kind.EXIT: 1.2},
    COLOURS | {Kind.WALL: "#59616d"},
)
WALKABLE = Look({Kind.WALL: 0.4}, {Kind.WALL: "#9aa3ac"}, "#4db5ee", "#2587c2")
_SHOWN = [kind for kind in page.MEANINGS if kind is not Kind.OUTSIDE]


def oblique(building: Building) -> Figure:
    """Draw the whole building, its storeys lifted off each other [A8, Fig. 1]."""
    figure = _storeys(building, STANDING, building.title)
    page.foot(figure, page.swatches(page.present(building.kind, _SHOWN)))
    return figure


def walkable(building: Building) -> Figure:
    """Draw every walkable cell, storey by storey [A8, Fig. 2] [A7]."""
    area = int(building.walkable.sum())
    title = f"{building.title}: where one may walk, {area} m²"
    figure = _storeys(building, WALKABLE, title)
    ground = Patch(fc=WALKABLE.ground, label="walkable cell")
    wall = Patch(fc=WALKABLE.standing[Kind.WALL], label="wall")
    page.foot(figure, [ground, wall])
    return figure


def closeup(building: Building) -> Figure:
    """Draw an exit, a stairwell entrance and a door up close [A8, Fig. 3]."""
    first = {mark.kind: mark for mark in reversed(building.landmarks)}
    kinds = [kind for kind in page.MEANINGS if kind in first]
    title, width = f"{building.title}: ways through, up close", _PIECE[0] * len(kinds)
    figure = page.sheet(title, max(width, _NARROWEST), _PIECE[1])
    panels = figure.subplots(1, len(kinds), squeeze=False)[0]
    pieces = [_piece(building, first[kind]) for kind in kinds]
    for axes, kind, cells in zip(panels, kinds, pieces, strict=True):
        _bare(axes)
        paint_boxes(axes, cells, STANDING, np.zeros(2), np.zeros(2))
        look: Style = {"color": COLOURS[kind], "fontweight": "bold", "loc": "center"}
        axes.set_title(page.MEANINGS[kind], **look)
    cells = np.concatenate([piece.ravel() for piece in pieces])
    page.foot(figure, page.swatches(page.present(cells, _SHOWN)))
    return figure


def _piece(building: Building, centre: Landmark) -> np.ndarray:
    """Kinds of cells in the window around a landmark, moved to stay on its floor."""
    cells = building.kind[centre.floor]
    size = np.minimum(WINDOW, cells.shape)
    first = np.clip(centre.cells[0] - size // 2, 0, cells.shape - size)
    (top, left), (bottom, right) = first, first + size
    return cells[top:bottom, left:right]


# -- Storeys on a page --------------------------------------------------------------


def project(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Project metres in the building to (..., 2) metres on the page."""
    across = x * np.cos(TURN) - y * np.sin(TURN)
    away = x * np.sin(TURN) + y * np.cos(TURN)
    return np.stack([across, away * np.sin(TILT) + z * np.cos(TILT)], axis=-1)


def _storeys(building: Building, look: Look, title: str) -> Figure:
    frame, floors = page.frame_of(building), building.floors
    x = np.array([frame.x0, frame.x1, frame.x1, frame.x0])
    y = np.array([frame.y0, frame.y0, frame.y1, frame.y1])
    outline = project(x, y, np.zeros(4))  # from the south-west corner to the north-west
    lift = _lift(outline)
    size = np.ptp(outline, axis=0) + (floors - 1) * lift
    inches = size * min(_ROOM / size) + _MARGIN
    figure = page.sheet(title, max(inches[0], _NARROWEST), inches[1])
    axes = _bare(figure.add_subplot())
    origin = np.array((frame.x0, frame.y1))
    for floor in range(floors):  # even zorders; the stairs' lines take those between
        shift = floor * lift
        paint_boxes(axes, building.kind[floor], look, origin, shift, zorder=2 * floor)
        name = page.floor_title(building, floor).replace(": ", "\n")
        west = outline[3] + shift
        fits = page.text_size(max(name.split("\n"), key=len), 0.7 * _MARGIN[0], 11)
        axes.annotate(name, (west[0], west[1]), (-12, 0), fontsize=fits, **_STOREY)
    for floor in range(floors - 1):
        _link_stairs(axes, building, floor, lift)
    _compass(axes, frame)
    return figure


_STOREY: Style = {
    "annotation_clip": False,
    "textcoords": "offset points",
    "ha": "right",
    "va": "center",
}


def _bare(axes: Axes) -> Axes:
    """Hide the frame of axes in metres of the page."""
    axes.set(aspect="equal")
    axes.margins(0.01)
    axes.set_axis_off()
    return axes


def _lift(outline: np.ndarray) -> np.ndarray:
    """Shift (u, v) from storey to storey that leaves all in full view."""
    sides = np.stack([outline[1] - outline[0], outline[3] - outline[0]], axis=1)
    share = np.abs(np.linalg.solve(sides, (0.0, 1.0))).max()
    return np.array([0.0, 1 / share + GAP])


def _compass(axes: Axes, frame: Bbox) -> None:
    """Draw, beside the lowest storey, an arrow to the north and a scale."""
    reach = page.step_of(frame)
    x, y = np.array(frame.min) - 0.2 * reach
    start, north, east = project(
        np.array([x, x, x + reach]), np.array([y, y + reach, y]), np.zeros(3)
    )
    for tip in (north, east):
        look = {"arrowstyle": "-|>", "color": page.FAINT, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tip, start, arrowprops=look)
    u, v = (start + east) / 2
    small: Style = {"fontsize": 8, "color": page.FAINT}
    axes.text(north[0], north[1], "north ", ha="right", va="center", **small)
    axes.text(u, v, f"\n{reach} m", va="top", **small)


def _link_stairs(axes: Axes, building: Building, floor: int, lift: np.ndarray) -> None:
    """Draw dashed lines from each stairwell up to the next storey [A3]."""
    look: Style = {"color": COLOURS[Kind.ENTRANCE], "lw": 1.4, "ls": (0, (4, 3))}
    for shaft in building.stairwells:
        if shaft.leads_down(floor + 1):
            x, y = np.array([shaft.centre] * 2).T
            ends = project(x, y, np.array((2.0, 0.0)))
            ends += lift * [[floor], [floor + 1]]
            axes.plot(*ends.T, zorder=2 * floor + 1, **look)


# -- Boxes from back to front -------------------------------------------------------


def paint_boxes(
    axes: Axes,
    kind: np.ndarray,
    look: Look,
    origin: np.ndarray,
    shift: np.ndarray,
    zorder: int = 0,
) -> None:
    """Paint the slab of a floor, or of a piece of it, and what stands on it.

    kind: (rows, cols); origin: (x, y) of its north-west corner; shift: (u, v).
    """
    slab, height = np.where(kind == Kind.OUTSIDE, -SLAB, 0.0), np.zeros(kind.shape)
    for what, metres in look.height.items():
        height[kind == what] = metres
    if look is STANDING:
        _add_steps(height, kind == Kind.STAIRS)
    for top, base, colours, edges in (
        (slab, -SLAB, dict[Kind, str](), look.edges),
        (height, 0.0, look.standing, None),
    ):
        corners, cells, shades = faces(top, base)
        x, y = origin[0] + corners[..., 0], origin[1] - corners[..., 1]
        inks = np.array([to_rgb(colours.get(k, look.ground)) for k in Kind])
        fill = inks[kind[cells]] * shades[:, None]
        line: Style = {"ec": edges or fill, "lw": 0.3 if edges else 0.5}
        places = project(x, y, corners[..., 2]) + shift
        axes.add_collection(PolyCollection(places, fc=fill, zorder=zorder, **line))


def _add_steps(height: np.ndarray, stairs: np.ndarray) -> None:
    """Raise steps along each stairwell, towards the north or the east."""
    patches, _ = ndimage.label(stairs)
    for rows, cols in ndimage.find_objects(patches):
        down, across = rows.stop - rows.start, cols.stop - cols.start
        steps = np.linspace(0, STEPS, max(down, across) + 1)[1:]
        rise = steps if across > down else steps[::-1, None]
        height[rows, cols] = np.where(stairs[rows, cols], rise, height[rows, cols])


_SOUTH = ((0, 1, 0), (1, 1, 0), (1, 1, 1), (0, 1, 1))
_WEST = ((0, 0, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1))
_LID = ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
SHADES = np.array((0.62, 0.8, 1.0))


def faces(
    top: np.ndarray, base: float
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray], np.ndarray]:
    """Visible sides of boxes on a grid, back to front, as the eye looks.

    top: (rows, cols) metres.  For k sides: corners (k, 4, 3) column, row, metres up;
    the cell (row, column) of each; and shades (k,).
    """
    south = np.vstack([top[1:], np.full((1, top.shape[1]), base)])
    west = np.hstack([np.full((len(top), 1), base), top[:, :-1]])
    row, col = np.nonzero(top[:, ::-1] > base)  # from the north, in a row from the east
    col = top.shape[1] - 1 - col
    high = top[row, col]
    seen = np.stack([south[row, col] < high, west[row, col] < high, high > base], 1)
    box = np.stack([np.ones_like(high), np.ones_like(high), high - base], axis=1)
    corner = np.stack([col, row, np.full(len(col), base)], axis=1)
    sides = np.array([_SOUTH, _WEST, _LID])
    corners = sides * box[:, None, None] + corner[:, None, None]
    which, side = np.nonzero(seen)
    return corners[seen], (row[which], col[which]), SHADES[side]
