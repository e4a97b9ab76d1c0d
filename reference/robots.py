"""Robots: Algorithm 3, Eq. 1, and hand-written strategies of rising skill.

Clauses: C5, C6, C7, C8.  A strategy and a learned policy have the same interface: they
name the next destination, two floats in metres.

    X_r, Y_r    decided destination;  X_r', Y_r'  the actual one [C6]
    p           place
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import Protocol

import numpy as np

from reference.building import Building, Kind
from reference.navigation import Navigation, prepared
from reference.paper import NEAR_STAIRWELL, ROBOT_SPEED
from reference.world import NOBODY, Instruction, Robot, World

Destination = tuple[float, float]
"""X_r, Y_r in metres [C5]."""

FOLLOWER_GAP, CROWD_GAP = 1.2, 0.4
"""[C7, chosen] metres: a robot waits while its n followers are on average farther
behind than FOLLOWER_GAP + CROWD_GAP * sqrt(n); the root, since a crowd fills a disc."""

AT_EXIT = 2.5
"""[C7, chosen] metres: a destination so near an exit means "this exit"."""


class Strategy(Protocol):
    """Whoever decides for the robots: an algorithm or a model [C7]."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """The next destination of each of these robots; None keeps the old one."""


class RobotAlgorithm:
    """Algorithm 3: one robot of one floor [C7, Alg. 3]."""

    def __init__(self, building: Building):
        self.building = building
        self.navigation: Navigation = prepared(building)

    def act(
        self, robot: Robot, world: World, decision: Destination | None, seconds: float
    ) -> None:
        """One pass of the loop, `seconds` long."""
        robot.active = world.people_at_or_above(robot.floor) > 0  # 1
        if not robot.active:
            return
        speed = evacuate_humans(robot, world)  # 2
        if decision is not None:  # 3
            target = actual_target(self.building, robot.floor, *decision)
            robot.destination = np.array(target)  # 4
            robot.instruction = instruction_for(self.building, robot.floor, target)  # 5
            goal = self.navigation.nearest_free(robot.floor, *target)
            risk = caution(world, robot.floor)
            robot.way = self.navigation.way(robot.place, goal, risk)[1]
        self._move(robot, speed * seconds)  # 7

    def _move(self, robot: Robot, metres: float) -> None:
        """Along the way, as far as the metres carry."""
        x, y = robot.position.tolist()
        while robot.way and metres > 0:
            to_x, to_y = self.navigation.centres[robot.way[0]].tolist()
            left = ((to_x - x) ** 2 + (to_y - y) ** 2) ** 0.5
            if left > metres:
                x, y = x + (to_x - x) * metres / left, y + (to_y - y) * metres / left
                break
            x, y, metres = to_x, to_y, metres - left
            robot.way.pop(0)
        place = self.navigation.place(robot.floor, x, y)
        if self.navigation.walkable[place]:
            robot.position, robot.place = np.array((x, y)), place
        else:  # from beside its cell's middle round a corner: by the middle, then
            robot.way.insert(0, robot.place)


def evacuate_humans(robot: Robot, world: World) -> float:
    """Lead those who follow: walk at ROBOT_SPEED, wait for those behind (m/s) [C7].

    The instruction itself is taken up by whoever sees the robot [B5].
    """
    followers = led_by(world, robot) if robot.way else ()
    if not len(followers):
        return ROBOT_SPEED
    off = world.bodies.position[followers] - robot.position
    gap = np.hypot(off[:, 0], off[:, 1]).sum() / len(followers)
    waits = gap > FOLLOWER_GAP + CROWD_GAP * len(followers) ** 0.5
    return 0.0 if waits else ROBOT_SPEED


def led_by(world: World, robot: Robot) -> np.ndarray:
    """(k,) people who follow a robot."""
    return (world.bodies.leader == robot.body).nonzero()[0]


def actual_target(
    building: Building, floor: int, x: float, y: float
) -> tuple[float, float]:
    """(X_r', Y_r'): the middle of a stairwell if one is near, else (X_r, Y_r).

    [C6, Eq. 1], reconstructed; "near" is NEAR_STAIRWELL.
    """
    for shaft in building.stairwells:
        x_s, y_s = shaft.centre
        if floor in shaft.areas and np.hypot(x - x_s, y - y_s) <= NEAR_STAIRWELL:
            return shaft.centre
    return x, y


def instruction_for(
    building: Building, floor: int, target: tuple[float, float]
) -> Instruction:
    """What to tell people on the way to a target [C7, Alg. 3:5].

    Nobody is sent into a stairwell that does not lead down.
    """
    if any(target == s.centre and floor - 1 in s.areas for s in building.stairwells):
        return Instruction.THIS_STAIRWELL
    for mark in building.landmarks:
        if mark.kind is Kind.EXIT and mark.floor == floor:
            off = np.subtract(mark.position, target)
            if np.hypot(*off) <= AT_EXIT:
                return Instruction.THIS_EXIT
    return Instruction.FOLLOW_ME


def caution(world: World, floor: int) -> np.ndarray | None:
    """What a metre costs in each place, given flames on this floor; None without."""
    return world.flames.cost if world.flames.burning[floor].any() else None


# -- Hand-written strategies --------------------------------------------------------


class NoRobots:
    """There are no robots, so nobody decides."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Nothing."""
        return [None] * len(robots)


class Random:
    """A random cell of the robot's floor."""

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Uniform over the rooms' cells."""
        return [_random_room_cell(world.building, r.floor, rng) for r in robots]


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
        nav = prepared(world.building)
        d = nav.distances([robot.place], caution(world, robot.floor))
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
        nav, building = prepared(world.building), world.building
        ways = {
            mark: float(d[nav.distance[mark] == 0].min())
            for mark in building.ways_out(robot.floor)
        }
        return min(ways, key=lambda mark: ways[mark], default=None)

    @staticmethod
    def _station(world: World, robot: Robot) -> Destination | None:
        """Before the busiest stairwell, where people still come down."""
        building, bodies = world.building, world.bodies
        coming = bodies.shaft[bodies.inside & (bodies.shaft >= 0)]
        shafts = [
            k for k, s in enumerate(building.stairwells) if min(s.areas) == robot.floor
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
    nav = prepared(building)
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


def _random_room_cell(
    building: Building, floor: int, rng: np.random.Generator
) -> Destination:
    cells = np.argwhere(building.kind[floor] == Kind.FLOOR)
    return building.metres(*rng.choice(cells).tolist())


def _metres(position: np.ndarray) -> Destination:
    return float(position[0]), float(position[1])


STRATEGIES: dict[str, type[Strategy]] = {
    "none": NoRobots,
    "random": Random,
    "patrol": Patrol,
    "sweep": Sweep,
}
"""Hand-written strategies by name, in order of skill; "none" is no robots at all."""
