"""Placements for a fire, those beside the busiest ways first.

Clauses: D2, D6, F4.
"""

from functools import lru_cache

import numpy as np

from reference.building import Building
from reference.fire import Decision, occupied
from reference.game.environment import fire_decision
from reference.game.moments import Moment
from reference.game.observations import fire_vector
from reference.paper import Scenario
from reference.workshop.landmarks.of_fire import FIRE_FEATURES, FireOptions
from reference.world import World

CROSS = [FIRE_FEATURES.index(name) for name in ("cross", "come")]
"""Counts of people, of the floor and from above, whose cheapest way out passes."""


def placements(world: World, scenario: Scenario) -> list[Decision]:
    """List free cells beside ways, people and robots; none if nobody is inside.

    [F4, chosen] They are the options of a learned fire's pointer head: one for each
    landmark, group and robot of floors where somebody is or still comes through, about
    60 in the paper's building. Those that most people's cheapest ways out pass come
    first: mostly the worst are among them. scenario: the simulation's own.
    """
    if not any(world.occupancy):
        return []
    moment = Moment.of(world, fire_vector(world, scenario)[None], np.ones(1, bool))
    options = _options(world.building, scenario)(moment)
    there = np.flatnonzero(options.action_mask[0])
    crossing = options.features[0][:, CROSS].sum(axis=1)
    busiest = there[np.argsort(-crossing[there], kind="stable")]
    places = options.places[0][busiest]
    found = dict.fromkeys(fire_decision(world.building, p) for p in places)
    return [place for place in found if not occupied(world, *place)]


@lru_cache(maxsize=8)
def _options(building: Building, scenario: Scenario) -> FireOptions:
    return FireOptions(building, scenario)
