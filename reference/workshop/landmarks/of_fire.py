"""Beside what the fire can break out: ways, groups of people, robots.

Clauses: D1, D2, D6.

    K   options;  L  landmarks;  p  place;  d  way with flames counted, metres
"""

from dataclasses import dataclass
from enum import IntEnum
from functools import lru_cache

import numpy as np
from scipy import ndimage

from reference.building import Building, Kind
from reference.game.observations import decode_fire, to_normalised
from reference.navigation import Navigation, navigation_of
from reference.paper import Scenario
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
        self.navigation: Navigation = navigation_of(building)
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
        self.shaft = shafts(building)
        self.way_out = _ways_out(building)

    def __call__(self, vectors: np.ndarray, cells: np.ndarray) -> Options:
        """vectors (1, V), the fire's; cells, the grid."""
        scene = decode_fire(vectors, self.building, self.scenario)
        now = Moment(self.navigation, self.scenario, one_of(scene, 0), cells)
        place, action_mask = self._places(now)
        features = _House(self, now).features(self.kind, place)
        features[~action_mask] = 0
        return Options(
            self._actions(place)[None], features[None], self._some(action_mask)[None]
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
        action_mask = np.zeros(self.size, dtype=bool)
        place[: len(marks)], action_mask[: len(marks)] = marks, found
        at = np.concatenate(
            [
                len(marks) + np.arange(len(spots) - len(now.robot_place)),
                len(marks) + GROUPS + np.arange(len(now.robot_place)),
            ]
        )
        place[at], action_mask[at] = self._nearest_free(spots, free)
        return place, action_mask

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

    def _some(self, action_mask: np.ndarray) -> np.ndarray:
        """At least one: if everything is taken, it does not matter which."""
        if not action_mask.any():
            action_mask[0] = True
        return action_mask

    def _actions(self, place: np.ndarray) -> np.ndarray:
        """(K, 3) float32: the middle of a floor's share of [-1, 1], and a spot."""
        floors = self.building.floors
        floor = (2 * (place // self.navigation.floor_size) + 1) / floors - 1
        spot = to_normalised(self.building, self.navigation.centres[place])
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
        return stacked(
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
    nav, marks = navigation_of(building), building.landmarks
    cells = [nav.places_of(m.floor, m.cells) for m in marks]
    of_floor = [building.ways_out(floor) for floor in range(building.floors)]
    none = np.zeros(0, dtype=int)
    foot: list[int] = []
    landing: dict[int, int] = {}
    for well in building.stairwells:
        foot.append(int(cells[well.entrances[well.lowest][0]][0]))
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
    nav, rooms = navigation_of(building), building.kind.ravel() == Kind.FLOOR
    rows = np.zeros((len(building.landmarks), NEAREST_CELLS), dtype=int)
    for mark in building.landmarks:
        d = np.where(rooms, nav.distance[mark.index], np.inf)
        order = np.argsort(d, kind="stable")[:NEAREST_CELLS]
        own = nav.places_of(mark.floor, mark.cells)[0]
        kept = np.where(np.isfinite(d[order]), order, own)
        rows[mark.index] = own
        rows[mark.index, : len(kept)] = kept
    return rows
