"""The environment: robots and the fire as agents, one decision a step.

Methods are those of PettingZoo's parallel API.  A robot is terminated when its floor
and all above it are empty [C8], the fire when nobody is inside any more.  When time is
up the others are truncated.

    step        one decision of the robots, 5 s; the fire's action is read at every k-th
    agents      "robot_0", ..., "fire_0"; a side that a strategy plays is not among them
    normalised  coordinates in which the main body of the building is [-1, 1] x [-1, 1]
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import Building
from reference.fire import Decision, FireStrategy
from reference.game import observations
from reference.paper import (
    InputError,
    Scenario,
    check_action,
    check_objects,
    check_seed,
)
from reference.rewards import fire_reward, group_reward
from reference.robots import Destination, Destinations, RobotStrategy
from reference.simulation import Simulation
from reference.world import Robot, World

FIRE = "fire_0"

DECIMALS = 4
"""[C5, chosen] of metres: so in float32 an agent can name exactly the point that a
strategy names, such as the middle of a door between two cells."""

Observations = dict[str, dict[str, np.ndarray]]
Infos = dict[str, dict[str, float]]
StepResult = tuple[
    Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos
]
"""Observations, rewards, terminations, truncations and infos, by agent."""

Advance = Callable[[Sequence[Simulation]], None]
"""Runs simulations up to their next decision or their end, in whatever order."""


# -- Actions ------------------------------------------------------------------------


def action_size(agent: str) -> int:
    """Size of an action: a robot's x, y [C5]; the fire's floor, x, y [D2]."""
    return 3 if agent == FIRE else 2


def destination(building: Building, action: np.ndarray) -> Destination | None:
    """Convert a robot's action, (2,) normalised, to metres [C5]; nan: keep the old."""
    if np.isnan(action).all():
        return None
    return _metres(building, action)


def fire_decision(building: Building, action: np.ndarray) -> Decision:
    """Convert the fire's action, (3,) normalised, to a floor and metres [D2].

    [-1, 1] is cut into equal shares, one per floor; the first number chooses a share.
    The paper has a discrete branch instead, as our networks have [D2, deviation].
    """
    share = (float(action[0].clip(-1, 1)) + 1) / 2
    floor = min(int(share * building.floors), building.floors - 1)
    return floor, *_metres(building, action[1:])


def _metres(building: Building, action: np.ndarray) -> tuple[float, float]:
    """Convert normalised x and y, clipped to the main body, to metres with DECIMALS."""
    metres = observations.from_normalised(building, action.clip(-1, 1))
    x, y = metres.astype(np.float64).round(DECIMALS).tolist()
    return x, y


@dataclass
class AgentRobots:
    """A strategy that does what the robots' agents chose, in the order of robots."""

    chosen: Sequence[Destination | None] = ()

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> Destinations:
        """Return the destinations chosen last [C7]."""
        first = len(world.bodies)
        return [self.chosen[robot.body - first] for robot in robots]


@dataclass
class AgentFire:
    """A strategy that does what the fire's agent chose."""

    chosen: Sequence[Decision | None] = (None,)

    def decide(self, world: World, rng: np.random.Generator) -> Decision | None:
        """Return the place chosen last."""
        return self.chosen[0]


# -- The environment ----------------------------------------------------------------


def until_next_decision(simulations: Sequence[Simulation]) -> None:
    """Run each simulation to its next decision or its end, one after the other."""
    for simulation in simulations:
        for _ in range(simulation.decision_ticks):
            if not simulation.done:
                simulation.step()


class Environment:
    """One building and one scenario, episode after episode, for learners of one's own.

    The learners of this book play simulations themselves: see `learning.rollouts`.

    simulation  what runs now;  agents  who has not left, of possible_agents

    An observation has a "vector" (`observations.vector_layout`) and the "grid", both
    float32.  An action is clipped to [-1, 1]: a robot's is (2,) x, y, or all nan to
    keep the old destination; the fire's is (3,) a floor, x, y.  Robots are paid the
    group's reward [E5], the fire its own [D6].  An agent's info `acts` is 1 if its next
    action is read and else 0.
    """

    def __init__(
        self,
        building: Building,
        scenario: Scenario | None = None,
        robots: RobotStrategy | None = None,
        fire: FireStrategy | None = None,
        advance: Advance = until_next_decision,
    ):
        """robots, fire: None for agents, or the strategy that plays this side.

        advance: plays to the next decision; the workshop's engine has a quick one.
        Raises InputError as `Simulation` does, and if there is nobody to act.
        """
        check_objects(building, scenario, robots, fire)
        self.building = building
        self.scenario = scenario or Scenario()
        self.layout = observations.vector_layout(building, self.scenario)
        self._advance = advance

        count = 0
        if robots is None:
            robots = AgentRobots()
            count = self.scenario.robots_per_floor * building.floors
        self._robot_agents = [f"robot_{k}" for k in range(count)]
        self.possible_agents = self._robot_agents.copy()
        if fire is None:
            fire = AgentFire()
            self.possible_agents.append(FIRE)
        self._robots = robots
        self._fire = fire
        if not self.possible_agents:
            raise InputError("nobody acts: leave the robots or the fire to an agent")
        self.agents: list[str] = []
        self._seeds = np.random.default_rng()
        self._begin(0)

    def _begin(self, seed: int) -> None:
        """Begin a simulation that carries out the agents' actions."""
        self.simulation = Simulation(
            self.building, self.scenario, self._robots, self._fire, seed
        )

    def reset(self, seed: int | None = None) -> tuple[Observations, Infos]:
        """Begin a new episode: observations and infos. Same seed, same episode.

        Without a seed the next one is drawn from the last one given, or at random.
        Raises InputError for a seed that is no whole number of 0 or more.
        """
        if seed is None:
            seed = int(self._seeds.integers(2**32))
        else:
            check_seed(seed)
            self._seeds = np.random.default_rng(seed)
        self._begin(seed)
        self.agents = self.possible_agents.copy()
        return self._observed(self.agents), self._infos(self.agents)

    def step(self, actions: Mapping[str, Any]) -> StepResult:
        """Take one decision of all agents; play until the next one.

        Actions of agents that have left are ignored. Raises InputError, which names
        the agent, for one that is missing or invalid, and RuntimeError before `reset`.
        """
        run = self.simulation
        agents = self.agents
        if not agents and not run.done:
            raise RuntimeError("call reset() before step()")
        already = len(run.events)
        chosen: dict[str, Any] = {}
        for agent in agents:
            read = fire_decision if agent == FIRE else destination
            size = action_size(agent)
            action = check_action(agent, actions, size, keep=agent != FIRE)
            chosen[agent] = read(self.building, action)
        if isinstance(run.robot_strategy, AgentRobots):
            run.robot_strategy.chosen = [chosen.get(a) for a in self._robot_agents]
        if isinstance(run.fire_strategy, AgentFire):
            run.fire_strategy.chosen = [chosen.get(FIRE)]
        self._advance([run])

        # rewards
        events = run.events[already:]
        rewards = dict.fromkeys(agents, group_reward(events))  # [E5]
        if FIRE in agents:
            rewards[FIRE] = fire_reward(events)  # [D6]

        # who leaves
        at_work = self._at_work()
        ended = {agent: not at_work[agent] for agent in agents}  # [C8]
        cut = {agent: run.done and at_work[agent] for agent in agents}
        self.agents = [a for a in agents if not (ended[a] or cut[a])]
        return self._observed(agents), rewards, ended, cut, self._infos(agents)

    def _at_work(self) -> dict[str, bool]:
        """Tell which agents have work to do: the fire, while anybody is inside."""
        world = self.simulation.world
        robots = observations.robots_at_work(world).tolist()
        at_work = {FIRE: any(world.occupancy)}
        return at_work | dict(zip(self._robot_agents, robots, strict=False))

    def _observed(self, agents: list[str]) -> Observations:
        """Collect what each agent observes now [C1] [C4] [D1], in arrays of its own."""
        world = self.simulation.world
        vectors = {FIRE: observations.fire_vectors([world], self.layout)[0, 0]}
        if self._robot_agents:
            robots = observations.robot_vectors([world], self.layout)[0]
            vectors |= zip(self._robot_agents, robots, strict=True)
        grid = observations.grid(world)
        return {
            agent: {"vector": vectors[agent], "grid": grid.astype(np.float32)}
            for agent in agents
        }

    def _infos(self, agents: list[str]) -> Infos:
        """Tell whose next action is read: the fire's at its turn, with sources left."""
        acts = self._at_work() | {FIRE: self.simulation.fire_turn}
        done = self.simulation.done
        return {agent: {"acts": float(acts[agent] and not done)} for agent in agents}
