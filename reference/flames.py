"""Flames spread by first passage: a cell burns when the fastest chain reaches it.

Clauses: A6, B7, D7.

    p   place;  t  seconds
"""

from math import inf

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference.building import Building, Kind
from reference.navigation import navigation_of, shifted
from reference.paper import (
    BURN_COST,
    BURN_LOSS,
    DOOR_DELAY_FACTOR,
    HEAT_COST,
    HEAT_LOSS,
    SPREAD_RATE,
)
from reference.world import Flames, Source


class Spread:
    """How flames spread in one run: first passage [D7, chosen].

    Every border between two cells has a fixed, seeded delay; a cell burns from the
    earliest time that a chain of delays from any source reaches it.
    """

    def __init__(self, building: Building, rng: np.random.Generator):
        self.building = building
        self.delays = _delays(building, rng)

    def ignite(self, flames: Flames, source: Source) -> None:
        """One more source: every cell burns from the earliest chain of delays."""
        p = navigation_of(self.building).place(source.floor, source.x, source.y)
        delay = dijkstra(self.delays, indices=p)
        earliest = np.minimum(flames.arrival.ravel(), source.time + delay)
        flames.arrival = earliest.reshape(flames.arrival.shape)
        flames.sources.append(source)

    def resampled(
        self, flames: Flames, time: float, rng: np.random.Generator
    ) -> "Spread":
        """Another future of the same fire: what burns at a time (s) stays as it is.

        [D7, chosen] Delays are exponential, and an exponential delay that is not over
        yet forgets how long it has lasted: what is left of it is distributed like a
        new one, on a door's border too. Borders between cells that do not burn have
        told nothing; those between cells that do no longer matter. So fresh delays
        everywhere, begun now at the edge of what burns, are exactly what is possible
        given what one has seen.
        """
        other = Spread(self.building, rng)
        arrival = flames.arrival.ravel()
        alight = np.flatnonzero(arrival <= time)
        if len(alight):
            delay = dijkstra(other.delays, indices=alight, min_only=True)
            arrival = np.where(arrival <= time, arrival, time + delay)
        flames.arrival = arrival.reshape(flames.arrival.shape)
        return other

    def advance(self, flames: Flames, time: float) -> float:
        """Let everything burn whose time has come; when the next cell will (s)."""
        flames.burning = flames.arrival <= time
        places = [flames.burning, beside_flames(self.building, flames.burning)]
        flames.harm = np.select(places, [BURN_LOSS, HEAT_LOSS], 0.0)
        flames.cost = walking_cost(*places)
        return float(flames.arrival[~flames.burning].min(initial=inf))


def beside_flames(building: Building, burning: np.ndarray) -> np.ndarray:
    """(floors, rows, cols) bool: walkable cells that share a side with flames."""
    beside = np.zeros_like(burning)
    for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        beside |= shifted(burning, *step)
    return beside & building.walkable


def walking_cost(burning: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """Metres that a metre in or beside flames counts as; arrays like `burning` [C5]."""
    return np.select([burning, beside], [BURN_COST, HEAT_COST], 1.0)


def _delays(building: Building, rng: np.random.Generator) -> csr_matrix:
    """(places, places) seconds for every border that flames can pass.

    Flames enter neither walls nor stairwells nor their entrances [D7]; doors, and the
    exits, take longer.
    """
    kind = building.kind
    cols = kind.shape[2]
    fuel = np.isin(kind, (Kind.FLOOR, Kind.DOOR, Kind.EXIT))
    slow = np.isin(kind, (Kind.DOOR, Kind.EXIT)).ravel()
    starts, ends = [], []
    for d_row, d_col in ((0, 1), (1, 0)):
        p = np.flatnonzero(fuel & shifted(fuel, d_row, d_col))
        starts.append(p)
        ends.append(p + d_row * cols + d_col)
    one, other = np.concatenate(starts), np.concatenate(ends)
    delay = rng.exponential(1 / SPREAD_RATE, len(one))
    delay[slow[one] | slow[other]] *= DOOR_DELAY_FACTOR
    where = (np.concatenate([one, other]), np.concatenate([other, one]))
    shape = (kind.size, kind.size)
    return csr_matrix((np.concatenate([delay, delay]), where), shape=shape)
