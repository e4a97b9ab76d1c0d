"""Decode observations: vectors into points, and the grid into burning cells.

Clauses: C1, C3, D1.  Landmarks and pictures are made from observations, not from the
world.
"""

from dataclasses import dataclass

import numpy as np

from reference.building import Building
from reference.game.observations import (
    channels,
    main_body,
    vector_layout,
)
from reference.paper import Scenario


@dataclass(frozen=True)
class Decoded:
    """A decoded vector, in metres and storeys; the gone are rows of SENTINEL.

    humans (..., n, 3);  robots (..., R, 3);  fires (..., F, 3);  time (...) s
    """

    humans: np.ndarray
    robots: np.ndarray
    fires: np.ndarray
    time: np.ndarray


def decode(vectors: np.ndarray, building: Building, scenario: Scenario) -> Decoded:
    """Decode vectors of robots or of the fire, (..., V)."""
    layout = vector_layout(building, scenario)
    return Decoded(
        humans=layout.read(vectors, "humans"),
        robots=layout.read(vectors, "robots"),
        fires=layout.read(vectors, "fires"),
        time=layout.read(vectors, "time")[..., 0, 0],
    )


def burning(cells: np.ndarray, building: Building) -> np.ndarray:
    """Mark the cells that a grid shows in flames: (floors, rows, cols) bool."""
    everywhere = np.zeros(building.kind.shape, dtype=bool)
    main_body(everywhere, building)[:] = channels(cells, building, "fires")
    return everywhere
