"""What a robot can go to: stay, rooms, ways out, groups of people.

Clauses: A3, A4, C5, C6, C7.

    k   options of one floor;  r  robots and m  people there
    d   way with flames counted, metres;  on  from there to the way out
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np

from reference.building import Building, Kind, Landmark
from reference.game.observations import Scene, decode, to_normalised
from reference.navigation import Navigation, navigation_of
from reference.paper import Scenario
from reference.robots import AT_EXIT, actual_target, instruction_for
from reference.workshop.landmarks.moment import (
    FAR,
    GROUP_RADIUS,
    GROUPS,
    Moment,
    Options,
    groups,
    one_of,
    shafts,
    stacked,
    together,
)
from reference.workshop.strategies.robots import before_stairwell
from reference.world import Instruction

FLAMES_AROUND = 7  # cells: side of the square in which a robot counts flames
STEP = 5.0  # metres: ways are also given as log(1 + d / STEP), to be compared

Point = tuple[float, float]


class RobotOption(IntEnum):
    """What a robot can go to [C5, chosen]."""

    STAY = 0  # where it is
    ROOM = 1  # the middle of a room
    STAIRWELL = 2  # one that leads down
    LANDING = 3  # before one that ends here: people come out of it
    EXIT = 4
    GROUP = 5  # a person with people around


ROBOT_FEATURES = (
    *(kind.name.lower() for kind in RobotOption),
    "east",  # metres from me, / 20
    "north",
    "way",  # metres to it, / 20
    "out",  # metres from it to its cheapest way out, / 20
    "near",  # 1 / (1 + way / STEP)
    "trip",  # 1 / (1 + (way + out) / STEP)
    "log_way",  # log(1 + way / STEP) / 2
    "log_trip",  # log(1 + (way + out) / STEP) / 2
    "people",  # people at it, / 10
    "lost",  # those of them no robot looks after, / 10
    "mine",  # people with me, / 10
    "log_gain",  # log(1 + people with me + lost ones at it) / 2
    "log_mine",  # log(1 + people with me) / 2
    "lost_here",  # share of all people: lost on my floor
    "here",  # share of all people: on my floor
    "above",  # share of all people: above it
    "on_stairs",  # people on the stairs of this stairwell, / 10
    "flames",  # share of the square around it that burns
    "my_flames",  # share of the square around me that burns
    "mate_way",  # metres from the nearest mate to it, / 20
    "mate_nearer",  # 1 if a mate is nearer to it than I am
    "best_out",  # 1 for the way out that is cheapest from me
    "time",  # share of the time limit
)
"""Features of a robot's option, all on its own floor; FAR stands for no way."""


Offer = tuple[RobotOption, Point, int]
"""What, where (metres), and the stairwell it belongs to or -1."""


@dataclass(frozen=True, eq=False)
class Fixed:
    """What a floor's map offers robots.

    kind (k,);  target (k, 2) metres;  place (k,) where a robot then goes
    shaft (k,) index of the stairwell, -1 elsewhere;  out places of all ways out
    """

    kind: np.ndarray
    target: np.ndarray
    place: np.ndarray
    shaft: np.ndarray
    out: np.ndarray


class RobotOptions:
    """Options of all robots of a world: stay, rooms, ways out, groups of people."""

    def __init__(self, building: Building, scenario: Scenario):
        """size K and features F follow from the building alone."""
        self.building, self.scenario = building, scenario
        self.navigation: Navigation = navigation_of(building)
        self.fixed, self.shaft = fixed(building), shafts(building)
        self.size = 1 + max(len(f.kind) for f in self.fixed) + GROUPS
        self.features = len(ROBOT_FEATURES)

    def __call__(self, vectors: np.ndarray, cells: np.ndarray) -> Options:
        """vectors (G, V), the robots of one world; cells, the grid they share.

        Whoever has left is told so by its own vector, and may only stay.
        """
        G, K = len(vectors), self.size
        places = np.zeros((G, K, 2), dtype=np.float32)
        features = np.zeros((G, K, self.features), dtype=np.float32)
        action_mask = np.repeat(np.arange(K)[None] == 0, G, axis=0)
        scene = decode(vectors, self.building, self.scenario)
        own = scene.robots[:, 0] if scene.robots.shape[1] else np.zeros((0, 3))
        at_work = np.flatnonzero(own[:, 2] > -0.5)
        if len(at_work):
            now = self._moment(one_of(scene, int(at_work[0])), cells)
        for floor in np.unique(own[at_work, 2]).astype(int).tolist():
            g = at_work[own[at_work, 2] == floor]
            seen = _FloorOfRobots(self, now, floor, own[g, :2].astype(np.float64))
            k = len(seen.kind)
            places[g, :k] = to_normalised(self.building, seen.target).clip(-1, 1)
            features[g, :k] = seen.features()
            action_mask[g, :k] = True
        return Options(places, features, action_mask)

    def _moment(self, scene: Scene, cells: np.ndarray) -> Moment:
        return Moment(self.navigation, self.scenario, scene, cells)


class _FloorOfRobots:
    """One floor, seen by the robots at work there.

    me      metres (r, 2) and places (r,);  people  metres (m, 2) and places (m,)
    kind    (k,);  target  (r, k, 2) metres;  place  (r, k)
    ways    (r, places) metres from each robot;  out (places,) to the cheapest way out
    mine    (r, m) bool, who is with whom;  lost  (m,) bool, with nobody
    """

    def __init__(self, options: RobotOptions, now: Moment, floor: int, me: np.ndarray):
        """me: (r, 2) metres."""
        self.in_sight = options.scenario.sight_range
        self.nav, self.now, self.floor = options.navigation, now, floor
        self.fixed, self.shaft = options.fixed[floor], options.shaft
        self.me = me, self.nav.places_at(np.full(len(me), floor), me)
        self.people = now.people_on(floor)
        cost = now.cost_on(floor)
        ways = [self.nav.distances([p], cost) for p in self.me[1].tolist()]
        self.ways = np.minimum(ways, FAR)
        self.out = np.minimum(self.nav.distances(self.fixed.out, cost), FAR)
        self.mine = self._mine()
        self.lost = np.logical_not(self.mine.any(axis=0))
        self.kind, self.target, self.place = self._choices()

    def _mine(self) -> np.ndarray:
        """(r, m) bool: who is with which robot: the nearest one, on foot, in sight.

        So it is four times in five; who follows whom is not observed.
        """
        to_people = self.ways[:, self.people[1]]
        nearest = to_people.argmin(axis=0) == np.arange(len(to_people))[:, None]
        return nearest & (to_people <= self.in_sight)

    def _choices(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stay first, then what the map offers, then groups, those of lost people."""
        near = together(self.nav, self.people, self.people, GROUP_RADIUS)
        heads = groups(near, self.lost, GROUPS)
        fixed, r = self.fixed, len(self.me[0])
        kind = [RobotOption.STAY, *fixed.kind, *[RobotOption.GROUP] * len(heads)]
        target = np.concatenate([fixed.target[:1], fixed.target, self.people[0][heads]])
        place = np.concatenate([fixed.place[:1], fixed.place, self.people[1][heads]])
        target, place = np.repeat(target[None], r, 0), np.repeat(place[None], r, 0)
        target[:, 0], place[:, 0] = self.me
        return np.array(kind, dtype=int), target, place

    def features(self) -> np.ndarray:
        """(r, k, F), in the order of ROBOT_FEATURES."""
        east, north = np.moveaxis((self.target - self.me[0][:, None]) / 20, -1, 0)
        return stacked(
            ROBOT_FEATURES,
            self.place.shape,
            {kind.name.lower(): self.kind == kind for kind in RobotOption}
            | {"east": east, "north": north}
            | self._ways()
            | self._people()
            | self._surroundings(),
        )

    def _ways(self) -> dict[str, np.ndarray]:
        """How far it is, for me and for mates."""
        r = np.arange(len(self.place))
        d, on = self.ways[r[:, None], self.place], self.out[self.place]
        mates = self.ways[:, self.place]
        mates[r, r] = FAR
        mate = mates.min(axis=0)
        leads_out = np.isin(self.kind, (RobotOption.STAIRWELL, RobotOption.EXIT))
        way_out = np.where(leads_out, d, np.inf)
        return {
            "way": d / 20,
            "out": on / 20,
            "near": 1 / (1 + d / STEP),
            "trip": 1 / (1 + (d + on) / STEP),
            "log_way": np.log1p(d / STEP) / 2,
            "log_trip": np.log1p((d + on) / STEP) / 2,
            "mate_way": mate / 20,
            "mate_nearer": mate < d,
            "best_out": leads_out & (way_out == way_out.min(axis=1, keepdims=True)),
        }

    def _people(self) -> dict[str, np.ndarray]:
        """Who is there, and with me."""
        r, k = self.place.shape
        options = self.target.reshape(-1, 2), self.place.ravel()
        at = together(self.nav, options, self.people, GROUP_RADIUS).reshape(r, k, -1)
        lost = (at & self.lost).sum(axis=-1)
        mine = self.mine.sum(axis=1)[:, None]
        return {
            "people": at.sum(axis=-1) / 10,
            "lost": lost / 10,
            "mine": mine / 10,
            "log_gain": np.log1p(mine + lost) / 2,
            "log_mine": np.log1p(mine) / 2,
            "on_stairs": self._on_stairs() / 10,
        }

    def _on_stairs(self) -> np.ndarray:
        """(k,) people on the stairs of each stairwell, 0 for other options."""
        shafts = self.shaft[self.now.place[~self.now.walking]]
        counts = np.zeros(len(self.kind))
        mine = self.fixed.shaft
        counts[1 : 1 + len(mine)] = (mine[:, None] == shafts).sum(axis=1) * (mine >= 0)
        return counts

    def _surroundings(self) -> dict[str, np.ndarray]:
        """Flames and the floor as a whole."""
        around, occupancy = self.now.flames_around(FLAMES_AROUND), self.now.occupancy
        return {
            "flames": around[self.place],
            "my_flames": around[self.me[1]][:, None],
            "lost_here": self.lost.sum() / self.now.everybody,
            "here": occupancy[self.floor] / self.now.everybody,
            "above": occupancy[self.floor + 1 :].sum() / self.now.everybody,
            "time": np.array(self.now.time),
        }


@lru_cache(maxsize=8)
def fixed(building: Building) -> tuple[Fixed, ...]:
    """What each floor's map offers robots."""
    return tuple(_fixed(building, floor) for floor in range(building.floors))


def _fixed(building: Building, floor: int) -> Fixed:
    nav = navigation_of(building)
    found = [*_rooms(building, floor), *_wells(building, floor)]
    for mark in building.landmarks:
        if mark.kind is Kind.EXIT and mark.floor == floor:
            found.append((RobotOption.EXIT, _exit_spot(building, mark), -1))
    ends = [actual_target(building, floor, x, y) for _, (x, y), _ in found]
    outs = [building.landmarks[m].cells for m in building.ways_out(floor)]
    return Fixed(
        kind=np.array([kind for kind, _, _ in found], dtype=int),
        target=np.array([point for _, point, _ in found]).reshape(-1, 2),
        place=np.array([nav.nearest_free(floor, *end) for end in ends], dtype=int),
        shaft=np.array([shaft for _, _, shaft in found], dtype=int),
        out=nav.places_of(floor, np.concatenate([np.zeros((0, 2), int), *outs])),
    )


def _rooms(building: Building, floor: int) -> Iterator[Offer]:
    """Of each room the cell nearest to its centre."""
    nav = navigation_of(building)
    for room in building.rooms(floor):
        points = nav.centres[nav.places_of(floor, room.cells)]
        x, y = points[np.argmin(np.hypot(*(points - room.centre).T))].tolist()
        yield RobotOption.ROOM, (x, y), -1


def _wells(building: Building, floor: int) -> Iterator[Offer]:
    """Into the stairs where they lead down, before them where they end."""
    for shaft, well in enumerate(building.stairwells):
        if floor - 1 in well.areas:
            yield RobotOption.STAIRWELL, _well_spot(building, shaft), shaft
        elif floor in well.areas:
            spot = before_stairwell(building, floor, shaft)
            yield RobotOption.LANDING, spot, shaft


def _well_spot(building: Building, shaft: int) -> Point:
    """The point of the main body nearest to a stairwell: Eq. 1 leads inside [C6]."""
    x, y = building.stairwells[shaft].centre
    left, bottom, right, top = building.body
    return min(max(x, left), right), min(max(y, bottom), top)


def _exit_spot(building: Building, exit_: Landmark) -> Point:
    """A point near an exit that means this exit and no stairwell beside it [C6] [C7].

    The exit itself, unless Eq. 1 leads away from there.
    """
    points = navigation_of(building).centres[: building.kind[0].size]
    off = np.hypot(*(points - exit_.position).T)
    near = points[np.argsort(off, kind="stable")[: int((off <= AT_EXIT).sum())]]
    for point in [exit_.position, *((float(x), float(y)) for x, y in near)]:
        target = actual_target(building, exit_.floor, *point)
        told = instruction_for(building, exit_.floor, target)
        if told is Instruction.THIS_EXIT:
            return point
    return exit_.position
