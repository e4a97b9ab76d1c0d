"""Hand-written robots beyond the simplest; to add one, see the folder's `__init__`.

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

GROUP_RADIUS = 4.0  # [C7, chosen] metres: who stands so near is of the same group


class Patrol:
    """Walks a round through all rooms of the floor, to the way out after each."""

    def __init__(self) -> None:
        self._stops: dict[int, list[Destination]] = {}

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Choose the next stop once the last is reached."""
        return [self._next(world, robot) for robot in robots]

    def _next(self, world: World, robot: Robot) -> Destination | None:
        if robot.way:
            return None
        stops = self._stops.setdefault(robot.body, _round(world.building, robot))
        stops.append(stops.pop(0))
        return stops[-1]


class Sweep:
    """Fetches groups not yet guided and leads them out where risk is least.

    Saves most people per metre, the way out included: goes on with those it leads, or
    first to one more group. Flames count as metres, so a way that begins to burn is
    given up at the next decision.
    """

    AT_HAND = 2.0  # [C7, chosen] metres: so near it, people follow or will not
    FULL = 15  # [C7, chosen] people led: more would wait over 12 s before every door
    TRIP = 5.0  # [C7, chosen] metres that each way out costs besides, to come back

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> list[Destination | None]:
        """Let robots choose in turn, each among the groups the others left over."""
        guide, lost = guided_by(world), unguided(world)
        return [
            self._one(world, robot, int((guide == robot.body).sum()), lost)
            for robot in robots
        ]

    def _one(
        self, world: World, robot: Robot, led: int, lost: np.ndarray
    ) -> Destination | None:
        """Choose for one robot; take the group it chooses out of `lost`."""
        nav = navigation_of(world.building)
        d = nav.distances([robot.place], flame_cost(world, robot.floor))
        out = self._way_out(world, robot, d)
        heads, groups = groups_of(world, robot.floor, lost)
        far = d[world.bodies.place[heads]] >= self.AT_HAND
        heads, groups = heads[far], groups[far]
        if len(heads) and led < self.FULL:
            place = world.bodies.place[heads]
            on = nav.distance[out] if out is not None else np.zeros(nav.places)
            rate = (led + groups.sum(axis=1)) / (self.TRIP + d[place] + on[place])
            best = int(np.argmax(rate))
            if not led or rate[best] > led / (self.TRIP + d[on == 0].min()):
                lost[groups[best]] = False
                return _metres(world.bodies.position[heads[best]])
        if out is not None and led:
            return world.building.landmarks[out].position
        return self._station(world, robot)

    @staticmethod
    def _way_out(world: World, robot: Robot, d: np.ndarray) -> int | None:
        """The exit or entrance with the least risky way, flames counted as metres."""
        nav, building = navigation_of(world.building), world.building
        marks = building.ways_out(robot.floor)
        return min(marks, key=lambda m: d[nav.distance[m] == 0].min(), default=None)

    @staticmethod
    def _station(world: World, robot: Robot) -> Destination | None:
        """Before the busiest stairwell, where people still come down."""
        building, bodies = world.building, world.bodies
        coming = bodies.stairwell[bodies.inside & (bodies.stairwell >= 0)]
        ends = [well.lowest == robot.floor for well in building.stairwells]
        wells = np.flatnonzero(ends).tolist()
        if not wells:
            return None
        counts = [int((coming == k).sum()) for k in wells]
        k = wells[int(np.argmax(counts))] if any(counts) else robot.team % len(wells)
        return before_stairwell(building, robot.floor, k)


def groups_of(
    world: World, floor: int, lost: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """(k,) people of a floor who lead themselves; (k, n) bool: the lost around each."""
    bodies = world.bodies
    mine = lost & (bodies.floor == floor)
    heads = np.flatnonzero(mine & (bodies.leader == NOBODY))
    off = bodies.position[heads, None] - bodies.position
    return heads, mine & (np.hypot(off[..., 0], off[..., 1]) < GROUP_RADIUS)


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
def before_stairwell(building: Building, floor: int, index: int) -> Destination:
    """The nearest room cell outside a stairwell that Eq. 1 does not pull inside."""
    nav = navigation_of(building)
    well = building.stairwells[index]
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
