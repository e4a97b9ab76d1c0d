"""Flames spread by first passage: a cell burns when the fastest chain reaches it.

Clauses: A6, B7, C5, D6, D7.

    p   place
"""

from functools import lru_cache
from math import inf

import numpy as np
from numpy.random import Generator as Rng
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference import paper
from reference.building import Building, Kind
from reference.navigation import navigation_of, shifted
from reference.world import Flames, Source


class Spread:
    """How flames spread in one run: first passage [D7, chosen].

    Every border between two cells has a fixed, seeded delay; a cell burns from the
    earliest time that a chain of delays from any source reaches it.
    """

    def __init__(self, building: Building, rng: Rng):
        self.building, self.delays = building, _delays(building, rng)

    def ignite(self, flames: Flames, source: Source) -> None:
        """Add a source; each cell's arrival is the earliest over all sources."""
        p = navigation_of(self.building).place(source.floor, source.x, source.y)
        delay = dijkstra(self.delays, indices=p).reshape(flames.arrival.shape)
        flames.arrival = np.minimum(flames.arrival, source.time + delay)
        flames.sources.append(source)

    def advance(self, flames: Flames, time: float) -> float:
        """Burn every cell whose time has come; return when the next one will (s)."""
        flames.burning = flames.arrival <= time
        flames.alight = frozenset(np.flatnonzero(flames.burning).tolist())
        burning, beside = flames.burning, cells_beside(self.building, flames.burning)
        heat = np.where(beside, paper.HEAT_LOSS, 0.0)
        flames.harm = np.where(burning, paper.BURN_LOSS, heat)
        detour = np.where(beside, paper.HEAT_COST, 1.0)
        flames.cost = np.where(burning, paper.BURN_COST, detour)
        return float(flames.arrival[~flames.burning].min(initial=inf))


@lru_cache(maxsize=8)
def fuel(building: Building) -> np.ndarray:
    """Mark the cells that can burn, (floors, rows, cols) bool.

    Room cells and doors, but for those within PROTECTED_METRES on foot of an exit or
    stairwell entrance [D6, D7, chosen].
    """
    ways = [m.index for m in building.landmarks if m.kind is not Kind.DOOR]
    metres = navigation_of(building).distance_to(*ways)
    unprotected = (metres > paper.PROTECTED_METRES).reshape(building.kind.shape)
    return np.isin(building.kind, (Kind.FLOOR, Kind.DOOR)) & unprotected


def rim(building: Building, landmark: int) -> np.ndarray:
    """Find what can burn around a protected landmark's clearance, (k,) places.

    [D6, D7, chosen] The clearance is all that one can walk to from there without
    crossing `fuel`: once its whole rim burns, nobody outside gets in.
    """
    nav, burns = navigation_of(building), fuel(building)
    start = nav.goals[landmark]
    metres = nav.distances(start, np.where(burns, inf, 1.0)).reshape(burns.shape)
    return np.flatnonzero(cells_beside(building, np.isfinite(metres)) & burns)


def cells_beside(building: Building, cells: np.ndarray) -> np.ndarray:
    """Walkable cells that share a side with any of these, (floors, rows, cols) bool."""
    beside = np.zeros_like(cells)
    for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        beside |= shifted(cells, *step)
    return beside & building.walkable


def _delays(building: Building, rng: Rng) -> csr_matrix:
    """(places, places) seconds for every border that flames can pass [D7].

    Both cells must be `fuel`.
    """
    burns, shape = fuel(building), building.kind.shape
    east = np.flatnonzero(burns & shifted(burns, 0, 1))
    south = np.flatnonzero(burns & shifted(burns, 1, 0))
    one = np.concatenate([east, south])
    other = np.concatenate([east + 1, south + shape[2]])
    delay = rng.exponential(1 / paper.SPREAD_RATE, len(one))
    where = (np.concatenate([one, other]), np.concatenate([other, one]))
    return csr_matrix((np.tile(delay, 2), where), shape=(burns.size, burns.size))
