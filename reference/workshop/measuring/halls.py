"""Let crowds that know the way and do not think walk on small maps; measure them.

n   people;  rows, cols  of a floor's drawing, walls included
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from math import inf

import numpy as np

from reference.beginning import world_with_people_at
from reference.building import Building
from reference.floorplan import Drawing, Storey
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.world import Bodies, Event, World

BARE = Scenario(robots_per_floor=0, sources=0, time_limit=300.0)

Spot = tuple[int, slice, slice]
"""A part of a building, as np.s_ writes it: floor, rows, columns."""

Past = Callable[[Bodies], np.ndarray]
"""(n,) bool: who is past something?"""


class Crowd(Simulation):
    """Bodies without minds, who walk to the nearest way out, or to a goal each [A9].

    goals: (n,) landmarks, on one floor;  limit: s
    """

    def __init__(
        self, world: World, seed: int, goals: Sequence[int] = (), limit: float = 300.0
    ):
        scenario = replace(BARE, time_limit=limit)
        super().__init__(world.building, scenario, seed=seed, world=world)
        self._anywhere = not goals
        if goals:
            world.bodies.landmark[:] = goals

    def step(self) -> list[Event]:
        """Run one tick in which nobody thinks."""
        self.due[:] = False  # nobody's turn to run Algorithm 1 or 2
        bodies = self.world.bodies
        if self._anywhere:
            for floor in range(self.building.floors):
                marks = np.array(self.building.ways_out(floor))
                who = np.flatnonzero(bodies.walking & (bodies.floor == floor))
                cells = bodies.place[who] % self.navigation.floor_size
                far = self.navigation.metres[marks[:, None], cells]
                bodies.landmark[who] = marks[far.argmin(axis=0)]
        return super().step()


def build_floors(*floors: Sequence[str]) -> Building:
    """Build floors from their rows, the lowest first."""
    storeys = tuple(Storey("", tuple(rows)) for rows in floors)
    return Building(Drawing("case", len(floors[0][0]), len(floors[0]), storeys))


def hall(*rows: str) -> Building:
    """Build one floor from its rows, with a wall above and below."""
    return build_floors(["#" * len(rows[0]), *rows, "#" * len(rows[0])])


def put_people(building: Building, seed: int, *groups: tuple[int, Spot]) -> World:
    """Put people in spots, (count, spot) each, at most four on 1 m²; nobody dies."""
    rng = np.random.default_rng(seed)
    place: list[np.ndarray] = []
    aside: list[np.ndarray] = []  # from the middle of a cell to that of its quarter
    for count, spot in groups:
        quarters = np.repeat(places_of_spot(building, spot), 4)
        chosen = rng.choice(len(quarters), count, replace=False)
        place.append(quarters[chosen])
        aside.append(np.stack([chosen % 2, chosen // 2 % 2], axis=1) / 2 - 0.25)
    spots = np.concatenate(place)
    position = navigation_of(building).centres[spots] + np.concatenate(aside)
    world = world_with_people_at(building, BARE, spots, position, rng)
    world.bodies.health[:] = inf
    return world


def places_of_spot(building: Building, spot: Spot) -> np.ndarray:
    """Find the walkable places of a spot: (k,)."""
    chosen = np.zeros_like(building.walkable)
    chosen[spot] = building.walkable[spot]
    return np.flatnonzero(chosen)


def passing_times(
    crowd: Crowd, past: Past = lambda bodies: ~bodies.inside
) -> np.ndarray:
    """Run until everybody is past something; by default, out of the building.

    Returns when, (n,) s, inf for never.
    """
    bodies = crowd.world.bodies
    when = np.full(len(bodies), inf)
    while not crowd.done and np.isinf(when).any():
        crowd.step()
        when[np.isinf(when) & past(bodies)] = crowd.world.time
    return when


def east_of(building: Building, col: int) -> Past:
    """Make what tells who is in this column or east of it, or out."""
    x = building.metres(0, col)[0] - 0.5
    return lambda bodies: (bodies.position[:, 0] >= x) | ~bodies.inside


def flow(when: np.ndarray) -> float:
    """Count people per second from first to last, or to 300 s if some never pass."""
    passed = np.isfinite(when).sum()
    if passed < 2:
        return 0.0
    last = min(when.max(), BARE.time_limit)
    return float((passed - 1) / (last - when.min()))


def peak_density(crowd: Crowd, spot: Spot) -> float:
    """Find the people per square metre in a spot, in its most crowded ten seconds."""
    part = places_of_spot(crowd.building, spot)
    ticks = []
    bodies = crowd.world.bodies
    while not crowd.done:
        crowd.step()
        here = bodies.place[bodies.walking]
        ticks.append(np.isin(here, part).sum() / len(part))
    ten = round(10 / crowd.tick)
    return float(np.convolve(ticks, np.full(ten, 1 / ten)).max())
