"""What one human sees now: their own rays and nothing else [B3].

Walls and landmarks are in the sight tables; which people, robots and flames are in
sight is computed anew for all who are about to think.  Neither people nor flames hide
what is behind them [B1, chosen].

    i  who looks;  j  a body in sight: people by their numbers, and then robots
"""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from reference.building import distance
from reference.rays import NO_HOLES, Direction, Hit, Sight
from reference.world import FLOOR_APART, NOWHERE, Aim, Goal, World


@dataclass(slots=True)
class View:
    """What one human sees at one instant: "observe" in Algorithms 1 and 2.

    landmarks  intact doors, ways down, exits that rays meet, by index, nearest first
    bodies     people and robots in sight: place and metres of each
    robots     in sight, the nearest first, and what each says
    """

    _world: World
    _sight: Sight
    time: float  # s
    landmarks: dict[int, Hit]
    holes: frozenset[int]  # destroyed doors in view: rays pass [A6]
    place: int  # where one stands
    patch: int  # of floor that one stands in
    room: int  # that one stands in, NOWHERE for none
    here: int  # door, entrance or exit that one stands in, NOWHERE for none
    rank: float  # one's own
    headway_time: float  # s, when one's body last made headway
    bodies: dict[int, tuple[int, float]]
    robots: dict[int, int]

    @property
    def looked_at(self) -> frozenset[int]:
        """Patches of floor that one sees well from here [B2]."""
        return self._sight.looked_at(self.place, self.holes)

    @property
    def of_room(self) -> Collection[int]:
        """Landmarks in view, without those that are seen through a hole."""
        if not self.holes:
            return self.landmarks
        return self.landmarks.keys() & self._sight.landmarks(self.place)

    @property
    def ground(self) -> frozenset[int]:
        """Places of rooms and doors in line of sight; if there are none, of stairs."""
        line = self._sight.in_line(self.place, self.holes)
        rooms = line & self._sight.rooms
        return rooms if rooms else line

    def seen_on_all_sides(self, place: int) -> frozenset[int]:
        """What was in line of sight from a place, without its border."""
        return self._sight.seen_on_all_sides(place)

    def nearest(self, places: Iterable[int]) -> int:
        """The nearest of some places; one's own place if there are none."""
        return self._sight.nearest(self.place, places)

    @property
    def burnt(self) -> frozenset[int]:
        """Destroyed doors that rays meet, or that one stands in [A6]."""
        under_me = self._world.burnt & {self.here}
        return self.holes | under_me

    @property
    def open(self) -> list[Direction]:
        """Directions whose rays return nothing, not even flames [B2]."""
        ways = self._sight.open(self.place, self.holes)
        return [way for way in ways if not self.burns_towards(way.place)]

    def leaders_to(self, landmark: int) -> list[int]:
        """People in sight who lead there and outrank this one, the highest rank first.

        [B6, chosen] One can tell people's rank, where they head, and whom they follow.
        """
        them = self._world.bodies
        people = [j for j in self.bodies if j < len(them)]
        going = [j for j in people if them.landmark[j] == landmark]
        above = [j for j in going if them.leader[j] < 0 and them.rank[j] > self.rank]
        return sorted(above, key=them.rank.item, reverse=True)

    def followers_of(self, body: int) -> int:
        """How many people in sight follow a body?"""
        leader = self._world.bodies.leader
        return sum(1 for j in self.bodies if j < len(leader) and leader[j] == body)

    def passable(self, landmark: int) -> bool:
        """Is there no flame in sight on the straight way to a landmark in view?"""
        on, _ = self._sight.line(self.place, landmark, self.holes)
        return not self.burns(on)

    def safe(self, landmark: int) -> bool:
        """Is there no flame in sight on or beside the straight way to a landmark?"""
        _, beside = self._sight.line(self.place, landmark, self.holes)
        return not self.burns(beside)

    def burns(self, places: Iterable[int]) -> bool:
        """Is there a flame in sight in any of these places?"""
        alight = self._world.flames.alight.intersection(places)
        if not alight:
            return False
        return not alight.isdisjoint(self._sight.seen(self.place, self.holes))

    def burns_towards(self, place: int) -> bool:
        """Is there a flame in sight on the straight way to a place of this floor?"""
        if not self._world.flames.alight:
            return False
        return self.burns(self._sight.navigation.straight_way(self.place, place))

    def towards(self, goal: Goal) -> tuple[float, float] | None:
        """Unit vector to a goal in sight or remembered, None when one is there."""
        nav = self._sight.navigation
        here = nav.centres[self.place].tolist()
        there = here
        if goal.aim is Aim.LANDMARK:
            there = self._world.building.landmarks[goal.which].position
        elif goal.place != NOWHERE:
            there = nav.centres[goal.place].tolist()
        x = there[0] - here[0]
        y = there[1] - here[1]
        far = distance(here, there)
        return (x / far, y / far) if far else None


Around = list[tuple[int, int, float]]
"""Bodies near somebody who looks: number, place and metres of each."""


def look(world: World, sight: Sight, who: np.ndarray) -> list[View]:
    """Return what each of these people sees; who: (k,) people walking on a floor."""
    # where everybody is: people by their numbers, then robots
    bodies = world.bodies
    robots = world.robots
    at = np.array([robot.position for robot in robots]).reshape(-1, 2)
    floors = np.array([robot.floor for robot in robots], int)
    places = np.array([robot.place for robot in robots], int)
    active = np.array([robot.active for robot in robots], bool)
    floor = np.concatenate([bodies.floor, floors])
    place = np.concatenate([bodies.place, places])
    present = np.concatenate([bodies.walking, active])
    x, y = np.concatenate([bodies.position, at]).T
    x_apart = x + FLOOR_APART * floor  # so that one comparison tells floors apart, too

    # who is near whom
    off_x = x_apart - x_apart[who, None]
    off_y = y - y[who, None]
    near = (np.abs(off_x) < sight.reach) & (np.abs(off_y) < sight.reach) & present
    near[np.arange(len(who)), who] = False
    looker, seen = np.nonzero(near)
    to_x = off_x[looker, seen]
    to_y = off_y[looker, seen]
    metres = np.sqrt(to_x * to_x + to_y * to_y)

    facts = (seen.tolist(), place[seen].tolist(), metres.tolist())
    around = list(zip(*facts, strict=True))
    # lookers are sorted: those around the k-th stand from ends[k] to ends[k + 1]
    ends = looker.searchsorted(np.arange(len(who) + 1)).tolist()
    return [
        see(world, sight, i, around[ends[k] : ends[k + 1]])
        for k, i in enumerate(who.tolist())
    ]


def see(world: World, sight: Sight, i: int, around: Around) -> View:
    """What one person sees; around: bodies in the square that the range spans."""
    place = int(world.bodies.place[i])
    holes = NO_HOLES
    landmarks = sight.landmarks(place)
    while through := world.burnt.intersection(landmarks):
        holes |= through
        landmarks = sight.landmarks(place, holes)

    line = sight.in_line(place, holes)
    bodies = {j: (p, metres) for j, p, metres in around if p in line}
    people = len(world.bodies)
    robots = [j for j in bodies if j >= people]
    robots.sort(key=lambda j: bodies[j][1])
    return View(
        _world=world,
        _sight=sight,
        time=world.time,
        landmarks=landmarks,
        holes=holes,
        place=place,
        patch=int(sight.patches[place]),
        room=int(world.building.area.flat[place]),
        here=int(world.building.landmark.flat[place]),
        rank=float(world.bodies.rank[i]),
        headway_time=float(world.bodies.headway_time[i]),
        bodies=bodies,
        robots={j: world.robots[j - people].says for j in robots},
    )
