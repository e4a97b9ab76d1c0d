"""The world before the first tick: who stands where, and what they remember.

n   people;  p  place
"""

from math import inf

import numpy as np
from numpy.random import Generator as Rng

from reference import paper
from reference.building import Building, Kind
from reference.navigation import navigation_of
from reference.paper import InputError, Scenario
from reference.world import (
    NOBODY,
    NOWHERE,
    Bodies,
    Fate,
    Flames,
    Mind,
    Mode,
    Robot,
    World,
)

PURPOSES = ("people", "flames", "fire", "robots", "elsewhere", "bodies")
"""Each has a random generator, so two runs may differ in one and share the rest.

people: their places, pace and rank; flames: delays; fire, robots: their strategies;
elsewhere: where a fire burns instead of an occupied place; bodies: the random steps of
those held up.
"""


def generators(seed: int) -> dict[str, np.random.Generator]:
    """One random generator for each of PURPOSES."""
    seeds = np.random.SeedSequence(seed).spawn(len(PURPOSES))
    return dict(zip(PURPOSES, map(np.random.default_rng, seeds), strict=True))


def starting_world(building: Building, scenario: Scenario, rng: Rng) -> World:
    """Build the world at 0 s; rng draws people's places, pace and rank.

    Raises InputError for more people than fit and for rooms that do not exist.
    """
    place = _starting_places(building, scenario, rng)
    jitter = rng.uniform(-1, 1, (len(place), 2)) * (0.5 - paper.BODY_RADIUS)
    position = navigation_of(building).centres[place] + jitter
    return world_with_people_at(building, scenario, place, position, rng)


def world_with_people_at(
    building: Building,
    scenario: Scenario,
    place: np.ndarray,
    position: np.ndarray,
    rng: Rng,
) -> World:
    """Build the world at 0 s: people in these places, (n,), at these metres, (n, 2).

    They begin as followers without a leader: Alg. 1:3 makes them leaders at once
    [B4, B5].
    """
    bodies = _make_bodies(building, place, position, rng)
    shape = building.kind.shape
    no_flames = Flames(
        arrival=np.full(shape, inf),
        burning=np.zeros(shape, dtype=bool),
        ash=np.zeros(shape, dtype=bool),
        alight=frozenset(),
        harm=np.zeros(shape),
        cost=np.ones(shape),
        sources=[],
    )
    world = World(
        building=building,
        time=0.0,
        bodies=bodies,
        minds=[Mind() for _ in place],
        robots=_place_robots(building, scenario.robots_per_floor, len(bodies)),
        flames=no_flames,
        burnt=set(),
    )
    for robot in world.robots:
        robot.active = world.anybody_at_or_above(robot.floor)
    return world


def _make_bodies(
    building: Building, place: np.ndarray, position: np.ndarray, rng: Rng
) -> Bodies:
    """Bodies of people in these places, with a pace drawn for each.

    The last digit of few paces depends on the machine: see `simulation`.
    """
    n = len(place)
    pace = paper.WALKING_SPEED + paper.WALKING_SPREAD * rng.standard_normal(n)
    slowest, fastest = paper.WALKING_SPEED + np.array([-2, 2]) * paper.WALKING_SPREAD
    return Bodies(
        position=position,
        floor=place // building.kind[0].size,
        place=place,
        pace=np.clip(pace, slowest, fastest),
        health=np.full(n, paper.HEALTH),  # [B7]
        fate=np.full(n, Fate.INSIDE, dtype=np.int8),
        mode=np.full(n, Mode.FOLLOWER, dtype=np.int8),
        landmark=np.full(n, NOWHERE),
        target=position.copy(),
        goal=position.copy(),
        leader=np.full(n, NOBODY),
        stairwell=np.full(n, NOWHERE),
        stairs_until=np.full(n, inf),
        rank=rng.random(n),
        headway=position.copy(),
        headway_time=np.zeros(n),
        reckless_until=np.full(n, -inf),
    )


def _starting_places(building: Building, scenario: Scenario, rng: Rng) -> np.ndarray:
    """Draw (n,) distinct places [B8], a count per floor or all in some rooms."""
    if scenario.rooms:
        places = _cells_of_rooms(building, scenario.rooms)
        groups = [("in these rooms", scenario.people, places)]
    else:
        cells = np.flatnonzero(building.kind == Kind.FLOOR)
        floor = cells // building.kind[0].size
        groups = [
            (f"on floor {k + 1}", count, cells[floor == k])
            for k, count in enumerate(scenario.start_counts(building.floors))
        ]

    chosen = []
    for where, count, places in groups:
        if count > len(places):
            raise InputError(
                f"{count} people do not fit {where} of '{building.title}'; there is "
                f"room for {len(places)}. Ask for fewer: the scenario's `people`."
            )
        chosen.append(rng.choice(places, count, replace=False))
    return np.concatenate(chosen)


def _cells_of_rooms(building: Building, rooms: tuple[str, ...]) -> np.ndarray:
    """(k,) places of these rooms, by id; InputError for a room that does not exist."""
    known = {a.id: a.index for a in building.areas if a.kind == "room"}
    for room in rooms:
        if room not in known:
            raise InputError(
                f"no room {room!r} in {building.title!r}. There is: {', '.join(known)}"
            )
    return np.flatnonzero(np.isin(building.area.ravel(), [known[r] for r in rooms]))


def _place_robots(building: Building, per_floor: int, people: int) -> list[Robot]:
    """Put a team on each floor, a robot at each stairwell in turn [C2].

    On a floor without stairwells at each room in turn.

    Robots hinder nobody [C7, chosen]: they and people walk through each other. Their
    numbers follow those of people, so that who follows whom is one number.
    """
    nav = navigation_of(building)
    robots: list[Robot] = []
    for floor in range(building.floors):
        wells = [s.centre for s in building.stairwells if floor in s.areas]
        posts = wells or [room.centre for room in building.rooms(floor)]
        for number in range(per_floor):
            p = nav.nearest_free(floor, *posts[number % len(posts)])
            body = people + len(robots)
            robots.append(Robot(body, floor, number, nav.centres[p].copy(), p))
    return robots
