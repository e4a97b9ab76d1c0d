"""Rollouts: play whole episodes, given weights, a scenario and seeds.

A job plays its episodes in lockstep, so that one call of a network serves all of them;
an episode's randomness depends on its own seed alone.  The last digits of a network's
numbers depend on how many are computed at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.building import Building, building_of
from reference.fire import FireStrategy
from reference.game.codec import Moment, decision_in
from reference.game.environment import (
    Advance,
    AgentFire,
    AgentRobots,
    until_next_decision,
)
from reference.game.observations import robots_at_work
from reference.learning.experience import Record, Trajectory
from reference.learning.players import LearnedNetwork, Player
from reference.learning.settings import SIDES, Side
from reference.paper import Scenario
from reference.rewards import fire_reward, group_reward
from reference.robots import RobotStrategy
from reference.simulation import Simulation
from reference.world import FireRefused


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


def play(job: Job, advance: Advance = until_next_decision) -> list[Episode]:
    """Play a job's episodes in lockstep; each is as if played alone [E6]."""
    runs = _begin_episodes(job)
    while running := [run for run in runs if not run.simulation.done]:
        _decide(running)
        advance([run.simulation for run in running])
        for run in running:
            run.end_step()
    return [run.episode() for run in runs]


def _begin_episodes(job: Job) -> "list[_RunningEpisode]":
    """Begin a job's episodes."""
    building = building_of(job.plan)
    players: dict[Side, Player] = {}
    for side in SIDES:
        who = getattr(job, side)
        if isinstance(who, LearnedNetwork):
            players[side] = who.player(side, building, job.scenario)
    return [_RunningEpisode(job, building, players, seed) for seed in job.seeds]


def _decide(running: "Sequence[_RunningEpisode]") -> None:
    """Let the players of a job choose, all episodes by one call of each network."""
    for side, player in running[0].players.items():
        asked = [run for run in running if run.acting(side).any()]
        if asked:
            rows, records = player.act(_moments(asked, side))
            for run, chosen, record in zip(asked, rows, records, strict=True):
                run.choose(side, chosen, record)


def _moments(runs: "Sequence[_RunningEpisode]", side: Side) -> list[Moment]:
    """Collect what the side's player needs, all worlds observed at once."""
    codec = runs[0].players[side].codec
    seen = codec.observe([run.simulation.world for run in runs])
    return [run.moment(side, vectors) for run, vectors in zip(runs, seen, strict=True)]


class _RunningEpisode:
    """One running episode: what its recorded sides see, do and are paid.

    agents     strategies of both sides; a player's does what `choose` says
    paid       how many events rewards have been paid for
    decisions  of the robots, so far
    observing  (R,) bool, robots whose next observation counts: those that acted last.
               So who finishes is observed once more, and keeps that
    seen       (R, size of the layout), what each robot observed last
    rngs       by side, for sampling; beside the simulation's own
    records    by recorded side, its decisions and their rewards
    """

    def __init__(
        self, job: Job, building: Building, players: dict[Side, Player], seed: int
    ):
        self.players = players
        self.seed = seed
        sides: dict[Side, Any] = {"robots": AgentRobots(), "fire": AgentFire()}
        sides |= {side: getattr(job, side) for side in SIDES if side not in players}
        run = Simulation(building, job.scenario, **sides, seed=seed)
        self.simulation = run
        self.agents: dict[Side, Any] = {
            "robots": run.robot_strategy,
            "fire": run.fire_strategy,
        }
        self.paid = 0
        self.decisions = 0
        self.observing = np.ones(len(run.world.robots), dtype=bool)
        self.seen = np.zeros((), dtype=np.float32)
        self.rngs = {
            side: np.random.default_rng([seed, k]) for k, side in enumerate(SIDES, 1)
        }
        recorded = [side for side in players if side in job.record]
        self.records: dict[Side, list[Record]] = {side: [] for side in recorded}

    def acting(self, side: Side) -> np.ndarray:
        """(G,) bool: whose actions are read now?"""
        if side == "robots":
            return robots_at_work(self.simulation.world)
        return np.array([self.simulation.fire_turn])

    def moment(self, side: Side, vectors: np.ndarray) -> Moment:
        """Collect what the side's player needs; vectors: (G, V), what agents observe.

        A robot that has left keeps what it observed last. Called once a decision:
        it remembers what was observed.
        """
        acting = self.acting(side)
        if side == "robots":
            vectors = np.where(self.observing[:, None], vectors, self.seen)
            self.seen = vectors
            # all robots take part in the first step, as in `Environment.reset`
            self.observing = acting | (self.decisions == 0)
        return Moment(
            vectors=vectors,
            alive=acting,
            world=self.simulation.world,
            rng=self.rngs[side],
        )

    def choose(self, side: Side, chosen: np.ndarray, record: Record) -> None:
        """Take a decision, and record it with no reward yet."""
        self.agents[side].chosen = list(map(decision_in, chosen))
        if side in self.records:
            self.records[side].append(record | {"rewards": np.zeros(())})

    def end_step(self) -> None:
        """Pay a side's last decision, the same for all agents.

        Rewards before its first decision are not learned from.
        """
        events = self.simulation.events[self.paid :]
        self.paid += len(events)
        earned = {"robots": group_reward(events), "fire": fire_reward(events)}
        for side, records in self.records.items():
            if records:
                records[-1]["rewards"] += earned[side]
        self.decisions += 1

    def episode(self) -> Episode:
        """Make the whole episode, once it is over."""
        run = self.simulation
        outcome = run.outcome()
        facts = {
            "group_reward": outcome.reward,
            "fire_reward": fire_reward(run.events),
            "survival": outcome.evacuated / max(1, outcome.people),
            "evacuated": outcome.evacuated,
            "died": outcome.died,
            "refused": sum(isinstance(e, FireRefused) for e in run.events),
            "sources": len(run.world.flames.sources),
            "seconds": outcome.simulated_seconds,
            "length": self.decisions,
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
        last = _moments([self], side)
        columns = {name: [row[name] for row in records] for name in records[0]}
        columns["vectors"].extend(codec.read(last))
        columns["grids"].extend(codec.grids(last))
        columns["alive"].append(columns["alive"][-1] & self._cut_off(side))
        arrays = {name: np.stack(rows) for name, rows in columns.items()}
        return Trajectory(**arrays)

    def _cut_off(self, side: Side) -> np.ndarray | bool:
        """Who could still have decided when time was up [C8]? (G,) bool, or bool."""
        world = self.simulation.world
        if side == "robots":
            return robots_at_work(world)
        left = len(world.flames.sources) < self.simulation.scenario.sources
        return left and any(world.occupancy)
