"""What one human sees now: their own rays and nothing else [B3].

Clauses: A6, B1, B2, B3, B6.  Walls and landmarks are in the sight tables; which
people, robots and flames are in sight is computed anew for all who are about to think.
Neither people nor flames hide what is behind them [B1, chosen].

    k  a viewer: the k-th of those who look;  j  a body in sight
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from reference.sight import Direction, Hit, Sight
from reference.world import FLOOR_APART, NOBODY, NOWHERE, Aim, Goal, Said, World


@dataclass(frozen=True)
class Surroundings:
    """What all views share until the fire moves again.

    burnt     landmarks destroyed [A6]
    useless   burnt, or stairs that do not go down: a sign says so [B6, chosen]
    burning   places in flames
    """

    sight: Sight
    burnt: frozenset[int]
    useless: frozenset[int]
    burning: frozenset[int]

    @classmethod
    def of(cls, world: World, sight: Sight) -> "Surroundings":
        """Read them from a world."""
        burnt = frozenset(np.flatnonzero(world.burnt).tolist())
        burning = frozenset(np.flatnonzero(world.flames.burning).tolist())
        return cls(sight, burnt, burnt | sight.building.dead_ends, burning)

    def landmarks(self, place: int) -> dict[int, Hit]:
        """Find the landmarks that rays from a place meet, without the useless ones."""
        met = self.sight.landmarks[place]
        if self.useless.isdisjoint(met):
            return met
        return {m: hit for m, hit in met.items() if m not in self.useless}


class Others(NamedTuple):
    """What one can tell of the people and robots in sight, by their numbers.

    [B6, chosen] Whom they follow, where they head, people's rank, what robots say.
    """

    leader: list[int]
    heading: list[int]
    rank: list[float]
    says: list[Said]

    @classmethod
    def of(cls, world: World) -> "Others":
        """Read it from a world; robots follow nobody and head for no landmark."""
        bodies, nobody = world.bodies, [NOBODY] * len(world.robots)
        leader, heading = bodies.leader.tolist(), bodies.landmark.tolist()
        says = [robot.says for robot in world.robots]
        return cls(leader + nobody, heading + nobody, bodies.rank.tolist(), says)


@dataclass(slots=True)
class View:
    """What one human sees at one instant: "observe" in Algorithms 1 and 2.

    time (s), place, rank   of the human who looks
    halted_since            s, when their body last made headway
    landmarks               intact doors, ways down and exits that rays meet, by index,
                            the nearest first
    bodies                  people and robots in sight: place and metres of each
    robots                  in sight, the nearest first, and what they say
    """

    time: float
    place: int
    rank: float
    halted_since: float
    landmarks: dict[int, Hit]
    _around: Surroundings
    _others: Others
    bodies: dict[int, tuple[int, float]] = field(default_factory=dict)
    robots: dict[int, Said] = field(default_factory=dict)

    @property
    def here(self) -> int:
        """The door, entrance or exit that one stands in, or NOWHERE."""
        return int(self._around.sight.building.landmark.flat[self.place])

    @property
    def burnt(self) -> frozenset[int]:
        """Destroyed doors that rays meet, or that one stands in [A6]."""
        if not self._around.burnt:
            return self._around.burnt
        met = self._around.sight.landmarks[self.place]
        return self._around.burnt.intersection((self.here, *met))

    @property
    def open(self) -> list[Direction]:
        """Directions whose rays return nothing, not even flames [B2]."""
        ways = self._around.sight.open[self.place]
        return [way for way in ways if not self.burns_towards(way.place)]

    @property
    def room(self) -> int:
        """The room that one stands in, or NOWHERE."""
        return self._around.sight.rooms[self.place]

    @property
    def patch(self) -> int:
        """The patch of floor that one stands in."""
        return self._around.sight.patches[self.place]

    @property
    def looked_at(self) -> frozenset[int]:
        """Patches of floor that one sees well from here [B2]."""
        return self._around.sight.looked_at(self.place)

    @property
    def far_end(self) -> Goal:
        """The goal of walking to the farthest place in sight."""
        sight = self._around.sight
        place = sight.farthest[self.place]
        return Goal(Aim.DIRECTION, sight.patches[place], place)

    def leaders_to(self, landmark: int) -> list[int]:
        """People in sight who lead there and outrank this one, the highest rank first.

        [B6, chosen] Who leads follows nobody.
        """
        leader, heading, rank, _ = self._others
        them = [j for j in self.bodies if heading[j] == landmark and leader[j] < 0]
        above = [j for j in them if rank[j] > self.rank]
        return sorted(above, key=rank.__getitem__, reverse=True)

    def followers_of(self, body: int) -> int:
        """How many people in sight follow a body?"""
        return [self._others.leader[j] for j in self.bodies].count(body)

    def passable(self, landmark: int) -> bool:
        """Is there no flame in sight on the straight way to a landmark in view?"""
        fire, sight = self._around.burning, self._around.sight
        return not fire or not self.burns(sight.line(self.place, landmark)[0])

    def safe(self, landmark: int) -> bool:
        """Is there no flame in sight on or beside the straight way to a landmark?"""
        fire, sight = self._around.burning, self._around.sight
        return not fire or not self.burns(sight.line(self.place, landmark)[1])

    def burns(self, places: Iterable[int]) -> bool:
        """Is there a flame in sight in any of these places?"""
        alight = self._around.burning.intersection(places)
        return bool(alight & self._around.sight.seen(self.place)) if alight else False

    def burns_towards(self, place: int) -> bool:
        """Is there a flame in sight on the straight way to a place of this floor?"""
        navigation = self._around.sight.navigation
        fire = self._around.burning
        return bool(fire) and self.burns(navigation.straight(self.place, place))

    def towards(self, goal: Goal) -> tuple[float, float] | None:
        """Unit vector to a goal in sight or remembered, None when one is there."""
        building, nav = self._around.sight.building, self._around.sight.navigation
        here = there = nav.centres[self.place].tolist()
        if goal.aim is Aim.LANDMARK:
            there = building.landmarks[goal.which].position
        elif goal.place != NOWHERE:
            there = nav.centres[goal.place].tolist()
        x, y = there[0] - here[0], there[1] - here[1]
        far = (x * x + y * y) ** 0.5
        return (x / far, y / far) if far else None


def look(world: World, around: Surroundings, who: np.ndarray) -> list[View]:
    """Return what each of these people sees; who: (k,) people walking on a floor."""
    views = views_of(world, around, who)
    everybody = points(world)
    show_bodies(views, who, [array[who] for array in everybody], everybody)
    return views


def views_of(world: World, around: Surroundings, who: np.ndarray) -> list[View]:
    """Return the views of these people, (k,), before they look at others."""
    bodies, others = world.bodies, Others.of(world)
    mine = bodies.place[who], bodies.rank[who], bodies.anchor_time[who]
    return [
        View(world.time, place, rank, since, around.landmarks(place), around, others)
        for place, rank, since in rows(*mine)
    ]


def points(world: World) -> list[np.ndarray]:
    """x, y (metres, floors far apart), place and presence of people, then of robots."""
    bodies, robots = world.bodies, world.robots
    at = np.array([robot.position for robot in robots]).reshape(-1, 2)
    facts = [(robot.floor, robot.place, robot.active) for robot in robots]
    floor, place, active = np.array(facts, dtype=np.int64).reshape(-1, 3).T
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
    sight, people = views[0]._around.sight, len(views[0]._others.rank)
    x, y, place, present = everybody
    off_x, off_y = x - mine[0][:, None], y - mine[1][:, None]
    near = (np.abs(off_x) < sight.reach) & (np.abs(off_y) < sight.reach) & present
    near[np.arange(len(me)), me] = False
    k, j = np.divmod(np.flatnonzero(near), near.shape[1])
    there = np.broadcast_to(place, near.shape)[k, j]
    seen = sight.sees.reaches(mine[2][k], there)
    k, j, there = k[seen], j[seen], there[seen]
    metres = np.hypot(off_x[k, j], off_y[k, j])
    for who, body, at, far in rows(k, j, there, metres):
        views[who].bodies[body] = at, far
    robots = np.flatnonzero(j >= people)
    robots = robots[metres[robots].argsort(kind="stable")]
    for who, body in rows(k[robots], j[robots]):
        views[who].robots[body] = views[who]._others.says[body - people]


def rows(*columns: np.ndarray) -> Iterator[tuple[Any, ...]]:
    """Zip columns of one length, as Python's own numbers."""
    return zip(*(column.tolist() for column in columns), strict=True)
