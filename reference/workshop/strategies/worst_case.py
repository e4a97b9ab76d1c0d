"""The worst fire and the worst errors of observation: Eq. 5, approximated greedily.

[F4] The appendix says that R_w = min E[R] over all attacks cannot be computed, and
takes the greedy worst case (GWC): at every state the action of lowest reward. Each
decision is treated alone, so that the cost is linear in their number. Eq. 5 attacks
what robots observe, as `DisturbedRobots` does; `WorstCase` attacks by fires. Eq. 6's
R_w, if everybody dies, is below both: see `bounds`.

    δ  error of what robots observe;  ε  its largest size, metres
"""

from collections.abc import Sequence
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.random import Generator as Rng
from numpy.typing import ArrayLike
from scipy.sparse.csgraph import dijkstra

from reference.fire import Decision, FireStrategy, RandomFire
from reference.paper import Scenario
from reference.rewards import group_reward
from reference.robots import Destinations, NoRobots, RobotStrategy
from reference.simulation import Simulation
from reference.workshop.engine import run_to_end
from reference.workshop.strategies.fires import BusiestFire, busiest
from reference.workshop.strategies.observed import known_map_of
from reference.world import Robot, World

CANDIDATES = 4
"""[F4, chosen] cells tried at a decision: a second or two of one core for an evacuation
of the paper's building, ten where the book plays."""

DRAWS = 4
"""[F4, chosen] errors tried at a decision of the robots, besides none: five seconds of
one core for an evacuation of the paper's building, most of a minute where the book
plays."""


class WorstCase:
    """Simulates the busiest cells, each to the end, and lights the worst.

    [F4, Eq. 5, chosen] The robots play by their own strategy. Later fires are those of
    `BusiestFire`: without them this one would never block the first of two exits. All
    candidates are tried with the same random numbers. These are new ones, so the fire
    does not know how flames will really spread.
    """

    def __init__(self) -> None:
        self.robots: RobotStrategy = NoRobots()
        self.scenario = Scenario()

    def meet(self, robots: RobotStrategy, scenario: Scenario) -> None:
        """Say whom it attacks; it asks copies of the robots what they would do."""
        self.robots = robots
        self.scenario = scenario

    def decide(self, world: World, rng: Rng) -> Decision | None:
        """Light the candidate that leaves least reward; a random cell if none [D2]."""
        candidates = busiest(world, CANDIDATES)
        if not candidates:
            return RandomFire().decide(world, rng)
        robots = self.robots
        if isinstance(robots, DisturbedRobots):  # as they remember now, without errors
            robots = robots.robots
        tries = [(robots, FirstDecision(p, BusiestFire())) for p in candidates]
        return candidates[_worst_try(world, self.scenario, tries, rng)]


class DisturbedRobots:
    """Robots that observe with errors: at every decision the worst of a few draws.

    [F4, Eq. 5, chosen] Each δ, and none, leads to destinations; they are tried out to
    the end, without further errors, and those that leave least reward are taken. The
    fire plays by its own strategy there, `WorstCase` as `BusiestFire`.
    """

    def __init__(
        self, robots: RobotStrategy, fire: FireStrategy, scenario: Scenario, most: float
    ):
        """most: ε, metres."""
        self.robots = robots
        self.scenario = scenario
        self.most = most
        self.fire = BusiestFire() if isinstance(fire, WorstCase) else fire

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Send robots where the worst of these errors lets them go."""
        at_work = {robot.body for robot in robots}
        tries: list[tuple[FirstDecision, FireStrategy]] = []
        for most in (0.0, *[self.most] * DRAWS):
            seen = with_errors(world, most, rng)
            team = [robot for robot in seen.robots if robot.body in at_work]
            guides = deepcopy(self.robots)
            answer = guides.decide(seen, team, rng)
            tries.append((FirstDecision(answer, guides), self.fire))

        taken, _ = tries[_worst_try(world, self.scenario, tries, rng)]
        self.robots = taken.strategy  # it remembers what it has seen
        return taken.decisions[0]


def copy_of(world: World) -> World:
    """Copy a world; changing the copy leaves it as it is."""
    return deepcopy(world, {id(world.building): world.building})


def with_errors(world: World, most: float, rng: Rng) -> World:
    """Copy a world as robots observe it with a random error δ, |δ| ≤ most metres.

    [F4, chosen] δ shifts people, robots and fire sources in x and in y, for all robots
    alike [C4]; storeys, counts, time and the grid are exact.
    """
    seen = copy_of(world)
    bodies = seen.bodies
    sources = seen.flames.sources
    known = known_map_of(world.building)

    def shifted(position: ArrayLike) -> np.ndarray:
        return np.asarray(position) + most * rng.uniform(-1, 1, np.shape(position))

    bodies.position = shifted(bodies.position)
    bodies.place = known.places(np.column_stack([bodies.position, bodies.floor]))
    for robot in seen.robots:
        robot.position = shifted(robot.position)
        robot.place = int(known.places(np.array([*robot.position, robot.floor])))
    for k, source in enumerate(sources):
        x, y = shifted((source.x, source.y)).tolist()
        sources[k] = replace(source, x=x, y=y)
    return seen


# -- Trying out ---------------------------------------------------------------------


class FirstDecision:
    """A strategy that is told its next decision; then it decides itself."""

    def __init__(self, decision: Any, strategy: Any):
        self.decisions = [decision]
        self.strategy = strategy

    def decide(self, *seen: Any) -> Any:
        """Take that decision; later, the strategy's own."""
        return self.decisions.pop() if self.decisions else self.strategy.decide(*seen)


def _worst_try(world: World, scenario: Scenario, tries: Sequence[Any], rng: Rng) -> int:
    """Find which robots and fire leave least reward, each tried in the same future."""
    seed = int(rng.integers(2**32))
    futures = [
        another_future(world, scenario, robots, fire, seed) for robots, fire in tries
    ]
    run_to_end(futures)
    return int(np.argmin([group_reward(future.events) for future in futures]))


def another_future(
    world: World,
    scenario: Scenario,
    robots: RobotStrategy,
    fire: FireStrategy,
    seed: int,
) -> Simulation:
    """Continue copies of a world and its strategies, with new random numbers.

    [D7, chosen] Exponential delays have no memory: what is left of one is distributed
    like a new one. So flames spread anew from all that burns now, each cell for as long
    as it burns.
    """
    world = copy_of(world)
    future = Simulation(world.building, scenario, robots, fire, seed, world)
    flames = world.flames
    begun = flames.arrival <= world.time
    if not begun.any():
        return future

    # a cell ignites none of its neighbours later than it burns out
    borders = future.spread.delays
    left = np.where(begun, flames.arrival - world.time, 0) + scenario.burn_seconds
    too_late = borders.data >= left.ravel().repeat(np.diff(borders.indptr))
    borders.data[too_late] = np.inf

    delay = dijkstra(borders, indices=np.flatnonzero(begun), min_only=True)
    later = world.time + delay.reshape(begun.shape)
    flames.arrival = np.where(begun, flames.arrival, later)
    return future
