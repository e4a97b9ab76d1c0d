"""Rollouts: play whole episodes, given weights, a scenario and seeds.

Clauses: C8, E3, E6.  A job plays its episodes in lockstep, so that one call of
a network serves all of them; an episode's randomness depends on its own seed alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import building_of
from reference.fire import FireStrategy
from reference.game.codec import Moment
from reference.game.environment import (
    FIRE,
    Environment,
    action_size,
    until_next_decision,
)
from reference.game.observations import grid, robots_at_work
from reference.learning.experience import Record, Trajectory
from reference.learning.players import Learned, Player
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.rewards import fire_reward
from reference.robots import RobotStrategy
from reference.simulation import Simulation
from reference.world import FireRefused

Advance = Callable[[Sequence[Simulation]], None]
"""Runs simulations up to their next decision or their end, in whatever order."""


@dataclass(frozen=True)
class Job:
    """Episodes to play; at least one side is a network."""

    plan: str  # the text of a floor file
    scenario: Scenario
    robots: Learned | RobotStrategy
    fire: Learned | FireStrategy
    seeds: tuple[int, ...]
    record: tuple[Side, ...] = SIDES  # whose decisions to record, if a network plays


@dataclass(frozen=True)
class Episode:
    """One whole episode; a side that was not recorded has no trajectory.

    facts  group_reward and fire_reward (health points), survival (share of all),
           evacuated, died, refused, sources, seconds,
           length (decisions of the robots)
    """

    seed: int
    robots: Trajectory | None
    fire: Trajectory | None
    facts: dict[str, float]


def play(*jobs: Job, advance: Advance = until_next_decision) -> list[Episode]:
    """Play the episodes of jobs in one lockstep; each is as if played alone.

    Only `advance` sees the simulations of all: a job's networks decide for its own.
    """
    games = [_begun(job) for job in jobs]
    every = [run for game in games for run in game]
    while running := [run for run in every if not run.simulation.done]:
        for game in games:
            _decide([run for run in game if not run.simulation.done])
        for run in running:
            run.environment.begin_step(run.actions)
        advance([run.simulation for run in running])
        for run in running:
            run.see()
    return [run.episode() for run in every]


def _begun(job: Job) -> "list[_Run]":
    """Begin a job's episodes."""
    building = building_of(job.plan)
    sides = {side: getattr(job, side) for side in SIDES}
    players: dict[Side, Player] = {
        side: who.player(side, building, job.scenario)
        for side, who in sides.items()
        if isinstance(who, Learned)
    }
    scripts: Any = {s: None if s in players else who for s, who in sides.items()}
    return [
        _Run(Environment(building, job.scenario, **scripts), seed, players, job.record)
        for seed in job.seeds
    ]


def _decide(running: "Sequence[_Run]") -> None:
    """Let the players of a job choose, all episodes by one call of each network."""
    if not running:
        return
    for side, player in running[0].players.items():
        moments = [(run, run.moment(side)) for run in running]
        asked = [(run, moment) for run, moment in moments if moment.alive.any()]
        if asked:
            emitted, records = player.act([moment for _, moment in asked])
            for (run, _), chosen, record in zip(asked, emitted, records, strict=True):
                run.choose(side, chosen, record)


class _Run:
    """One running episode: what its recorded sides see, do and are paid.

    vectors, actions  by agent, the last ones;  agents, records, rewards  by side
    """

    def __init__(
        self,
        environment: Environment,
        seed: int,
        players: dict[Side, Player],
        record: Sequence[Side],
    ):
        self.environment, self.seed, self.players = environment, seed, players
        seen, self.infos = environment.reset(seed)
        self.simulation = environment.simulation
        self.vectors = {agent: observed["vector"] for agent, observed in seen.items()}
        self.actions = {agent: np.zeros(action_size(agent)) for agent in seen}
        self.agents: dict[Side, list[str]] = {
            "robots": [agent for agent in seen if agent != FIRE],
            "fire": [agent for agent in seen if agent == FIRE],
        }
        streams = enumerate(SIDES, 1)  # beside the simulation's own
        self.rngs = {side: np.random.default_rng([seed, k]) for k, side in streams}
        recorded = [side for side in players if side in record]
        self.records: dict[Side, list[Record]] = {side: [] for side in recorded}
        self.rewards: dict[Side, list[float]] = {side: [] for side in recorded}

    def moment(self, side: Side) -> Moment:
        """Collect what the side's player needs; alive: whose actions are read now."""
        agents = self.agents[side]
        acts = [a in self.infos and self.infos[a]["acts"] > 0 for a in agents]
        vectors = np.stack([self.vectors[agent] for agent in agents])
        world, rng = self.simulation.world, self.rngs[side]
        return Moment(vectors, np.array(acts), world, rng, self.seed)

    def choose(self, side: Side, actions: np.ndarray, record: Record) -> None:
        """Take a decision, and record it with no reward yet."""
        self.actions.update(zip(self.agents[side], actions, strict=True))
        if side in self.records:
            self.records[side].append(record)
            self.rewards[side].append(0.0)

    def see(self) -> None:
        """End the step; add its rewards to a side's last decision.

        Rewards before its first decision are not learned from.
        """
        seen, rewards, _, _, self.infos = self.environment.end_step()
        self.vectors |= {agent: observed["vector"] for agent, observed in seen.items()}
        for side, paid in self.rewards.items():
            alike = [rewards[a] for a in self.agents[side] if a in rewards]
            if paid and alike:
                paid[-1] += alike[0]

    def episode(self) -> Episode:
        """Make the whole episode, once it is over."""
        outcome, events = self.simulation.outcome(), self.simulation.events
        facts = {
            "group_reward": outcome.reward,
            "fire_reward": fire_reward(events),
            "survival": outcome.evacuated / max(1, outcome.people),
            "evacuated": outcome.evacuated,
            "died": outcome.died,
            "refused": sum(isinstance(e, FireRefused) for e in events),
            "sources": len(self.simulation.world.flames.sources),
            "seconds": outcome.simulated_seconds,
            "length": self.environment.decision,
        }
        sides = {side: self._trajectory(side) for side in SIDES}
        return Episode(seed=self.seed, facts=facts, **sides)

    def _trajectory(self, side: Side) -> Trajectory | None:
        """Stack a side's records, and row T, observed after the last of them."""
        if not (records := self.records.get(side)):
            return None
        (seen,) = self.players[side].read([self.moment(side)])
        alive = records[-1]["alive"] & self._cut_off(side)
        last = {"vectors": seen, "grids": grid(self.simulation.world), "alive": alive}
        columns = {
            name: np.stack([row[name] for row in [*records, last] if name in row])
            for name in records[0]
        }
        return Trajectory(rewards=np.array(self.rewards[side]), **columns)

    def _cut_off(self, side: Side) -> np.ndarray | bool:
        """(G,) bool, or one for all: has time left them with something to decide?"""
        world = self.simulation.world
        if side == "robots":
            return robots_at_work(world)
        left = len(world.flames.sources) < self.simulation.scenario.sources
        return left and any(world.occupancy)
