"""The fire: who decides where it starts, Eqs. 2-3 and rule D6, how flames spread.

p       place
X, Y    what the fire agent decides, metres;  X', Y'  where the source appears
"""

from functools import lru_cache
from math import floor as floor_of
from math import inf
from typing import Protocol

import numpy as np
from numpy.random import Generator as Rng
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference import paper
from reference.building import Building, Kind
from reference.navigation import navigation_of, shifted
from reference.paper import Scenario
from reference.world import FireLit, FireRefused, Flames, World

Decision = tuple[int, float, float]  # floor, X, Y: what the fire agent decides [D2]


def snapped(x: float) -> float:
    """Centre of the grid cell nearest to a coordinate [D3, Eq. 2] [D5, Eq. 3].

    Written as printed; with the floor of x its first branch is never taken [D4].
    """
    below = floor_of(x)
    if abs(below - x + 0.5) > abs(below - x - 0.5):
        return below - 0.5
    return below + 0.5


class SourceGenerator:
    """The fire source generator: Eqs. 2-3, and rule D6 in both modes.

    For an occupied place there is no fire in training, else one at another place: the
    first free one in an order that is drawn once per run [D6, chosen]. So with the same
    seed the same occupied places lead to the same fires, whoever guides.
    """

    def __init__(self, building: Building, scenario: Scenario, rng: Rng):
        self.training = scenario.training
        self.order = rng.permutation(building.kind.size)

    def generate(self, world: World, decision: Decision) -> FireLit | FireRefused:
        """Turn a decision into a source; refuse it or move it if occupied [D6]."""
        floor = int(decision[0])
        x = snapped(decision[1])
        y = snapped(decision[2])
        free = free_places(world)
        shape = world.building.kind.shape
        cell = (floor, *world.building.cell(x, y))
        inside = all(0 <= k < size for k, size in zip(cell, shape, strict=True))
        if inside and free.reshape(shape)[cell]:
            return FireLit(world.time, floor, x, y)

        others = self.order[free[self.order]]
        if self.training or not len(others):
            return FireRefused(world.time, floor, x, y)
        return FireLit(world.time, *decision_at(world, others[0]))


def lightable(building: Building) -> np.ndarray:
    """(floors, rows, cols) bool: room cells that can burn, where one may light [D6]."""
    return burnable(building) & (building.kind == Kind.FLOOR)


def free_places(world: World) -> np.ndarray:
    """(places,) bool: unburnt, unprotected room cells without human or robot [D6].

    A robot stands in its cell also when its work is done.
    """
    unlit = world.flames.arrival > world.time
    free = (lightable(world.building) & unlit).ravel()
    free[world.bodies.place[world.bodies.walking]] = False
    free[[robot.place for robot in world.robots]] = False
    return free


def decision_at(world: World, p: int) -> Decision:
    """The decision that lights a place."""
    nav = navigation_of(world.building)
    x, y = nav.centres[p].tolist()
    return int(p) // nav.floor_size, x, y


class Spread:
    """How flames spread and burn out in one run: first passage [D7, chosen].

    Every border between two cells has a fixed, seeded delay; a cell burns from the
    earliest time that a chain of delays from any source reaches it, for burn_seconds.
    Where a delay is longer than that, the cell has burnt out before its flames cross
    the border: this is bond percolation.

    Flames move on every FLAME_SECONDS. A source is lit between two moves and shows
    flames from the next one on, so it burns that much shorter than others.
    """

    def __init__(self, building: Building, scenario: Scenario, rng: Rng):
        """delays: (places, places) s, a border each between two cells that can burn.

        The last digit of few delays depends on the machine: see `simulation`.
        """
        self.building = building
        self.burn_seconds = scenario.burn_seconds
        burns = burnable(building)
        east = np.flatnonzero(burns & shifted(burns, 0, 1))
        south = np.flatnonzero(burns & shifted(burns, 1, 0))
        one = np.concatenate([east, south])
        other = np.concatenate([east + 1, south + burns.shape[2]])
        delay = rng.exponential(1 / scenario.spread_rate, len(one))

        passes = delay < self.burn_seconds
        shape = (burns.size, burns.size)
        one_way = csr_matrix((delay[passes], (one[passes], other[passes])), shape)
        self.delays = one_way + one_way.T  # flames pass a border both ways

    def ignite(self, flames: Flames, source: FireLit) -> None:
        """Add a source; each cell's arrival is the earliest over all sources."""
        p = navigation_of(self.building).place(source.floor, source.x, source.y)
        delay = dijkstra(self.delays, indices=p).reshape(flames.arrival.shape)
        flames.arrival = np.minimum(flames.arrival, source.time + delay)
        flames.sources.append(source)

    def advance(self, flames: Flames, time: float) -> float:
        """Burn every cell whose time has come, till its time is over: then it is ash.

        Returns when the next cell will begin or end to burn (s).
        """
        ends = flames.arrival + self.burn_seconds
        flames.ash = ends <= time
        flames.burning = (flames.arrival <= time) & ~flames.ash
        flames.alight = frozenset(np.flatnonzero(flames.burning).tolist())

        burning = flames.burning
        beside = cells_beside(self.building, burning)
        heat = np.where(beside, paper.HEAT_LOSS, 0.0)
        flames.harm = np.where(burning, paper.BURN_LOSS, heat)  # [B7]
        flames.cost = cost_of_flames(burning, beside)

        coming = np.where(burning, ends, flames.arrival)
        return float(coming[~flames.ash].min(initial=inf))


def burnable(building: Building) -> np.ndarray:
    """Mark the cells that can burn, (floors, rows, cols) bool.

    These are room cells and doors, except those within PROTECTED_METRES on foot of an
    exit or stairwell entrance [D6, D7, chosen].
    """
    return _fuel(building, paper.PROTECTED_METRES)


@lru_cache(maxsize=8)
def _fuel(building: Building, protected_metres: float) -> np.ndarray:
    ways = [m.index for m in building.landmarks if m.kind is not Kind.DOOR]
    metres = navigation_of(building).distance_to(*ways)
    unprotected = (metres > protected_metres).reshape(building.kind.shape)
    fuel = np.isin(building.kind, (Kind.FLOOR, Kind.DOOR)) & unprotected
    fuel.flags.writeable = False  # shared by all runs
    return fuel


def cells_around_clearance(building: Building, landmark: int) -> np.ndarray:
    """Find the cells that can burn beside a landmark's clearance, (k,) places.

    [D6, D7, chosen] The clearance is all that one can walk to from there without
    crossing `burnable`: once its whole rim burns, nobody outside gets in.
    """
    return _rim(building, landmark, paper.PROTECTED_METRES)


@lru_cache(maxsize=512)
def _rim(building: Building, landmark: int, protected_metres: float) -> np.ndarray:
    nav = navigation_of(building)
    burns = _fuel(building, protected_metres)
    barred = np.where(burns, inf, 1.0)
    metres = nav.distances(nav.goals[landmark], barred).reshape(burns.shape)
    rim = np.flatnonzero(cells_beside(building, np.isfinite(metres)) & burns)
    rim.flags.writeable = False
    return rim


def cells_beside(building: Building, cells: np.ndarray) -> np.ndarray:
    """Walkable cells that share a side with any of these, (floors, rows, cols) bool."""
    beside = np.zeros_like(cells)
    for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        beside |= shifted(cells, *step)
    return beside & building.walkable


def cost_of_flames(burning: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """What a metre on foot costs in cells that burn and in those beside them [C7]."""
    detour = np.where(beside, paper.HEAT_COST, 1.0)
    return np.where(burning, paper.BURN_COST, detour)


# -- Who decides --------------------------------------------------------------------


class FireStrategy(Protocol):
    """Decides where fires break out [D2]."""

    def decide(self, world: World, rng: Rng) -> Decision | None:
        """Floor and metres of the next source, or None for none.

        Floors count from 0: what a map calls floor 1 is 0. Where no source may be, it
        is lit elsewhere, or refused in training [D6]. To measure h [F11] it is asked
        until its sources are lit, also when nobody is inside any more.
        """


class NoFire:
    """Nothing ever burns."""

    def decide(self, world: World, rng: Rng) -> None:
        """Decide nothing."""


class RandomFire:
    """Lights a random cell that may burn, on a random floor."""

    def decide(self, world: World, rng: Rng) -> Decision | None:
        """Draw the floor first, then one of its cells; None where nothing can burn."""
        building = world.building
        cells = lightable(building)
        floors = np.flatnonzero(cells.any(axis=(1, 2)))
        if not len(floors):
            return None
        floor = int(rng.choice(floors))
        return (floor, *building.random_point(cells[floor], rng))
