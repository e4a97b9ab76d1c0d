"""The robot's frame: how a policy reads the 167 numbers and speaks a destination.

Clauses: C1, C2, C4, C5, C6.  [C4, chosen] The environment keeps the paper's interface,
coordinates of the whole floor; a policy sees and means everything from where its robot
stands, in an order that follows from the map: those whom nobody leads come first.
All of it follows from the observation, the map, and where robots are headed.

    B   robots, of all worlds at once;  n  people;  R  robots;  S  fire sources
    K   anchors: points that a destination may mean
    way   metres on foot, flames not counted;  near  1 / (1 + way / HALFWAY)
    guide  who leads somebody, as an index: a guess, nobody observes it
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import ndimage

from reference.building import Building, Kind
from reference.game.observations import (
    from_normalised,
    robot_layout,
    to_normalised,
)
from reference.navigation import Navigation, navigation_of
from reference.paper import SIGHT_RANGE, Scenario
from reference.robots import AT_EXIT, at_exit, before_stairwell
from reference.world import NOBODY

UNIT = 10.0  # [C5, chosen] metres of one unit of an action
HALFWAY = 5.0  # [C4, chosen] metres on foot that are half as near as none
FAR = 100.0  # metres: whatever is farther, or unreachable, counts as this far
PEOPLE = 6  # [C5, chosen] anchors at people
ASTRAY = 8.0  # [C5, chosen] metres: hardly anybody goes farther between decisions
EDGE = 1e-3  # metres: a point on the drawing's edge is inside

KEEP, STAY = 0, 1
"""The first two anchors: where a robot is headed, and where it stands."""


@dataclass(frozen=True)
class Seen:
    """What robots see in their own frames, float32 in units of UNIT metres.

    numbers  (B, V), what a network reads;  anchors  (B, K, 2), from the robot
    allowed  (B, K) bool, which anchors may be meant; STAY always
    """

    numbers: np.ndarray
    anchors: np.ndarray
    allowed: np.ndarray


class Frame:
    """The frame of robots in one building.

    size  V, how many numbers a network reads;  anchors  K
    """

    def __init__(self, building: Building, scenario: Scenario, masks: bool = False):
        """masks: forbid what helps nobody, see `_helpful`."""
        self.building, self.masks, self.end = building, masks, scenario.time_limit
        self.layout = robot_layout(building, scenario)
        self.ways = Ways(building)
        each = [way_marks(building, floor) for floor in range(building.floors)]
        outs, feet = zip(*each, strict=True)
        self.outs, self.feet = self._marks(outs), self._marks(feet)
        nobody = np.zeros((1, self.layout.size), dtype=np.float32)
        seen = self.read(nobody, np.full((1, 2), np.nan))
        self.size, self.anchors = seen.numbers.shape[1], seen.anchors.shape[1]

    def _marks(self, floors: tuple[np.ndarray, ...]) -> np.ndarray:
        """(floors, most, 2) metres of each floor's marks; nan where there are fewer."""
        marks = np.full((len(floors), max(map(len, floors)), 2), np.nan)
        for floor, points in enumerate(floors):
            marks[floor, : len(points)] = points
        return marks

    # -- Speaking -------------------------------------------------------------------

    def spoken(self, vectors: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Convert actions (..., 2) to the environment's, normalised [C5].

        The destination is the robot's place + UNIT metres for each unit.
        """
        metres = self._own(vectors) + UNIT * actions
        return to_normalised(self.building, metres).clip(-1, 1).astype(np.float32)

    def actions(self, vectors: np.ndarray, normalised: np.ndarray) -> np.ndarray:
        """Invert `spoken`; nan, for none, stays nan."""
        metres = from_normalised(self.building, normalised.astype(np.float64))
        return ((metres - self._own(vectors)) / UNIT).astype(np.float32)

    def _own(self, vectors: np.ndarray) -> np.ndarray:
        return self.layout.read(vectors, "robots")[..., 0, :2].astype(np.float64)

    # -- Reading --------------------------------------------------------------------

    def read(self, vectors: np.ndarray, headed: np.ndarray) -> Seen:
        """vectors (B, V): robots' observations; headed (B, 2): as a `Moment` says."""
        humans, robots, fires = (
            self.layout.read(vectors, name).astype(np.float64)
            for name in ("humans", "robots", "fires")
        )
        me, floor = robots[:, 0, :2], robots[:, 0, 2].round().clip(0).astype(int)
        here = From(self.ways, me, floor)

        # PEOPLE: first those on my floor whom nobody leads
        inside, place = humans[..., 2] > -0.5, self.ways.places(humans)
        walking = inside & ~self.ways.stairs[place]
        at_work, robot_place = robots[..., 2] > -0.5, self.ways.places(robots)
        guide = guides(self.ways.nav, robot_place, at_work, place, walking)
        on_mine = walking & (humans[..., 2].round() == floor[:, None])
        lost = on_mine & (guide == NOBODY)
        mine = on_mine & (guide == 0)
        groups = [lost, mine, on_mine, inside]  # then those who are out or dead
        group = np.select(groups, range(len(groups)), len(groups))
        way = np.where(on_mine, here.way(place), FAR)
        order = np.lexsort((way, group), axis=1)
        seen = here.points(humans, walking & (guide == NOBODY))
        people = np.take_along_axis(seen, order[..., None], axis=1)

        # ANCHORS: keep, stay, ways out, feet of stairs, lost people
        spot = from_normalised(self.building, headed.astype(np.float64))
        under_way = ~np.isnan(spot[:, :1])
        outs, feet = here.nearest_first(self.outs), here.nearest_first(self.feet)
        first = order[:, :PEOPLE]
        who = np.take_along_axis(humans[..., :2], first[..., None], axis=1)
        who[~np.take_along_axis(lost, first, axis=1)] = np.nan
        parts = [spot[:, None], me[:, None], outs, feet, who]
        anchors = np.concatenate(parts, axis=1)
        way_there = here.way_to(anchors)
        exists = ~np.isnan(anchors[..., 0])
        out = _within(spot, outs, AT_EXIT)  # is it headed to a way out?
        leads, astray = mine.sum(axis=1), _within(spot, humans, ASTRAY, lost)
        allowed = exists & (way_there < FAR)
        if self.masks:
            leave = slice(STAY + 1, STAY + 1 + outs.shape[1])
            allowed[:, leave] &= leads[:, None] > 0
            foot = _within(spot, feet, AT_EXIT)
            allowed[:, KEEP] &= np.where(out, leads > 0, foot | astray)
        allowed[:, STAY] = True
        off = np.nan_to_num((anchors - me[:, None]) / UNIT)

        # COUNTS
        floors = np.arange(self.building.floors)
        on_floors = (humans[..., 2:].round() == floors).sum(axis=1)
        lit = self.layout.read(vectors, "fires_per_floor")[..., 0]
        time = self.layout.read(vectors, "time")[:, 0]
        alone = [leads[:, None], lost.sum(axis=1)[:, None], under_way, out[:, None]]
        return Seen(
            numbers=_joined(
                people,
                here.points(robots[:, 1:], at_work[:, 1:]),
                here.points(fires, fires[..., 2] > -0.5),
                off,
                near(way_there),
                way_there / UNIT,
                allowed,
                on_floors / UNIT,
                lit,
                floor[:, None] == floors,
                time / self.end,
                *alone,
            ),
            anchors=off.astype(np.float32),
            allowed=allowed,
        )


@dataclass(frozen=True)
class From:
    """Where robots stand, and what they see from there: metres (B, 2), floor (B,)."""

    ways: "Ways"
    me: np.ndarray
    floor: np.ndarray

    @property
    def _place(self) -> np.ndarray:
        return self.ways.places_on(self.floor[:, None], self.me[:, None])

    def way(self, place: np.ndarray) -> np.ndarray:
        """Metres on foot to places (B, m)."""
        return np.minimum(self.ways.nav.between(self._place, place), FAR)

    def way_to(self, metres: np.ndarray) -> np.ndarray:
        """Metres on foot to points (B, m, 2) of the same floor; nan is FAR."""
        place = self.ways.places_on(self.floor[:, None], np.nan_to_num(metres))
        return np.where(np.isnan(metres[..., 0]), FAR, self.way(place))

    def nearest_first(self, marks: np.ndarray) -> np.ndarray:
        """Sort the marks of each robot's floor, (B, k, 2) metres; nan comes last."""
        own = marks[self.floor]
        order = np.argsort(self.way_to(own), axis=1, kind="stable")
        return np.take_along_axis(own, order[..., None], axis=1)

    def points(self, points: np.ndarray, flag: np.ndarray) -> np.ndarray:
        """(B, m, 5): x, y and storeys from me, near, flag; zeros for SENTINEL."""
        there = points[..., 2] > -0.5
        off = (points[..., :2] - self.me[:, None]) / UNIT
        up = points[..., 2:] - self.floor[:, None, None]
        close = near(self.way(self.ways.places(points)))
        parts = [off, up, close[..., None], flag[..., None]]
        return np.concatenate(parts, axis=-1) * there[..., None]


class Ways:
    """Places of a building's points, those in walls moved to the nearest free place."""

    def __init__(self, building: Building):
        self.nav = navigation_of(building)
        free = building.walkable
        cells = [
            ndimage.distance_transform_edt(
                ~floor, return_distances=False, return_indices=True
            )
            for floor in free
        ]
        each = (self.nav.places_of(k, c.reshape(2, -1).T) for k, c in enumerate(cells))
        self.free = np.concatenate([*each])
        self.stairs = building.kind.ravel() == Kind.STAIRS
        left, top = building.metres(-0.5, -0.5)
        right, bottom = building.metres(free.shape[1] - 0.5, free.shape[2] - 0.5)
        self.edges = (left + EDGE, bottom + EDGE), (right - EDGE, top - EDGE)

    def places(self, points: np.ndarray) -> np.ndarray:
        """(..., m) places of points (..., m, 3); SENTINEL's is on the first floor."""
        floor = points[..., 2].round().clip(0).astype(int)
        return self.places_on(floor, points[..., :2])

    def places_on(self, floor: np.ndarray, metres: np.ndarray) -> np.ndarray:
        """(..., m) places of (..., m, 2) metres; floor: (..., m) or broadcast to it."""
        floor = np.broadcast_to(floor, metres.shape[:-1]).ravel()
        inside = metres.clip(*self.edges).reshape(-1, 2)
        return self.free[self.nav.places_at(floor, inside)].reshape(metres.shape[:-1])


def near(way: np.ndarray) -> np.ndarray:
    """1 for a way of no metres, one half at HALFWAY; 0 for what is FAR."""
    return np.where(way < FAR, 1 / (1 + way / HALFWAY), 0)


def guides(
    nav: Navigation,
    robots: np.ndarray,
    at_work: np.ndarray,
    people: np.ndarray,
    walking: np.ndarray,
) -> np.ndarray:
    """Guess who leads whom [C1, chosen]: (..., n) index of a robot, or NOBODY.

    robots (..., R), people (..., n): places; at_work (..., R), walking (..., n) bool.
    The nearest robot at work, if it is in sight on foot, flames or not: right nineteen
    times in twenty.
    """
    if not robots.shape[-1]:
        return np.full(people.shape, NOBODY)
    way = nav.between(robots[..., None], people[..., None, :])
    way = np.where(at_work[..., None], way, np.inf)
    led = walking & (way.min(axis=-2) <= SIGHT_RANGE)
    return np.where(led, way.argmin(axis=-2), NOBODY)


@lru_cache(maxsize=64)
def way_marks(building: Building, floor: int) -> tuple[np.ndarray, np.ndarray]:
    """Find a floor's ways out and the feet of its stairs, (k, 2) metres each [C6].

    Where stairs lead down, the nearest point of the main body: Eq. 1 leads inside;
    where they end, before them, where people come out.
    """
    low, high = np.reshape(building.body, (2, 2))
    marks, wells = building.landmarks, building.stairwells
    down = [well.centre for well in wells if well.leads_down(floor)]
    outs = [tuple(np.clip(centre, low, high)) for centre in down]
    exits = (m for m in marks if m.kind is Kind.EXIT and m.floor == floor)
    outs += [at_exit(building, mark) for mark in exits]
    feet = [
        before_stairwell(building, floor, k)
        for k, well in enumerate(wells)
        if well.lowest == floor
    ]
    return np.reshape(outs, (-1, 2)), np.reshape(feet, (-1, 2))


def _within(
    spot: np.ndarray,
    points: np.ndarray,
    metres: float,
    which: np.ndarray | None = None,
) -> np.ndarray:
    """(B,) bool: is one of these points, (B, m, 2 or 3), so near to the spot (B, 2)?"""
    off = np.nan_to_num(points[..., :2] - spot[:, None], nan=np.inf)
    close = np.hypot(off[..., 0], off[..., 1]) <= metres
    return (close if which is None else close & which).any(axis=1)


def _joined(*parts: np.ndarray) -> np.ndarray:
    """(B, V) float32 of parts (B, ...)."""
    rows = [part.reshape(len(part), -1).astype(np.float32) for part in parts]
    return np.concatenate(rows, axis=1)
