"""The world as pixels, painted with numpy: what `Environment.render` returns.

Clauses: A2, A3 and A4 for the colours of doors, entrances and exits, B7 for health,
D3 for fire sources.  Shapes tell things apart as well as colours do: a disc is a human,
a diamond a robot, ragged cells burn, and a ring is where a fire broke out.

    side   pixels of a cell
"""

from functools import lru_cache

import numpy as np

from reference.building import Building, Kind
from reference.paper import HEALTH
from reference.world import World

SIDE = 8  # pixels of a cell
GAP = 2  # cells between two floors, and around all

COLOURS = {
    Kind.OUTSIDE: (231, 236, 239),
    Kind.WALL: (43, 47, 54),
    Kind.FLOOR: (250, 248, 242),
    Kind.DOOR: (63, 159, 224),  # blue [A2]
    Kind.ENTRANCE: (109, 44, 150),  # purple [A3]
    Kind.EXIT: (15, 157, 88),  # green [A4]
    Kind.STAIRS: (216, 203, 230),
}
FLAME, EMBER = (244, 123, 32), (196, 60, 0)
SOURCE, ROBOT, INK, WHITE = (209, 26, 26), (0, 190, 210), (22, 25, 29), (255,) * 3
WELL, DYING = np.array((255, 232, 56)), np.array((16, 27, 70))


def picture(world: World) -> np.ndarray:
    """(height, width, 3) uint8: all floors side by side, the first floor left."""
    pixels = _empty(world.building).copy()
    _paint_flames(pixels, world)
    for source in world.flames.sources:
        at = source.x, source.y, source.floor
        _stamp(pixels, world.building, at, RIM, WHITE)
        _stamp(pixels, world.building, at, RING, SOURCE)
    bodies = world.bodies
    for i in np.flatnonzero(bodies.inside).tolist():
        at = (*bodies.position[i].tolist(), int(bodies.floor[i]))
        health = max(0.0, bodies.health[i]) / HEALTH
        _stamp(pixels, world.building, at, DISC, INK)
        _stamp(pixels, world.building, at, DOT, DYING + health * (WELL - DYING))
    for robot in world.robots:
        at = (*robot.position.tolist(), robot.floor)
        _stamp(pixels, world.building, at, DIAMOND, INK)
        _stamp(pixels, world.building, at, GEM, ROBOT)
    return pixels


@lru_cache(maxsize=8)
def _empty(building: Building) -> np.ndarray:
    """The building without anybody in it."""
    palette = np.array([COLOURS[kind] for kind in Kind], dtype=np.uint8)
    floors, rows, cols = building.kind.shape
    page = np.zeros((rows + 2 * GAP, floors * (cols + GAP) + GAP), dtype=np.uint8)
    for floor, kind in enumerate(building.kind):
        left = GAP + floor * (cols + GAP)
        page[GAP : GAP + rows, left : left + cols] = kind
    return palette[page].repeat(SIDE, axis=0).repeat(SIDE, axis=1)


def _corner(building: Building, floor: int) -> tuple[int, int]:
    """Pixels from the top and from the left to a floor's drawing."""
    cols = building.kind.shape[2]
    return GAP * SIDE, (GAP + floor * (cols + GAP)) * SIDE


def _paint_flames(pixels: np.ndarray, world: World) -> None:
    """Every burning cell in a flame's pattern, over what stands there."""
    burning = world.flames.burning
    rows, cols = burning.shape[1:]
    tile = np.where(EMBERS[..., None], EMBER, FLAME).astype(np.uint8)
    for floor, alight in enumerate(burning):
        top, left = _corner(world.building, floor)
        part = pixels[top : top + rows * SIDE, left : left + cols * SIDE]
        where = alight.repeat(SIDE, axis=0).repeat(SIDE, axis=1)
        part[where] = np.tile(tile, (rows, cols, 1))[where]


def _stamp(
    pixels: np.ndarray,
    building: Building,
    at: tuple[float, float, int],
    shape: np.ndarray,
    colour: tuple[int, int, int] | np.ndarray,
) -> None:
    """Paint a shape, (k, k) bool, with its middle at a point: x, y, floor."""
    x, y, floor = at
    top, left = _corner(building, floor)
    row = round(top + (building.origin[0] - y) * SIDE - len(shape) / 2)
    col = round(left + (building.origin[1] + x) * SIDE - len(shape) / 2)
    part = pixels[row : row + len(shape), col : col + len(shape)]
    part[shape] = np.asarray(colour).astype(np.uint8)


def _shape(size: int, power: float, hole: float = 0.0) -> np.ndarray:
    """(size, size) bool: |x|^power + |y|^power < 1, without so much of the middle."""
    x = np.abs((np.arange(size) + 0.5) / size * 2 - 1)
    away = x[:, None] ** power + x**power
    return (away < 1) & (away >= hole)


DISC, DOT = _shape(8, 2), _shape(6, 2)
DIAMOND, GEM = _shape(15, 1), _shape(11, 1)
RIM, RING = _shape(16, 2, hole=0.3), _shape(14, 2, hole=0.5)
EMBERS = np.array(
    [
        [letter == "x" for letter in row]
        for row in (
            "...x....",
            "..xx...x",
            "..xxx...",
            ".x.xx.x.",
            ".xx.xxx.",
            "x.xx.xx.",
            ".xxxxx..",
            "..xxx..x",
        )
    ]
)
