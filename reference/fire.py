"""The fire: flames by first passage, the generator of Eqs. 2-3, scripted strategies.

Clauses: A6, B7, D2, D3, D4, D5, D6, D7.

    p       place;  t  seconds
    X, Y    what the fire agent decides, metres;  X', Y'  where the source appears
"""

from collections.abc import Iterable
from math import floor as floor_of
from math import inf
from typing import NamedTuple, Protocol

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.csgraph import dijkstra

from reference.building import Building, Kind
from reference.navigation import Navigation, prepared, shifted
from reference.paper import (
    BURN_COST,
    BURN_LOSS,
    DOOR_DELAY_FACTOR,
    HEAT_COST,
    HEAT_LOSS,
    SPREAD_RATE,
)
from reference.world import Flames, Source, World

Decision = tuple[int, float, float]
"""What the fire agent decides: floor, X, Y [D2]."""


def snapped(x: float) -> float:
    """Centre of the grid cell nearest to a coordinate [D3, Eq. 2] [D5, Eq. 3].

    Written as printed; with the floor of x its first branch is never taken [D4].
    """
    below = floor_of(x)
    if abs(below - x + 0.5) > abs(below - x - 0.5):
        return below - 0.5
    return below + 0.5


class Strategy(Protocol):
    """Whoever decides where fires break out: a script or a learned policy."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Floor and metres of the next source, or None for none."""


# -- Flames -------------------------------------------------------------------------


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
        p = prepared(self.building).place(source.floor, source.x, source.y)
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
        flames.cost = cost_of(*places)
        return float(flames.arrival[~flames.burning].min(initial=inf))


def beside_flames(building: Building, burning: np.ndarray) -> np.ndarray:
    """(floors, rows, cols) bool: walkable cells that share a side with flames."""
    beside = np.zeros_like(burning)
    for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
        beside |= shifted(burning, *step)
    return beside & building.walkable


def cost_of(burning: np.ndarray, beside: np.ndarray) -> np.ndarray:
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


# -- The generator ------------------------------------------------------------------


class Refused(NamedTuple):
    """A position that is occupied: no fire, and a penalty in training [D6]."""

    floor: int
    x: float
    y: float
    reason: str


class Generator:
    """Turns decisions into sources: Eqs. 2-3 and rule D6 in both modes."""

    def __init__(self, building: Building, sources: int, training: bool):
        self.building, self.sources, self.training = building, sources, training
        self.navigation: Navigation = prepared(building)

    def generate(
        self, world: World, decision: Decision, rng: np.random.Generator
    ) -> Source | Refused:
        """The source that follows from a decision, or why there is none [D6]."""
        floor, x, y = decision[0], snapped(decision[1]), snapped(decision[2])
        if len(world.flames.sources) >= self.sources:
            return Refused(floor, x, y, "no sources left")
        occupied = self.occupied(world, floor, x, y)
        if occupied and self.training:
            return Refused(floor, x, y, occupied)
        if occupied:
            place = self.random_free(world, rng)
            if place is None:
                return Refused(floor, x, y, "no free place left")
            floor, x, y = place
        return Source(floor, x, y, world.time)

    def occupied(self, world: World, floor: int, x: float, y: float) -> str:
        """What occupies a position, in one word; empty when it is free [D6, chosen]."""
        row, col = self.building.cell(x, y)
        floors, rows, cols = self.building.kind.shape
        if not (0 <= floor < floors and 0 <= row < rows and 0 <= col < cols):
            return "outside"
        kind = Kind(int(self.building.kind[floor, row, col]))
        if kind is not Kind.FLOOR:
            return kind.name.lower()
        if world.flames.burning[floor, row, col]:
            return "fire"
        p = self.navigation.place(floor, x, y)
        if any(robot.place == p for robot in world.robots):
            return "robot"
        return "human" if (world.bodies.place[world.bodies.walking] == p).any() else ""

    def random_free(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Another random position without anything on it, on any floor."""
        places = np.flatnonzero(free_places(world))
        return _at(world, rng.choice(places)) if len(places) else None


def free_places(world: World) -> np.ndarray:
    """(places,) bool: room cells with neither flames nor a human nor a robot [D6]."""
    free = ((world.building.kind == Kind.FLOOR) & ~world.flames.burning).ravel()
    free[world.bodies.place[world.bodies.walking]] = False
    free[[robot.place for robot in world.robots]] = False
    return free


def _at(world: World, p: int) -> Decision:
    nav = prepared(world.building)
    x, y = nav.centres[p]
    return int(p) // nav.floor_size, float(x), float(y)


# -- Scripted strategies ------------------------------------------------------------


class NoFire:
    """Nothing ever burns."""

    def decide(self, world: World, rng: np.random.Generator) -> None:
        """Never."""


class RandomFire:
    """A random cell of a random floor's rooms."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision:
        """Uniform over floors first, then over the floor's room cells."""
        kind = world.building.kind
        floor = int(rng.integers(len(kind)))
        cells = np.argwhere(kind[floor] == Kind.FLOOR)
        return (floor, *world.building.metres(*rng.choice(cells).tolist()))


class GreedyFire:
    """Attacks the ways people are using: the cell that most are about to cross."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """The busiest free cell of all floors, a random one among equals."""
        traffic = self._traffic(world)
        traffic[~free_places(world)] = 0
        if not traffic.any():
            return RandomFire().decide(world, rng)
        return _at(world, rng.choice(np.flatnonzero(traffic == traffic.max())))

    @staticmethod
    def _traffic(world: World) -> np.ndarray:
        """(places,) how many people will cross each place on the way to their goals."""
        nav, bodies = prepared(world.building), world.bodies
        traffic = np.zeros(nav.places)
        for i in np.flatnonzero(bodies.walking).tolist():
            mark, p = int(bodies.landmark[i]), int(bodies.place[i])
            goal = nav.places_at(bodies.floor[i : i + 1], bodies.target[i : i + 1])
            chain = nav.walk(p, mark) if mark >= 0 else nav.straight(p, int(goal[0]))
            np.add.at(traffic, list(set(chain)), 1)
        return traffic


class Replay:
    """Sources of an earlier run once more: the same fires for others."""

    def __init__(self, sources: Iterable[Source]):
        self.sources = sorted(sources, key=lambda source: source.time)

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """The next source, once its time has come; rule D6 holds as for any fire."""
        left = self.sources[len(world.flames.sources) :]
        return left[0][:3] if left and left[0].time <= world.time else None


STRATEGIES: dict[str, type[Strategy]] = {
    "none": NoFire,
    "random": RandomFire,
    "greedy": GreedyFire,
}
"""Scripted fires by name, in order of harm."""
