"""Scripted fires beyond the simplest; add your own here and name it in `FIRES`.

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
    """Attacks the ways people are using: the cell that most are about to cross."""

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """The busiest free cell of all floors, a random one among equals."""
        traffic = self._traffic(world)
        traffic[~free_places(world)] = 0
        if not traffic.any():
            return RandomFire().decide(world, rng)
        return decision_at(world, rng.choice(np.flatnonzero(traffic == traffic.max())))

    @staticmethod
    def _traffic(world: World) -> np.ndarray:
        """(places,) how many people will cross each place on the way to their goals."""
        nav, bodies = navigation_of(world.building), world.bodies
        traffic = np.zeros(nav.places)
        for i in np.flatnonzero(bodies.walking).tolist():
            mark, p = int(bodies.landmark[i]), int(bodies.place[i])
            goal = nav.places_at(bodies.floor[i : i + 1], bodies.target[i : i + 1])
            chain = nav.walk(p, mark) if mark >= 0 else nav.straight(p, int(goal[0]))
            np.add.at(traffic, list(set(chain)), 1)
        return traffic


class Replay:
    """Sources of an earlier run once more: the same fires for others."""

    def __init__(self, sources: Iterable[Source]):
        self.sources = sorted(sources, key=lambda source: source.time)

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """The next source, once its time has come; rule D6 holds as for any fire."""
        left = self.sources[len(world.flames.sources) :]
        return left[0][:3] if left and left[0].time <= world.time else None
