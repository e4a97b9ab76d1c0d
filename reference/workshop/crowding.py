"""How dense people were, and where they died, over one evacuation or many.

Clause: B7 for deaths.  The density at a cell is people per square metre of floor in the
square of 3 m around it, without what lies behind a wall; on stairs nobody is counted.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from reference.building import Building
from reference.navigation import shifted
from reference.simulation import Simulation
from reference.workshop.recording import ticks
from reference.world import Fate

SQUARE = 3  # metres
STEPS = tuple(product(range(-(SQUARE // 2), SQUARE // 2 + 1), repeat=2))


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
        self.simulation, building = simulation, simulation.building
        self._near = {step: _joined(building, *step) for step in STEPS}
        floor = self._around(building.walkable)
        self._floor = np.maximum(floor, 1)  # m2; nobody is where there is none
        self.density = np.zeros(floor.shape)

    def note(self) -> None:
        """Look at who stands where now."""
        people = self._count(self.simulation.world.bodies.walking)
        np.maximum(self.density, self._around(people) / self._floor, out=self.density)

    @property
    def deaths(self) -> np.ndarray:
        """People who have died at each cell: (floors, rows, cols)."""
        return self._count(self.simulation.world.bodies.fate == Fate.DEAD)

    def _count(self, who: np.ndarray) -> np.ndarray:
        place, shape = self.simulation.world.bodies.place[who], self.density.shape
        return np.bincount(place, minlength=self.density.size).reshape(shape)

    def _around(self, cells: np.ndarray) -> np.ndarray:
        """Sum over the square around each cell, as far as it is in the same room."""
        parts = [near * shifted(cells, *step) for step, near in self._near.items()]
        return np.sum(parts, axis=0)


def _joined(building: Building, d_row: int, d_col: int) -> np.ndarray:
    """(floors, rows, cols) bool: is the cell at an offset of this room, or a door?"""
    room, door = building.area + 1, building.landmark >= 0  # 0: of no room
    same = room == shifted(room, d_row, d_col)
    near = same | door | shifted(door, d_row, d_col)
    return near & building.walkable & shifted(building.walkable, d_row, d_col)


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
