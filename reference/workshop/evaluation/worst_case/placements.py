"""Placements for a fire, those beside the busiest ways first.

Clauses: D2, D6, F4.
"""

import numpy as np

from reference.fire import Decision, decision_at, free_places
from reference.navigation import navigation_of
from reference.workshop.traffic import traffic
from reference.world import World


def placements(world: World) -> list[Decision]:
    """List the free cells nearest to doors, entrances and exits of floors in use.

    [F4, chosen] Those that most people's cheapest ways out pass come first: mostly the
    worst are among them. A floor is in use where, or above which, somebody is inside.
    """
    bodies, building = world.bodies, world.building
    stairs = bodies.stairwell[bodies.inside & (bodies.stairwell >= 0)]
    walking = bodies.place[bodies.walking]
    passing = traffic(building, walking, stairs, world.flames.cost)
    free, people = free_places(world), passing.cross + passing.come
    distance, places = navigation_of(building).distance, []
    for mark in building.landmarks:
        metres = np.where(free, distance[mark.index], np.inf)
        if world.anybody_at_or_above(mark.floor) and np.isfinite(metres).any():
            places.append(int(metres.argmin()))
    places.sort(key=lambda place: -people[place])
    return [decision_at(world, place) for place in dict.fromkeys(places)]
