"""Hand-written robots beyond the simplest; add your own and name it in `ROBOTS`.

Clauses: C5, C7.

    p   place;  d  metres on foot
"""

from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from reference.building import Building, Kind
from reference.navigation import navigation_of
from reference.paper import NEAR_STAIRWELL
from reference.robots import Destination, flame_cost
from reference.world import NOBODY, Robot, World


class Patrol:
    """A round through all rooms of the floor, and out after each: room, way out, ..."""

    def __init__(self) -> None:
        self._stops: dict[int, list[Destination]] = {}

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """The next stop once the last is reached."""
        return [self._next(world, robot) for robot in robots]

    def _next(self, world: World, robot: Robot) -> Destination | None:
        if robot.way:
            return None
        stops = self._stops.setdefault(robot.body, _round(world.building, robot))
        stops.append(stops.pop(0))
        return stops[-1]


class Sweep:
    """Fetches groups not yet guided and leads them out where risk is least.

    Goes where it saves most people per metre, the way out included: on with those it
    leads, or first to one more group. Flames make a way longer, so that a way that
    begins to burn is given up at the next decision.
    """

    AT_HAND = 2.0  # [C7, chosen] metres: so near it, people follow or will not
    GROUP_RADIUS = 4.0  # [C7, chosen] metres: who stands so near is of the same group
    TRIP = 5.0  # [C7, chosen] metres that each way out costs besides, to come back

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Robots choose in turn, each among the groups the others left over."""
        guide, lost = guided_by(world), unguided(world)
        return [
            self._one(world, robot, int((guide == robot.body).sum()), lost)
            for robot in robots
        ]

    def _one(
        self, world: World, robot: Robot, led: int, lost: np.ndarray
    ) -> Destination | None:
        """One robot's choice; takes the group it chooses out of `lost`."""
        nav = navigation_of(world.building)
        d = nav.distances([robot.place], flame_cost(world, robot.floor))
        out = self._way_out(world, robot, d)
        groups = Groups(world, robot.floor, lost, self.GROUP_RADIUS)
        groups.drop(d[groups.place] < self.AT_HAND)
        if len(groups.heads):
            on = nav.distance[out] if out is not None else np.zeros(nav.places)
            metres = self.TRIP + d[groups.place] + on[groups.place]
            rate = (led + groups.sizes) / metres
            best = int(np.argmax(rate))
            if not led or rate[best] > led / (self.TRIP + d[on == 0].min()):
                lost[groups.members[best]] = False
                return _metres(world.bodies.position[groups.heads[best]])
        if out is not None and led:
            return world.building.landmarks[out].position
        return self._station(world, robot)

    @staticmethod
    def _way_out(world: World, robot: Robot, d: np.ndarray) -> int | None:
        """The exit or entrance with the least risky way, flames counted as metres."""
        nav, building = navigation_of(world.building), world.building
        ways = {
            mark: float(d[nav.distance[mark] == 0].min())
            for mark in building.ways_out(robot.floor)
        }
        return min(ways, key=lambda mark: ways[mark], default=None)

    @staticmethod
    def _station(world: World, robot: Robot) -> Destination | None:
        """Before the busiest stairwell, where people still come down."""
        building, bodies = world.building, world.bodies
        coming = bodies.stairwell[bodies.inside & (bodies.stairwell >= 0)]
        shafts = [
            k for k, s in enumerate(building.stairwells) if s.lowest == robot.floor
        ]
        if not shafts:
            return None
        counts = [int((coming == k).sum()) for k in shafts]
        k = shafts[int(np.argmax(counts))] if any(counts) else robot.team % len(shafts)
        return before_stairwell(building, robot.floor, k)


class Groups:
    """People of one floor who lead themselves, each with all lost people around.

    heads: (k,) people; place: (k,) where; members: k arrays of people; sizes: (k,)
    """

    def __init__(self, world: World, floor: int, lost: np.ndarray, radius: float):
        bodies = world.bodies
        people = np.flatnonzero(lost & (bodies.floor == floor))
        self.heads = people[bodies.leader[people] == NOBODY]
        self.place = bodies.place[self.heads]
        off = bodies.position[self.heads, None] - bodies.position[people]
        near = np.hypot(off[..., 0], off[..., 1]) < radius
        self.members = [people[row] for row in near]
        self.sizes = near.sum(axis=1)

    def drop(self, which: np.ndarray) -> None:
        """Leave these out; which: (k,) bool."""
        keep = np.flatnonzero(~which)
        self.heads, self.place = self.heads[keep], self.place[keep]
        self.members = [self.members[k] for k in keep]
        self.sizes = self.sizes[keep]


def guided_by(world: World) -> np.ndarray:
    """(n,) the body that each human follows in the end, -1 for those who lead."""
    leader, n = world.bodies.leader, len(world.bodies)
    first = leader
    for _ in range(4):  # from my leader to my leader's leader
        second = leader[np.clip(first, 0, n - 1)] if n else first
        first = np.where((first >= 0) & (first < n) & (second >= 0), second, first)
    return first


def unguided(world: World) -> np.ndarray:
    """(n,) bool: on a floor, not led by a robot at any hand, not at a way out yet."""
    bodies = world.bodies
    leads_out = np.array([m.leads_out for m in world.building.landmarks] + [False])
    led = guided_by(world) >= len(bodies)
    return bodies.walking & ~led & ~leads_out[bodies.landmark]


@lru_cache(maxsize=64)
def before_stairwell(building: Building, floor: int, shaft: int) -> Destination:
    """The nearest room cell outside a stairwell that Eq. 1 does not pull inside."""
    nav = navigation_of(building)
    well = building.stairwells[shaft]
    d = nav.distance[well.entrances[floor][0]].copy()
    d[building.kind.ravel() != Kind.FLOOR] = np.inf
    off = nav.centres - well.centre
    d[np.hypot(off[:, 0], off[:, 1]) <= NEAR_STAIRWELL] = np.inf
    return _metres(nav.centres[int(np.argmin(d))])


def _round(building: Building, robot: Robot) -> list[Destination]:
    """Room, nearest way out, next room, ...; team mates start at different rooms."""
    ways = [building.landmarks[m].position for m in building.ways_out(robot.floor)]
    rooms = [room.centre for room in building.rooms(robot.floor)]
    shift = robot.team * len(rooms) // 2
    stops = []
    for room in rooms[shift:] + rooms[:shift]:
        near = min(ways, key=lambda way: float(np.hypot(*np.subtract(way, room))))
        stops += [room, near]
    return stops


def _metres(position: np.ndarray) -> Destination:
    return float(position[0]), float(position[1])
