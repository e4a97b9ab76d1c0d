"""The building seen obliquely from above: whole, and where one may walk.

Clauses: A8 (Figs. 1 and 2), A1 for the unit cubes, A7 for the walkable cells.  The view
is our own parallel projection, from the south-west; boxes are painted back to front.

    x, y, z  metres east, north and up in the building
    u, v     metres right and up on the page
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from scipy import ndimage

from reference.building import LANDMARKS, Building, Kind
from reference.workshop.drawing.page import (
    COLOURS,
    FAINT,
    MEANINGS,
    TEXT,
    Frame,
    blank,
    floor_title,
    foot,
    frame_of,
    heading,
    swatches,
)

TURN, TILT = np.radians(28), np.radians(34)  # of the eye: from the south, from the flat
THIN = 3  # walls are drawn a third of a cell thick
SLAB = 0.6  # metres of ceiling below a floor
STEPS = 1.1  # metres from the first step to the last
GAP = 4.0  # metres of page between two storeys, the lower one's walls included
_ROOM = (8.0, 7.0)  # inches for the building
_MARGIN, _NARROWEST = 1.4, 8.6
_ASIDE = 0.2


@dataclass(frozen=True)
class Look:
    """How a storey is drawn: heights in metres, colours, edges between cells."""

    height: dict[Kind, float]
    standing: dict[Kind, str]
    ground: dict[Kind, str]
    edges: str | None = None


_SKIRTING = "#c6cbd0"
STANDING = Look(
    {Kind.WALL: 1.5, Kind.DOOR: 1.2, Kind.ENTRANCE: 1.2, Kind.EXIT: 1.2},
    COLOURS | {Kind.WALL: "#59616d"},
    dict.fromkeys(Kind, COLOURS[Kind.FLOOR])
    | {Kind.WALL: _SKIRTING, Kind.STAIRS: COLOURS[Kind.STAIRS]},
)
WALKABLE = Look(
    {Kind.WALL: 0.4},
    {Kind.WALL: "#9aa3ac"},
    dict.fromkeys(Kind, "#4db5ee") | {Kind.WALL: _SKIRTING},
    edges="#2587c2",
)


def oblique(building: Building) -> Figure:
    """The whole building, its storeys lifted off each other [A8, Fig. 1]."""
    figure = _storeys(building, STANDING, building.title)
    foot(figure, swatches([k for k in MEANINGS if k is not Kind.OUTSIDE]))
    return figure


def walkable(building: Building) -> Figure:
    """Every cell a body may stand in, storey by storey [A8, Fig. 2] [A7]."""
    area = int(building.walkable.sum())
    title = f"{building.title}: where one may walk, {area} m²"
    figure = _storeys(building, WALKABLE, title)
    colours = {"walkable cell": WALKABLE.ground, "wall": WALKABLE.standing}
    kinds = zip(colours.items(), (Kind.FLOOR, Kind.WALL), strict=True)
    foot(figure, [Patch(fc=ink[kind], label=name) for (name, ink), kind in kinds])
    return figure


# -- Storeys on a page --------------------------------------------------------------


def project(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Metres in the building -> (..., 2) metres on the page."""
    across = x * np.cos(TURN) - y * np.sin(TURN)
    away = x * np.sin(TURN) + y * np.cos(TURN)
    return np.stack([across, away * np.sin(TILT) + z * np.cos(TILT)], axis=-1)


def _storeys(building: Building, look: Look, title: str) -> Figure:
    frame, floors = frame_of(building), building.floors
    x = np.array([frame.left, frame.right, frame.right, frame.left])
    y = np.array([frame.bottom, frame.bottom, frame.top, frame.top])
    outline = project(x, y, np.zeros(4))  # from the south-west corner to the north-west
    lift = _lift(outline)
    top = outline.max(axis=0) + (floors - 1) * lift
    low = outline.min(axis=0) - (0, (SLAB + _ASIDE * frame.step) * 1.5)
    figure, axes = canvas(low, top + np.array((0, 2)), _ROOM, title)
    for floor in range(floors):
        _paint_storey(axes, building, floor, look, floor * lift)
        _label(axes, floor_title(building, floor), outline[3] + floor * lift)
    for floor in range(floors - 1):
        _link_stairs(axes, building, floor, lift)
    _compass(axes, frame)
    return figure


def _lift(outline: np.ndarray) -> np.ndarray:
    """The shift (u, v) straight up to the next storey that leaves both in full view."""
    sides = np.stack([outline[1] - outline[0], outline[3] - outline[0]], axis=1)
    share = np.abs(np.linalg.solve(sides, (0.0, 1.0))).max()
    return np.array([0.0, 1 / share + GAP])


def canvas(
    low: np.ndarray, high: np.ndarray, room: tuple[float, float], title: str
) -> tuple[Figure, Axes]:
    """A titled page for what lies between two corners (u, v), within so many inches."""
    scale = min(np.array(room) / (high - low))
    wide, tall = (high - low) * scale
    width, height = max(wide + 2 * _MARGIN, _NARROWEST), tall + 1.0
    figure = blank(width, height)
    heading(figure, title)
    place = ((width - wide) / 2 / width, 0.45 / height, wide / width, tall / height)
    axes = figure.add_axes(place)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    axes.set_axis_off()
    return figure, axes


def _label(axes: Axes, title: str, corner: np.ndarray) -> None:
    """The name of a storey, left of its westernmost corner."""
    axes.annotate(
        title.replace(": ", "\n"),
        (corner[0], corner[1]),
        xytext=(-12, 0),
        textcoords="offset points",
        fontsize=11,
        color=TEXT,
        ha="right",
        va="center",
        parse_math=False,
    )


def _compass(axes: Axes, frame: Frame) -> None:
    """Beside the lowest storey: which way is north, and how long so many metres are."""
    reach = frame.step
    x, y = frame.left - _ASIDE * reach, frame.bottom - _ASIDE * reach
    start, north, east = project(
        np.array([x, x, x + reach]), np.array([y, y + reach, y]), np.zeros(3)
    )
    for tip in (north, east):
        look = {"arrowstyle": "-|>", "color": FAINT, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", tuple(tip), xytext=tuple(start), arrowprops=look)
    u, v = (start + east) / 2
    axes.text(
        north[0], north[1], "north ", fontsize=8, color=FAINT, ha="right", va="center"
    )
    axes.text(u, v, f"\n{reach} m", fontsize=8, color=FAINT, va="top")


def _link_stairs(axes: Axes, building: Building, floor: int, lift: np.ndarray) -> None:
    """Dashed, from each stairwell up to the same one a storey higher [A3]."""
    for shaft in building.stairwells:
        if {floor, floor + 1} <= set(shaft.areas):
            x, y = np.array(shaft.centre)
            low = project(x, y, np.array(2.0)) + floor * lift
            high = project(x, y, np.array(0.0)) + (floor + 1) * lift
            axes.plot(
                *np.transpose([low, high]),
                color=COLOURS[Kind.ENTRANCE],
                linewidth=1.4,
                linestyle=(0, (4, 3)),
                zorder=2 * floor + 1,
            )


def _paint_storey(
    axes: Axes, building: Building, floor: int, look: Look, shift: np.ndarray
) -> None:
    """Clear of the stairs' dashed lines, which pass between two storeys."""
    origin = np.array(building.metres(-0.5, -0.5))
    paint(axes, building.kind[floor], look, origin, shift, zorder=2 * floor)


# -- Boxes from back to front -------------------------------------------------------


def paint(
    axes: Axes,
    kind: np.ndarray,
    look: Look,
    origin: np.ndarray,
    shift: np.ndarray,
    zorder: int = 0,
) -> None:
    """The slab of a floor, or of a piece of it, and everything that stands on it.

    kind: (rows, cols); origin: (x, y) of its north-west corner; shift: (u, v).
    """
    slab = np.where(kind == Kind.OUTSIDE, -SLAB, 0.0)
    fine, height = _standing(kind, look)
    for boxes, colours, edges in (
        (Boxes(kind, slab, -SLAB, 1.0), look.ground, look.edges),
        (Boxes(fine, height, 0.0, 1 / THIN), look.standing, None),
    ):
        faces = list(_faces(boxes, whole=edges is None))
        col, row, z = np.moveaxis(np.array([face.corners for face in faces]), 2, 0)
        x, y = origin[0] + col * boxes.size, origin[1] - row * boxes.size
        fill = [np.array(to_rgb(colours[f.kind])) * f.shade for f in faces]
        axes.add_collection(
            PolyCollection(
                list(project(x, y, z) + shift),
                facecolors=fill,
                edgecolors=edges or fill,
                linewidths=0.3 if edges else 0.5,
                zorder=zorder,
            ),
            autolim=False,
        )


@dataclass(frozen=True)
class Boxes:
    """Upright boxes on a grid: (rows, cols) kinds and tops; base and size, metres."""

    kind: np.ndarray
    top: np.ndarray
    base: float
    size: float


@dataclass(frozen=True)
class Face:
    """One visible side of a box; corners: (4, 3) column, row, metres up."""

    corners: np.ndarray
    kind: Kind
    shade: float


def _standing(kind: np.ndarray, look: Look) -> tuple[np.ndarray, np.ndarray]:
    """Kinds and heights (0: nothing) on a grid THIN times as fine."""
    solid = np.isin(kind, (Kind.WALL, *LANDMARKS))
    fine = np.kron(kind, np.ones((THIN, THIN), dtype=int))
    height = np.zeros(fine.shape)
    for what, metres in look.height.items():
        height[(fine == what) & _thin(solid)] = metres
    if Kind.STAIRS in look.standing:
        _add_steps(height, fine == Kind.STAIRS)
    return fine, height


def _add_steps(height: np.ndarray, stairs: np.ndarray) -> None:
    """Steps that rise along each stairwell, towards the north or the east."""
    patches, _ = ndimage.label(stairs)
    for rows, cols in ndimage.find_objects(patches):
        down, across = rows.stop - rows.start, cols.stop - cols.start
        steps = np.linspace(0, STEPS, max(down, across) // THIN + 1)[1:].repeat(THIN)
        rise = steps if across > down else steps[::-1, None]
        height[rows, cols] = np.where(stairs[rows, cols], rise, height[rows, cols])


def _thin(solid: np.ndarray) -> np.ndarray:
    """A post in every solid cell, with arms to the solid cells beside it."""
    rows, cols = solid.shape
    around = np.pad(solid, 1)
    thin = np.zeros((rows, THIN, cols, THIN), dtype=bool)
    for y in (-1, 0, 1):
        for x in (-1, 0, 1):
            beside = [
                around[1 + y :, 1 + x :],
                around[1 + y :, 1:],
                around[1:, 1 + x :],
            ]
            thin[:, 1 + y, :, 1 + x] = np.logical_and.reduce(
                [solid, *(grid[:rows, :cols] for grid in beside)]
            )
    return thin.reshape(rows * THIN, cols * THIN)


def _faces(boxes: Boxes, whole: bool) -> Iterator[Face]:
    """Back to front: rows from the north, in a row from the east, as the eye looks.

    Equal neighbours in a row become one box when they shall look like a whole.
    """
    top, base = boxes.top, boxes.base
    south = np.vstack([top[1:], np.full((1, top.shape[1]), base)])
    west = np.hstack([np.full((len(top), 1), base), top[:, :-1]])
    for row, (kinds, heights, fronts) in enumerate(
        zip(boxes.kind, top, south, strict=True)
    ):
        line = list(zip(kinds.tolist(), heights.tolist(), fronts.tolist(), strict=True))
        for run in reversed(_runs(line, whole)):
            (what, height, front), first, end = line[run[0]], run[0], run[-1] + 1
            if height <= base:
                continue
            kind, near = Kind(what), row + 1
            if front < height:
                yield Face(_side((first, near), (end, near), base, height), kind, 0.62)
            if west[row, first] < height:
                yield Face(_side((first, row), (first, near), base, height), kind, 0.8)
            yield Face(_lid(first, end, row, near, height), kind, 1.0)


def _runs(line: list[tuple[int, float, float]], whole: bool) -> list[list[int]]:
    if not whole:
        return [[place] for place in range(len(line))]
    return [list(run) for _, run in groupby(range(len(line)), line.__getitem__)]


def _side(
    start: tuple[int, int], end: tuple[int, int], base: float, height: float
) -> np.ndarray:
    return np.array([(*start, base), (*end, base), (*end, height), (*start, height)])


def _lid(west: int, east: int, north: int, south: int, height: float) -> np.ndarray:
    corners = ((west, north), (east, north), (east, south), (west, south))
    return np.array([(*corner, height) for corner in corners])
