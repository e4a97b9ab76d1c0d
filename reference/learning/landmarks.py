"""What a pointer head chooses among: landmarks, computed from the observation.

Clauses: A3, A4, C1, C3, C5, C6, C7, D1, D2, D6.  [C5, chosen] [D2, chosen] A pointer
head scores options by their features, and the coordinates of the one it chooses are
the action, which stays two floats.  A policy is trained for one building, so its map
may be used; of what changes, only the observation is.

    G   agents;  K  options, their number fixed per building;  F  features of an option
    k   options of one floor;  r  robots and m  people there
    p   place;  d  way with flames counted, metres;  spot  in half-bodies
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from scipy import ndimage

from reference.building import Building, Kind, Landmark
from reference.fire import beside_flames, cost_of
from reference.learning.observations import (
    Scene,
    burning,
    decode,
    decode_fire,
    to_half_bodies,
)
from reference.navigation import Navigation, prepared
from reference.paper import Scenario
from reference.robots import AT_EXIT, actual_target, before_stairwell, instruction_for
from reference.world import Instruction

FAR = 100.0  # metres: whatever is farther, or cannot be reached, counts as so far
GROUPS = 8  # at most so many groups of people, on a floor or, for the fire, in all
GROUP_RADIUS = 4.0  # metres: who stands so near, and in sight, is of the same group
FLAMES_AROUND = 7  # cells: side of the square in which a robot counts flames
STEP = 5.0  # metres: ways are also given as log(1 + d / STEP), to be compared

Point = tuple[float, float]


@dataclass(frozen=True)
class Options:
    """What agents choose among.

    places    (G, K, A) float32, the action each option emits, in [-1, 1]
    features  (G, K, F) float32, about 1
    allowed   (G, K) bool, False for padding; at least one is True in a row
    """

    places: np.ndarray
    features: np.ndarray
    allowed: np.ndarray


class Moment:
    """What an observation says, on the map.

    at       (n, 2) metres, floor (n,), place (n,) of all people inside
    walking  (n,) bool, on a floor and not on the stairs
    robots   (R, 2) metres of robots at work, robot_floor (R,), robot_place (R,)
    burning  (floors, rows, cols) bool
    cost     metres that a metre counts as, the same shape
    time     share of the time limit
    """

    def __init__(
        self, nav: Navigation, scenario: Scenario, scene: Scene, cells: np.ndarray
    ):
        """scene: one agent's, not a batch; cells: the grid."""
        building = self.building = nav.building
        self.everybody = max(1, sum(scenario.start_counts(building.floors)))
        self.time = scene.time.item() / scenario.time_limit
        self.at, self.floor, self.place = _on_the_map(nav, scene.humans)
        self.robots, self.robot_floor, self.robot_place = _on_the_map(nav, scene.robots)
        self.walking = building.kind.ravel()[self.place] != Kind.STAIRS
        self.burning = burning(cells, building)
        self.cost = cost_of(self.burning, beside_flames(building, self.burning))
        self.flames = np.asarray(self.burning.any(axis=(1, 2)))
        self._around: dict[int, np.ndarray] = {}
        self.occupancy = np.bincount(self.floor, minlength=building.floors)

    def people_on(self, floor: int) -> tuple[np.ndarray, np.ndarray]:
        """Metres (m, 2) and places (m,) of those who walk on a floor."""
        here = self.walking & (self.floor == floor)
        return self.at[here], self.place[here]

    def cost_on(self, floor: int) -> np.ndarray | None:
        """As robots plan their ways: None on a floor without flames."""
        return self.cost if self.flames[floor] else None

    def free_rooms(self) -> np.ndarray:
        """(places,) bool: where a fire can break out and somebody is there to harm.

        Room cells with neither flames nor human nor robot [D6], on floors on or above
        which somebody is.
        """
        at_stake = self.occupancy[::-1].cumsum()[::-1] > 0
        free = (self.building.kind == Kind.FLOOR) & ~self.burning
        free = (free & at_stake[:, None, None]).ravel()
        free[self.place] = False
        free[self.robot_place] = False
        return free

    def flames_around(self, side: int) -> np.ndarray:
        """(places,) share of the square of so many cells around that burns."""
        if side not in self._around:
            share = self.burning.astype(np.float32)
            if self.flames.any():
                share = ndimage.uniform_filter(share, (0, side, side), mode="constant")
            self._around[side] = share.ravel()
        return self._around[side]


def _on_the_map(
    nav: Navigation, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Metres (k, 2), floors (k,) and places (k,) of those who are there.

    In an order that does not depend on theirs: by floor, then from west to east.
    """
    points = points[np.flatnonzero(points[:, 2] > -0.5)].astype(np.float64)
    points = points[np.lexsort((points[:, 1], points[:, 0], points[:, 2]))]
    floor = np.rint(points[:, 2]).astype(np.int64)
    return points[:, :2], floor, nav.places_at(floor, points[:, :2])


def together(
    nav: Navigation,
    one: tuple[np.ndarray, np.ndarray],
    other: tuple[np.ndarray, np.ndarray],
    radius: float,
) -> np.ndarray:
    """(a, b) bool: so near each other, and no wall between them.

    one, other: metres (a, 2) and places (a,), metres (b, 2) and places (b,), of the
    same floor; radius: metres, at most navigation's LOOK_AHEAD.
    """
    off = one[0][:, None] - other[0]
    near = (off**2).sum(axis=-1) <= radius**2
    a, b = np.nonzero(near)
    near[a, b] = nav.clear.reaches(one[1][a], other[1][b])
    return near


def groups(near: np.ndarray, count: np.ndarray, most: int) -> list[int]:
    """Heads of at most so many groups, the largest first.

    near: (m, m) bool, who stands with whom; count: (m,) whether a person counts for
    the size of a group. Greedy: those around a head are in no other group.
    """
    heads: list[int] = []
    left = np.ones(len(near), dtype=bool)
    for _ in range(most):
        if not left.any():
            break
        size = near @ (left * (count + 1e-3))
        heads.append(int(np.argmax(np.where(left, size, -1.0))))
        left &= ~near[heads[-1]]
    return heads


# -- The robots' options ------------------------------------------------------------


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
        self.navigation: Navigation = prepared(building)
        self.fixed, self.shaft = fixed(building), _shafts(building)
        self.size = 1 + max(len(f.kind) for f in self.fixed) + GROUPS
        self.features = len(ROBOT_FEATURES)

    def __call__(self, vectors: np.ndarray, cells: np.ndarray) -> Options:
        """vectors (G, V), the robots of one world; cells, the grid they share.

        Whoever has left is told so by its own vector, and may only stay.
        """
        G, K = len(vectors), self.size
        places = np.zeros((G, K, 2), dtype=np.float32)
        features = np.zeros((G, K, self.features), dtype=np.float32)
        allowed = np.repeat(np.arange(K)[None] == 0, G, axis=0)
        scene = decode(vectors, self.building, self.scenario)
        own = scene.robots[:, 0] if scene.robots.shape[1] else np.zeros((0, 3))
        at_work = np.flatnonzero(own[:, 2] > -0.5)
        if len(at_work):
            now = self._moment(_one(scene, int(at_work[0])), cells)
        for floor in np.unique(own[at_work, 2]).astype(int).tolist():
            g = at_work[own[at_work, 2] == floor]
            seen = _FloorOfRobots(self, now, floor, own[g, :2].astype(np.float64))
            k = len(seen.kind)
            places[g, :k] = to_half_bodies(self.building, seen.target).clip(-1, 1)
            features[g, :k] = seen.features()
            allowed[g, :k] = True
        return Options(places, features, allowed)

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
        return _stacked(
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
    nav = prepared(building)
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
    nav = prepared(building)
    for room in building.rooms(floor):
        points = nav.centres[nav.places_of(floor, room.cells)]
        x, y = points[np.argmin(np.hypot(*(points - room.centre).T))].tolist()
        yield RobotOption.ROOM, (x, y), -1


def _wells(building: Building, floor: int) -> Iterator[Offer]:
    """Into the stairs where they lead down, before them where they end."""
    for shaft, well in enumerate(building.stairwells):
        if floor - 1 in well.areas:
            yield RobotOption.STAIRWELL, _well_spot(building, floor, shaft), shaft
        elif floor in well.areas:
            spot = before_stairwell(building, floor, shaft)
            yield RobotOption.LANDING, spot, shaft


def _well_spot(building: Building, floor: int, shaft: int) -> Point:
    """A point of the main body from which Eq. 1 leads into the stairwell [C6].

    The one nearest to its centre; its entrance, where there is none.
    """
    well, (left, bottom, right, top) = building.stairwells[shaft], building.body
    x, y = well.centre
    nearest = min(max(x, left), right), min(max(y, bottom), top)
    if actual_target(building, floor, *nearest) == well.centre:
        return nearest
    return building.landmarks[well.entrances[floor][0]].position


def _exit_spot(building: Building, exit_: Landmark) -> Point:
    """A point near an exit that means this exit and no stairwell beside it [C6, C7].

    The exit itself, unless Eq. 1 leads away from there.
    """
    points = prepared(building).centres[: building.kind[0].size]
    off = np.hypot(*(points - exit_.position).T)
    near = points[np.argsort(off, kind="stable")[: int((off <= AT_EXIT).sum())]]
    for point in [exit_.position, *((float(x), float(y)) for x, y in near)]:
        target = actual_target(building, exit_.floor, *point)
        told = instruction_for(building, exit_.floor, target)
        if target == point and told is Instruction.THIS_EXIT:
            return point
    return exit_.position


@lru_cache(maxsize=8)
def _shafts(building: Building) -> np.ndarray:
    """(places,) index of the stairwell around a place, -1 outside."""
    shaft = np.full(building.kind.shape, -1)
    for k, well in enumerate(building.stairwells):
        for floor in well.areas:
            shaft[floor, well.cells[:, 0], well.cells[:, 1]] = k
    return shaft.ravel()


def _stacked(
    names: Sequence[str], shape: tuple[int, ...], columns: Mapping[str, np.ndarray]
) -> np.ndarray:
    """(*shape, F) float32, the columns in the order of their names."""
    out = np.empty((*shape, len(names)), dtype=np.float32)
    for k, name in enumerate(names):
        out[..., k] = columns[name]
    return out


def _one(scene: Scene, g: int) -> Scene:
    """What agent g of a batch sees."""
    parts = scene.humans, scene.robots, scene.fires, scene.time
    return Scene(*(part[g] for part in parts))


# -- The fire's options -------------------------------------------------------------


class FireOption(IntEnum):
    """Beside what the fire can break out [D2, chosen]."""

    EXIT = 0
    ENTRANCE = 1
    DOOR = 2
    GROUP = 3
    ROBOT = 4


FIRE_FEATURES = (
    *(kind.name.lower() for kind in FireOption),
    "storey",  # share of the highest one
    "leads_out",  # 1 for exits and entrances of stairs that lead down
    "people",  # people within GROUP_RADIUS, / 10
    "here",  # share of all people: on this floor
    "above",  # share of all people: above it
    "cross",  # share of all people: on this floor, whose way out comes past
    "come",  # share of all people: still above, whose way out comes past
    "log_cross",  # log(1 + people whose way out comes past) / 2
    "ahead",  # metres they have to go till there, on average, / 20
    "out",  # metres from there to the cheapest way out, / 20
    "robots",  # robots within GROUP_RADIUS, / 2
    "robot_way",  # metres to the nearest robot as the crow flies, / 20
    "flames",  # share of the square of FLAMES_BESIDE cells that burns
    "flames_around",  # share of the square of FLAMES_FAR cells that burns
    "open",  # share of this floor's ways out that no flames are beside
    "here_open",  # 1 if it is beside such a way out
    "burning",  # log(1 + burning cells of this floor) / 5
    "burning_everywhere",  # log(1 + burning cells of all floors) / 5
    "inside",  # share of all people: still inside
)
"""Features of an option of the fire; FAR stands for no way."""

FLAMES_BESIDE, FLAMES_FAR = 3, 15  # cells: sides of squares in which flames count
NEAREST_CELLS = 80  # room cells around a landmark that are looked at for a free one


class FireOptions:
    """Options of the fire: free room cells beside ways, groups and robots [D6]."""

    def __init__(self, building: Building, scenario: Scenario):
        """size K and features F follow from the building and the number of robots."""
        self.building, self.scenario = building, scenario
        self.navigation: Navigation = prepared(building)
        self.marks = building.landmarks
        self.robots = scenario.robots_per_floor * building.floors
        self.size = len(self.marks) + GROUPS + self.robots
        self.features = len(FIRE_FEATURES)
        self.kind = np.array(
            [FireOption[m.kind.name] for m in self.marks]
            + [FireOption.GROUP] * GROUPS
            + [FireOption.ROBOT] * self.robots
        )
        self.beside = _beside(building)
        self.around = _around(GROUP_RADIUS)
        self.shaft = _shafts(building)
        self.way_out = _ways_out(building)

    def __call__(self, vectors: np.ndarray, cells: np.ndarray) -> Options:
        """vectors (1, V), the fire's; cells, the grid."""
        scene = decode_fire(vectors, self.building, self.scenario)
        now = Moment(self.navigation, self.scenario, _one(scene, 0), cells)
        place, allowed = self._places(now)
        features = _House(self, now).features(self.kind, place)
        features[~allowed] = 0
        return Options(
            self._actions(place)[None], features[None], self._some(allowed)[None]
        )

    def _places(self, now: Moment) -> tuple[np.ndarray, np.ndarray]:
        """(K,) the cell of each option, and (K,) bool whether it is there.

        [D6, chosen] Only floors on which, or above which, somebody is: there is
        nobody to harm on others, and robots whose work is done stand there unseen.
        """
        free = now.free_rooms()
        marks, found = self._first_free(free)
        spots = np.concatenate([self._heads(now), now.robot_place])
        place = np.zeros(self.size, dtype=int)
        allowed = np.zeros(self.size, dtype=bool)
        place[: len(marks)], allowed[: len(marks)] = marks, found
        at = np.concatenate(
            [
                len(marks) + np.arange(len(spots) - len(now.robot_place)),
                len(marks) + GROUPS + np.arange(len(now.robot_place)),
            ]
        )
        place[at], allowed[at] = self._nearest_free(spots, free)
        return place, allowed

    def _first_free(self, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(L,) the free room cell nearest to each landmark, (L,) whether there is."""
        good = free[self.beside]
        first = good.argmax(axis=1)
        rows = np.arange(len(good))
        return self.beside[rows, first], good[rows, first]

    def _nearest_free(
        self, spots: np.ndarray, free: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The same for places, as the crow flies."""
        floors, rows, cols = self.building.kind.shape
        floor, row, col = np.unravel_index(spots[:, None], (floors, rows, cols))
        row, col = row + self.around[:, 0], col + self.around[:, 1]
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        place = (floor * rows + row) * cols + col
        good = inside & free[np.where(inside, place, 0)]
        first, k = good.argmax(axis=1), np.arange(len(spots))
        return np.where(good[k, first], place[k, first], spots), good[k, first]

    def _heads(self, now: Moment) -> np.ndarray:
        """Places of the people in the middle of the largest groups of all floors."""
        at, place = now.at[now.walking], now.place[now.walking]
        floor = now.floor[now.walking]
        near = together(self.navigation, (at, place), (at, place), GROUP_RADIUS)
        near &= floor[:, None] == floor
        return place[groups(near, np.ones(len(place)), GROUPS)]

    def _some(self, allowed: np.ndarray) -> np.ndarray:
        """At least one: if everything is taken, it does not matter which."""
        if not allowed.any():
            allowed[0] = True
        return allowed

    def _actions(self, place: np.ndarray) -> np.ndarray:
        """(K, 3) float32: the middle of a floor's share of [-1, 1], and a spot."""
        floors = self.building.floors
        floor = (2 * (place // self.navigation.floor_size) + 1) / floors - 1
        spot = to_half_bodies(self.building, self.navigation.centres[place])
        return np.column_stack([floor, spot.clip(-1, 1)]).astype(np.float32)


class _House:
    """All floors as the fire sees them, and who is about to go where.

    cross, come  (places,) people of this floor and from above whose cheapest way out
                 comes past;  ahead (places,) metres they have to go till there, summed
    out          (places,) metres to the cheapest way out
    """

    def __init__(self, options: FireOptions, now: Moment):
        self.nav, self.now = options.navigation, now
        self.options = options
        self.cross, self.come = np.zeros(self.nav.places), np.zeros(self.nav.places)
        self.ahead = np.zeros(self.nav.places)
        self.out = np.full(self.nav.places, FAR)
        self._let_go()

    def _let_go(self) -> None:
        """Everybody out in thought, the highest floor first."""
        now, landing = self.now, self.options.way_out.landing
        coming: dict[int, list[int]] = {f: [] for f in range(self.nav.floors)}
        for shaft in self.options.shaft[now.place[~now.walking]].tolist():
            foot = self.options.way_out.foot[shaft]
            coming[foot // self.nav.floor_size].append(foot)
        for floor in reversed(range(self.nav.floors)):
            d, after = self._ways(floor)
            own = now.people_on(floor)[1].tolist()
            for starts, count in ((own, self.cross), (coming[floor], self.come)):
                for p in starts:
                    end = self._go(p, d, after, count)
                    if end in landing:
                        foot = landing[end]
                        coming[foot // self.nav.floor_size].append(foot)

    def _ways(self, floor: int) -> tuple[np.ndarray, dict[int, int]]:
        """(places,) metres to the cheapest way out; from where to where one walks."""
        goals = self.options.way_out.places[floor]
        d, after = self.nav.shortest(goals, self.now.cost_on(floor))
        start = floor * self.nav.floor_size
        part = slice(start, start + self.nav.floor_size)
        self.out[part] = np.minimum(d[part], FAR)
        return d, dict(enumerate(after[part].tolist(), start))

    def _go(
        self, p: int, d: np.ndarray, after: dict[int, int], count: np.ndarray
    ) -> int:
        """One human's way out is noted; where it ends."""
        chain = [p]
        while after[p] != p:
            p = after[p]
            chain.append(p)
        if len(chain) > 1:
            count[chain] += 1
            self.ahead[chain] += np.minimum(d[chain[0]] - d[chain], FAR)
        return p

    def features(self, kind: np.ndarray, place: np.ndarray) -> np.ndarray:
        """(K, F), in the order of FIRE_FEATURES; kind, place: (K,)."""
        floor = place // self.nav.floor_size
        return _stacked(
            FIRE_FEATURES,
            place.shape,
            {k.name.lower(): kind == k for k in FireOption}
            | self._floors(floor)
            | self._traffic(place)
            | self._bodies(place, floor)
            | self._fire(place, floor),
        )

    def _floors(self, floor: np.ndarray) -> dict[str, np.ndarray]:
        """How many people are at stake."""
        now, highest = self.now, max(1, self.nav.floors - 1)
        above = now.occupancy[::-1].cumsum()[::-1] - now.occupancy
        return {
            "storey": floor / highest,
            "here": now.occupancy[floor] / now.everybody,
            "above": above[floor] / now.everybody,
            "inside": np.array(now.occupancy.sum() / now.everybody),
        }

    def _traffic(self, place: np.ndarray) -> dict[str, np.ndarray]:
        """Whose way out comes past: through one of the 3 x 3 cells around."""
        shape = self.options.building.kind.shape

        def most(count: np.ndarray) -> np.ndarray:
            return ndimage.maximum_filter(count.reshape(shape), (1, 3, 3)).ravel()

        cross, come = most(self.cross)[place], most(self.come)[place]
        ahead = most(self.ahead / np.maximum(self.cross + self.come, 1))[place]
        return {
            "cross": cross / self.now.everybody,
            "come": come / self.now.everybody,
            "log_cross": np.log1p(cross + come) / 2,
            "ahead": ahead / 20,
            "out": self.out[place] / 20,
        }

    def _bodies(self, place: np.ndarray, floor: np.ndarray) -> dict[str, np.ndarray]:
        """People and robots near."""
        now, walking = self.now, self.now.walking
        to_people = self._off(place, floor, now.at[walking], now.floor[walking])
        to_robots = self._off(place, floor, now.robots, now.robot_floor)
        return {
            "people": (to_people <= GROUP_RADIUS).sum(axis=1) / 10,
            "robots": (to_robots <= GROUP_RADIUS).sum(axis=1) / 2,
            "robot_way": to_robots.min(axis=1, initial=FAR) / 20,
        }

    def _off(
        self, place: np.ndarray, floor: np.ndarray, at: np.ndarray, on: np.ndarray
    ) -> np.ndarray:
        """(K, m) metres as the crow flies, FAR from floor to floor."""
        off = self.nav.centres[place][:, None] - at
        apart = np.hypot(off[..., 0], off[..., 1])
        return np.where(floor[:, None] == on, apart, FAR)

    def _fire(self, place: np.ndarray, floor: np.ndarray) -> dict[str, np.ndarray]:
        """What burns, and which ways out do not."""
        now, way_out = self.now, self.options.way_out
        beside = now.flames_around(FLAMES_BESIDE)
        is_open = np.array([not beside[cells].any() for cells in way_out.cells])
        of_floor = [is_open[marks] for marks in way_out.marks]
        share = np.array([marks.mean() if len(marks) else 0.0 for marks in of_floor])
        count = now.burning.sum(axis=(1, 2))
        L = len(is_open)
        leads_out, here_open = np.zeros(len(place)), np.zeros(len(place))
        leads_out[:L], here_open[:L] = way_out.leads_out, way_out.leads_out & is_open
        return {
            "flames": beside[place],
            "flames_around": now.flames_around(FLAMES_FAR)[place],
            "open": share[floor],
            "here_open": here_open,
            "leads_out": leads_out,
            "burning": np.log1p(count)[floor] / 5,
            "burning_everywhere": np.array(np.log1p(count.sum()) / 5),
        }


def _around(radius: float) -> np.ndarray:
    """(k, 2) steps in rows and columns to the cells around, the nearest first."""
    reach = int(radius)
    side = np.arange(-reach, reach + 1)
    steps = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    far = np.hypot(steps[:, 0], steps[:, 1])
    order = np.argsort(far, kind="stable")
    return steps[order[: int((far <= radius).sum())]]


@dataclass(frozen=True, eq=False)
class WaysOut:
    """Ways out of a building, and where one comes out again.

    cells      places of each landmark;  leads_out (L,) bool
    marks      of each floor, landmarks that lead out;  places  their places
    foot       of each stairwell, the place where people come out of it
    landing    of each place of an entrance that leads down, the foot of its stairwell
    """

    cells: list[np.ndarray]
    leads_out: np.ndarray
    marks: list[list[int]]
    places: list[np.ndarray]
    foot: list[int]
    landing: dict[int, int]


@lru_cache(maxsize=8)
def _ways_out(building: Building) -> WaysOut:
    nav, marks = prepared(building), building.landmarks
    cells = [nav.places_of(m.floor, m.cells) for m in marks]
    of_floor = [building.ways_out(floor) for floor in range(building.floors)]
    none = np.zeros(0, dtype=int)
    foot: list[int] = []
    landing: dict[int, int] = {}
    for well in building.stairwells:
        foot.append(int(cells[well.entrances[min(well.areas)][0]][0]))
        for entrances in well.entrances.values():
            down = [m for m in entrances if marks[m].leads_out]
            landing |= {int(p): foot[-1] for m in down for p in cells[m]}
    return WaysOut(
        cells,
        np.array([m.leads_out for m in marks], dtype=bool),
        of_floor,
        [np.concatenate([none, *(cells[m] for m in ways)]) for ways in of_floor],
        foot,
        landing,
    )


@lru_cache(maxsize=8)
def _beside(building: Building) -> np.ndarray:
    """(L, NEAREST_CELLS) room cells around each landmark, the nearest first.

    Where there are not so many the landmark's own cell, never free, fills the row.
    """
    nav, rooms = prepared(building), building.kind.ravel() == Kind.FLOOR
    rows = np.zeros((len(building.landmarks), NEAREST_CELLS), dtype=int)
    for mark in building.landmarks:
        d = np.where(rooms, nav.distance[mark.index], np.inf)
        order = np.argsort(d, kind="stable")[:NEAREST_CELLS]
        own = nav.places_of(mark.floor, mark.cells)[0]
        kept = np.where(np.isfinite(d[order]), order, own)
        rows[mark.index] = own
        rows[mark.index, : len(kept)] = kept
    return rows
