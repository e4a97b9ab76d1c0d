"""Options of a robot: groups of people, ways out, the foot of stairs.

Clauses: A3, A4, C5, C6, C7.  Left out [C5, chosen] are a way out for a robot that leads
nobody; rooms, since it is observed where people are; a place whose group has gone; and
the robot's own place, while there is another option. With them robots learned to pace
before an exit and to wait for whoever finds it.

    k   options of one floor;  r  robots and m  people there
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np

from reference.building import Building, Kind
from reference.game.environment import DECIMALS
from reference.game.moments import Choices, Moment
from reference.game.observations import from_normalised, to_normalised
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.robots import Destination, actual_target, at_exit, before_stairwell
from reference.workshop.decoding import decode
from reference.workshop.landmarks import shared
from reference.workshop.traffic import places_out

OWN = 2  # options of the robot itself: keep and stay
FLAMES_AROUND = 7  # cells: side of the square in which a robot counts flames
THERE = 1.5  # [C5, chosen] metres on foot within which a robot is there already
TIE = 2.0  # metres: of two robots this close, the first of the team counts as nearer
ASTRAY = 8.0  # [C5, chosen] metres: hardly anybody goes farther between decisions
STEP = 5.0  # metres: ways are also given as log(1 + way / STEP), to be compared


class RobotOption(IntEnum):
    """What a robot can go to [C5, chosen]."""

    KEEP = 0  # the destination it has, while under way; people there may have moved
    STAY = 1  # where it is, if there is nowhere else to go
    STAIRWELL = 2  # one that leads down
    LANDING = 3  # before one that ends here: people come out of it
    EXIT = 4
    GROUP = 5  # a person with people around


ROBOT_TABLE: shared.FeatureTable = {
    **shared.one_hot(RobotOption.__members__),
    "east": lambda v: v.off[..., 0] / 20,  # metres from me
    "north": lambda v: v.off[..., 1] / 20,
    "way": lambda v: v.way / 20,  # metres to it
    "out": lambda v: v.out / 20,  # metres from it to its cheapest way out
    "near": lambda v: 1 / (1 + v.way / STEP),
    "trip": lambda v: 1 / (1 + (v.way + v.out) / STEP),
    "log_way": lambda v: np.log1p(v.way / STEP) / 2,
    "log_trip": lambda v: np.log1p((v.way + v.out) / STEP) / 2,
    "people": lambda v: v.people_there / 10,  # at it
    "lost": lambda v: v.lost_there / 10,  # those of them no robot looks after
    "mine": lambda v: v.with_me / 10,  # people with me
    "log_gain": lambda v: np.log1p(v.with_me + v.lost_there) / 2,
    "log_mine": lambda v: np.log1p(v.with_me) / 2,
    "lost_here": lambda v: v.lost.sum() / v.now.everybody,  # on my floor
    "here": lambda v: v.now.occupancy[v.floor] / v.now.everybody,
    "above": lambda v: v.now.above[v.floor] / v.now.everybody,
    "on_stairs": lambda v: v.on_stairs / 10,  # people in this stairwell
    "flames": lambda v: v.flames[v.place],  # share of the square around it
    "my_flames": lambda v: v.flames[v.me[1]][:, None],  # ... around me
    "mate_way": lambda v: v.mate_way / 20,  # metres from the nearest mate to it
    "mate_nearer": lambda v: v.mate_nearer,
    "best_out": lambda v: v.best_out,  # 1 for the way out that is cheapest from me
    "time": lambda v: v.now.time,  # share of the time limit
}
"""Features of a robot's option, all on its own floor; FAR stands for no way."""

ROBOT_FEATURES = tuple(ROBOT_TABLE)


class RobotOptions:
    """Options of all robots of a world."""

    def __init__(self, building: Building, scenario: Scenario):
        """size O and features F follow from the building alone."""
        self.building, self.scenario = building, scenario
        self.navigation = navigation_of(building)
        self.fixed = [
            fixed_options(building, floor) for floor in range(building.floors)
        ]
        most = max(len(fixed.kind) for fixed in self.fixed)
        self.size = OWN + most + shared.GROUPS
        self.features = len(ROBOT_FEATURES)

    def __call__(self, moment: Moment) -> Choices:
        """Make the options of all robots of one world.

        A robot that has left reads this from its own vector, and may only stay.
        """
        vectors, headed = moment.vectors, moment.headed
        G, size = len(vectors), self.size
        places = np.zeros((G, size, 2), dtype=np.float32)
        features = np.zeros((G, size, self.features), dtype=np.float32)
        action_mask = np.repeat(np.arange(size)[None] == RobotOption.STAY, G, axis=0)
        own = decode(vectors, self.building, self.scenario).robots[:, :1].reshape(-1, 3)
        at_work = np.flatnonzero(own[:, 2] > -0.5)
        if len(at_work):
            decoded = decode(vectors[at_work[0]], self.building, self.scenario)
            now = shared.Snapshot(self.navigation, self.scenario, decoded, moment.grid)
        for floor in np.unique(own[at_work, 2]).astype(int).tolist():
            g = at_work[own[at_work, 2] == floor]
            view = RobotView(self, now, floor, own[g, :2].astype(float), headed[g])
            k = len(view.kind)
            places[g, :k] = to_normalised(self.building, view.target).clip(-1, 1)
            features[g, :k] = shared.evaluate(ROBOT_TABLE, view)
            action_mask[g, :k] = view.offered
        return Choices(places, features, action_mask)


class RobotView:
    """One floor as its robots at work see it; ROBOT_TABLE reads the attributes.

    me      metres (r, 2) and places (r,);  people  metres (m, 2) and places (m,)
    kind    (k,), leads_out (k,) bool;  target  (r, k, 2) metres;  place  (r, k)
    way     (r, k) metres on foot from each robot, flames counted;  out  (r, k) from
            there to the cheapest way out;  mate_way  (r, k) from the nearest mate
    mate_nearer  (r, k) bool; of two that stand together only one has a nearer mate:
            they see the same and would otherwise do the same
    offered (r, k) bool, whether a robot may choose it;  keeps (r,) bool, the first one
    lost    (m,) bool, people with no robot;  with_me  (r, 1) people
    """

    def __init__(
        self,
        options: RobotOptions,
        now: shared.Snapshot,
        floor: int,
        me: np.ndarray,
        headed: np.ndarray,
    ):
        """me: (r, 2) metres; headed: as a `Moment` says."""
        self.nav, self.now, self.floor = options.navigation, now, floor
        self.fixed = options.fixed[floor]
        self.me = me, self.nav.places_at(np.full(len(me), floor), me)
        self.people = now.people_on(floor)
        cost = now.cost_on(floor)
        each = [self.nav.distances([p], cost) for p in self.me[1].tolist()]
        out = self.nav.distances(places_out(now.building, floor), cost)
        self._assign_people(options.scenario.sight_range)
        self._choose()
        self._keep(headed)
        self._measure_ways(*(np.minimum(d, shared.FAR) for d in (each, out)))
        self._offer()
        self._count_people()
        self.flames = now.flames_around(FLAMES_AROUND)

    def _assign_people(self, in_sight: float) -> None:
        """Assign people to the nearest robot on foot, if it is in sight.

        Flames do not count: those beside them follow too. Who follows whom is not
        observed; the guess is right nineteen times in twenty.
        """
        metres = [self.nav.distances([p]) for p in self.me[1].tolist()]
        to_people = np.array(metres)[:, self.people[1]]
        nearest = to_people.argmin(axis=0) == np.arange(len(to_people))[:, None]
        mine = nearest & (to_people <= in_sight)
        self.lost = np.logical_not(mine.any(axis=0))
        self.with_me = mine.sum(axis=1)[:, None]

    def _choose(self) -> None:
        """List options: the robot's OWN, those of the map, groups of lost people."""
        near = shared.near_in_sight(self.nav, self.people, self.people)
        centres = shared.group_centres(near, self.lost)
        fixed, r = self.fixed, len(self.me[0])
        groups = [RobotOption.GROUP] * len(centres)
        kind = [RobotOption.KEEP, RobotOption.STAY, *fixed.kind, *groups]
        metres, places = self.people
        target = np.concatenate([np.zeros((OWN, 2)), fixed.target, metres[centres]])
        place = np.concatenate([np.zeros(OWN, int), fixed.place, places[centres]])
        self.kind = np.array(kind, dtype=int)
        self.leads_out = np.isin(self.kind, (RobotOption.STAIRWELL, RobotOption.EXIT))
        self.target, self.place = (np.repeat(a[None], r, 0) for a in (target, place))
        self.target[:, :OWN], self.place[:, :OWN] = (a[:, None] for a in self.me)

    def _keep(self, headed: np.ndarray) -> None:
        """Find where robots under way go on to, and whether it may help somebody.

        People walk on: a robot on the way to some goes after the lost one nearest to
        where they were. Where nobody is lost any more, there is nobody to go to.
        """
        spots = from_normalised(self.now.building, headed.astype(float))
        metres, places = (known[self.lost] for known in self.people)
        self.keeps = ~np.isnan(headed[:, 0])
        for k in np.flatnonzero(self.keeps).tolist():
            spot = spots[k]
            named = spot.round(DECIMALS).tolist()
            end = actual_target(self.now.building, self.floor, *named)
            place = self.nav.nearest_free(self.floor, *end)
            fixed = np.flatnonzero(self.fixed.place == place)
            if len(fixed):
                leads_out = self.leads_out[OWN + fixed].any()
                self.keeps[k] = self.with_me[k, 0] > 0 or not leads_out
            else:
                off = np.hypot(*(metres - spot).T)
                self.keeps[k] = off.min(initial=np.inf) <= ASTRAY
                if self.keeps[k]:
                    spot, place = metres[off.argmin()], places[off.argmin()]
            self.target[k, 0], self.place[k, 0] = spot, place

    def _measure_ways(self, ways: np.ndarray, out: np.ndarray) -> None:
        """Measure robots' and mates' ways; ways (r, places), out (places,) metres."""
        self.off = self.target - self.me[0][:, None]
        r = np.arange(len(self.place))
        self.way, self.out = ways[r[:, None], self.place], out[self.place]
        mates = ways[:, self.place]
        mates[r, r] = shared.FAR
        self.mate_way = mates.min(axis=0)
        earlier = np.sign(r - r[:, None])[:, :, None]  # 1: than the robot that asks
        self.mate_nearer = (mates - TIE * earlier < self.way).any(axis=0)
        way_out = np.where(self.leads_out, self.way, np.inf)
        nearest = way_out.min(axis=1, keepdims=True)
        self.best_out = self.leads_out & (way_out == nearest)

    def _offer(self) -> None:
        """Offer options that lead elsewhere; ways out to those who lead people."""
        self.offered = self.way >= THERE
        self.offered &= (self.with_me > 0) | ~self.leads_out
        self.offered[:, RobotOption.KEEP] = self.keeps
        self.offered[:, RobotOption.STAY] = ~self.offered.any(axis=1)

    def _count_people(self) -> None:
        """Count people at each option, (r, k), and in each stairwell, (k,)."""
        r, k = self.place.shape
        options = self.target.reshape(-1, 2), self.place.ravel()
        there = shared.near_in_sight(self.nav, options, self.people).reshape(r, k, -1)
        self.people_there = there.sum(axis=-1)
        self.lost_there = (there & self.lost).sum(axis=-1)
        mine = self.fixed.shaft
        self.on_stairs = np.zeros(k)
        self.on_stairs[OWN : OWN + len(mine)] = (
            mine[:, None] == self.now.on_stairs
        ).sum(1)


# -- Options that do not change -----------------------------------------------------


@dataclass(frozen=True, eq=False)
class FixedOptions:
    """Options of a floor that never change: stairwells and exits.

    kind (k,);  target (k, 2) metres;  place (k,) where a robot then goes
    shaft (k,) index of the stairwell, -1 elsewhere
    """

    kind: np.ndarray
    target: np.ndarray
    place: np.ndarray
    shaft: np.ndarray


@lru_cache(maxsize=64)
def fixed_options(building: Building, floor: int) -> FixedOptions:
    """Find where robots go for each stairwell and exit of a floor."""
    nav = navigation_of(building)
    found = list(_found_on(building, floor))
    ends = [actual_target(building, floor, x, y) for _, (x, y), _ in found]
    return FixedOptions(
        kind=np.array([kind for kind, _, _ in found], dtype=int),
        target=np.array([point for _, point, _ in found]).reshape(-1, 2),
        place=np.array([nav.nearest_free(floor, *end) for end in ends], dtype=int),
        shaft=np.array([shaft for _, _, shaft in found], dtype=int),
    )


def _found_on(
    building: Building, floor: int
) -> Iterator[tuple[RobotOption, Destination, int]]:
    """Yield an option's kind, its point, and its stairwell or -1.

    Where stairs lead down, the nearest point of the main body: Eq. 1 leads inside [C6];
    where they end, before them.
    """
    for shaft, well in enumerate(building.stairwells):
        if well.leads_down(floor):
            low, high = np.reshape(building.body, (2, 2))
            x, y = np.clip(well.centre, low, high).tolist()
            yield RobotOption.STAIRWELL, (x, y), shaft
        elif floor in well.areas:
            before = before_stairwell(building, floor, shaft)
            yield RobotOption.LANDING, before, shaft
    for mark in building.landmarks:
        if mark.kind is Kind.EXIT and mark.floor == floor:
            yield RobotOption.EXIT, at_exit(building, mark), -1
