"""What one human sees now: their own rays and nothing else [B3].

Clauses: A6, B1, B2, B3, B6.  Walls and landmarks are in the sight tables; which
people, robots and flames are in sight is computed anew for all who are about to think.
Neither people nor flames hide what is behind them [B1, chosen].

    i  who looks;  j  a body in sight, by its number in its world;  w  number of a world
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from reference.paper import RAYS
from reference.sight import Direction, Hit, Sight
from reference.world import FLOOR_APART, NOBODY, NOWHERE, Aim, Bodies, Goal, Said, World


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


class Leading(NamedTuple):
    """A human in sight who follows nobody and heads for a landmark in sight.

    [B6, chosen] Others can tell where they head, and their rank; followers counts those
    in sight.
    """

    body: int
    heading: int
    rank: float
    followers: int


@dataclass(slots=True)
class View:
    """What one human sees at one instant: "observe" in Algorithms 1 and 2.

    time (s), place, rank   of the human who looks
    halted_since            s, when their body last made headway
    landmarks               intact doors, ways down and exits that rays meet, by index,
                            the nearest first
    bodies                  people and robots in sight: place and metres of each
    leading                 people in sight who lead to a landmark in sight
    robots                  in sight, the nearest first, and what they say
    """

    time: float
    place: int
    rank: float
    halted_since: float
    landmarks: dict[int, Hit]
    _around: Surroundings
    bodies: dict[int, tuple[int, float]] = field(default_factory=dict)
    leading: list[Leading] = field(default_factory=list)
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
    def flames(self) -> frozenset[int]:
        """Places in flames in sight."""
        return self._around.burning & self._around.sight.seen(self.place)

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


def look(
    worlds: Sequence[World],
    surroundings: Sequence[Surroundings],
    bodies: Bodies,
    who: np.ndarray,
) -> list[View]:
    """Return what each of these people sees.

    worlds: one, or several with equally many people and robots (`workshop.lockstep`);
    surroundings: one per world; bodies: of all worlds in a row; who: (k,) of these
    bodies, walking on a floor.
    """
    sight, n = surroundings[0].sight, len(worlds[0].bodies)
    world, me = np.divmod(who, n)
    rows, j, places, metres = _pairs(_everybody(worlds, bodies), sight, world, me)
    mine = bodies.place[who], bodies.rank[who], bodies.anchor_time[who]
    views = []
    for w, place, rank, since in _rows(world, *mine):
        time, around = worlds[w].time, surroundings[w]
        views.append(View(time, place, rank, since, around.landmarks(place), around))
    for row, body, place, far in _rows(rows, j, places, metres):
        views[row].bodies[body] = place, far
    people, robots = np.flatnonzero(j < n), np.flatnonzero(j >= n)
    seen = world[rows[people]] * n + j[people]
    _show_people(bodies, sight, who, views, rows[people], seen, j[people])
    robots = robots[metres[robots].argsort(kind="stable")]
    for row, w, body in _rows(rows[robots], world[rows[robots]], j[robots]):
        views[row].robots[body] = worlds[w].robots[body - n].says
    return views


def _show_people(
    bodies: Bodies,
    sight: Sight,
    who: np.ndarray,
    views: list[View],
    rows: np.ndarray,
    seen: np.ndarray,
    j: np.ndarray,
) -> None:
    """Add leaders to the views.

    rows: (p,) indices of views; seen: (p,) indices of bodies; j: (p,) their numbers in
    their own worlds.

    followed: sorted, one number per follower seen, made of viewer and leader; how
    often it occurs is how many followers of that leader the viewer sees.
    """
    leader, heading = bodies.leader[seen], bodies.landmark[seen]
    m = len(bodies) + int(leader.max(initial=0)) + 1  # above every j and leader
    followed = np.sort((rows * m + leader)[leader != NOBODY])
    lead = sight.meets[bodies.place[who[rows]], heading] & (leader == NOBODY)
    rows, seen, j, heading = rows[lead], seen[lead], j[lead], heading[lead]
    first, last = (followed.searchsorted(rows * m + j, s) for s in ("left", "right"))
    facts = j, heading, bodies.rank[seen], last - first
    for row, shown in zip(rows.tolist(), _rows(*facts), strict=True):
        views[row].leading.append(Leading(*shown))


def _rows(*columns: np.ndarray) -> Iterator[tuple[Any, ...]]:
    """Zip columns of one length, as Python's own numbers."""
    return zip(*(column.tolist() for column in columns), strict=True)


def _pairs(
    everybody: list[np.ndarray], sight: Sight, world: np.ndarray, me: np.ndarray
) -> tuple[np.ndarray, ...]:
    """Who sees whom, (pairs,) each: row of `me`, body seen, its place, metres away.

    everybody: as `_everybody` returns it; me: (k,) people; world: (k,) which of the
    worlds each is in.
    """
    x, y, place, present = everybody
    row, col = np.array(np.divmod(place, sight.navigation.cols), dtype=np.int16)
    near = np.abs(row[world] - row[world, me, None]) <= sight.sees.reach
    near &= np.abs(col[world] - col[world, me, None]) <= sight.sees.reach  # all small
    rows, j = np.divmod(np.flatnonzero(near & present[world]), place.shape[1])
    i, w = me[rows], world[rows]
    here, there = place[w, i], place[w, j]
    off_x, off_y = x[w, j] - x[w, i], y[w, j] - y[w, i]
    seen = np.maximum(np.abs(off_x), np.abs(off_y)) < sight.reach
    seen &= sight.sees.reaches(here, there) & (i != j)
    return rows[seen], j[seen], there[seen], np.hypot(off_x[seen], off_y[seen])


def _everybody(worlds: Sequence[World], bodies: Bodies) -> list[np.ndarray]:
    """x, y (metres, floors far apart), place and presence, (worlds, people + robots).

    bodies: the people of all worlds in a row.
    """
    robots = [robot for world in worlds for robot in world.robots]
    at = np.array([robot.position for robot in robots]).reshape(-1, 2)
    apart = FLOOR_APART * np.array([robot.floor for robot in robots], dtype=np.int64)
    columns = (
        (bodies.position[:, 0] + FLOOR_APART * bodies.floor, at[:, 0] + apart),
        (bodies.position[:, 1], at[:, 1]),
        (bodies.place, np.array([robot.place for robot in robots], dtype=np.int64)),
        (bodies.walking, np.array([robot.active for robot in robots], dtype=bool)),
    )
    sizes = [(len(worlds), some // len(worlds)) for some in (len(bodies), len(robots))]
    return [
        np.concatenate([c.reshape(s) for c, s in zip(pair, sizes, strict=True)], axis=1)
        for pair in columns
    ]


def rays(world: World, sight: Sight, person: int) -> list[Hit | None]:
    """What every ray of one human returns; None is an unexplored direction [B1] [B2].

    For tutorials and tests: the simulation uses `look`. People, robots and flames are
    met by the ray at their middle only; flames in sight hide a door that they burn.
    """
    around = Surroundings.of(world, sight)
    view = look([world], [around], world.bodies, np.array([person]))[0]
    bodies, robots, centres = world.bodies, world.robots, sight.navigation.centres
    off = {p: np.hypot(*(centres[p] - bodies.position[person])) for p in view.flames}
    nearest_last = sorted(off, key=lambda p: (-off[p], p))
    things = [("fire", p, centres[p]) for p in nearest_last]
    people = (j for j in view.bodies if j not in view.robots)
    things += [("human", j, bodies.position[j]) for j in people]
    things += [("robot", j, robots[j - len(bodies)].position) for j in view.robots]
    hits = [sight.cast(view.place, k) for k in range(RAYS)]
    for kind, index, where in things:
        x, y = where - bodies.position[person]
        k, far = round(np.arctan2(y, x) / (2 * np.pi) * RAYS) % RAYS, np.hypot(x, y)
        met = hits[k]
        seen_through = met is None or met.kind == "entrance"  # it has no leaf
        if seen_through or far < met.distance or kind == "fire":
            hits[k] = Hit(kind, float(far), index)
    return hits
