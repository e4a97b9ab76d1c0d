"""What the people inside can still hope for: an estimate of the reward to come.

Clauses: F4, F8, B7, D7.  It stands in for the rest of a simulation that is broken off:
crude, but a hundredth of its cost.  Losses are health points.

    f, p    floor, place;  n  people inside
    first   lost on the cheapest way off the floor;  last  ... to the outside
    storeys that are walked down on it
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from reference.building import Building, Kind
from reference.flames import beside_flames
from reference.navigation import navigation_of
from reference.paper import (
    BURN_LOSS,
    FIXED_PENALTY,
    FIXED_REWARD,
    FRAMES_PER_SECOND,
    HEALTH_RATE,
    HEAT_LOSS,
    STAIRS_SECONDS,
    WALKING_SPEED,
)
from reference.world import World

SEARCH = 3.0
"""[F4, chosen] metres walked for one of the shortest way: people search, robots fetch
and queues form. With 3 the estimate is right on average for `sweep`, within 500 points
of 8000, over moments of random, greedy and exit-burning fires."""

SOON = 30.0
"""[F4, chosen] seconds: people meet the flames as they will be so much later."""

STOREY_LOSS = HEALTH_RATE * FRAMES_PER_SECOND * STAIRS_SECONDS


class Losses(NamedTuple):
    """What each place of a floor costs to leave, (places,) each; inf: no way."""

    first: np.ndarray
    last: np.ndarray
    storeys: np.ndarray


class Way(NamedTuple):
    """A way out of a floor: its places, and where it leads.

    foot  where one comes out of the stairs, -1 for an exit;  down  storeys till there
    """

    places: tuple[int, ...]
    foot: int
    down: int


def prospects(world: World) -> float:
    """Reward that those inside still bring, if no more fires break out.

    [F4, chosen] Everybody takes the cheapest way, SEARCH times as long as it is, with
    the flames as they will be SOON; these are walked through at the health it costs,
    as stuck people do. Flames must be known that far: ask a simulation of its own
    future.
    """
    bodies = world.bodies
    who = np.flatnonzero(bodies.inside)
    health, out = bodies.health[who], _of_people(world, who)
    floors = np.arange(world.building.floors)
    left = health[:, None] - out.first[:, None] - STOREY_LOSS * floors
    passed = np.where(floors < out.storeys[:, None], left, 0.0).clip(0)
    end = health - out.last
    outside = np.where(end > 0, end + FIXED_REWARD, -FIXED_PENALTY)
    return float(passed.sum() + outside.sum())


def _of_people(world: World, who: np.ndarray) -> Losses:
    """(n,) each: what lies before these people."""
    bodies, building = world.bodies, world.building
    burning = world.flames.arrival <= world.time + SOON
    losses = all_losses(building, burning)
    place, shaft = bodies.place[who], bodies.stairwell[who]
    down = np.flatnonzero(shaft >= 0)
    feet, lowest = _feet(building)
    place[down] = feet[shaft[down]]
    mine = Losses(*(field[place] for field in losses))
    waits = (bodies.stairs_until[who[down]] - world.time).clip(0)
    wait = HEALTH_RATE * FRAMES_PER_SECOND * waits
    more = bodies.floor[who[down]] - lowest[shaft[down]] - 1
    mine.first[down] = wait
    mine.last[down] += wait + STOREY_LOSS * more
    mine.storeys[down] += more
    return mine


def all_losses(building: Building, burning: np.ndarray) -> Losses:
    """(places,) each, for the whole building; burning: (floors, rows, cols) bool."""
    size = building.kind[0].size
    losses = Losses(*np.full((3, building.kind.size), np.inf))
    losses.storeys[:] = 0
    for floor, ways in enumerate(_ways_out(building)):
        part = slice(floor * size, (floor + 1) * size)
        metres = _on_foot(building, floor, burning[floor].tobytes())
        for way, first in zip(ways, metres, strict=True):
            last, storeys = first.copy(), way.down
            if way.foot >= 0:
                last += STOREY_LOSS * way.down + losses.last[way.foot]
                storeys += int(losses.storeys[way.foot])
            better = last < losses.last[part]
            losses.first[part][better] = first[better]
            losses.last[part][better] = last[better]
            losses.storeys[part][better] = storeys
    return losses


@lru_cache(maxsize=32)
def _on_foot(building: Building, floor: int, burning: bytes) -> tuple[np.ndarray, ...]:
    """For each way out of a floor, what is lost on foot till there, (size,) each.

    Kept, since from one placement to the next most floors burn alike.
    """
    shape = building.kind.shape
    flames = np.zeros(shape, dtype=bool)
    flames[floor] = np.frombuffer(burning, dtype=bool).reshape(shape[1:])
    places = [flames, beside_flames(building, flames)]
    harm = np.select(places, [BURN_LOSS, HEAT_LOSS], 0.0)
    per_second = HEALTH_RATE * FRAMES_PER_SECOND * SEARCH + harm
    nav = navigation_of(building)
    part = slice(floor * nav.floor_size, (floor + 1) * nav.floor_size)
    cost = per_second / WALKING_SPEED
    ways = _ways_out(building)[floor]
    return tuple(nav.distances(way.places, cost)[part] for way in ways)


@lru_cache(maxsize=8)
def _ways_out(building: Building) -> tuple[tuple[Way, ...], ...]:
    """Of every floor, its exits and entrances of stairs that lead down."""
    feet, lowest = _feet(building)
    shaft = building.stairwell_of
    return tuple(
        tuple(
            Way(_cells(building, mark), -1, 0)
            if building.landmarks[mark].kind is Kind.EXIT
            else Way(
                _cells(building, mark),
                int(feet[shaft[mark]]),
                floor - int(lowest[shaft[mark]]),
            )
            for mark in building.ways_out(floor)
        )
        for floor in range(building.floors)
    )


def _cells(building: Building, mark: int) -> tuple[int, ...]:
    landmark = building.landmarks[mark]
    cells = navigation_of(building).places_of(landmark.floor, landmark.cells)
    return tuple(cells.tolist())


@lru_cache(maxsize=8)
def _feet(building: Building) -> tuple[np.ndarray, np.ndarray]:
    """(stairwells,) the place where people come out of each, and its floor."""
    lowest = [well.lowest for well in building.stairwells]
    feet = [
        _cells(building, well.entrances[floor][0])[0]
        for well, floor in zip(building.stairwells, lowest, strict=True)
    ]
    return np.array(feet, dtype=int), np.array(lowest, dtype=int)
