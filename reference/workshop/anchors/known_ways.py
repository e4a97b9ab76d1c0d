"""What robots and fire know of a building's ways out, and of what leads on from there.

k   ways out of a floor, or feet of its stairs, in the map's order
"""

from collections.abc import Sequence

import numpy as np

from reference.building import Building
from reference.navigation import navigation_of
from reference.workshop.anchors.reckoning import FARTHEST
from reference.workshop.strategies.guides import SOON
from reference.workshop.strategies.observed import (
    guarded_ways,
    kept_under_numbers,
    padded,
    stairs_that_end,
    ways_out_of,
)
from reference.workshop.strategies.traffic import (
    places_walked,
    stairwell_feet,
    ways_outside,
)

Ways = dict[int, np.ndarray]  # metres to the outside by each landmark: (places,)


class KnownWays:
    """What robots know of ways out, feet of stairs and rims, in the map's order.

    by_mark     `ways_outside`, without flames
    outside     (places,) metres from there to the outside, with stairs and lower floors
    marks       of each floor, the landmarks of each of its ways out
    wells       (floors, k) index of a way out's stairwell, -1 for exits
    width       (floors, k) cells of a way out
    metres_out  (floors, k) metres from a way out to the outside
    on_way      (places, floors, k) float32, 1 for a place on the way from there
    near_way    (places, floors, k) float32, 1 on that way, 0 from SOON metres on foot
    feet        (floors, k) index of a foot's stairwell
    rim_width, rim_wells  (floors, k) of the way out, or in, that a rim guards
    well_of     (places,) index of the stairwell, -1 elsewhere
    """

    def __init__(self, building: Building):
        self.building = building
        floors = range(building.floors)
        by_mark = ways_outside(building, None)
        self.by_mark = by_mark
        self.outside = np.minimum(np.min([*by_mark.values()], axis=0), FARTHEST)

        # ways out
        ways = [ways_out_of(building, floor) for floor in floors]
        self.marks = [[way.landmarks for way in here] for here in ways]
        self.wells = padded([[way.stairwell for way in here] for here in ways], -1)
        widths = [[self._width(marks) for marks in here] for here in self.marks]
        self.width = padded(widths, 0)
        metres = [
            [self._metres_out(by_mark, marks) for marks in here] for here in self.marks
        ]
        self.metres_out = padded(metres, 0)
        chains = [
            [self._chain(by_mark, marks[0]) for marks in here] for here in self.marks
        ]
        shape = navigation_of(building).places, *self.wells.shape
        self.on_way = np.zeros(shape, dtype=np.float32)
        self.near_way = np.zeros(shape, dtype=np.float32)
        for floor, here in enumerate(chains):
            for k, chain in enumerate(here):
                self.on_way[chain, floor, k] = 1
                self.near_way[:, floor, k] = self._nearness_to(chain)

        # feet of stairs and rims
        self.feet = padded([stairs_that_end(building, floor) for floor in floors], -1)
        rims = [[mark for mark, _ in guarded_ways(building, floor)] for floor in floors]
        self.rim_width = padded([[self._width([m]) for m in here] for here in rims], 0)
        landmarks = building.landmarks
        wells = [[landmarks[mark].stairwell for mark in here] for here in rims]
        self.rim_wells = padded(wells, -1)

        self.well_of = np.full(building.kind.size, -1)
        areas = building.area.ravel()
        for k, well in enumerate(building.stairwells):
            self.well_of[np.isin(areas, list(well.areas.values()))] = k

    def _width(self, marks: Sequence[int]) -> int:
        return sum(self.building.landmarks[mark].width for mark in marks)

    def _metres_out(self, by_mark: Ways, marks: Sequence[int]) -> float:
        """Metres to the outside from a way out of these landmarks."""
        goals = navigation_of(self.building).goals
        return min(float(by_mark[mark][goals[mark][0]]) for mark in marks)

    def _chain(self, by_mark: Ways, mark: int) -> list[int]:
        """List the places on the cheapest way from a way out to the outside."""
        nav = navigation_of(self.building)
        feet = stairwell_feet(self.building)
        landmarks = self.building.landmarks
        chain = nav.goals[mark].tolist()
        while landmarks[mark].stairwell >= 0:
            foot = int(feet[landmarks[mark].stairwell])
            metres = {way: float(d[foot]) for way, d in by_mark.items()}
            mark = min(metres, key=metres.__getitem__)
            if not np.isfinite(metres[mark]):
                break
            chain += [foot, *places_walked(nav, foot, mark)]
        return chain

    def _nearness_to(self, chain: list[int]) -> np.ndarray:
        """(places,) 1 on a chain of places, 0 from SOON metres on foot."""
        nav = navigation_of(self.building)
        close = np.zeros(nav.places)
        floors = np.array(chain) // nav.floor_size
        for floor in np.unique(floors).tolist():
            d = nav.distances(np.array(chain)[floors == floor].tolist())
            close = np.maximum(close, 1 - np.minimum(d / SOON, 1))
        return close


@kept_under_numbers(8)
def known_ways_of(building: Building) -> KnownWays:
    """What robots know of a building's ways out, computed once."""
    return KnownWays(building)
