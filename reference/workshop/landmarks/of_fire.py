"""Options of the fire: free cells beside ways, groups of people and robots.

Clauses: D1, D2, D6.

    O   options;  L  landmarks;  p  place
"""

from enum import IntEnum
from functools import lru_cache

import numpy as np
from scipy import ndimage

from reference.building import Building, Kind
from reference.flames import fuel, rim
from reference.game.moments import Choices, Moment
from reference.game.observations import to_normalised
from reference.navigation import navigation_of
from reference.paper import Scenario
from reference.workshop.decoding import decode
from reference.workshop.landmarks import shared
from reference.workshop.traffic import Traffic, traffic

FLAMES_BESIDE, FLAMES_FAR = 3, 15  # cells: sides of squares in which flames count
ABOUT_AS_NEAR = 1.0  # metres: among cells this close, busier is better
NEAREST_CELLS = 80  # room cells around a landmark that are searched for a free one


class FireOption(IntEnum):
    """What the fire can break out beside [D2, chosen]."""

    EXIT = 0
    ENTRANCE = 1
    DOOR = 2
    GROUP = 3
    ROBOT = 4


FIRE_TABLE: shared.FeatureTable = {
    **shared.one_hot(FireOption.__members__),
    "storey": lambda v: v.floor / max(1, v.nav.floors - 1),  # share of the highest
    "leads_out": lambda v: v.leads_out,  # exits and entrances of stairs that lead down
    "people": lambda v: (v.to_people <= shared.GROUP_RADIUS).sum(axis=1) / 10,
    "here": lambda v: v.now.occupancy[v.floor] / v.now.everybody,
    "above": lambda v: v.now.above[v.floor] / v.now.everybody,
    "cross": lambda v: v.cross / v.now.everybody,  # of this floor, and come past
    "come": lambda v: v.come / v.now.everybody,  # from above, and come past
    "log_cross": lambda v: np.log1p(v.cross + v.come) / 2,
    "ahead": lambda v: v.ahead / 20,  # metres they walk to get there, on average
    "out": lambda v: v.out[v.place] / 20,  # metres from there to the cheapest way out
    "robots": lambda v: (v.to_robots <= shared.GROUP_RADIUS).sum(axis=1) / 2,
    "robot_way": lambda v: v.to_robots.min(axis=1, initial=shared.FAR) / 20,
    "flames": lambda v: v.flames_beside[v.place],
    "flames_around": lambda v: v.now.flames_around(FLAMES_FAR)[v.place],
    "open": lambda v: v.open[v.floor],  # `here_open`, mean over the floor's ways out
    "here_open": lambda v: v.here_open,  # share of a way out's rim without flames
    "burning": lambda v: np.log1p(v.burning)[v.floor] / 5,  # cells of this floor
    "burning_everywhere": lambda v: np.log1p(v.burning.sum()) / 5,
    "inside": lambda v: v.now.occupancy.sum() / v.now.everybody,
}
"""Features of an option of the fire; FAR stands for no way."""

FIRE_FEATURES = tuple(FIRE_TABLE)


class FireOptions:
    """Options of the fire: free room cells beside ways, groups and robots [D6]."""

    def __init__(self, building: Building, scenario: Scenario):
        """size O and features F follow from the building and the number of robots."""
        self.building, self.scenario = building, scenario
        self.navigation = navigation_of(building)
        kind = [FireOption[mark.kind.name] for mark in building.landmarks]
        kind += [FireOption.GROUP] * shared.GROUPS
        kind += [FireOption.ROBOT] * (scenario.robots_per_floor * building.floors)
        self.kind, self.size = np.array(kind), len(kind)
        self.features = len(FIRE_FEATURES)
        self.beside = _beside(building)
        marks = np.arange(len(self.beside))[:, None]
        self.metres = self.navigation.metres_to(marks, self.beside)
        self.rims = [rim(building, m.index) for m in building.landmarks if m.leads_out]
        self.steps = _steps_around(shared.GROUP_RADIUS)
        self.far = np.hypot(*self.steps.T)

    def __call__(self, moment: Moment) -> Choices:
        """Make the options of the only agent, the fire."""
        decoded = decode(moment.vectors[0], self.building, self.scenario)
        now = shared.Snapshot(self.navigation, self.scenario, decoded, moment.grid)
        walking = now.place[now.walking]
        passing = traffic(self.building, walking, now.on_stairs, now.cost)
        place, action_mask = self._places(now, passing)
        features = shared.evaluate(FIRE_TABLE, FireView(self, now, place, passing))
        features[~action_mask] = 0
        if not action_mask.any():  # everything is taken: it does not matter which
            action_mask[0] = True
        actions = self._actions(place)
        return Choices(actions[None], features[None], action_mask[None])

    def _places(
        self, now: shared.Snapshot, passing: Traffic
    ) -> tuple[np.ndarray, np.ndarray]:
        """Choose each option's cell, (O,), and whether it exists, (O,) bool.

        It is the one of the nearest free cells that most people pass: around a
        clearance many are equally near.

        [D6, chosen] Only floors on which, or above which, somebody is: there is
        nobody to harm on others, and robots whose work is done stand there unseen.
        """
        place, there = np.zeros(self.size, dtype=int), np.zeros(self.size, dtype=bool)
        centres, L, free = self._group_centres(now), len(self.beside), now.free_rooms()
        people = 1 + passing.cross + passing.come
        for start, candidates, metres in (
            (0, self.beside, self.metres),
            (L, self._around(centres), self.far),
            (L + shared.GROUPS, self._around(now.robot_place), self.far),
        ):
            part, k = slice(start, start + len(candidates)), np.arange(len(candidates))
            d = np.where(free[candidates], metres, np.inf)
            near = d <= d.min(axis=1, keepdims=True) + ABOUT_AS_NEAR
            first = (near * people[candidates]).argmax(axis=1)
            place[part] = candidates[k, first]
            there[part] = free[place[part]]
        return place, there

    def _around(self, places: np.ndarray) -> np.ndarray:
        """List cells around places, (k, n), the nearest as the crow flies first.

        The place itself stands for cells beyond the drawing.
        """
        floors, rows, cols = self.building.kind.shape
        floor, row, col = np.unravel_index(places[:, None], (floors, rows, cols))
        row, col = row + self.steps[:, 0], col + self.steps[:, 1]
        inside = (row >= 0) & (row < rows) & (col >= 0) & (col < cols)
        return np.where(inside, (floor * rows + row) * cols + col, places[:, None])

    def _group_centres(self, now: shared.Snapshot) -> np.ndarray:
        """Find the people in the middle of the largest groups, all floors: places."""
        at, place = now.at[now.walking], now.place[now.walking]
        floor = now.floor[now.walking]
        near = shared.near_in_sight(self.navigation, (at, place), (at, place))
        near &= floor[:, None] == floor
        return place[shared.group_centres(near, np.ones(len(place)))]

    def _actions(self, place: np.ndarray) -> np.ndarray:
        """Make (O, 3) float32: the middle of a floor's share of [-1, 1], x and y."""
        floors = self.building.floors
        floor = (2 * (place // self.navigation.floor_size) + 1) / floors - 1
        metres = self.navigation.centres[place]
        axes = to_normalised(self.building, metres).clip(-1, 1)
        return np.column_stack([floor, axes]).astype(np.float32)


class FireView:
    """All floors as the fire sees them; FIRE_TABLE reads the attributes.

    kind, place, floor, leads_out, here_open  (O,) of each option
    to_people, to_robots  (O, m) metres as the crow flies, FAR from floor to floor
    cross, come, ahead    (O,) people who pass, as in `Traffic`, ahead on average
    out                   (places,) metres to the cheapest way out
    flames_beside         (places,) share of the square around that burns
    burning, open         (floors,) cells;  mean of here_open over the ways out
    """

    def __init__(
        self,
        options: FireOptions,
        now: shared.Snapshot,
        place: np.ndarray,
        passing: Traffic,
    ):
        """place: (O,) the cell of each option."""
        self.nav, self.now = options.navigation, now
        self.kind, self.place = options.kind, place
        self.floor = place // self.nav.floor_size
        walking = now.walking
        self.to_people = self._distances(now.at[walking], now.floor[walking])
        self.to_robots = self._distances(now.robots, now.robot_floor)
        self.burning = now.burning.sum(axis=(1, 2))
        self.flames_beside = now.flames_around(FLAMES_BESIDE)
        self._find_open(options.rims)
        self._count(passing)

    def _distances(self, at: np.ndarray, on: np.ndarray) -> np.ndarray:
        """(O, m) metres to points at, (m, 2), on floors, (m,)."""
        off = self.nav.centres[self.place][:, None] - at
        apart = np.hypot(off[..., 0], off[..., 1])
        return np.where(self.floor[:, None] == on, apart, shared.FAR)

    def _find_open(self, rims: list[np.ndarray]) -> None:
        """Find the share of each way out's rim that does not burn, 1 without a rim."""
        building, burning = self.now.building, self.now.burning.ravel()
        self.leads_out, self.here_open = np.zeros((2, len(self.place)))
        ways = [m.index for m in building.landmarks if m.leads_out]
        self.leads_out[ways] = 1
        self.here_open[ways] = [1 - burning[r].sum() / max(1, len(r)) for r in rims]
        of_floor = [
            self.here_open[building.ways_out(f)] for f in range(self.nav.floors)
        ]
        self.open = np.array([m.mean() if len(m) else 0.0 for m in of_floor])

    def _count(self, passing: Traffic) -> None:
        """Count people who pass each option, through one of the 3 x 3 cells around.

        For a landmark these are around itself, not around the cell beside it that may
        burn: people enter a clearance from all sides.
        """
        shape, goals = self.now.burning.shape, self.nav.goals
        middle = self.place.copy()
        middle[: len(goals)] = [places[0] for places in goals]

        def busiest(count: np.ndarray) -> np.ndarray:
            around = ndimage.maximum_filter(count.reshape(shape), (1, 3, 3))
            return around.ravel()[middle]

        self.cross, self.come = busiest(passing.cross), busiest(passing.come)
        people = np.maximum(passing.cross + passing.come, 1)
        self.ahead = np.minimum(busiest(passing.ahead / people), shared.FAR)
        self.out = np.minimum(passing.out, shared.FAR)


# -- Cells to burn ------------------------------------------------------------------


def _steps_around(radius: float) -> np.ndarray:
    """(n, 2) steps in rows and columns to the cells around, the nearest first."""
    side = np.arange(-int(radius), int(radius) + 1)
    steps = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    far = np.hypot(steps[:, 0], steps[:, 1])
    return steps[np.argsort(far, kind="stable")[: int((far <= radius).sum())]]


@lru_cache(maxsize=8)
def _beside(building: Building) -> np.ndarray:
    """(L, NEAREST_CELLS) unprotected room cells around each landmark, nearest first.

    Where there are fewer, the landmark's own cell, never free, fills the row.
    """
    nav = navigation_of(building)
    rooms = (fuel(building) & (building.kind == Kind.FLOOR)).ravel()
    rows = np.zeros((len(building.landmarks), NEAREST_CELLS), dtype=int)
    for mark in building.landmarks:
        d = np.where(rooms, nav.distance_to(mark.index), np.inf)
        order = np.argsort(d, kind="stable")[:NEAREST_CELLS]
        own = nav.goals[mark.index][0]
        kept = np.where(np.isfinite(d[order]), order, own)
        rows[mark.index] = own
        rows[mark.index, : len(kept)] = kept
    return rows
