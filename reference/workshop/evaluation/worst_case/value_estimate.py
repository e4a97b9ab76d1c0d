"""Estimate the reward still to come, where a simulation is broken off.

Clauses: F4, F8, B7, D7.  Everybody is assumed to take the cheapest way out: crude, but
a hundredth of the cost of simulating the rest.  Losses are health points.
"""

import numpy as np

from reference import paper
from reference.building import Building
from reference.flames import cells_beside
from reference.paper import FIXED_PENALTY, FIXED_REWARD, LOSS_PER_SECOND
from reference.workshop.traffic import stairwell_feet, ways_outside
from reference.world import World

SEARCH = 3.0
"""[F4, chosen] metres walked per metre of the shortest way: people search, robots fetch
and queues form. With 3 the estimate was right on average for `sweep`, within 500 points
of 8000, over moments of random, greedy and exit-burning fires: before version 0.5.0,
when exits could burn."""

SOON = 30.0
"""[F4, chosen] seconds: people meet the flames as they will be this much later."""

STOREY_LOSS = LOSS_PER_SECOND * paper.STAIRS_SECONDS

Losses = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Costs of the cheapest way out from n places, (n,) each: health lost till the floor is
left, till the building is left (inf: no way), and storeys walked down on it."""


def value_estimate(world: World) -> float:
    """Estimate the reward that those inside still bring, if no more fires break out.

    [F4, chosen] Everybody takes the cheapest way, SEARCH times as long as it is, with
    the flames as they will be SOON. They walk through these at a cost of health, as
    stuck people do. Flames must be known that far: ask a simulation of its own
    future.
    """
    bodies = world.bodies
    who = np.flatnonzero(bodies.inside)
    health, (off_floor, outside, storeys) = bodies.health[who], _of_people(world, who)
    floors = np.arange(world.building.floors)
    left = health[:, None] - off_floor[:, None] - STOREY_LOSS * floors
    passed = np.where(floors < storeys[:, None], left, 0.0).clip(0)
    end = health - outside
    got_out = np.where(end > 0, end + FIXED_REWARD, -FIXED_PENALTY)
    return float(passed.sum() + got_out.sum())


def _of_people(world: World, who: np.ndarray) -> Losses:
    """Look up the losses before these people, (n,); those on stairs come out first."""
    bodies, building = world.bodies, world.building
    everywhere = _of_places(building, world.flames.arrival <= world.time + SOON)
    place, well = bodies.place[who], bodies.stairwell[who]
    down = np.flatnonzero(well >= 0)
    place[down] = stairwell_feet(building)[well[down]]
    off_floor, outside, storeys = (field[place] for field in everywhere)
    lowest = np.array([well.lowest for well in building.stairwells], dtype=int)
    wait = LOSS_PER_SECOND * (bodies.stairs_until[who[down]] - world.time).clip(0)
    more = bodies.floor[who[down]] - lowest[well[down]] - 1
    off_floor[down] = wait
    outside[down] += wait + STOREY_LOSS * more
    storeys[down] += more
    return off_floor, outside, storeys


def _of_places(building: Building, burning: np.ndarray) -> Losses:
    """Find every place's cheapest way out; burning: (floors, rows, cols) bool."""
    beside = cells_beside(building, burning)
    harm = np.select([burning, beside], [paper.BURN_LOSS, paper.HEAT_LOSS], 0.0)
    cost = (LOSS_PER_SECOND * SEARCH + harm) / paper.WALKING_SPEED
    on_foot, outside, storeys = ways_outside(building, cost, STOREY_LOSS)
    best = outside.argmin(axis=0)
    here = best, np.arange(len(best))
    return on_foot[here], outside[here], storeys[best]
