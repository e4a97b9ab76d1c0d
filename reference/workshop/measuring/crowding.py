"""Measure how dense people were, and where they died, over one evacuation or many.

The density at a cell is people per square metre of floor in the
square of 3 m around it; on stairs nobody is counted.
"""

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from scipy import ndimage

from reference.building import Building
from reference.simulation import Simulation
from reference.workshop.measuring.recording import ticks
from reference.world import Fate

SQUARE = 3  # metres


class Crowding:
    """What happened at the cells of a building in all evacuations watched."""

    building: Building

    def __init__(self) -> None:
        self.runs = 0  # evacuations watched
        # of all: sums of the highest densities, and who is dead
        self._highest: Any = 0.0
        self._dead: Any = 0
        # of the last one, which may go on
        self._last_highest: Any = 0.0
        self._last_dead: Any = 0

    def watch(self, simulation: Simulation) -> Callable[[], None]:
        """Watch one more evacuation, when the one before is over.

        Returns what notes an instant, for `ticks`.
        """
        walkable = simulation.building.walkable
        # square metres; inf so that a wall is never dense
        floor = np.where(walkable, _sum_around(walkable), np.inf)
        highest = np.zeros(walkable.shape)
        dead = np.zeros(walkable.shape, int)
        self.building = simulation.building
        self.runs += 1
        self._highest = self._highest + self._last_highest
        self._dead = self._dead + self._last_dead
        self._last_highest = highest
        self._last_dead = dead

        def note() -> None:
            """Note this instant's densities, and who is dead."""
            bodies = simulation.world.bodies
            people = _sum_around(_count(simulation, bodies.walking))
            np.maximum(highest, people / floor, out=highest)
            dead[:] = _count(simulation, bodies.fate == Fate.DEAD)

        return note

    @property
    def density(self) -> np.ndarray:
        """Highest people per square metre, the mean over all: (floors, rows, cols)."""
        return (self._highest + self._last_highest) / self.runs

    @property
    def deaths(self) -> np.ndarray:
        """How many died at each cell, in all together [B7]: (floors, rows, cols)."""
        return self._dead + self._last_dead


def _count(simulation: Simulation, who: np.ndarray) -> np.ndarray:
    """Count these people at each cell."""
    cells = simulation.building.walkable
    place = simulation.world.bodies.place[who]
    return np.bincount(place, minlength=cells.size).reshape(cells.shape)


def _sum_around(cells: np.ndarray) -> np.ndarray:
    """Sum over the square around each cell, on its floor."""
    square = np.ones((1, SQUARE, SQUARE), int)
    return ndimage.convolve(cells.astype(int), square, mode="constant")


def measure_crowding(simulations: Iterable[Simulation]) -> Crowding:
    """Run simulations of one building to their ends; measure how dense people were."""
    seen = Crowding()
    for simulation in simulations:
        for _ in ticks([simulation], [seen.watch(simulation)]):
            pass
    return seen
