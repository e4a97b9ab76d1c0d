"""Scripted fires beyond the simplest; to add one, see the folder's `__init__`.

Clauses: D2, D6.

    p   place
"""

import numpy as np

from reference.fire import Decision, decision_at, free_places
from reference.navigation import navigation_of
from reference.strategies import RandomFire
from reference.world import World


class GreedyFire:
    """Attacks the ways people use: lights the cell that most are about to cross."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose the busiest free cell of all floors, at random among equals."""
        traffic = self._traffic(world)
        traffic[~free_places(world)] = 0
        if not traffic.any():
            return RandomFire().decide(world, rng)
        return decision_at(world, rng.choice(np.flatnonzero(traffic == traffic.max())))

    @staticmethod
    def _traffic(world: World) -> np.ndarray:
        """Walk everyone to their goals; (places,) how many people cross each place."""
        nav, bodies = navigation_of(world.building), world.bodies
        traffic = np.zeros(nav.places)
        for i in np.flatnonzero(bodies.walking).tolist():
            mark, p = int(bodies.landmark[i]), int(bodies.place[i])
            goal = nav.places_at(bodies.floor[i : i + 1], bodies.target[i : i + 1])
            chain = nav.walk(p, mark) if mark >= 0 else nav.straight(p, int(goal[0]))
            np.add.at(traffic, list(set(chain)), 1)
        return traffic
