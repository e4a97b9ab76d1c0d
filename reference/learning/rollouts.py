"""Rollouts: play whole episodes, given weights, a scenario and seeds.

Clauses: C8, E3, E6.  A job plays its episodes in lockstep, so that one call of
a network serves all of them; an episode's randomness depends on its own seed alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import building_of
from reference.events import FireRefused
from reference.game.environment import (
    Environment,
    action_size,
    until_next_decision,
)
from reference.game.observations import headed, robots_at_work
from reference.game.rewards import fire_reward
from reference.learning.experience import GroupDecision, Trajectory, trajectory_of
from reference.learning.players import Moment, Player, Recorded
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import FireStrategy, RobotStrategy

PLAYER_STREAM: dict[Side, int] = {"robots": 1, "fire": 2}
"""Each side's actions have a generator of their own, beside the simulation's."""

Advance = Callable[[Sequence[Simulation]], None]
"""Runs simulations up to their next decision or their end, in whatever order."""


@dataclass(frozen=True)
class Job:
    """Episodes to play; robots and fire: a side to be recorded, or a strategy.

    plan  the text of a floor file
    """

    plan: str
    scenario: Scenario
    robots: Recorded | RobotStrategy
    fire: Recorded | FireStrategy
    seeds: tuple[int, ...]


@dataclass(frozen=True)
class Episode:
    """One whole episode; a side that a script played has no trajectory.

    facts  group_reward and fire_reward (health points), survival (share of all),
           evacuated, died, refused, sources, seconds,
           length (decisions of the robots)
    """

    seed: int
    robots: Trajectory | None
    fire: Trajectory | None
    facts: dict[str, float]


def play(job: Job, advance: Advance = until_next_decision) -> list[Episode]:
    """Play all episodes of a job; return them in the order of their seeds."""
    return play_all([job], advance)[0]


def play_all(
    jobs: Sequence[Job], advance: Advance = until_next_decision
) -> list[list[Episode]]:
    """Play several jobs in one lockstep; each job's episodes are as if played alone.

    Only `advance` sees the simulations of all: a job's networks decide for its own.
    """
    games = [_begun(job) for job in jobs]
    while running := [run for runs in games for run in runs if run.goes_on]:
        for runs in games:
            _decide([run for run in runs if run.goes_on])
        for run in running:
            run.act()
        advance([run.environment.simulation for run in running])
        for run in running:
            run.see()
    return [[run.episode() for run in runs] for runs in games]


def _begun(job: Job) -> "list[_Run]":
    """Begin a job's episodes."""
    building = building_of(job.plan)
    players: dict[Side, Player] = {}
    scripts: list[Any] = []
    for side in SIDES:
        who = getattr(job, side)
        if isinstance(who, Recorded):
            players[side] = who.player(side, building, job.scenario)
        scripts.append(None if side in players else who)
    return [
        _Run(Environment(building, job.scenario, *scripts), seed, players)
        for seed in job.seeds
    ]


def _decide(running: "Sequence[_Run]") -> None:
    """Let the players of a job choose, all episodes by one call of each network."""
    for side in running[0].players if running else ():
        if asked := [run for run in running if run.acts(side)]:
            player = asked[0].players[side]
            emitted, decisions = player.act([run.moment(side) for run in asked])
            for run, *chosen in zip(asked, emitted, decisions, strict=True):
                run.choose(side, *chosen)


class _Run:
    """One running episode, with its sides' decisions and rewards."""

    def __init__(
        self, environment: Environment, seed: int, players: dict[Side, Player]
    ):
        self.environment, self.seed, self.players = environment, seed, players
        seen, self.infos = environment.reset(seed)
        self.agents = {side: _agents(environment, side) for side in players}
        streams = {side: PLAYER_STREAM[side] for side in players}
        self.rngs = {s: np.random.default_rng([seed, k]) for s, k in streams.items()}
        self.decisions: dict[Side, list[GroupDecision[np.ndarray]]]
        self.decisions = {side: [] for side in players}
        self.rewards: dict[Side, list[float]] = {side: [] for side in players}
        self.actions: dict[str, np.ndarray] = {}
        self.vectors = {
            side: np.stack([seen[agent]["vector"] for agent in agents])
            for side, agents in self.agents.items()
        }
        self.grid = self._grid(seen)
        self.truncated = False

    @property
    def goes_on(self) -> bool:
        """Check whether the episode is still running."""
        return not self.environment.simulation.done

    def acts(self, side: Side) -> bool:
        """Check whether the environment reads a decision of this side now."""
        return any(map(self._acts, self.agents[side]))

    def _acts(self, agent: str) -> bool:
        return agent in self.environment.agents and bool(self.infos[agent]["acts"])

    def moment(self, side: Side) -> Moment:
        """Collect what the side's player needs to decide now."""
        world, agents = self.environment.simulation.world, self.agents[side]
        return Moment(
            self.vectors[side].copy(),
            self.grid,
            np.array([self._acts(agent) for agent in agents]),
            headed(world),
            world,
            self.rngs[side],
            self.seed,
        )

    def choose(
        self, side: Side, actions: np.ndarray, decision: GroupDecision[np.ndarray]
    ) -> None:
        """Record a decision, with no reward yet; `act` carries it out."""
        self.decisions[side].append(decision)
        self.rewards[side].append(0.0)
        self.actions.update(zip(self.agents[side], actions, strict=True))

    def act(self) -> None:
        """Begin a step of the environment with the chosen actions."""
        world = self.environment.simulation.world
        self.before = world.time, sum(world.occupancy)
        actions = {
            agent: self.actions.get(agent, np.zeros(action_size(agent), np.float32))
            for agent in self.environment.agents
        }
        self.environment.begin_step(actions)
        self.actions = {}

    def see(self) -> None:
        """End the step; add its rewards to a side's last decision.

        What happens before its first decision is not learned from.
        """
        (time, inside), world = self.before, self.environment.simulation.world
        seen, rewards, _, truncations, self.infos = self.environment.end_step()
        self.truncated = any(truncations.values())
        self.grid = self._grid(seen)
        for side, agents in self.agents.items():
            there = [k for k, agent in enumerate(agents) if agent in seen]
            for k in there:
                self.vectors[side][k] = seen[agents[k]]["vector"]
            if there and self.rewards[side]:
                gone = inside - sum(world.occupancy)
                extra = self._extra_reward(side, gone, time)
                self.rewards[side][-1] += rewards[agents[there[0]]] + extra

    def _extra_reward(self, side: Side, gone: int, time: float) -> float:
        seconds = self.environment.scenario.decision_seconds
        return self.players[side].settings.extra_reward(gone, time, seconds)

    def episode(self) -> Episode:
        """Make the whole episode, once it is over."""
        sides: dict[str, Trajectory | None] = {"robots": None, "fire": None}
        for side, decisions in self.decisions.items():
            if decisions:
                (seen,) = self.players[side].read([self.moment(side)])
                last = {"vectors": seen, "grids": self.grid}
                last["alive"] = decisions[-1].alive & self._cut_off(side)
                sides[side] = trajectory_of(decisions, self.rewards[side], last)
        return Episode(seed=self.seed, facts=_facts(self.environment), **sides)

    def _cut_off(self, side: Side) -> np.ndarray | bool:
        """(G,) bool, or one for all: has time left them with something to decide?"""
        world, scenario = self.environment.simulation.world, self.environment.scenario
        if side == "robots":
            return self.truncated & robots_at_work(world)
        return self.truncated and len(world.flames.sources) < scenario.sources

    def _grid(self, seen: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
        """Return the grid, the same for every agent; the last one if none observes."""
        for observation in seen.values():
            return observation["grid"].astype(np.uint8)
        return self.grid


def _agents(environment: Environment, side: Side) -> list[str]:
    name = "robot" if side == "robots" else "fire"
    return [a for a in environment.possible_agents if a.startswith(name)]


def _facts(environment: Environment) -> dict[str, float]:
    """Collect the outcome of an episode in numbers."""
    simulation = environment.simulation
    outcome, events = simulation.outcome(), simulation.events
    return {
        "group_reward": outcome.reward,
        "fire_reward": fire_reward(events),
        "survival": outcome.evacuated / max(1, outcome.people),
        "evacuated": outcome.evacuated,
        "died": outcome.died,
        "refused": sum(isinstance(e, FireRefused) for e in events),
        "sources": len(simulation.world.flames.sources),
        "seconds": outcome.simulated_seconds,
        "length": environment.decision,
    }
