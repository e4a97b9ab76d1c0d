"""The robot's frame: observations and destinations from where a robot stands.

[C5, chosen] The environment keeps the paper's interface, coordinates of the whole
floor.  In the frame points are relative to the robot, people whom nobody leads come
first, and a destination may be one of a few anchors.  All of it is computed from the
observation [C1], the map, and where robots are headed.

    B   robots, of all worlds at once;  n  people;  R  robots;  K  anchors
    way    metres on foot, flames not counted;  near  1 / (1 + way / HALFWAY)
    guide  index of the robot that leads somebody, or NOBODY: a guess
    lost   people whom nobody leads, on a robot's own floor
"""

import numpy as np

from reference import paper
from reference.building import Building, lengths
from reference.game.codec import PolicyCodec
from reference.game.observations import from_normalised
from reference.workshop.strategies.observed import (
    FAR,
    decisions_to_next_fire,
    guess_guides,
    known_map_of,
    metres_between,
)
from reference.world import NOBODY, World

UNIT = 10.0  # [C5, chosen] metres of one unit of an action
HALFWAY = 5.0  # [C4, chosen] metres on foot that are half as near as none
NEAREST_PEOPLE = 6  # [C5, chosen] anchors at people
ASTRAY = 8.0  # [C5, chosen] metres: hardly anybody goes farther between decisions

KEEP = 0
WAIT = 1
"""The first anchors: where a robot is headed, and where it stands."""


def to_normalised(building: Building, metres: np.ndarray) -> np.ndarray:
    """Convert metres (..., 2) so that the main body is [-1, 1] x [-1, 1]."""
    low, high = np.reshape(building.body, (2, 2))
    return (metres - (low + high) / 2) / ((high - low) / 2)


def in_body(building: Building, metres: np.ndarray) -> np.ndarray:
    """Clip metres (..., 2) to the main body."""
    low, high = np.reshape(building.body, (2, 2))
    return metres.clip(low, high)


def robot_destinations(world: World) -> np.ndarray:
    """Find where robots under way go to: (R, 2) float32 normalised, else nan.

    The actual target of their last decision (Eq. 1), clipped to the main body: deciding
    it again changes nothing.
    """
    spots = [r.destination if r.way else (np.nan, np.nan) for r in world.robots]
    metres = np.array(spots, dtype=np.float64).reshape(-1, 2)
    return to_normalised(world.building, metres).clip(-1, 1).astype(np.float32)


class RobotView:
    """What robots observe, in their frames.

    me     (B, 2) metres, floor (B,), place (B,): where they stand
    alone, lost, mine  (B, n) bool, people whom nobody leads, those on my floor, and
           those I lead, in the order of the vector;  order  (B, n), the frame's
    spot   (B, 2) metres, where robots are headed [C6]
    outs, feet, rims  (B, k, 2) metres,
           ways out and feet of stairs, nearest first, and where to guard, in the map's
           order, so that each keeps its number; nan for none
    points   (B, K, 2) metres, the anchors', nan for none
    anchors  (B, K, 2) units;  way  (B, K) metres;  allowed  (B, K) bool
    """

    def __init__(
        self, codec: PolicyCodec, vectors: np.ndarray, headed: np.ndarray, masks: bool
    ):
        """vectors (B, V): observed; headed (B, 2): see `robot_destinations`.

        masks: forbid what helps nobody, see `helpful`.
        """
        self.scenario = codec.scenario
        self.map = known_map_of(codec.building)
        self.masks = masks
        blocks = codec.layout.blocks
        self.seen = {name: codec.layout.read(vectors, name) for name in blocks}
        # Metres in float64, as the simulation has them.
        self.humans = self.seen["humans"].astype(np.float64)
        self.robots = self.seen["robots"].astype(np.float64)
        self.fires = self.seen["fires"].astype(np.float64)

        own = self.robots[:, 0]
        self.me = own[:, :2]
        self.floor = own[:, 2].round().clip(0).astype(int)
        self.place = self.map.places(own)
        self._sort_people()
        self.spot = from_normalised(codec.building, headed.astype(np.float64))
        self.outs = self._nearest_first(self.map.outs)
        self.feet = self._nearest_first(self.map.feet)
        self.rims = self.map.rims[self.floor]
        self._find_anchors()

    def _sort_people(self) -> None:
        """Sort people: lost ones, mine, my mates', others; the nearest first [C4]."""
        place = self.map.places(self.humans)
        inside = there(self.humans)
        walking = inside & ~self.map.stairs[place]
        robots = self.map.places(self.robots)
        guide = guess_guides(self.map.nav, robots, there(self.robots), place, walking)
        here = walking & (self.humans[..., 2].round() == self.floor[:, None])
        self.alone = walking & (guide == NOBODY)
        self.lost = here & self.alone
        self.mine = here & (guide == 0)

        groups = [self.lost, self.mine, here, inside]  # at last those out or dead
        group = np.select(groups, range(len(groups)), len(groups))
        way = np.where(here, self._way(place), FAR)
        self.order = np.lexsort((way, group), axis=1)

    def _find_anchors(self) -> None:
        """List anchors: keep, stay, ways out, feet, rims, nearest lost people [C5]."""
        first = self.order[:, :NEAREST_PEOPLE]
        people = np.take_along_axis(self.humans[..., :2], first[..., None], axis=1)
        people[~np.take_along_axis(self.lost, first, axis=1)] = np.nan
        self.points = np.concatenate(
            [
                self.spot[:, None],  # KEEP
                self.me[:, None],  # STAY
                self.outs,
                self.feet,
                self.rims,
                people,
            ],
            axis=1,
        )
        off = self.points - self.me[:, None]
        self.anchors: np.ndarray = np.nan_to_num(off / UNIT)
        self.way = self._way_to(self.points)
        self.allowed = ~np.isnan(self.points[..., 0])
        if self.masks:
            self.allowed &= self.helpful()
        self.allowed[:, WAIT] = True  # a mixture of nothing has no logarithm

    def helpful(self) -> np.ndarray:
        """(B, K) bool: False masks useless anchors.

        Useless are ways out while nobody follows, and the old destination once nobody
        lost is near it. Rims never are: who guards a way out [D6] leads nobody.
        """
        leads = self.mine.any(axis=1)
        helps = np.ones_like(self.allowed)
        outs = WAIT + 1  # the first way out
        helps[:, outs : outs + self.outs.shape[1]] = leads[:, None]

        # the old destination
        near_lost = _within(ASTRAY, self.spot, self.humans, self.lost)
        to_foot = _within(paper.AT_EXIT_METRES, self.spot, self.feet)
        to_rim = _within(paper.AT_EXIT_METRES, self.spot, self.rims)
        keeps = np.where(self.to_way_out(), leads, to_foot | near_lost)
        helps[:, KEEP] = keeps | to_rim
        return helps

    def to_way_out(self) -> np.ndarray:
        """(B,) bool: is the robot headed to one [C7]?"""
        return _within(paper.AT_EXIT_METRES, self.spot, self.outs)

    def numbers(self) -> np.ndarray:
        """(B, V) float32: anchors, people, robots, mates first, fires, counts, time."""
        people = self._points(self.humans, self.alone)
        mates = self.robots[:, 1:]
        floors = np.arange(len(self.map.free))
        time = self.seen["time"]
        step = self.scenario.decision_seconds
        parts = [
            self.anchors,
            self.allowed,
            np.take_along_axis(people, self.order[..., None], axis=1),
            self._points(mates, there(mates)),
            self._points(self.fires, there(self.fires)),
            nearness(self.way),
            self.way / UNIT,
            (self.humans[..., 2:].round() == floors).sum(axis=1) / UNIT,
            self.seen["fires_per_floor"],
            self.floor[:, None] == floors,
            time / self.scenario.time_limit,
            decisions_to_next_fire(time, step) / paper.FIRE_EVERY_DECISIONS,
            self.mine.sum(axis=1) / UNIT,
            self.lost.sum(axis=1) / UNIT,
            ~np.isnan(self.spot[:, 0]),
            self.to_way_out(),
        ]
        rows = [part.reshape(len(part), -1) for part in parts]
        return np.concatenate(rows, axis=1, dtype=np.float32)

    def _points(self, points: np.ndarray, flag: np.ndarray) -> np.ndarray:
        """(B, m, 5): x, y and storeys from me, near, flag; zeros for `ABSENT_POINT`."""
        off = (points[..., :2] - self.me[:, None]) / UNIT
        up = points[..., 2:] - self.floor[:, None, None]
        close = nearness(self._way(self.map.places(points)))
        parts = [off, up, close[..., None], flag[..., None]]
        return np.concatenate(parts, axis=-1) * there(points)[..., None]

    def _way(self, place: np.ndarray) -> np.ndarray:
        """Metres on foot to places (B, m)."""
        return np.minimum(metres_between(self.map.nav, self.place[:, None], place), FAR)

    def _way_to(self, metres: np.ndarray) -> np.ndarray:
        """Metres on foot to points (B, m, 2) of my floor; to nan it is FAR."""
        place = self.map.places(np.nan_to_num(metres), self.floor[:, None])
        return np.where(np.isnan(metres[..., 0]), FAR, self._way(place))

    def _nearest_first(self, marks: np.ndarray) -> np.ndarray:
        """Sort the marks of my floor, (floors, k, 2) metres: (B, k, 2)."""
        mine = marks[self.floor]
        order = np.argsort(self._way_to(mine), axis=1, kind="stable")
        return np.take_along_axis(mine, order[..., None], axis=1)


def nearness(way: np.ndarray) -> np.ndarray:
    """1 for a way of no metres, one half at HALFWAY; 0 for what is FAR."""
    return np.where(way < FAR, 1 / (1 + way / HALFWAY), 0)


def there(points: np.ndarray) -> np.ndarray:
    """(...) bool: which points (..., 3) are not `ABSENT_POINT`?"""
    return np.asarray(points[..., 2] > -0.5)


def _within(
    metres: float, spot: np.ndarray, points: np.ndarray, which: np.ndarray | bool = True
) -> np.ndarray:
    """(B,) bool: is any of which points (B, m, 2 or 3) so near to a spot (B, 2)?"""
    off = np.nan_to_num(points[..., :2] - spot[:, None], nan=np.inf)
    return np.asarray(((lengths(off) <= metres) & which).any(axis=1))
