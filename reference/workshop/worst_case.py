"""The worst fire that a simulation finds: Eq. 5, approximated greedily.

Clauses: D2, D7, F4.  The appendix says that R_w = min E[R] over all attacks cannot be
computed, and takes the greedy worst case (GWC): at every state the action of lowest
reward. Each decision is treated alone, so that the cost is linear in their number.
Eq. 6's R_w, if everybody dies, is below this: see `bounds`.
"""

from copy import deepcopy

import numpy as np
from scipy.sparse.csgraph import dijkstra

from reference.fire import Decision
from reference.game.rewards import group_reward
from reference.paper import BURN_SECONDS, Scenario
from reference.simulation import Simulation
from reference.strategies import FireStrategy, NoRobots, RandomFire, RobotStrategy
from reference.workshop.lockstep import to_the_end
from reference.workshop.strategies.fires import BusiestFire, busiest
from reference.world import World

CANDIDATES = 4
"""[F4, chosen] cells tried at a decision: some ten seconds of one core for an
evacuation of the paper's building."""


class WorstCase:
    """Simulates the busiest cells, each to the end, and lights the worst.

    [F4, Eq. 5, chosen] The robots play by their own strategy. Later fires act as
    `BusiestFire`: without them this one would never take the first of two exits. All
    candidates meet the same chances, which are fresh, so that the fire does not know
    how flames will really spread.
    """

    def __init__(self) -> None:
        self.robots: RobotStrategy = NoRobots()
        self.scenario = Scenario()

    def meet(self, robots: RobotStrategy, scenario: Scenario) -> None:
        """Say whom it attacks; it asks copies of the robots what they would do."""
        self.robots, self.scenario = robots, scenario

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Light the candidate that leaves least reward; a random cell if none."""
        candidates = busiest(world, CANDIDATES)
        if not candidates:
            return RandomFire().decide(world, rng)
        seed = int(rng.integers(2**32))
        meets = world, self.scenario, self.robots
        futures = [another_future(*meets, FirstAt(p), seed) for p in candidates]
        to_the_end(futures)
        rewards = [group_reward(future.events) for future in futures]
        return candidates[int(np.argmin(rewards))]


def another_future(
    world: World,
    scenario: Scenario,
    robots: RobotStrategy,
    fire: FireStrategy,
    seed: int,
) -> Simulation:
    """Continue copies of a world and of who plays in it, with fresh chances.

    [D7, chosen] Exponential delays have no memory: what is left of one is distributed
    like a new one. So flames spread anew from all that burns now, each cell for as long
    as it burns.
    """
    robots, fire, world = deepcopy(robots), deepcopy(fire), world.copy()
    after = Simulation(world.building, scenario, robots, fire, seed, world)
    flames, begun = world.flames, world.flames.arrival <= world.time
    if begun.any():
        borders, lit = after.spread.delays, np.flatnonzero(begun)
        left = np.where(begun, flames.arrival - world.time, 0) + BURN_SECONDS
        too_late = borders.data >= left.ravel().repeat(np.diff(borders.indptr))
        borders.data[too_late] = np.inf
        delay = dijkstra(borders, indices=lit, min_only=True).reshape(begun.shape)
        flames.arrival = np.where(begun, flames.arrival, world.time + delay)
    return after


class FirstAt(BusiestFire):
    """Lights one place at its next decision; then acts as `BusiestFire`."""

    def __init__(self, place: Decision):
        self.first = [place]

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Take that place; later, the cell that most people will cross."""
        return self.first.pop() if self.first else super().decide(world, rng)
