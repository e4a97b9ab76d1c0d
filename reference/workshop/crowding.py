"""How dense people were, and where they died, over one evacuation or many.

Clause: B7 for deaths.  The density at a cell is people per square metre of floor in the
square of 3 m around it; on stairs nobody is counted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from reference.building import Building
from reference.simulation import Simulation
from reference.workshop.recording import ticks
from reference.world import Fate

SQUARE = 3  # metres


@dataclass(frozen=True)
class Crowding:
    """What happened at the cells of a building: arrays (floors, rows, cols).

    density  people per square metre: each evacuation's highest, the mean over all
    deaths   people who died there, in all evacuations together
    """

    building: Building
    evacuations: int
    density: np.ndarray
    deaths: np.ndarray


class Crowd:
    """The highest density at every cell of one evacuation, so far."""

    def __init__(self, simulation: Simulation):
        """Before its first tick; then call `note` after each, as `ticks` does."""
        self.simulation, walkable = simulation, simulation.building.walkable
        self._floor = np.where(walkable, _around(walkable), np.inf)  # square metres
        self.density = np.zeros(walkable.shape)

    def note(self) -> None:
        """Look at who stands where now."""
        people = _around(self._count(self.simulation.world.bodies.walking))
        np.maximum(self.density, people / self._floor, out=self.density)

    @property
    def deaths(self) -> np.ndarray:
        """People who have died at each cell: (floors, rows, cols)."""
        return self._count(self.simulation.world.bodies.fate == Fate.DEAD)

    def _count(self, who: np.ndarray) -> np.ndarray:
        place, shape = self.simulation.world.bodies.place[who], self.density.shape
        return np.bincount(place, minlength=self.density.size).reshape(shape)


def _around(cells: np.ndarray) -> np.ndarray:
    """Sum over the square around each cell, on its floor."""
    square = np.ones((1, SQUARE, SQUARE), int)
    return ndimage.convolve(cells.astype(int), square, mode="constant")


def crowding(simulations: Iterable[Simulation]) -> Crowding:
    """Run simulations of one building to their ends; tell where people were dense."""
    crowds = []
    for simulation in simulations:
        crowds.append(Crowd(simulation))
        for _ in ticks([simulation], [crowds[-1].note]):
            pass
    return together(crowds)


def together(crowds: Sequence[Crowd]) -> Crowding:
    """Put evacuations of one building together."""
    density = np.mean([crowd.density for crowd in crowds], axis=0)
    deaths = np.sum([crowd.deaths for crowd in crowds], axis=0)
    return Crowding(crowds[0].simulation.building, len(crowds), density, deaths)
