"""Hand-written robots; to add one, see the folder's `__init__`.

A guide is made of `groups`, whom a robot can fetch, a way out, as `nearest_way` or
`safest_way` finds it, and `choose`, which weighs one against the other. To write one of
your own, change one of the three and put them together as `decide_in_turn` does.

    p   place;  d  metres on foot;  lost  people whom no robot leads or is sent to yet
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial, reduce
from math import inf

import numpy as np
from numpy.random import Generator as Rng

from reference import paper
from reference.building import Building, Kind, distance, lengths
from reference.navigation import navigation_of
from reference.robots import Destination, Destinations, actual_target, flame_cost
from reference.workshop.strategies.observed import (
    at_way_out,
    before_stairwell,
    ends_of_ways,
    guess_guides,
    may_lead,
    metres_between,
    stairs_that_end,
)
from reference.workshop.strategies.traffic import ways_outside
from reference.world import NOBODY, NOWHERE, Flames, Robot, World

GROUP_RADIUS = 4.0  # [C7, chosen] metres: people this near form one group
AT_HAND = 2.0  # [C7, chosen] metres: people this near a robot follow it, or never will
FULL = 10  # [C7, chosen] people led: more would wait over 8 s at every door
TRIP = 5.0  # [C7, chosen] metres added to each way out, for coming back
DETOUR = 8.0
"""[C7, chosen] metres of detour of an `Escort`, summed over those led, for each person
fetched: four go 2 m for one, 8 m for four. With 16 m 4 % fewer got out under
`busiest`."""
SOON = 5.0
"""[C7, chosen] metres on foot from flames within which a metre costs more: flames
spread about this far while one walks 25 s."""
SOON_COST = 4.0  # [C7, chosen] how much more a metre costs beside flames


class RandomRobots:
    """Walk to random places, each on its floor."""

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Draw uniformly from the floor's room cells."""
        building = world.building
        rooms = building.kind == Kind.FLOOR
        return [building.random_point(rooms[robot.floor], rng) for robot in robots]


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
            self._stops[robot.body] = _stops_of(world.building, robot, mates)
        stops = self._stops[robot.body]
        stops.append(stops.pop(0))
        return stops[-1]


def _stops_of(building: Building, robot: Robot, mates: int) -> list[Destination]:
    """List room, nearest way out, next room, ...; mates start at different rooms.

    [C6] Of a room: the cell nearest to its centre, if possible one that Eq. 1 leaves
    alone.
    """
    floor = robot.floor
    ways_out = [building.landmarks[mark] for mark in building.ways_out(floor)]
    exits = [at_way_out(building, way) for way in ways_out]
    rooms = building.rooms(floor)
    first = robot.number * len(rooms) // mates

    stops: list[Destination] = []
    for room in rooms[first:] + rooms[:first]:
        cells = [building.metres(*cell) for cell in room.cells.tolist()]
        kept = [spot for spot in cells if actual_target(building, floor, *spot) == spot]
        middle = min(kept or cells, key=partial(distance, room.centre))
        stops += [middle, min(exits, key=partial(distance, middle))]
    return stops


# -- Guides -------------------------------------------------------------------------


class Sweep:
    """Fetch groups of people, several if that pays, and lead them to a way out.

    Flames add metres, so a robot gives up a way that begins to burn at its next
    decision.
    """

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Take the nearest way out of the floor, and every detour that pays."""

        def way_of(robot: Robot, led: int) -> Way:
            return nearest_way(world, robot)

        return decide_in_turn(world, robots, unguided(world), way_of, detour=inf)


class Escort:
    """Lead people out at once by the safest way; fetch only people near it.

    Ways are measured to the outside, with stairs and lower floors. Metres near flames
    count more, since flames grow: so upper floors empty into stairs that end where it
    is safe. Followers make a detour for others only if it is a few metres for each of
    them. People who come down the stairs are awaited at their foot.
    """

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Take the way that is safest to the outside, and short detours."""
        return _escort(world, robots, in_doubt=None)


class Observer:
    """Do as `escort`, but know only what robots that learn observe.

    So it is the one to compare learned robots with, and the one that they can copy. Who
    seems to lead nobody, and finds nobody to fetch, leads out whom it `may_lead`: with
    eight robots on a floor the guess is wrong about every third person.
    """

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Look at what can be observed, then decide as `Escort` does."""
        seen = as_observed(world)
        return _escort(seen, robots, partial(_may_lead_anybody, seen))


def _escort(
    world: World,
    robots: Sequence[Robot],
    in_doubt: Callable[[Robot], bool] | None,
) -> Destinations:
    """Take the way that is safest to the outside, and short detours."""
    outside = ways_outside(world.building, risk(world.building, world.flames))
    on_stairs = world.bodies.inside & ~world.bodies.walking
    lost = unguided(world) | on_stairs
    way_of = partial(safest_way, outside)
    return decide_in_turn(world, robots, lost, way_of, DETOUR, in_doubt)


def _may_lead_anybody(world: World, robot: Robot) -> bool:
    """Is anybody led within the sight of a robot, as far as it is observed?"""
    guide = world.bodies.leader
    led = guide != NOBODY
    nav = navigation_of(world.building)
    way = metres_between(nav, np.array(robot.place), world.bodies.place)
    return bool(may_lead(guide == robot.body, led, way).any())


# -- What guides are made of --------------------------------------------------------


@dataclass(frozen=True)
class Group:
    """People whom a robot can fetch together.

    people  (n,) bool, who belongs to it
    place   where the robot meets them, and the point of that in metres
    metres  that the robot has walked when it has them; waiting counts as walking
    """

    people: np.ndarray
    place: int
    point: Destination
    metres: float


@dataclass(frozen=True)
class Way:
    """A way out, as one robot weighs it.

    landmark  the exit or entrance to stairs
    here      metres to get out by it from where the robot stands
    metres    (places,) from each place
    """

    landmark: int
    here: float
    metres: np.ndarray


def decide_in_turn(
    world: World,
    robots: Sequence[Robot],
    lost: np.ndarray,
    way_of: Callable[[Robot, int], Way],
    detour: float,
    in_doubt: Callable[[Robot], bool] | None = None,
) -> Destinations:
    """Let robots choose in turn, each among the people whom the others left over.

    lost      (n,) bool, who may be fetched
    way_of    the way out for a robot that leads so many
    detour    as in `choose`
    in_doubt  whether a robot that leads nobody goes to a way out all the same
    """
    guide = guided_by(world)
    landmarks = world.building.landmarks
    destinations = Destinations()
    for robot in robots:
        led = int(np.count_nonzero(guide == robot.body))
        way = way_of(robot, led)
        group = choose(groups(world, robot, lost), way, led, detour)
        if group is not None:
            lost = lost & ~group.people
            destinations.append(group.point)
        elif led or (in_doubt is not None and in_doubt(robot)):
            destinations.append(at_way_out(world.building, landmarks[way.landmark]))
        else:
            destinations.append(station(world, robot))
    return destinations


def choose(found: Iterable[Group], way: Way, led: int, detour: float) -> Group | None:
    """Choose the group to fetch before leading out; None to lead out at once.

    It is what saves most people per metre, the way out included. The detour, times
    those who are led, may be at most `detour` metres for each person fetched.
    """
    if led >= FULL:
        return None
    best = None
    most = led / (TRIP + way.here)
    for group in found:
        count = int(np.count_nonzero(group.people))
        out = float(way.metres[group.place])
        rate = (led + count) / (TRIP + group.metres + out)
        extra = group.metres + out - way.here  # nan or inf where a way is cut
        short = not led or led * extra <= detour * count
        if rate > most and short:
            best = group
            most = rate
    return best


def groups(world: World, robot: Robot, lost: np.ndarray) -> Iterator[Group]:
    """Find groups of lost people on a robot's floor, and on the stairs down to it.

    lost: (n,) bool, who may be fetched
    """
    yield from _groups_on_floor(world, robot, lost)
    yield from _groups_on_stairs(world, robot, lost)


def _groups_on_floor(world: World, robot: Robot, lost: np.ndarray) -> Iterator[Group]:
    """Gather people around each who follows nobody and is not at hand already."""
    bodies = world.bodies
    here = lost & bodies.walking & (bodies.floor == robot.floor)
    heads = np.flatnonzero(here & (bodies.leader == NOBODY))
    if not len(heads):
        return
    d = metres_from(world, robot)
    heads = heads[d[bodies.place[heads]] >= AT_HAND]
    place = bodies.place[heads]
    point = bodies.position[heads]
    off = lengths(bodies.position - point[:, None])
    people = here & (off < GROUP_RADIUS)
    found = zip(people, place.tolist(), point.tolist(), d[place].tolist(), strict=True)
    for those, p, (x, y), metres in found:
        yield Group(those, p, (x, y), metres)


def _groups_on_stairs(world: World, robot: Robot, lost: np.ndarray) -> Iterator[Group]:
    """Of those who come down a stairwell: the first, the first two, ... as a group."""
    building = world.building
    bodies = world.bodies
    for k in stairs_that_end(building, robot.floor):
        coming = lost & (bodies.stairwell == k)
        if not coming.any():
            continue
        storeys = bodies.floor - robot.floor - 1  # still to go after this flight
        seconds = bodies.stairs_until - world.time + storeys * paper.stairs_seconds()
        foot = before_stairwell(building, robot.floor, k)
        p = navigation_of(building).place(robot.floor, *foot)
        d = metres_from(world, robot)
        for last in np.unique(seconds[coming]).tolist():
            metres = max(float(d[p]), last * paper.ROBOT_SPEED)
            yield Group(coming & (seconds <= last), p, foot, metres)


def nearest_way(world: World, robot: Robot) -> Way:
    """Find the nearest way out of a robot's floor, round flames."""
    nav = navigation_of(world.building)
    d = metres_from(world, robot)
    ways = world.building.ways_out(robot.floor)
    here, way = min((float(d[nav.goals[way]].min()), way) for way in ways)
    metres = nav.distances(nav.goals[way], flame_cost(world, robot.floor))
    return Way(way, here, metres)


def safest_way(outside: Mapping[int, np.ndarray], robot: Robot, led: int) -> Way:
    """Find the cheapest way to the outside; by any way if a robot leads nobody yet.

    outside: metres by each way, (places,), as `ways_outside` finds them
    """
    way = min(outside, key=lambda mark: outside[mark][robot.place])
    metres = outside[way] if led else reduce(np.minimum, outside.values())
    return Way(way, float(metres[robot.place]), metres)


def metres_from(world: World, robot: Robot) -> np.ndarray:
    """(places,) metres on foot from a robot, more through flames of its floor.

    Who asks again pays nothing: the search is kept.
    """
    nav = navigation_of(world.building)
    return nav.distances([robot.place], flame_cost(world, robot.floor))


def risk(building: Building, flames: Flames) -> np.ndarray | None:
    """Weigh a metre in each place: dearer where flames are or may be soon, (places,).

    A factor, 1 far from flames. None without flames.
    """
    if not flames.burning.any():
        return None
    nav = navigation_of(building)
    d = np.full(nav.places, inf)
    for floor, burning in enumerate(flames.burning):
        alight = np.flatnonzero(burning) + floor * nav.floor_size
        d = np.minimum(d, nav.distances(alight))
    soon = np.maximum(1 - d / SOON, 0)
    return np.maximum(flames.cost.ravel(), 1 + SOON_COST * soon)


def station(world: World, robot: Robot) -> Destination | None:
    """Choose where to wait: before the stairwell that most people come down.

    While nobody comes, mates share the stairwells by their numbers. None, stay, where
    no stairs end.
    """
    wells = stairs_that_end(world.building, robot.floor)
    if not wells:
        return None
    coming = world.bodies.stairwell[world.bodies.inside]
    counts = [int((coming == k).sum()) for k in wells]
    k = int(np.argmax(counts)) if any(counts) else robot.number % len(wells)
    return before_stairwell(world.building, robot.floor, wells[k])


def guided_by(world: World) -> np.ndarray:
    """Find the head of each human's chain of leaders: bodies (n,), -1 for leaders."""
    leader = world.bodies.leader
    # One more: robots, whose numbers follow people's, and NOBODY, -1, have no leader.
    leader_of = np.append(leader, NOBODY)
    head = leader
    for _ in leader:  # a chain has at most as many links as there are people
        above = leader_of[np.minimum(head, len(leader))]
        if (above < 0).all():
            break
        head = np.where(above >= 0, above, head)
    return head


def as_observed(world: World) -> World:
    """Replace what robots do not observe by guesses: who follows whom, and goals [C1].

    People within sight of robots follow one of them, as `guess_guides` finds it. Nobody
    else is led, nobody heads for a landmark, all on stairs are halfway.
    """
    nav = navigation_of(world.building)
    bodies = world.bodies
    place = np.array([robot.place for robot in world.robots], dtype=int)
    active = np.array([robot.active for robot in world.robots], dtype=bool)
    headed = ends_of_ways(world)
    guide = guess_guides(nav, place, active, bodies.place, bodies.walking, headed)

    body = np.array([*(robot.body for robot in world.robots), NOBODY])
    halfway = world.time + paper.stairs_seconds() / 2
    on_stairs = np.isfinite(bodies.stairs_until)
    observed = replace(
        bodies,
        leader=body[guide],
        landmark=np.full_like(bodies.landmark, NOWHERE),
        stairs_until=np.where(on_stairs, halfway, inf),
    )
    return replace(world, bodies=observed)


def unguided(world: World) -> np.ndarray:
    """Mark people on floors, led by no robot and headed for no way out: (n,) bool."""
    bodies = world.bodies
    # one more for NOWHERE, -1: who heads for no landmark
    leads_out = np.array([m.leads_out for m in world.building.landmarks] + [False])
    led = guided_by(world) >= len(bodies)
    return bodies.walking & ~led & ~leads_out[bodies.landmark]
