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

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from reference import paper
from reference.building import Building, lengths
from reference.game.codec import PolicyCodec, Sizes
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
CROWD = 10.0  # people who count as one, in the numbers that a network reads
HALFWAY = 5.0  # [C4, chosen] metres on foot that are half as near as none
NEAREST_PEOPLE = 6  # [C5, chosen] anchors at people
ASTRAY = 8.0  # [C5, chosen] metres: hardly anybody goes farther between decisions

KEEP = 0
WAIT = 1
FIRST_MARK = 2
"""The first anchors: where a robot is headed, and where it stands; then the map's."""


@dataclass(frozen=True, kw_only=True)
class AnchorSizes(Sizes):
    """Shapes of a network whose head weighs anchors, and what else that head is told.

    anchors     K; their C numbers each, and K numbers, 1 for those that may be chosen
                now, stand first in what the network reads
    spread      metres, standard deviation around each
    commitment  logit bonus of the anchor KEEP
    """

    anchors: int
    spread: float
    commitment: float


def to_normalised(building: Building, metres: np.ndarray) -> np.ndarray:
    """Convert metres (..., 2) so that the main body is [-1, 1] x [-1, 1]."""
    low, high = np.reshape(building.body, (2, 2))
    return (metres - (low + high) / 2) / ((high - low) / 2)


def in_body(building: Building, metres: np.ndarray) -> np.ndarray:
    """Clip metres (..., 2) to the main body."""
    low, high = np.reshape(building.body, (2, 2))
    return metres.clip(low, high)


def fire_decisions(building: Building, raw: np.ndarray) -> np.ndarray:
    """Read floor and metres (..., 3) from a network's storey, x and y (..., 3) [D2]."""
    floor = raw[..., :1].round().clip(0, building.floors - 1)
    metres = in_body(building, UNIT * raw[..., 1:].astype(np.float64))
    return np.concatenate([floor, metres], axis=-1)


def robot_destinations(*worlds: World) -> np.ndarray:
    """Find where robots under way go to: (robots, 2) float32 normalised, else nan.

    The actual target of their last decision (Eq. 1), clipped to the main body: deciding
    it again changes nothing. worlds: of one building, one after the other
    """
    nowhere = [np.nan, np.nan]
    spots = [
        nowhere
        if robot.destination is None or not robot.way
        else robot.destination.tolist()
        for world in worlds
        for robot in world.robots
    ]
    metres = np.array(spots, dtype=np.float64).reshape(-1, 2)
    return to_normalised(worlds[0].building, metres).clip(-1, 1).astype(np.float32)


class RobotView:
    """What robots observe, in their frames.

    What is seen: people first, then robots (me first), then fires.
    points  (B, n + R + F, 3) metres and storey
    of_people, of_robots, of_fires  slices: which columns of points are theirs
    there   (B, n + R + F) bool: which are not `ABSENT_POINT`
    places  (B, n + R + F) where they stand
    far     (B, n + R + F) metres on foot from me

    Me.
    me, floor, place  (B, 2) metres, (B,), (B,): where I stand
    destination  (B, 2) metres, nan for none: where I am headed [C6]
    to_way_out   (B,) bool: headed to a way out [C7]

    People, (B, n) in the order of the vector.
    alone   bool: nobody leads them;  lost  bool: those of them on my floor
    led     bool: somebody leads them;  mine  bool: on my floor, and I lead them
    order   indices of people in the order of the frame

    Marks of the map on my floor.
    marks   (B, m, 2) metres, nan for none: ways out and feet of stairs, each nearest
            first; then places to guard in the map's order, so that each keeps its
            number
    of_outs, of_feet, of_rims  slices: which columns of marks are of this kind
    to_marks  (B, m) metres on foot;  headed_to  (B, m) bool: where I am headed

    Anchors.
    spots   (B, K, 2) metres;  anchors  (B, K, 2) the same from me, in units
    way     (B, K) metres on foot;  allowed  (B, K) bool
    """

    def __init__(
        self, codec: PolicyCodec, vectors: np.ndarray, headed: np.ndarray, masks: bool
    ):
        """vectors (B, layout.size): observed; headed (B, 2): `robot_destinations`.

        masks: forbid what helps nobody, see `helpful`.
        """
        self.scenario = codec.scenario
        self.map = known_map_of(codec.building)
        self.masks = masks
        blocks = codec.layout.blocks
        self.seen = {name: codec.layout.block_of(vectors, name) for name in blocks}
        # Metres in float64, as the simulation has them.
        parts = [self.seen[name] for name in ("humans", "robots", "fires")]
        self.points = np.concatenate(parts, axis=1, dtype=np.float64)
        slices = _slices(part.shape[1] for part in parts)
        self.of_people, self.of_robots, self.of_fires = slices
        self.there = self.points[..., 2] > -0.5

        # where all of it is, and how far from me
        own = self.points[:, self.of_robots][:, 0]
        self.me = own[:, :2]
        self.floor = own[:, 2].round().clip(0).astype(int)
        self.destination = from_normalised(codec.building, headed.astype(np.float64))
        aim = np.column_stack([np.nan_to_num(self.destination), self.floor])
        places = self.map.places(np.concatenate([self.points, aim[:, None]], axis=1))
        self.place = places[:, self.of_robots][:, 0]
        places = np.concatenate([places, self.map.mark_places[self.floor]], axis=1)
        way = metres_between(self.map.nav, self.place[:, None], places)
        way = np.minimum(way, FAR)
        n = self.points.shape[1]
        self.far, to_destination, to_marks = np.split(way, [n, n + 1], axis=1)

        self.places = places[:, :n]
        self._sort_people(places)
        self._sort_marks(to_marks)
        self._find_anchors(to_destination)

    def _sort_people(self, places: np.ndarray) -> None:
        """Sort people: lost ones, mine, my mates', others; the nearest first [C4].

        places: (B, n + R + F + 1 + m), of points, where one is headed, and marks
        """
        place = places[:, self.of_people]
        inside = self.there[:, self.of_people]
        walking = inside & ~self.map.stairs[place]
        robots = places[:, self.of_robots]
        at_work = self.there[:, self.of_robots]
        headed = self._headed()
        guide = guess_guides(self.map.nav, robots, at_work, place, walking, headed)
        storey = self.points[:, self.of_people, 2].round()
        here = walking & (storey == self.floor[:, None])
        self.alone = walking & (guide == NOBODY)
        self.led = walking & (guide != NOBODY)
        self.lost = here & self.alone
        self.mine = here & (guide == 0)

        groups = [self.lost, self.mine, here, inside]  # at last those out or dead
        group = np.select(groups, range(len(groups)), len(groups))
        way = np.where(here, self.far[:, self.of_people], FAR)
        self.order = np.lexsort((way, group), axis=1)

    def _headed(self) -> np.ndarray | None:
        """(B, R) places where robots are headed; None: a robot knows its own alone."""
        return None

    def _sort_marks(self, way: np.ndarray) -> None:
        """Sort ways out and feet, each kind by metres on foot (B, m); rims stay."""
        marks = self.map.marks[self.floor]
        self.of_outs, self.of_feet, self.of_rims = _slices(self.map.kinds)
        way = np.where(np.isnan(marks[..., 0]), FAR, way)
        order = self._order_of_marks(way)
        each = np.arange(len(order))[:, None]
        self.marks = marks[each, order]
        self.to_marks = way[each, order]

        off = lengths(self.marks - self.destination[:, None])
        self.headed_to = off <= paper.AT_EXIT_METRES
        self.to_way_out = self.headed_to[:, self.of_outs].any(axis=1)

    def _order_of_marks(self, way: np.ndarray) -> np.ndarray:
        """(B, m) indices of marks in the order in which they are told."""
        kind = np.repeat(range(3), self.map.kinds)
        key = np.where(kind < 2, way, 0.0)
        return np.lexsort((key, np.broadcast_to(kind, key.shape)), axis=1)

    def _find_anchors(self, to_destination: np.ndarray) -> None:
        """List anchors: keep, stay, ways out, feet, rims, nearest lost people [C5].

        to_destination: (B, 1) metres to where each is headed
        """
        first, lost = self._people_at_anchors()
        each = np.arange(len(first))[:, None]
        people = np.where(lost[..., None], self.points[each, first, :2], np.nan)
        to_people = np.where(lost, self.far[each, first], FAR)

        headed = self.destination[:, None]
        here = self.me[:, None]
        to_destination = np.where(np.isnan(headed[..., 0]), FAR, to_destination)
        parts = [headed, here, self.marks, people]  # KEEP, WAIT, ...
        ways = [to_destination, 0 * to_destination, self.to_marks, to_people]
        self.spots = np.concatenate(parts, axis=1)
        self.way = np.concatenate(ways, axis=1)
        self.allowed = ~np.isnan(self.spots[..., 0])
        off = (self.spots - here) / UNIT
        self.anchors: np.ndarray = np.where(self.allowed[..., None], off, 0.0)
        if self.masks:
            self.allowed &= self.helpful()
        self.allowed[:, WAIT] = True  # a mixture of nothing has no logarithm

    def _people_at_anchors(self) -> tuple[np.ndarray, np.ndarray]:
        """(B, k) indices of people, the nearest lost; and which of them are lost."""
        first = self.order[:, :NEAREST_PEOPLE]
        each = np.arange(len(first))[:, None]
        return first, self.lost[each, first]

    def helpful(self) -> np.ndarray:
        """(B, K) bool: False masks useless anchors.

        Ways out help a robot that leads somebody. The old destination (KEEP) helps

        * if it is a way out: while the robot leads somebody;
        * if it is a foot of stairs or a rim: always, since it waits or guards there;
        * elsewhere: while somebody lost is within ASTRAY of it.

        All other anchors help. Rims do: who guards a way out [D6] leads nobody.
        """
        leads = self.mine.any(axis=1)
        helps = np.ones_like(self.allowed)
        helps[:, FIRST_MARK:][:, self.of_outs] = leads[:, None]

        # the old destination
        people = self.points[:, self.of_people, :2]
        near = lengths(people - self.destination[:, None]) <= ASTRAY
        near_lost = (near & self.lost).any(axis=1)
        to_foot = self.headed_to[:, self.of_feet].any(axis=1)
        to_rim = self.headed_to[:, self.of_rims].any(axis=1)
        keeps = np.where(self.to_way_out, leads, to_foot | near_lost)
        helps[:, KEEP] = keeps | to_rim
        return helps

    def numbers(self) -> np.ndarray:
        """(B, V) float32, what a network reads; in the order of `parts`."""
        known = self._points_from_me()
        each = np.arange(len(known))[:, None]
        floors = np.arange(len(self.map.free))
        storeys = self.points[:, self.of_people, 2:].round()
        time = self.seen["time"]
        step = self.scenario.decision_seconds
        parts = [
            self.anchors,
            self.allowed,
            known[each, self.order],
            known[:, self.of_robots][:, 1:],
            known[:, self.of_fires],
            nearness(self.way),
            self.way / UNIT,
            (storeys == floors).sum(axis=1) / CROWD,
            self.seen["fires_per_floor"],
            self.floor[:, None] == floors,
            time / self.scenario.time_limit,
            decisions_to_next_fire(time, step) / paper.FIRE_EVERY_DECISIONS,
            self.mine.sum(axis=1) / CROWD,
            self.lost.sum(axis=1) / CROWD,
            ~np.isnan(self.destination[:, 0]),
            self.to_way_out,
        ]
        rows = [part.reshape(len(part), -1) for part in parts]
        return np.concatenate(rows, axis=1, dtype=np.float32)

    def _points_from_me(self) -> np.ndarray:
        """(B, n + R + F, 5): x, y and storeys from me, near, flag; else zeros.

        The flag of people: nobody leads them; of others: they are there.
        """
        flag = self.there.copy()
        flag[:, self.of_people] = self.alone
        known = np.empty((*flag.shape, 5))
        known[..., :2] = (self.points[..., :2] - self.me[:, None]) / UNIT
        known[..., 2] = self.points[..., 2] - self.floor[:, None]
        known[..., 3] = nearness(self.far)
        known[..., 4] = flag
        return known * self.there[..., None]


def nearness(way: np.ndarray) -> np.ndarray:
    """1 for a way of no metres, one half at HALFWAY; 0 for what is FAR."""
    return np.where(way < FAR, 1 / (1 + way / HALFWAY), 0)


def _slices(counts: Iterable[int]) -> list[slice]:
    """Slices of parts that stand side by side, so many numbers each."""
    ends = [0, *accumulate(counts)]
    return [slice(first, last) for first, last in pairwise(ends)]
