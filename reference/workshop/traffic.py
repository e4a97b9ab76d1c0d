"""Traffic: how many people pass each place on their cheapest ways outside.

Clauses: A3, A7.

    p  place;  d  metres to the nearest way out of the floor
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from reference.building import Building
from reference.navigation import Navigation, navigation_of


class Traffic(NamedTuple):
    """How many people pass each place; arrays (places,).

    cross, come  people of this floor, and from above
    ahead        metres they walk to get there, summed
    out          metres to the cheapest way out of the floor, inf where there is none
    """

    cross: np.ndarray
    come: np.ndarray
    ahead: np.ndarray
    out: np.ndarray


def traffic(
    building: Building, walking: np.ndarray, stairs: np.ndarray, cost: np.ndarray
) -> Traffic:
    """Walk everyone along their cheapest ways out, floor by floor and down the stairs.

    walking  (n,) places of people on floors
    stairs   (m,) stairwells of people on stairs
    cost     of a metre, in metres, (floors, rows, cols)
    """
    nav, wells = navigation_of(building), _wells(building)
    feet = stairwell_feet(building)
    found, coming = Traffic(*np.zeros((4, nav.places))), feet[stairs]
    for floor in reversed(range(building.floors)):
        d, after = nav.shortest(places_out(building, floor), cost)
        here = slice(floor * nav.floor_size, (floor + 1) * nav.floor_size)
        found.out[here] = d[here]
        for people, count in ((walking, found.cross), (coming, found.come)):
            at = people[(people // nav.floor_size == floor) & np.isfinite(d[people])]
            start = d[at]
            while len(at):
                np.add.at(count, at, 1)
                np.add.at(found.ahead, at, start - d[at])
                walks = after[at] != at
                entered = wells[at[~walks]]
                coming = np.append(coming, feet[entered[entered >= 0]])
                start, at = start[walks], after[at[walks]]
    return found


def walk(nav: Navigation, p: int, landmark: int) -> list[int]:
    """List the places on the way from p to a landmark, without p."""
    chain: list[int] = []
    while 0 < nav.metres_to(landmark, p) < np.inf:
        waypoint = int(nav.waypoint(landmark, p))
        chain += nav.straight(p, waypoint)
        p = waypoint
    return chain


def ways_outside(
    building: Building, cost: np.ndarray | None, storey: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Compute what leaving by each landmark costs: to reach it, and to get outside.

    Both (landmarks, places), inf where a landmark does not lead out; and (landmarks,)
    storeys walked down. From the foot of stairs the cheapest way leads on.
    cost: of a metre, (places,) or (floors, rows, cols), None for 1;  storey: of one
    """
    nav, feet = navigation_of(building), stairwell_feet(building)
    on_foot, outside = np.full((2, len(building.landmarks), nav.places), np.inf)
    storeys = np.zeros(len(building.landmarks), dtype=int)
    for mark in building.landmarks:  # the lowest floor first
        k, below = mark.index, 0.0
        if mark.leads_out:
            on_foot[k] = nav.distances(nav.goals[k], cost)
            if k in building.stairwell_of:
                well = building.stairwell_of[k]
                on = outside[:, feet[well]].argmin()
                down = mark.floor - building.stairwells[well].lowest
                below = outside[on, feet[well]] + down * storey
                storeys[k] = down + storeys[on]
            outside[k] = on_foot[k] + below
    return on_foot, outside, storeys


def places_out(building: Building, floor: int) -> np.ndarray:
    """Places of all ways out of a floor."""
    goals = navigation_of(building).goals
    ways = [goals[m] for m in building.ways_out(floor)]
    return np.concatenate([np.zeros(0, dtype=int), *ways])


@lru_cache(maxsize=8)
def stairwell_feet(building: Building) -> np.ndarray:
    """Find where people come out of each stairwell: places, (stairwells,)."""
    entrances = [well.entrances[well.lowest][0] for well in building.stairwells]
    goals = navigation_of(building).goals
    return np.array([goals[m][0] for m in entrances], dtype=int)


@lru_cache(maxsize=8)
def _wells(building: Building) -> np.ndarray:
    """Map entrances to the stairwells they lead down: (places,), -1 elsewhere."""
    goals, well = navigation_of(building).goals, np.full(building.kind.size, -1)
    for mark, index in building.stairwell_of.items():
        if building.landmarks[mark].leads_out:
            well[goals[mark]] = index
    return well
