"""Scripted fires beyond the simplest; to add one, see the folder's `__init__`.

Clauses: D2, D6.

    p   place
"""

from collections.abc import Iterable

import numpy as np

from reference.fire import Decision, decision_at, free_places
from reference.navigation import navigation_of
from reference.strategies import RandomFire
from reference.world import Source, World


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


class Replay:
    """Lights the sources of an earlier run again: the same fires for others."""

    def __init__(self, sources: Iterable[Source]):
        self.sources = sorted(sources, key=lambda source: source.time)

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Choose the next source once its time has come; rule D6 holds."""
        left = self.sources[len(world.flames.sources) :]
        return left[0][:3] if left and left[0].time <= world.time else None
