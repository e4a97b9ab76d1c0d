"""Stairs: people leave a floor, pass landings and come out at the lowest floor.

Clauses: A3, F8.  On the stairs nobody is seen and nobody is in the way; the bottleneck
is the entrance at either end [A3, chosen].  Nobody walks up.  The paper's entrances
join a floor's platform and its staircases; ours stand between room and stairwell, and
the platform is part of the stairs: who enters is on the stairs [A3, deviation].

    i   person;  p  place;  k  stairwell
"""

from math import inf

import numpy as np

from reference.building import Stairwell
from reference.humans import arrive
from reference.motion import DIAMETER
from reference.navigation import navigation_of
from reference.paper import STAIRS_METRES
from reference.world import NOBODY, NOWHERE, World


def enter(world: World, i: int, entrance: int) -> None:
    """Move a human who has touched an entrance onto its stairs, which lead down."""
    building, bodies = world.building, world.bodies
    nav, k = navigation_of(building), building.stairwell_of[entrance]
    cells = nav.places_of(int(bodies.floor[i]), building.stairwells[k].cells)
    bodies.stairwell[i], bodies.leader[i], bodies.landmark[i] = k, NOBODY, NOWHERE
    bodies.stairs_until[i] = world.time + _seconds(world, i)
    bodies.place[i] = cells[i % len(cells)]
    bodies.position[i] = nav.centres[bodies.place[i]]


def descend(world: World, i: int) -> int | None:
    """Bring a human one storey down; return the floor of a landing passed, if any.

    At the lowest floor the human steps out, or waits for a free place to do so.
    """
    bodies = world.bodies
    well = world.building.stairwells[bodies.stairwell[i]]
    if bodies.floor[i] > well.lowest:
        bodies.floor[i] -= 1
        bodies.place[i] -= world.building.kind[0].size
        if bodies.floor[i] > well.lowest:
            bodies.stairs_until[i] += _seconds(world, i)
            return int(bodies.floor[i])
    _step_out(world, i, well)
    return None


def _seconds(world: World, i: int) -> float:
    """Time for one storey: on stairs, too, some are faster than others."""
    return STAIRS_METRES / float(world.bodies.pace[i])


def _step_out(world: World, i: int, well: Stairwell) -> None:
    """Step out into an entrance cell that nobody stands in, if there is one."""
    bodies, nav, floor = world.bodies, navigation_of(world.building), well.lowest
    others = bodies.position[bodies.walking & (bodies.floor == floor)]
    for mark in well.entrances[floor]:
        for p in nav.goals[mark].tolist():
            spot = nav.centres[p]
            if (np.hypot(*(others - spot).T) < DIAMETER).any():
                continue
            bodies.place[i], bodies.position[i] = p, spot
            bodies.anchor[i], bodies.anchor_time[i] = spot, world.time
            bodies.stairwell[i], bodies.stairs_until[i] = NOWHERE, inf
            arrive(world.minds[i], mark, nav.beyond(p, well.areas[floor]))
            return
