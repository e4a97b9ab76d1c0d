"""What one human sees now: their own rays and nothing else [B3].

Clauses: A6, B1, B2, B3.  Walls and landmarks are looked up in the sight tables; whether
a ray reaches people, robots and flames is asked anew, for all who are about to think.

    i   who looks;  j  a body in sight;  k  number of a ray
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from reference.paper import RAYS
from reference.sight import Direction, Hit, Sight
from reference.world import NOBODY, NOWHERE, Aim, Goal, Said, World


@dataclass(frozen=True)
class Surroundings:
    """What everybody's view is taken from until the fire moves again.

    burnt     landmarks destroyed [A6]
    useless   these, and stairs that do not go down: a sign says so [B6, chosen]
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
        """Doors, ways down and exits that rays from a place meet, but the useless."""
        met = self.sight.landmarks[place]
        if self.useless.isdisjoint(met):
            return met
        return {m: hit for m, hit in met.items() if m not in self.useless}


class Leading(NamedTuple):
    """A human in sight who walks after nobody, to a landmark in sight [B6, chosen].

    Their walk shows the heading, their bearing the rank; followers are those in sight.
    """

    body: int
    heading: int
    rank: float
    followers: int


@dataclass(slots=True)
class View:
    """What one human sees at one instant: "observe" in Algorithms 1 and 2.

    time (s), place, rank   when, where and who the human is that looks
    halted_since            s, since when their body has not got ahead
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
    def burnt(self) -> frozenset[int]:
        """Destroyed doors that rays meet, or that one stands in [A6]."""
        if not self._around.burnt:
            return self._around.burnt
        here = int(self._around.sight.building.landmark.flat[self.place])
        met = self._around.sight.landmarks[self.place]
        return self._around.burnt.intersection((here, *met))

    @property
    def flames(self) -> frozenset[int]:
        """Places in flames in sight."""
        return self._around.burning & self._around.sight.seen(self.place)

    @property
    def open(self) -> list[Direction]:
        """Directions whose rays return nothing, flames included [B2]."""
        ways = self._around.sight.open[self.place]
        return [way for way in ways if way.place not in self._around.burning]

    @property
    def patch(self) -> int:
        """The patch of floor that one stands in."""
        return self._around.sight.patches[self.place]

    @property
    def far_end(self) -> Goal:
        """The floor in sight that is farthest away."""
        sight = self._around.sight
        place = sight.farthest[self.place]
        return Goal(Aim.DIRECTION, sight.patches[place], place)

    def passable(self, landmark: int) -> bool:
        """Is there no flame in sight on the straight way to a landmark in view?"""
        fire, sight = self._around.burning, self._around.sight
        return not fire or not self.burns(sight.line(self.place, landmark)[0])

    def safe(self, landmark: int) -> bool:
        """Is there none beside it either?"""
        fire, sight = self._around.burning, self._around.sight
        return not fire or not self.burns(sight.line(self.place, landmark)[1])

    def burns(self, places: Iterable[int]) -> bool:
        """Is there a flame in sight in any of these places?"""
        alight = self._around.burning.intersection(places)
        return bool(alight & self._around.sight.seen(self.place)) if alight else False

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


def look(world: World, surroundings: Surroundings, who: np.ndarray) -> list[View]:
    """What each of these people sees; who: (k,) people walking on a floor."""
    bodies, sight = world.bodies, surroundings.sight
    me = bodies.place[who], bodies.rank[who], bodies.anchor_time[who]
    views = [
        View(world.time, p, rank, since, surroundings.landmarks(p), surroundings)
        for p, rank, since in _rows(*me)
    ]
    rows, j, places, metres = _pairs(world, sight, who)
    for row, body, place, far in _rows(rows, j, places, metres):
        views[row].bodies[body] = place, far
    _show_people(world, sight, who, views, rows, j)
    robots = np.flatnonzero(j >= len(bodies))
    robots = robots[metres[robots].argsort(kind="stable")]
    for row, body in _rows(rows[robots], j[robots]):
        views[row].robots[body] = world.robots[body - len(bodies)].says
    return views


def _show_people(
    world: World,
    sight: Sight,
    who: np.ndarray,
    views: list[View],
    rows: np.ndarray,
    j: np.ndarray,
) -> None:
    """Enter who leads in the views; rows, j: as `_pairs`."""
    bodies, n = world.bodies, len(world.bodies)
    rows, j = rows[j < n], j[j < n]
    leader, heading = bodies.leader[j], bodies.landmark[j]
    m = n + len(world.robots)
    followed = np.sort((rows * m + leader)[leader != NOBODY])
    lead = sight.meets[bodies.place[who[rows]], heading] & (leader == NOBODY)
    rows, j, heading = rows[lead], j[lead], heading[lead]
    first, last = (followed.searchsorted(rows * m + j, s) for s in ("left", "right"))
    facts = j, heading, bodies.rank[j], last - first
    for row, shown in zip(rows.tolist(), _rows(*facts), strict=True):
        views[row].leading.append(Leading(*shown))


def _rows(*columns: np.ndarray) -> Iterator[tuple[Any, ...]]:
    """Zip columns of one length, as Python's own numbers."""
    return zip(*(column.tolist() for column in columns), strict=True)


def _pairs(world: World, sight: Sight, who: np.ndarray) -> tuple[np.ndarray, ...]:
    """Who sees whom, (pairs,) each: row of `who`, body seen, its place, metres away."""
    x, y, place, present = _everybody(world)
    row, col = np.array(np.divmod(place, sight.navigation.cols), dtype=np.int16)
    near = np.abs(row - row[who, None]) <= sight.sees.reach  # small numbers: fast
    near &= np.abs(col - col[who, None]) <= sight.sees.reach
    rows, j = np.divmod(np.flatnonzero(near & present), len(x))
    i = who[rows]
    off_x, off_y = x[j] - x[i], y[j] - y[i]
    seen = np.maximum(np.abs(off_x), np.abs(off_y)) < sight.reach
    seen &= sight.sees.reaches(place[i], place[j]) & (i != j)
    j = j[seen]
    return rows[seen], j, place[j], np.hypot(off_x[seen], off_y[seen])


def _everybody(world: World) -> tuple[np.ndarray, ...]:
    """x, y (metres, floors far apart), place and presence of people, then robots."""
    bodies, robots = world.bodies, world.robots
    n = len(bodies)
    x, y = np.empty(n + len(robots)), np.empty(n + len(robots))
    place = np.empty(n + len(robots), dtype=np.int64)
    present = np.empty(n + len(robots), dtype=bool)
    x[:n], y[:n] = bodies.position[:, 0] + 1e4 * bodies.floor, bodies.position[:, 1]
    place[:n], present[:n] = bodies.place, bodies.walking
    for r in robots:
        x[r.body], y[r.body] = r.position[0] + 1e4 * r.floor, r.position[1]
        place[r.body], present[r.body] = r.place, r.active
    return x, y, place, present


def rays(world: World, sight: Sight, person: int) -> list[Hit | None]:
    """What every ray of one human returns; None is an unexplored direction [B1] [B2].

    For pictures and tests: the simulation uses `look`. People, robots and flames are
    met by the ray at their middle; flames in sight hide the door that they burn.
    """
    view = look(world, Surroundings.of(world, sight), np.array([person]))[0]
    bodies, robots, centres = world.bodies, world.robots, sight.navigation.centres
    things = [("fire", p, centres[p]) for p in sorted(view.flames)]
    people = (j for j in view.bodies if j not in view.robots)
    things += [("human", j, bodies.position[j]) for j in people]
    things += [("robot", j, robots[j - len(bodies)].position) for j in view.robots]
    hits = [sight.cast(view.place, k) for k in range(RAYS)]
    for kind, index, where in things:
        x, y = where - bodies.position[person]
        k, far = round(np.arctan2(y, x) / (2 * np.pi) * RAYS) % RAYS, np.hypot(x, y)
        met = hits[k]
        if met is None or far < met.distance or kind == "fire":
            hits[k] = Hit(kind, float(far), index)
    return hits
