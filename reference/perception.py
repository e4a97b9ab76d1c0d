"""What one human sees now: their own rays and nothing else [B3].

Clauses: A6, B1, B2, B3.  Walls and landmarks are looked up in the sight tables; whether
a ray reaches people, robots and flames is asked anew, for all who are about to think.

    i   who looks;  j  a body in sight;  k  number of a ray
"""

from dataclasses import dataclass

import numpy as np

from reference.paper import RAYS
from reference.sight import Direction, Hit, Sight
from reference.world import World


@dataclass(frozen=True)
class Surroundings:
    """What everybody's view is taken from until the fire moves again.

    burnt    landmarks destroyed [A6]
    burning  places in flames;  hot  places in flames or beside them
    """

    sight: Sight
    burnt: frozenset[int]
    burning: frozenset[int]
    hot: frozenset[int]

    @classmethod
    def of(cls, world: World, sight: Sight) -> "Surroundings":
        """Read them from a world."""
        flames = (world.burnt, world.flames.burning, world.flames.harm)
        return cls(sight, *(frozenset(np.flatnonzero(f).tolist()) for f in flames))


class View:
    """What one human sees at one instant: "observe" in Algorithms 1 and 2.

    place    where the human stands
    robots   bodies of the active robots in sight
    people   bodies of the people in sight
    """

    __slots__ = ("people", "place", "robots", "surroundings")

    def __init__(self, place: int, surroundings: Surroundings):
        self.place, self.surroundings = place, surroundings
        self.robots: list[int] = []
        self.people: list[int] = []

    @property
    def landmarks(self) -> list[int]:
        """Intact doors, entrances and exits that rays meet, the nearest first."""
        burnt = self.surroundings.burnt
        met = self.surroundings.sight.landmarks[self.place]
        return [m for m in met if m not in burnt] if burnt else list(met)

    @property
    def open(self) -> list[Direction]:
        """Directions whose rays return nothing, flames included [B2]."""
        burning = self.surroundings.burning
        ways = self.surroundings.sight.open[self.place]
        return [way for way in ways if way.place not in burning]

    def safe(self, landmark: int) -> bool:
        """Is there no flame in sight on or beside the straight way to a landmark?"""
        return self._free_of(self.surroundings.hot, landmark)

    def passable(self, landmark: int) -> bool:
        """Is there no flame in sight on the straight way to a landmark?"""
        return self._free_of(self.surroundings.burning, landmark)

    def _free_of(self, danger: frozenset[int], landmark: int) -> bool:
        if not danger:
            return True
        return danger.isdisjoint(self.surroundings.sight.line(self.place, landmark))


def look(world: World, surroundings: Surroundings, who: np.ndarray) -> list[View]:
    """What each of these people sees; who: (k,) people walking on a floor."""
    n, sight = len(world.bodies), surroundings.sight
    x, y, place, present = _everybody(world)
    near_x = np.abs(x - x[who, None]) < sight.reach
    near_y = np.abs(y - y[who, None]) < sight.reach
    rows, j = np.nonzero(present & near_x & near_y)
    i = who[rows]
    seen = sight.sees.reaches(place[i], place[j]) & (i != j)
    views = [View(p, surroundings) for p in place[who].tolist()]
    for row, body in zip(rows[seen].tolist(), j[seen].tolist(), strict=True):
        (views[row].people if body < n else views[row].robots).append(body)
    return views


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
    surroundings = Surroundings.of(world, sight)
    view = look(world, surroundings, np.array([person]))[0]
    bodies, robots, centres = world.bodies, world.robots, sight.navigation.centres
    seen = sight.sees.reached_from(view.place).tolist()
    things = [("fire", p, centres[p]) for p in seen if p in surroundings.burning]
    things += [("human", j, bodies.position[j]) for j in view.people]
    things += [("robot", j, robots[j - len(bodies)].position) for j in view.robots]
    hits = [sight.cast(view.place, k) for k in range(RAYS)]
    for kind, index, where in things:
        x, y = where - bodies.position[person]
        k, far = round(np.arctan2(y, x) / (2 * np.pi) * RAYS) % RAYS, np.hypot(x, y)
        met = hits[k]
        if met is None or far < met.distance or kind == "fire":
            hits[k] = Hit(kind, float(far), index)
    return hits
