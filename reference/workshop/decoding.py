"""Decode observations: vectors into points, and the grid into burning cells.

Clauses: C1, C3, D1.  Landmarks and pictures are made from observations, not from the
world.
"""

from dataclasses import dataclass

import numpy as np

from reference.building import Building
from reference.game.observations import (
    SENTINEL,
    channels,
    fire_layout,
    from_normalised,
    main_body,
    robot_layout,
)
from reference.paper import Scenario


@dataclass(frozen=True)
class Decoded:
    """A decoded vector, in metres and storeys; the gone are rows of SENTINEL.

    humans (..., n, 3);  robots (..., R, 3);  fires (..., F, 3);  time (...) s
    The fire agent observes neither fires (F = 0) nor the time (nan).
    """

    humans: np.ndarray
    robots: np.ndarray
    fires: np.ndarray
    time: np.ndarray


def decode(vectors: np.ndarray, building: Building, scenario: Scenario) -> Decoded:
    """Decode robots' vectors, (..., V)."""
    layout = robot_layout(building, scenario)
    return Decoded(
        humans=layout.read(vectors, "humans"),
        robots=layout.read(vectors, "robots"),
        fires=layout.read(vectors, "fires"),
        time=layout.read(vectors, "time")[..., 0, 0],
    )


def decode_fire(vectors: np.ndarray, building: Building, scenario: Scenario) -> Decoded:
    """Decode the fire's vectors, (..., V)."""
    layout, batch = fire_layout(building, scenario), vectors.shape[:-1]
    humans, robots = (
        from_normalised(building, layout.read(vectors, name))
        for name in ("humans", "robots")
    )
    for there in (humans, robots):
        there[..., 2] = there[..., 2].round()
        there[there[..., 2] < 0] = SENTINEL
    return Decoded(humans, robots, np.zeros((*batch, 0, 3)), np.full(batch, np.nan))


def burning(cells: np.ndarray, building: Building) -> np.ndarray:
    """Mark the cells that a grid shows in flames: (floors, rows, cols) bool."""
    everywhere = np.zeros(building.kind.shape, dtype=bool)
    main_body(everywhere, building)[:] = channels(cells, building, "fires")
    return everywhere
