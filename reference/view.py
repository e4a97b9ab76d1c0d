"""What one human sees now: their own rays and nothing else [B3].

Clauses: A6, B1, B2, B3, B6.  Walls and landmarks are in the sight tables; which
people, robots and flames are in sight is computed anew for all who are about to think.
Neither people nor flames hide what is behind them [B1, chosen].

    k  a viewer: the k-th of those who look;  j  a body in sight
"""

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

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
    halted_since: float  # s, when one's body last made headway
    bodies: dict[int, tuple[int, float]] = field(default_factory=dict)
    robots: dict[int, int] = field(default_factory=dict)

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
        return line & self._sight.rooms or line

    def overlooked(self, place: int) -> frozenset[int]:
        """Places seen from a place where one has been, with all beside them."""
        return self._sight.overlooked(place)

    def nearest(self, places: Iterable[int]) -> int:
        """The nearest of some places; one's own place if there are none."""
        return self._sight.nearest(self.place, places)

    @property
    def burnt(self) -> frozenset[int]:
        """Destroyed doors that rays meet, or that one stands in [A6]."""
        return self.holes | self._world.burnt & {self.here}

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
        fire, line = self._world.flames.alight, self._sight.line
        return not fire or not self.burns(line(self.place, landmark, self.holes)[0])

    def safe(self, landmark: int) -> bool:
        """Is there no flame in sight on or beside the straight way to a landmark?"""
        fire, line = self._world.flames.alight, self._sight.line
        return not fire or not self.burns(line(self.place, landmark, self.holes)[1])

    def burns(self, places: Iterable[int]) -> bool:
        """Is there a flame in sight in any of these places?"""
        alight = self._world.flames.alight.intersection(places)
        if not alight:
            return False
        return not alight.isdisjoint(self._sight.seen(self.place, self.holes))

    def burns_towards(self, place: int) -> bool:
        """Is there a flame in sight on the straight way to a place of this floor?"""
        fire, straight = self._world.flames.alight, self._sight.navigation.straight
        return bool(fire) and self.burns(straight(self.place, place))

    def towards(self, goal: Goal) -> tuple[float, float] | None:
        """Unit vector to a goal in sight or remembered, None when one is there."""
        nav = self._sight.navigation
        here = there = nav.centres[self.place].tolist()
        if goal.aim is Aim.LANDMARK:
            there = self._world.building.landmarks[goal.which].position
        elif goal.place != NOWHERE:
            there = nav.centres[goal.place].tolist()
        x, y = there[0] - here[0], there[1] - here[1]
        far = (x * x + y * y) ** 0.5
        return (x / far, y / far) if far else None


def look(world: World, sight: Sight, who: np.ndarray) -> list[View]:
    """Return what each of these people sees; who: (k,) people walking on a floor."""
    views = views_of(world, sight, who)
    everybody = points(world)
    show_bodies(views, who, [array[who] for array in everybody], everybody)
    return views


def views_of(world: World, sight: Sight, who: np.ndarray) -> list[View]:
    """Return the views of these people, (k,), before they look at others."""
    bodies, burnt, views = world.bodies, world.burnt, []
    maps = sight.patches, world.building.area.ravel(), world.building.landmark.ravel()
    place = bodies.place[who]
    around = (each[place] for each in maps)
    own = rows(place, *around, bodies.rank[who], bodies.anchor_time[who])
    for p, patch, room, here, rank, halted_since in own:
        holes, met = NO_HOLES, sight.landmarks(p)
        while through := burnt.intersection(met):
            holes |= through
            met = sight.landmarks(p, holes)
        view = View(
            _world=world,
            _sight=sight,
            time=world.time,
            landmarks=met,
            holes=holes,
            place=p,
            patch=patch,
            room=room,
            here=here,
            rank=rank,
            halted_since=halted_since,
        )
        views.append(view)
    return views


def points(world: World) -> list[np.ndarray]:
    """x, y (metres, floors far apart), place and presence of people, then of robots."""
    bodies, robots = world.bodies, world.robots
    at = np.array([robot.position for robot in robots]).reshape(-1, 2)
    each = [(robot.floor, robot.place, robot.active) for robot in robots]
    floor, place, active = np.array(each, dtype=np.int64).reshape(-1, 3).T
    x = bodies.position[:, 0] + FLOOR_APART * bodies.floor
    pairs = (
        (x, at[:, 0] + FLOOR_APART * floor),
        (bodies.position[:, 1], at[:, 1]),
        (bodies.place, place),
        (bodies.walking, active.astype(bool)),
    )
    return [np.concatenate(pair) for pair in pairs]


def show_bodies(
    views: list[View],
    me: np.ndarray,
    mine: list[np.ndarray],
    everybody: list[np.ndarray],
) -> None:
    """Add to views who is in sight: people, by their numbers, and then robots.

    me: (k,) numbers of those who look;  mine: as `points` has them, (k,) each;
    everybody: likewise, (m,), or (k, m) where each has others around.
    """
    if not views:
        return
    sight, people = views[0]._sight, len(views[0]._world.bodies)
    x, y, place, present = everybody
    off_x, off_y = x - mine[0][:, None], y - mine[1][:, None]
    near = (np.abs(off_x) < sight.reach) & (np.abs(off_y) < sight.reach) & present
    near[np.arange(len(me)), me] = False
    k, j = np.divmod(np.flatnonzero(near), near.shape[1])
    there = np.broadcast_to(place, near.shape)[k, j]
    seen = sight.sees.reaches(mine[2][k], there)
    for who in [who for who, view in enumerate(views) if view.holes]:
        own, view = slice(*k.searchsorted([who, who + 1])), views[who]
        line = sight.in_line(view.place, view.holes)
        seen[own] = [q in line for q in there[own].tolist()]
    k, j, there = k[seen], j[seen], there[seen]
    metres = np.hypot(off_x[k, j], off_y[k, j])
    for who, body, at, far in rows(k, j, there, metres):
        views[who].bodies[body] = at, far
    robots = np.flatnonzero(j >= people)
    robots = robots[metres[robots].argsort(kind="stable")]
    for who, body in rows(k[robots], j[robots]):
        views[who].robots[body] = views[who]._world.robots[body - people].says


def rows(*columns: np.ndarray) -> Iterator[tuple[Any, ...]]:
    """Zip columns of one length, as Python's own numbers."""
    return zip(*(column.tolist() for column in columns), strict=True)
