"""The robot's frame: how a policy reads the 167 numbers and speaks a destination.

Clauses: C1, C4-C7, D6.  [C5, chosen] The environment keeps the paper's interface,
coordinates of the whole floor.  A policy reads and speaks from where its robot stands:
points relative to it, those people first whom nobody leads, and a destination that may
mean one of a few anchors.  All of it follows from the observation, the map, and where
robots are headed.

    B   robots, of all worlds at once;  n  people;  R  robots;  K  anchors
    way    metres on foot, flames not counted;  near  1 / (1 + way / HALFWAY)
    guide  index of the robot that leads somebody, or NOBODY: a guess
    lost   people whom nobody leads, on a robot's own floor
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import zip_longest
from typing import Any

import numpy as np
from scipy import ndimage
from scipy.sparse.csgraph import dijkstra

from reference.building import Building, Kind, Landmark
from reference.fire import fuel
from reference.game.interface import Interface
from reference.game.observations import from_normalised
from reference.navigation import Navigation, navigation_of
from reference.paper import NEAR_STAIRWELL, SIGHT_RANGE
from reference.robots import AT_EXIT, Destination, actual_target, said_on_the_way
from reference.world import NOBODY

UNIT = 10.0  # [C5, chosen] metres of one unit of an action
HALFWAY = 5.0  # [C4, chosen] metres on foot that are half as near as none
FAR = 100.0  # metres: whatever is farther, or unreachable, counts as this far
PEOPLE = 6  # [C5, chosen] anchors at people
ASTRAY = 8.0  # [C5, chosen] metres: hardly anybody goes farther between decisions

KEEP, STAY = 0, 1
"""The first anchors: where a robot is headed, and where it stands."""


class View:
    """What robots see, step by step.

    me     (B, 2) metres, floor (B,), place (B,): where they stand
    alone, lost, mine  (B, n) bool, people whom nobody leads, those on my floor, and
           those I lead, in the order of the vector;  order  (B, n), the frame's
    spot   (B, 2) metres, where robots are headed;  outs, feet, rims  (B, k, 2) metres,
           ways out, feet of stairs and where to guard, nearest first; nan for none
    anchors  (B, K, 2) units;  way  (B, K) metres;  allowed  (B, K) bool
    """

    def __init__(
        self,
        interface: Interface,
        vectors: np.ndarray,
        headed: np.ndarray,
        masks: bool = False,
    ):
        """vectors (B, V) and headed (B, 2): observed, as `Interface.read` takes them.

        masks: forbid what helps nobody, see `helpful`.
        """
        self.scenario, building = interface.scenario, interface.building
        self.map, self.masks = map_of(building), masks
        blocks = interface.layout.blocks
        self.seen = {name: interface.layout.read(vectors, name) for name in blocks}
        self.humans, self.robots, self.fires = (
            self.seen[name].astype(np.float64) for name in ("humans", "robots", "fires")
        )
        own = self.robots[:, 0]
        self.me, self.floor = own[:, :2], own[:, 2].round().clip(0).astype(int)
        self.place = self.map.places(own)
        self._sort_people()
        self.spot = from_normalised(building, headed.astype(np.float64))
        self.outs = self._nearest_first(self.map.outs)
        self.feet = self._nearest_first(self.map.feet)
        self.rims = self._nearest_first(self.map.rims)
        self._find_anchors()

    def _sort_people(self) -> None:
        """Lost people first, by way, then mine, my mates', those elsewhere [C4]."""
        place, inside = self.map.places(self.humans), _there(self.humans)
        walking = inside & ~self.map.stairs[place]
        robots, at_work = self.map.places(self.robots), _there(self.robots)
        guide = guides(self.map.nav, robots, at_work, place, walking)
        here = walking & (self.humans[..., 2].round() == self.floor[:, None])
        self.alone = walking & (guide == NOBODY)
        self.lost, self.mine = here & self.alone, here & (guide == 0)
        groups = [self.lost, self.mine, here, inside]  # at last those out or dead
        group = np.select(groups, range(len(groups)), len(groups))
        way = np.where(here, self._way(place), FAR)
        self.order = np.lexsort((way, group), axis=1)

    def _find_anchors(self) -> None:
        """Keep, stay, ways out, feet of stairs, rims, the nearest lost people [C5]."""
        first = self.order[:, :PEOPLE]
        people = np.take_along_axis(self.humans[..., :2], first[..., None], axis=1)
        people[~np.take_along_axis(self.lost, first, axis=1)] = np.nan
        own, marks = [self.spot, self.me], [self.outs, self.feet, self.rims]
        parts = [*(point[:, None] for point in own), *marks, people]
        anchors = np.concatenate(parts, axis=1)
        self.anchors: np.ndarray = np.nan_to_num((anchors - self.me[:, None]) / UNIT)
        self.way = self._way_to(anchors)
        self.allowed = ~np.isnan(anchors[..., 0])
        if self.masks:
            self.allowed &= self.helpful()
        self.allowed[:, STAY] = True

    def helpful(self) -> np.ndarray:
        """(B, K) bool: False masks useless anchors.

        Useless are ways out while nobody follows, and the old destination once nobody
        lost is near it. Rims never are: who guards a way out leads nobody.
        """
        leads = self.mine.any(axis=1)
        near_lost = _within(ASTRAY, self.spot, self.humans, self.lost)
        helps = np.ones_like(self.allowed)
        helps[:, STAY + 1 : STAY + 1 + self.outs.shape[1]] = leads[:, None]
        to_foot = _within(AT_EXIT, self.spot, self.feet)
        keeps = np.where(self.to_way_out(), leads, to_foot | near_lost)
        helps[:, KEEP] = keeps | _within(AT_EXIT, self.spot, self.rims)
        return helps

    def to_way_out(self) -> np.ndarray:
        """(B,) bool: is the robot headed to one?"""
        return _within(AT_EXIT, self.spot, self.outs)

    def numbers(self) -> np.ndarray:
        """(B, V) float32: anchors, people, robots, mates first, fires, counts."""
        people = self._points(self.humans, self.alone)
        mates, floors = self.robots[:, 1:], np.arange(len(self.map.free))
        parts = [
            self.anchors,
            self.allowed,
            np.take_along_axis(people, self.order[..., None], axis=1),
            self._points(mates, _there(mates)),
            self._points(self.fires, _there(self.fires)),
            near(self.way),
            self.way / UNIT,
            (self.humans[..., 2:].round() == floors).sum(axis=1) / UNIT,
            self.seen["fires_per_floor"],
            self.floor[:, None] == floors,
            self.seen["time"] / self.scenario.time_limit,
            self.mine.sum(axis=1) / UNIT,
            self.lost.sum(axis=1) / UNIT,
            ~np.isnan(self.spot[:, 0]),
            self.to_way_out(),
        ]
        rows = [part.reshape(len(part), -1) for part in parts]
        return np.concatenate(rows, axis=1, dtype=np.float32)

    def _points(self, points: np.ndarray, flag: np.ndarray) -> np.ndarray:
        """(B, m, 5): x, y and storeys from me, near, flag; zeros for SENTINEL."""
        off = (points[..., :2] - self.me[:, None]) / UNIT
        up = points[..., 2:] - self.floor[:, None, None]
        close = near(self._way(self.map.places(points)))
        parts = [off, up, close[..., None], flag[..., None]]
        return np.concatenate(parts, axis=-1) * _there(points)[..., None]

    def _way(self, place: np.ndarray) -> np.ndarray:
        """Metres on foot to places (B, m)."""
        return np.minimum(between(self.map.nav, self.place[:, None], place), FAR)

    def _way_to(self, metres: np.ndarray) -> np.ndarray:
        """Metres on foot to points (B, m, 2) of my floor; to nan it is FAR."""
        place = self.map.places(np.nan_to_num(metres), self.floor[:, None])
        return np.where(np.isnan(metres[..., 0]), FAR, self._way(place))

    def _nearest_first(self, marks: np.ndarray) -> np.ndarray:
        """Sort the marks of my floor, (floors, k, 2) metres: (B, k, 2)."""
        mine = marks[self.floor]
        order = np.argsort(self._way_to(mine), axis=1, kind="stable")
        return np.take_along_axis(mine, order[..., None], axis=1)


class Map:
    """What robots know of a building.

    free    (floors, rows, cols) the nearest place where one can stand
    stairs  (places,) bool
    outs, feet, rims  (floors, k, 2) metres of ways out, feet of stairs and cells to
            guard, nan for none
    """

    def __init__(self, building: Building):
        self.nav, self.origin = navigation_of(building), building.origin
        self.stairs = building.kind.ravel() == Kind.STAIRS
        nearest = ndimage.distance_transform_edt(
            ~building.walkable,
            sampling=(FAR, 1, 1),
            return_distances=False,
            return_indices=True,
        )
        self.free = np.ravel_multi_index(nearest, building.walkable.shape)
        floors = range(building.floors)
        marks = [(*way_marks(building, f), rims(building, f)) for f in floors]
        self.outs, self.feet, self.rims = map(_filled, zip(*marks, strict=True))

    def places(self, points: np.ndarray, floor: np.ndarray | None = None) -> np.ndarray:
        """(...) places of points (..., 2), or (..., 3) with floors of their own.

        What is outside the drawing counts as on its edge, SENTINEL as on the first
        floor.
        """
        if floor is None:
            floor = points[..., 2].round().clip(0).astype(int)
        top, left = self.origin
        last = np.subtract(self.free.shape[1:], 1)
        right, up = np.moveaxis(np.floor(points[..., :2]).astype(int), -1, 0)
        cells = (top - 1 - up).clip(0, last[0]), (left + right).clip(0, last[1])
        return self.free[floor, *cells]


map_of = lru_cache(maxsize=8)(Map)


def between(nav: Navigation, p: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Metres on foot from places p to places q, broadcast; inf between floors.

    They come from a table; a row is computed when it is first asked for.
    """
    known, table = _table(nav)
    new = np.unique(p)
    new = new[~known[new]]
    for floor in np.unique(new // nav.floor_size).tolist():
        rows = new[new // nav.floor_size == floor]
        start = floor * nav.floor_size
        table[rows] = dijkstra(nav.steps[floor], indices=rows - start)
    known[new] = True
    metres = table[p, q % nav.floor_size]
    return np.where(p // nav.floor_size == q // nav.floor_size, metres, np.inf)


@lru_cache(maxsize=8)
def _table(nav: Navigation) -> tuple[np.ndarray, np.ndarray]:
    """(places,) bool, which rows are known, and (places, floor_size) float32."""
    table = np.empty((nav.places, nav.floor_size), dtype=np.float32)
    return np.zeros(nav.places, dtype=bool), table


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
    way = between(nav, robots[..., None], people[..., None, :])
    way = np.where(at_work[..., None], way, np.inf)
    led = walking & (way.min(axis=-2) <= SIGHT_RANGE)
    return np.where(led, way.argmin(axis=-2), NOBODY)


def way_marks(building: Building, floor: int) -> tuple[list[Any], list[Any]]:
    """Find a floor's ways out and the feet of its stairs, points in metres [C6].

    Where stairs lead down, the nearest point of the main body: Eq. 1 leads inside;
    where they end, before them, where people come out.
    """
    low, high = np.reshape(building.body, (2, 2))
    marks, wells = building.landmarks, building.stairwells
    outs = [np.clip(w.centre, low, high) for w in wells if w.leads_down(floor)]
    exits = [m for m in marks if m.kind is Kind.EXIT and m.floor == floor]
    ends = [k for k, well in enumerate(wells) if well.lowest == floor]
    outs += [np.array(at_exit(building, mark)) for mark in exits]
    return outs, [before_stairwell(building, floor, k) for k in ends]


def rims(building: Building, floor: int) -> list[Any]:
    """Find where one guards a floor's exits and entrances, points in metres [D6].

    [C5, chosen] Of the cells that flames may enter and that Eq. 1 leaves alone, the
    nearest on foot to each.
    """
    nav = navigation_of(building)
    guarded = (fuel(building) & (building.kind == Kind.FLOOR)).ravel()
    for well in (well for well in building.stairwells if floor in well.areas):
        off = nav.centres - well.centre
        guarded &= np.hypot(off[:, 0], off[:, 1]) > NEAR_STAIRWELL
    marks = [m for m in building.landmarks if m.floor == floor]
    ways = [m.index for m in marks if m.kind is not Kind.DOOR]
    metres = [np.where(guarded, nav.distance_to(way), np.inf) for way in ways]
    return [nav.centres[d.argmin()] for d in metres if np.isfinite(d).any()]


@lru_cache(maxsize=64)
def before_stairwell(building: Building, floor: int, index: int) -> Destination:
    """Find the room cell nearest to a stairwell that Eq. 1 does not pull inside."""
    nav = navigation_of(building)
    well = building.stairwells[index]
    d = nav.distance_to(well.entrances[floor][0])
    d[building.kind.ravel() != Kind.FLOOR] = np.inf
    off = nav.centres - well.centre
    d[np.hypot(off[:, 0], off[:, 1]) <= NEAR_STAIRWELL] = np.inf
    x, y = nav.centres[int(np.argmin(d))].tolist()
    return x, y


def at_exit(building: Building, exit_: Landmark) -> Destination:
    """Find a point that means this exit and no stairwell beside it [C6] [C7].

    The exit itself, unless Eq. 1 leads away from there.
    """
    points = navigation_of(building).centres[: building.kind[0].size]
    off = np.hypot(*(points - exit_.position).T)
    near = points[np.argsort(off, kind="stable")[: int((off <= AT_EXIT).sum())]]
    for point in [exit_.position, *map(tuple, near.tolist())]:
        target = actual_target(building, exit_.floor, *point)
        if said_on_the_way(building, exit_.floor, target) in building.exits:
            return point
    return exit_.position


def _filled(floors: Sequence[Any]) -> np.ndarray:
    """(floors, most, 2) of points on each floor; nan where there are fewer."""
    rows = list(zip_longest(*floors, fillvalue=(np.nan, np.nan)))
    return np.reshape(rows, (-1, len(floors), 2)).swapaxes(0, 1)


def _there(points: np.ndarray) -> np.ndarray:
    """(...) bool: which points (..., 3) are not SENTINEL?"""
    return np.asarray(points[..., 2] > -0.5)


def _within(
    metres: float, spot: np.ndarray, points: np.ndarray, which: np.ndarray | bool = True
) -> np.ndarray:
    """(B,) bool: is any of which points (B, m, 2 or 3) so near to a spot (B, 2)?"""
    off = np.nan_to_num(points[..., :2] - spot[:, None], nan=np.inf)
    return ((np.hypot(off[..., 0], off[..., 1]) <= metres) & which).any(axis=1)
