"""The fire that looks ahead: it simulates some placements and takes the worst.

Clauses: F4, D2, D6.  The greedy worst case (GWC), with a simulation to tell what is
worst. It treats each decision alone, so that the cost is linear in their number and not
exponential.
"""

from typing import NamedTuple

import numpy as np

from reference.fire import Decision
from reference.game.rewards import group_reward
from reference.simulation import Simulation
from reference.strategies import RandomFire
from reference.workshop.evaluation.worst_case.placements import placements
from reference.workshop.evaluation.worst_case.value_estimate import value_estimate
from reference.workshop.strategies.fires import BusiestFire
from reference.world import World

CHOICES, HORIZON = 4, 60.0
"""[F4, chosen] placements tried at a decision, and seconds simulated of each: about
ten seconds of one core for the paper's building. On four seeds more seconds, or more
placements for fewer seconds, did no more harm to `sweep`."""


class Foreseen(NamedTuple):
    """The reward expected after a placement, health points."""

    reward: float
    placement: Decision


class WorstCase:
    """A fire that breaks out where a look-ahead simulation says it is worst.

    [F4, Eq. 5, chosen] Each of the busiest placements is simulated up to a horizon,
    with the robots' own strategy; a `value_estimate` stands for the rest. Later fires
    follow the rule of `BusiestFire`: without them it would never take the first of two
    exits. All placements share the seed of their future, so that they are compared
    under the same chances. It is a fresh seed, so that the fire does not know how
    flames will really spread. The least of such values is biased low: `gap` re-scores
    it.

    foreseen  at the last decision, the worst first; among equals the busiest, since
              what can wait in one future may be too late in another
    """

    def __init__(self, choices: int = CHOICES, horizon: float = HORIZON):
        """choices: how many placements are tried;  horizon: seconds of each."""
        self.choices, self.horizon = choices, horizon
        self.foreseen: list[Foreseen] = []
        self._now: Simulation | None = None

    def watch(self, now: Simulation) -> None:
        """Save the simulation, which shows itself before each decision."""
        self._now = now

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Try out the busiest placements, take the worst; a random cell if none."""
        now, self._now = self._now, None
        assert now is not None, "a Simulation asks this fire, after showing itself"
        choice = placements(now.world)[: self.choices]
        if not choice:
            return RandomFire().decide(world, rng)
        future = now.another_future(int(rng.integers(2**32)))
        found = [self._simulate(future, placement) for placement in choice]
        self.foreseen = sorted(found, key=lambda each: each.reward)
        return self.foreseen[0].placement

    def _simulate(self, future: Simulation, placement: Decision) -> Foreseen:
        """Simulate a fire there up to the horizon, and estimate what comes after."""
        run = future.copy()
        run.fire_strategy = FirstAt(placement)
        end = run.world.time + self.horizon - 1e-9
        while not run.done and run.world.time < end:
            run.step()
        reward = group_reward(run.events[len(future.events) :])
        rest = 0.0 if run.done else value_estimate(run.world)
        return Foreseen(reward + rest, placement)


class FirstAt(BusiestFire):
    """Lights one place, or none, at its next decision; then acts as `BusiestFire`."""

    def __init__(self, placement: Decision | None):
        self.first = [placement]

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Take that place; later, the cell that most people will cross."""
        return self.first.pop() if self.first else super().decide(world, rng)
