"""Count how many people pass each place on their cheapest ways off each floor.

p  place;  d  metres to the nearest way out of the floor
"""

from functools import lru_cache

import numpy as np

from reference import paper
from reference.building import Building
from reference.navigation import Navigation, navigation_of


def traffic(
    building: Building, walking: np.ndarray, stairs: np.ndarray, cost: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Walk everyone along their cheapest ways out, floor by floor and down the stairs.

    walking  (n,) places of people on floors
    stairs   (m,) stairwells of people on stairs
    cost     of a metre, in metres, (floors, rows, cols)

    Returns how many people pass each place, and metres from there to the cheapest way
    out of the floor, inf where there is none: (places,) each.
    """
    nav = navigation_of(building)
    feet = stairwell_feet(building)
    below = np.full(nav.places, -1)  # where the stairs from an entrance come out [A3]
    for mark in building.landmarks:
        if mark.stairwell >= 0 and mark.leads_out:
            below[nav.goals[mark.index]] = feet[mark.stairwell]

    passed = np.zeros(nav.places)
    out = np.zeros(nav.places)
    coming = np.concatenate([walking, feet[stairs]])
    for floor in reversed(range(building.floors)):  # who comes down is counted there
        ways = [nav.goals[mark] for mark in building.ways_out(floor)]
        goals = np.concatenate([np.zeros(0, dtype=int), *ways])
        d, after = nav.shortest(goals, cost)
        here = slice(floor * nav.floor_size, (floor + 1) * nav.floor_size)
        out[here] = d[here]
        p = coming[(coming // nav.floor_size == floor) & np.isfinite(d[coming])]
        crossed = [p]
        while len(p):  # everybody takes one step, or has arrived
            further = after[p]
            p = further[further != p]
            crossed.append(p)
        walked = np.concatenate(crossed)
        passed += np.bincount(walked, minlength=nav.places)
        down = below[walked[after[walked] == walked]]
        coming = np.append(coming, down[down >= 0])
    return passed, out


def places_walked(nav: Navigation, p: int, landmark: int) -> list[int]:
    """List the places on the way from p to a landmark, without p [A7]."""
    chain: list[int] = []
    d = nav.distance_to(landmark)
    while 0 < d[p] < np.inf:
        waypoint = int(nav.waypoint[landmark, p % nav.floor_size])
        chain += nav.straight_way(p, waypoint)
        p = waypoint
    return chain


def ways_outside(building: Building, cost: np.ndarray | None) -> dict[int, np.ndarray]:
    """Compute what it costs to get outside, (places,) by each landmark that leads out.

    inf on other floors. From the foot of stairs the cheapest way leads on.
    cost: of a metre of floor, (places,) or (floors, rows, cols), None for 1
    """
    nav = navigation_of(building)
    feet = stairwell_feet(building)
    outside: dict[int, np.ndarray] = {}
    for mark in building.landmarks:  # the lowest floor first: others build on it
        if not mark.leads_out:
            continue
        metres = nav.distances(nav.goals[mark.index], cost)
        if mark.stairwell >= 0:
            down = mark.floor - building.stairwells[mark.stairwell].lowest
            foot = feet[mark.stairwell]
            onwards = min(further[foot] for further in outside.values())
            metres += onwards + down * paper.stairs_metres()
        outside[mark.index] = metres
    return outside


@lru_cache(maxsize=8)
def stairwell_feet(building: Building) -> np.ndarray:
    """Find where people come out of each stairwell: places, (stairwells,)."""
    entrances = [well.entrances[well.lowest][0] for well in building.stairwells]
    goals = navigation_of(building).goals
    return np.array([goals[m][0] for m in entrances], dtype=int)
