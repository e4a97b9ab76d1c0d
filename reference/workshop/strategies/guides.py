"""Hand-written robots beyond the simplest; to add one, see the folder's `__init__`.

Clauses: C1, C5, C7.

    p   place;  d  metres on foot;  lost  people whom no robot leads or is sent to yet
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial
from math import dist, inf

import numpy as np
from numpy.random import Generator as Rng

from reference import paper
from reference.building import Building
from reference.navigation import navigation_of
from reference.robots import Destination, Destinations, actual_target, flame_cost
from reference.workshop.strategies.observed import (
    at_way_out,
    before_stairwell,
    guides,
    stairs_that_end,
)
from reference.workshop.strategies.traffic import ways_outside
from reference.world import NOBODY, NOWHERE, Robot, World

GROUP_RADIUS = 4.0  # [C7, chosen] metres: people this near form one group
AT_HAND = 2.0  # [C7, chosen] metres: people this near a robot follow it, or never will
FULL = 10  # [C7, chosen] people led: more would wait over 8 s at every door
TRIP = 5.0  # [C7, chosen] metres added to each way out, for coming back
SOON, SOON_COST = 5.0, 4.0
"""[C7, chosen] metres on foot from flames within which a metre costs more, and how much
more beside them: flames spread about this far while one walks 25 s."""


class Patrol:
    """Visit all rooms of the floor in turn, and the nearest way out after each."""

    def __init__(self) -> None:
        self._stops: dict[int, list[Destination]] = {}

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Choose the next stop once the last is reached."""
        return [None if robot.way else self._next(world, robot) for robot in robots]

    def _next(self, world: World, robot: Robot) -> Destination:
        if robot.body not in self._stops:
            mates = sum(other.floor == robot.floor for other in world.robots)
            self._stops[robot.body] = _round(world.building, robot, mates)
        stops = self._stops[robot.body]
        stops.append(stops.pop(0))
        return stops[-1]


def _round(building: Building, robot: Robot, mates: int) -> list[Destination]:
    """List room, nearest way out, next room, ...; mates start at different rooms.

    Of a room: the cell nearest to its centre, if possible one that Eq. 1 leaves alone.
    """
    floor, out, stops = robot.floor, building.ways_out(robot.floor), list[Destination]()
    rooms = building.rooms(floor)
    shift = robot.number * len(rooms) // mates
    for room in rooms[shift:] + rooms[:shift]:
        cells = [building.metres(*cell) for cell in room.cells.tolist()]
        calm = [to for to in cells if actual_target(building, floor, *to) == to]
        stops.append(min(calm or cells, key=partial(dist, room.centre)))
        ways = [at_way_out(building, building.landmarks[mark]) for mark in out]
        stops.append(min(ways, key=partial(dist, stops[-1])))
    return stops


class Sweep:
    """Fetch groups of people, several if that pays, and lead them to a way out.

    A robot does what saves most people per metre, the way out included: it leads its
    people out, or fetches one more group first. Flames add metres, so it gives up a way
    that begins to burn at its next decision.
    """

    DETOUR = inf  # metres, summed over those led, for each person fetched

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Let robots choose in turn, each among the groups the others left over."""
        guide, lost = guided_by(world), self._lost(world)
        return [
            self._one(world, robot, int((guide == robot.body).sum()), lost)
            for robot in robots
        ]

    def _one(
        self, world: World, robot: Robot, led: int, lost: np.ndarray
    ) -> Destination | None:
        """Choose for one robot; take the group it chooses out of `lost`."""
        nav, cost = navigation_of(world.building), flame_cost(world, robot.floor)
        d = nav.distances([robot.place], cost)
        way, on, here = self._way_out(world, robot, d, led)
        best, most = None, led / (TRIP + here)
        for people, place, to, metres in fetches(world, robot, d, lost, led):
            more, out = int(people.sum()), float(on[place])
            rate, extra = (led + more) / (TRIP + metres + out), metres + out - here
            if rate > most and (not led or led * extra <= self.DETOUR * more):
                best, most = (people, to), rate
        if best is not None:
            people, to = best
            lost[people] = False
            return to
        if not led:
            return station(world, robot)
        return at_way_out(world.building, world.building.landmarks[way])

    def _lost(self, world: World) -> np.ndarray:
        """Mark whom robots may fetch: (n,) bool."""
        return unguided(world)

    def _way_out(
        self, world: World, robot: Robot, d: np.ndarray, led: int
    ) -> tuple[int, np.ndarray, float]:
        """Find the least risky way out, (places,) metres to it, and the robot's."""
        nav, cost = navigation_of(world.building), flame_cost(world, robot.floor)
        ways = world.building.ways_out(robot.floor)
        here, way = min((float(d[nav.goals[way]].min()), way) for way in ways)
        return way, nav.distances(nav.goals[way], cost), here


class Escort(Sweep):
    """Lead people out at once by the safest way; fetch only people near it.

    Ways are measured to the outside, with stairs and lower floors. Metres near flames
    count more, since flames grow: so upper floors empty into stairs that end where it
    is safe. Followers make a detour for others only if it is a few metres for each of
    them. People who come down the stairs are awaited at their foot.
    """

    DETOUR = 8.0
    """[C7, chosen] metres of detour, summed over those led, for each person fetched:
    four go 2 m for one, 8 m for four. With 16 m 4 % fewer got out under `busiest`."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Look for the ways to the outside, then decide as `Sweep` does."""
        self._outside = ways_outside(world.building, risk(world))
        return super().decide(world, robots, rng)

    def _lost(self, world: World) -> np.ndarray:
        """Mark those, too, who come down the stairs: (n,) bool."""
        return unguided(world) | (world.bodies.inside & ~world.bodies.walking)

    def _way_out(
        self, world: World, robot: Robot, d: np.ndarray, led: int
    ) -> tuple[int, np.ndarray, float]:
        """Do as `Sweep`, but to the outside; by any way if nobody is led."""
        way = int(self._outside[:, robot.place].argmin())
        on = self._outside[way] if led else self._outside.min(axis=0)
        return way, on, float(on[robot.place])


class Observer(Escort):
    """Do as `escort`, but know only what robots that learn observe.

    So it is the one to compare learned robots with, and the one that they can copy.
    """

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Look at what can be observed, then decide as `Escort` does."""
        return super().decide(as_observed(world), robots, rng)


def fetches(
    world: World, robot: Robot, d: np.ndarray, lost: np.ndarray, led: int
) -> Iterator[tuple[np.ndarray, int, Destination, float]]:
    """Yield groups of lost people on a robot's floor, and on the stairs down to it.

    Each is people (n,) bool, their place, their position, and the metres until the
    robot has them. There are none for a robot that leads as many as it can.
    """
    if led >= FULL:
        return
    nav, bodies, floor = navigation_of(world.building), world.bodies, robot.floor
    here = lost & bodies.walking & (bodies.floor == floor)
    for head in np.flatnonzero(here & (bodies.leader == NOBODY)).tolist():
        p, (x, y) = int(bodies.place[head]), bodies.position[head].tolist()
        if d[p] >= AT_HAND:
            metres = np.hypot(*(bodies.position - (x, y)).T)
            yield here & (metres < GROUP_RADIUS), p, (x, y), float(d[p])
    storeys = bodies.floor - floor - 1
    seconds = bodies.stairs_until - world.time + storeys * paper.stairs_seconds()
    for k in stairs_that_end(world.building, floor):
        to = before_stairwell(world.building, floor, k)
        p, coming = nav.place(floor, *to), lost & (bodies.stairwell == k)
        for last in np.unique(seconds[coming]).tolist():
            until = max(float(d[p]), last * paper.ROBOT_SPEED)
            yield coming & (seconds <= last), p, to, until


def risk(world: World) -> np.ndarray | None:
    """Raise the cost of a metre where flames are or will be soon: (places,) metres.

    None without flames.
    """
    nav, flames = navigation_of(world.building), world.flames
    cost = flames.cost.ravel()
    for floor, burning in enumerate(flames.burning):
        d = nav.distances(np.flatnonzero(burning) + floor * nav.floor_size)
        cost = np.maximum(cost, 1 + SOON_COST * np.maximum(1 - d / SOON, 0))
    return cost if flames.burning.any() else None


def station(world: World, robot: Robot) -> Destination | None:
    """Choose where to wait: before the stairwell that most people come down."""
    wells = stairs_that_end(world.building, robot.floor)
    if not wells:
        return None
    coming = world.bodies.stairwell[world.bodies.inside]
    counts = [int((coming == k).sum()) for k in wells]
    k = int(np.argmax(counts)) if any(counts) else robot.number % len(wells)
    return before_stairwell(world.building, robot.floor, wells[k])


def guided_by(world: World) -> np.ndarray:
    """Find the head of each human's chain of leaders: bodies (n,), -1 for leaders."""
    first = leader = world.bodies.leader
    of_all = np.append(leader, NOBODY)  # robots, like nobody, have no leader
    for _ in range(4):  # from my leader to my leader's leader
        second = of_all[np.minimum(first, len(leader))]
        first = np.where(second >= 0, second, first)
    return first


def as_observed(world: World) -> World:
    """Replace what robots do not observe by guesses: who follows whom, and goals [C1].

    People within sight of robots, measured on foot and without flames, follow the
    nearest. Nobody else is led, nobody heads for a landmark, all on stairs are halfway.
    """
    nav, bodies, robots = navigation_of(world.building), world.bodies, world.robots
    body, place, active = (
        np.array([getattr(robot, name) for robot in robots], dtype=int)
        for name in ("body", "place", "active")
    )
    guide = guides(nav, place, active > 0, bodies.place, bodies.walking)
    leader = np.append(body, NOBODY)[guide]
    on_stairs = np.isfinite(bodies.stairs_until)
    halfway = np.where(on_stairs, world.time + paper.stairs_seconds() / 2, inf)
    landmark = np.full_like(bodies.landmark, NOWHERE)
    known = {"leader": leader, "landmark": landmark, "stairs_until": halfway}
    return replace(world, bodies=replace(bodies, **known))


def unguided(world: World) -> np.ndarray:
    """Mark people on floors, led by no robot and headed for no way out: (n,) bool."""
    bodies = world.bodies
    leads_out = np.array([m.leads_out for m in world.building.landmarks] + [False])
    led = guided_by(world) >= len(bodies)
    return bodies.walking & ~led & ~leads_out[bodies.landmark]
