"""What both sides' landmarks share: options, feature tables, observations on the map.

Clauses: C1, C3, D1, D6.

    p   place;  m, n  people;  R  robots
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage

from reference.building import Building, Kind
from reference.flames import cells_beside, fuel, walking_cost
from reference.navigation import Navigation
from reference.paper import Scenario
from reference.workshop.decoding import Decoded, burning
from reference.workshop.strategies.robots import GROUP_RADIUS

FAR = 100.0  # metres: whatever is farther, or unreachable, counts as this far
GROUPS = 8  # groups of people at most, per floor or, for the fire, in all
BORDER = 1e-3
"""Metres: float32 cannot tell in which cell a robot on the border of two stands."""

FeatureTable = Mapping[str, Callable[[Any], ArrayLike]]
"""Features of an option by name: the formula of each, given a side's view."""


def one_hot(kinds: Mapping[str, Any]) -> FeatureTable:
    """Features that tell an option's kind: 1 for its own, 0 for the others."""

    def is_of(kind: Any) -> Callable[[Any], ArrayLike]:
        return lambda view: view.kind == kind

    return {name.lower(): is_of(kind) for name, kind in kinds.items()}


def evaluate(table: FeatureTable, view: Any) -> np.ndarray:
    """Compute features in table order: (*shape of the view's places, F) float32."""
    out = np.empty((*view.place.shape, len(table)), dtype=np.float32)
    for k, formula in enumerate(table.values()):
        out[..., k] = formula(view)
    return out


class Snapshot:
    """An observation, located on the map.

    building   whose map it is;  everybody  people who start, 1 at least
    at         (n, 2) metres, floor (n,), place (n,) of all people inside
    walking    (n,) bool, on a floor and not on the stairs
    on_stairs  stairwells of those who are on stairs
    robots     (R, 2) metres of robots at work, robot_floor (R,), robot_place (R,)
    burning    (floors, rows, cols) bool
    cost       of a metre, in metres, the same shape
    flames     (floors,) bool, where any cell burns
    time       share of the time limit
    occupancy  (floors,) people;  above (floors,) people above a floor
    """

    def __init__(
        self, nav: Navigation, scenario: Scenario, decoded: Decoded, cells: np.ndarray
    ):
        """decoded: one agent's vector, not a batch; cells: the grid."""
        self._nav, building = nav, nav.building
        self.building = building
        self.everybody = max(1, sum(scenario.start_counts(building.floors)))
        self.time = decoded.time.item() / scenario.time_limit
        self.at, self.floor, self.place = _present(nav, decoded.humans)
        self.robots, self.robot_floor, self.robot_place = _present(nav, decoded.robots)
        self.walking = building.kind.ravel()[self.place] != Kind.STAIRS
        self.on_stairs = stairwell_at(building)[self.place[~self.walking]]
        self.burning = burning(cells, building)
        self.cost = walking_cost(self.burning, cells_beside(building, self.burning))
        self.flames = np.asarray(self.burning.any(axis=(1, 2)))
        self.occupancy = np.bincount(self.floor, minlength=building.floors)
        self.above = self.occupancy[::-1].cumsum()[::-1] - self.occupancy

    def people_on(self, floor: int) -> tuple[np.ndarray, np.ndarray]:
        """Metres (m, 2) and places (m,) of those who walk on a floor."""
        here = self.walking & (self.floor == floor)
        return self.at[here], self.place[here]

    def cost_on(self, floor: int) -> np.ndarray | None:
        """Look up what a metre costs robots; None on a floor without flames."""
        return self.cost if self.flames[floor] else None

    def free_rooms(self) -> np.ndarray:
        """Mark where a fire can break out and do harm: (places,) bool.

        Unprotected room cells with neither flames nor human nor robot [D6], on floors
        on or above which somebody is.
        """
        at_stake = self.occupancy + self.above > 0
        free = (self.building.kind == Kind.FLOOR) & fuel(self.building) & ~self.burning
        free = (free & at_stake[:, None, None]).ravel()
        free[self.place] = False
        for off in product((-BORDER, BORDER), repeat=2):
            free[self._nav.places_at(self.robot_floor, self.robots + off)] = False
        return free

    def flames_around(self, side: int) -> np.ndarray:
        """Compute the burning share of a square of `side` cells around: (places,)."""
        share = self.burning.astype(np.float32)
        if self.flames.any():
            share = ndimage.uniform_filter(share, (0, side, side), mode="constant")
        return share.ravel()


def _present(
    nav: Navigation, points: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find metres (k, 2), floors (k,) and places (k,) of those present.

    Sorted, whatever their order was: by floor, then from west to east.
    """
    points = points[np.flatnonzero(points[:, 2] > -0.5)].astype(np.float64)
    points = points[np.lexsort((points[:, 1], points[:, 0], points[:, 2]))]
    floor = np.rint(points[:, 2]).astype(np.int64)
    return points[:, :2], floor, nav.places_at(floor, points[:, :2])


def near_in_sight(
    nav: Navigation,
    one: tuple[np.ndarray, np.ndarray],
    other: tuple[np.ndarray, np.ndarray],
) -> np.ndarray:
    """Mark pairs within GROUP_RADIUS and without a wall between: (a, b) bool.

    one, other: metres (a, 2) and places (a,), metres (b, 2) and places (b,), of the
    same floor.
    """
    off = one[0][:, None] - other[0]
    near = (off**2).sum(axis=-1) <= GROUP_RADIUS**2
    a, b = np.nonzero(near)
    near[a, b] = nav.clear.reaches(one[1][a], other[1][b])
    return near


def group_centres(near: np.ndarray, count: np.ndarray) -> list[int]:
    """Find people in the middle of at most GROUPS groups, the largest first.

    near: (m, m) bool, who stands with whom; count: (m,) whether a person counts for
    the size of a group. Greedy: those around one are in no other group.
    """
    centres: list[int] = []
    left = np.ones(len(near), dtype=bool)
    while left.any() and len(centres) < GROUPS:
        size = near @ (left * (count + 1e-3))
        centres.append(int(np.argmax(np.where(left, size, -1.0))))
        left &= ~near[centres[-1]]
    return centres


@lru_cache(maxsize=8)
def stairwell_at(building: Building) -> np.ndarray:
    """(places,) index of the stairwell around a place, -1 outside."""
    shaft = np.full(building.kind.shape, -1)
    for k, well in enumerate(building.stairwells):
        for floor in well.areas:
            shaft[floor, well.cells[:, 0], well.cells[:, 1]] = k
    return shaft.ravel()
