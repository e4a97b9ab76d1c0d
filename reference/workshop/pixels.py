"""The world as pixels, painted with numpy: what PettingZoo's `render` returns.

Clauses: A2, A3 and A4 for the colours of doors, entrances and exits, B7 for health,
D3 for fire sources.  Shapes tell things apart as well as colours do: a disc is a human,
a diamond a robot, ragged cells burn, and a ring is where a fire broke out.
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
    building, bodies = world.building, world.bodies
    pixels = _empty(building).copy()
    cols = building.kind.shape[2]
    for floor, row, col in np.argwhere(world.flames.burning).tolist():
        top, left = GAP + row, GAP + floor * (cols + GAP) + col
        cell = pixels[top * SIDE :, left * SIDE :]
        cell[:SIDE, :SIDE] = FLAMES
    for source in world.flames.sources:
        at = building, source.x, source.y, source.floor
        _stamp(pixels, *at, (RIM, WHITE), (RING, SOURCE))
    for i in np.flatnonzero(bodies.inside).tolist():
        health = max(0.0, bodies.health[i]) / HEALTH
        colour = DYING + health * (WELL - DYING)
        at = building, *bodies.position[i].tolist(), int(bodies.floor[i])
        _stamp(pixels, *at, (DISC, INK), (DOT, colour))
    for robot in world.robots:
        at = building, *robot.position.tolist(), robot.floor
        _stamp(pixels, *at, (DIAMOND, INK), (GEM, ROBOT))
    return pixels


@lru_cache(maxsize=8)
def _empty(building: Building) -> np.ndarray:
    """The building without anybody in it."""
    palette = np.array([COLOURS[kind] for kind in Kind], dtype=np.uint8)
    around = np.pad(building.kind, ((0, 0), (GAP, GAP), (0, GAP)))
    page = np.pad(np.concatenate(around, axis=1), ((0, 0), (GAP, 0)))
    return palette[page].repeat(SIDE, axis=0).repeat(SIDE, axis=1)


def _stamp(
    pixels: np.ndarray,
    building: Building,
    x: float,
    y: float,
    floor: int,
    *layers: tuple[np.ndarray, tuple[int, ...] | np.ndarray],
) -> None:
    """Paint shapes, (k, k) bool, in their colours with their middle at a point."""
    left = GAP + floor * (building.kind.shape[2] + GAP)
    for shape, colour in layers:
        k = len(shape)
        row = round(GAP * SIDE + (building.origin[0] - y) * SIDE - k / 2)
        col = round(left * SIDE + (building.origin[1] + x) * SIDE - k / 2)
        part = pixels[row : row + k, col : col + k]
        part[shape] = np.asarray(colour).astype(np.uint8)


def _shape(size: int, power: float, hole: float = 0.0) -> np.ndarray:
    """(size, size) bool: |x|^power + |y|^power < 1, without so much of the middle."""
    x = np.abs((np.arange(size) + 0.5) / size * 2 - 1)
    away = x[:, None] ** power + x**power
    return (away < 1) & (away >= hole)


DISC, DOT = _shape(8, 2), _shape(6, 2)
DIAMOND, GEM = _shape(15, 1), _shape(11, 1)
RIM, RING = _shape(16, 2, hole=0.3), _shape(14, 2, hole=0.5)
RAGGED = """
    ...x.... ..xx...x ..xxx... .x.xx.x. .xx.xxx. x.xx.xx. .xxxxx.. ..xxx..x
"""
RED_HOT = np.array([list(row) for row in RAGGED.split()]) == "x"
FLAMES = np.where(RED_HOT[..., None], EMBER, FLAME)
