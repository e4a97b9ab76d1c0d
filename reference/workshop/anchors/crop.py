"""The grid around a robot: what it reads of C3's picture."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from reference.building import Building
from reference.game.observations import GRID_KINDS

CROP = 21  # [C3, chosen] cells along a side of what a robot reads of the grid
CROP_SHAPE = (len(GRID_KINDS), CROP, CROP)


def crops(grids: np.ndarray, building: Building, robots: np.ndarray) -> np.ndarray:
    """Cut the own floor's cells around each robot out of the grids [C3].

    grids (S, channels, height, width); robots (S, G, 3) points. Returns
    (S, 3 G, CROP, CROP): walls, fires and ways out of the first robot, then of the
    next; 0 beyond the edges.
    """
    S, _, height, width = grids.shape
    half = CROP // 2
    kinds = len(GRID_KINDS)
    shape = S, kinds, building.floors, height + 2 * half, width + 2 * half
    wide = np.zeros(shape, dtype=grids.dtype)
    wide[..., half:-half, half:-half] = grids.reshape(
        S, kinds, building.floors, height, width
    )
    windows = sliding_window_view(wide, (CROP, CROP), axis=(3, 4))

    left, _, _, top = building.body
    row = np.floor(top - robots[..., 1]).astype(int).clip(0, height - 1)
    col = np.floor(robots[..., 0] - left).astype(int).clip(0, width - 1)
    floor = robots[..., 2].round().astype(int).clip(0)
    world = np.arange(S)[:, None]
    around = windows[world, :, floor, row, col]  # (S, G, 3, CROP, CROP)
    return around.reshape(S, -1, CROP, CROP)
