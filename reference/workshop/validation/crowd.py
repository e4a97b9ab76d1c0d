"""People who know the way and do not think: bodies on small maps, and what to measure.

Clauses: A3, A7, F8.

    n   people;  rows, cols  of a floor's drawing, walls included
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from reference.beginning import with_people_at
from reference.building import Building
from reference.events import Event
from reference.floorplan import parse
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.world import Bodies, World

BARE = Scenario(robots_per_floor=0, sources=0, time_limit=300.0)
TICK = BARE.tick

Spot = tuple[int, slice, slice]
"""A part of a building: floor, rows, columns."""

Past = Callable[[Bodies], np.ndarray]
"""(n,) bool: who is past something?"""


class Crowd(Simulation):
    """Bodies without minds, who walk to the nearest way out, or to a goal each.

    goals: (n,) landmarks, on one floor
    """

    def __init__(
        self, world: World, seed: int, goals: Sequence[int] = (), limit: float = 300.0
    ):
        """Begin with a world; seed: of their random steps; limit: s."""
        scenario = replace(BARE, time_limit=limit)
        super().__init__(world.building, scenario, seed=seed, world=world)
        self._goals = np.array(goals)

    def step(self) -> list[Event]:
        """Run one tick without SENSE and DECIDE."""
        already = len(self.events)
        self._choose()
        touched = self._people_move()
        self._burn()
        self._lose_health()
        self._settle(touched)
        return self.events[already:]

    def _choose(self) -> None:
        bodies = self.world.bodies
        for floor in range(self.building.floors):
            who = np.flatnonzero(bodies.walking & (bodies.floor == floor))
            marks = np.array(self.building.ways_out(floor))
            far = self.navigation.metres_to(marks[:, None], bodies.place[who])
            nearest = marks[far.argmin(axis=0)]
            bodies.landmark[who] = self._goals[who] if len(self._goals) else nearest


def built(*floors: Sequence[str]) -> Building:
    """Build floors from their rows, the lowest first."""
    text = f"building: case\nsize: {len(floors[0][0])} x {len(floors[0])}"
    for number, rows in enumerate(floors, 1):
        text += "\n".join(["", f"floor {number}:", *rows])
    return Building(parse(text))


def people(building: Building, seed: int, *groups: tuple[int, Spot]) -> World:
    """Put so many people in each spot, four a square metre at most; nobody dies."""
    rng, nav = np.random.default_rng(seed), navigation_of(building)
    place, off = [], []
    for count, spot in groups:
        quarters = np.repeat(places(building, spot), 4)
        chosen = rng.choice(len(quarters), count, replace=False)
        place.append(quarters[chosen])
        off.append(np.stack([chosen % 2, chosen // 2 % 2], axis=1) / 2 - 0.25)
    where = np.concatenate(place)
    position = nav.centres[where] + np.concatenate(off)
    world = with_people_at(building, BARE, where, position, rng)
    world.bodies.health[:] = inf
    return world


def places(building: Building, spot: Spot) -> np.ndarray:
    """(k,) walkable places of a spot."""
    chosen = np.zeros_like(building.walkable)
    chosen[spot] = building.walkable[spot]
    return np.flatnonzero(chosen)


def gone(bodies: Bodies) -> np.ndarray:
    """Who has left the building?"""
    return ~bodies.inside


def times(crowd: Crowd, past: Past = gone) -> np.ndarray:
    """Run until everybody is past something; return when, (n,) s, inf for never."""
    bodies = crowd.world.bodies
    when = np.full(len(bodies), inf)
    while not crowd.done and np.isinf(when).any():
        crowd.step()
        when[np.isinf(when) & past(bodies)] = crowd.world.time
    return when


def east_of(building: Building, col: int) -> Past:
    """Who is in this column or east of it, or out?"""
    x = building.metres(0, col)[0] - 0.5
    return lambda bodies: (bodies.position[:, 0] >= x) | ~bodies.inside


def flow(when: np.ndarray) -> float:
    """People per second from the first to the last, or to 300 s if some never pass."""
    passed = when[np.isfinite(when)]
    if len(passed) < 2:
        return 0.0
    last = passed.max() if len(passed) == len(when) else BARE.time_limit
    return float((len(passed) - 1) / (last - passed.min()))


def densest(crowd: Crowd, spots: dict[str, Spot]) -> dict[str, float]:
    """People per square metre in each spot, in its most crowded ten seconds."""
    parts = [places(crowd.building, spot) for spot in spots.values()]
    ticks = []
    while not crowd.done:
        crowd.step()
        here = crowd.world.bodies.place[crowd.world.bodies.walking]
        ticks.append([np.isin(here, part).sum() / len(part) for part in parts])
    ten = np.full(round(10 / TICK), TICK / 10)
    most = (float(np.convolve(part, ten).max()) for part in np.transpose(ticks))
    return dict(zip(spots, most, strict=True))
