"""Rollouts: play whole episodes, given weights, a scenario and seeds.

A job plays its episodes in lockstep, so that one call of a network serves all of them;
an episode's randomness depends on its own seed alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import building_of
from reference.fire import FireStrategy
from reference.game.codec import Moment, decided
from reference.game.environment import (
    FIRE,
    Environment,
    Observations,
    until_next_decision,
)
from reference.game.observations import robots_at_work
from reference.learning.experience import RECORDED, Record, Trajectory
from reference.learning.players import LearnedNetwork, Player
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
    robots: LearnedNetwork | RobotStrategy
    fire: LearnedNetwork | FireStrategy
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
    """Play the episodes of jobs in one lockstep; each is as if played alone [E6].

    Only `advance` sees the simulations of all: a job's networks decide for its own.
    """
    games = [_begin_episodes(job) for job in jobs]
    runs = [run for game in games for run in game]
    running = [run for run in runs if not run.simulation.done]
    while running:
        for game in games:
            _decide([run for run in game if not run.simulation.done])
        for run in running:
            run.environment.begin_step(run.decisions)
        advance([run.simulation for run in running])
        for run in running:
            run.end_step()
        running = [run for run in running if not run.simulation.done]
    return [run.episode() for run in runs]


def _begin_episodes(job: Job) -> "list[_RunningEpisode]":
    """Begin a job's episodes."""
    building = building_of(job.plan)
    players: dict[Side, Player] = {}
    strategies: dict[Side, Any] = {"robots": job.robots, "fire": job.fire}
    for side, who in strategies.items():
        if isinstance(who, LearnedNetwork):
            players[side] = who.player(side, building, job.scenario)
            strategies[side] = None  # its agents act
    runs = []
    for seed in job.seeds:
        environment = Environment(building, job.scenario, **strategies)
        runs.append(_RunningEpisode(environment, seed, players, job.record))
    return runs


def _decide(running: "Sequence[_RunningEpisode]") -> None:
    """Let the players of a job choose, all episodes by one call of each network."""
    if not running:
        return
    for side, player in running[0].players.items():
        moments = [run.moment(side) for run in running]
        asked = [k for k, moment in enumerate(moments) if moment.alive.any()]
        if asked:
            rows, records = player.act([moments[k] for k in asked])
            for k, chosen, record in zip(asked, rows, records, strict=True):
                running[k].choose(side, chosen, record)


class _RunningEpisode:
    """One running episode: what its recorded sides see, do and are paid.

    vectors, decisions  by agent, the last ones;  agents, records, rewards  by side
    """

    def __init__(
        self,
        environment: Environment,
        seed: int,
        players: dict[Side, Player],
        record: Sequence[Side],
    ):
        self.environment = environment
        self.seed = seed
        self.players = players
        seen, self.infos = environment.reset(seed)
        self.simulation = environment.simulation
        self.vectors: dict[str, np.ndarray] = {}
        self._observe(seen)
        self.decisions: dict[str, Any] = dict.fromkeys(seen)
        self.agents: dict[Side, list[str]] = {
            "robots": [agent for agent in seen if agent != FIRE],
            "fire": [agent for agent in seen if agent == FIRE],
        }
        self.rngs = {  # beside the simulation's own
            side: np.random.default_rng([seed, k]) for k, side in enumerate(SIDES, 1)
        }
        recorded = [side for side in players if side in record]
        self.records: dict[Side, list[Record]] = {side: [] for side in recorded}
        self.rewards: dict[Side, list[float]] = {side: [] for side in recorded}

    def moment(self, side: Side) -> Moment:
        """Collect what the side's player needs; alive: whose actions are read now."""
        agents = self.agents[side]
        acts = [a in self.infos and self.infos[a]["acts"] > 0 for a in agents]
        return Moment(
            vectors=np.stack([self.vectors[agent] for agent in agents]),
            alive=np.array(acts),
            world=self.simulation.world,
            rng=self.rngs[side],
            seed=self.seed,
        )

    def choose(self, side: Side, chosen: np.ndarray, record: Record) -> None:
        """Take a decision, and record it with no reward yet."""
        decisions = map(decided, chosen)
        self.decisions.update(zip(self.agents[side], decisions, strict=True))
        if side in self.records:
            self.records[side].append(record)
            self.rewards[side].append(0.0)

    def end_step(self) -> None:
        """End the environment's step: see what agents observe, and pay them."""
        seen, rewards, _, _, self.infos = self.environment.end_step()
        self._observe(seen)
        for side in self.rewards:
            self._pay(side, rewards)

    def _observe(self, seen: Observations) -> None:
        """Keep what each agent observed last."""
        self.vectors |= {agent: observed["vector"] for agent, observed in seen.items()}

    def _pay(self, side: Side, rewards: dict[str, float]) -> None:
        """Add the reward, the same for all of a side's agents, to its last decision.

        Rewards before its first decision are not learned from.
        """
        paid = self.rewards[side]
        earned = [rewards[agent] for agent in self.agents[side] if agent in rewards]
        if paid and earned:
            paid[-1] += earned[0]

    def episode(self) -> Episode:
        """Make the whole episode, once it is over."""
        outcome = self.simulation.outcome()
        events = self.simulation.events
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
        return Episode(
            seed=self.seed,
            robots=self._trajectory("robots"),
            fire=self._trajectory("fire"),
            facts=facts,
        )

    def _trajectory(self, side: Side) -> Trajectory | None:
        """Stack a side's records; row T is seen after them [E3, agent_processor.py]."""
        records = self.records.get(side)
        if not records:
            return None
        codec = self.players[side].codec
        last = [self.moment(side)]
        columns = {name: [row[name] for row in records] for name in RECORDED}
        columns["vectors"].extend(codec.read(last))
        columns["grids"].extend(codec.grids(last))
        columns["alive"].append(columns["alive"][-1] & self._cut_off(side))
        arrays = {name: np.stack(rows) for name, rows in columns.items()}
        return Trajectory(**arrays, rewards=np.array(self.rewards[side]))

    def _cut_off(self, side: Side) -> np.ndarray | bool:
        """Has time left them with something to do [C8]? (G,) bool, or one for all."""
        world = self.simulation.world
        if side == "robots":
            return robots_at_work(world)
        left = len(world.flames.sources) < self.simulation.scenario.sources
        return left and any(world.occupancy)
