"""Rollouts: pure jobs from weights, scenario and seeds to whole episodes.

Clauses: C8, E6.  A job plays its episodes in lockstep, so that one call of a network
serves all of them; what an episode's randomness is depends on its own seed alone.

    T    decisions of an episode;  G  agents
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reference.building import Building, building_of
from reference.events import FireRefused
from reference.game.environment import Environment, action_size
from reference.game.rewards import fire_reward
from reference.learning.experience import Trajectory
from reference.learning.players import Acted, Landmarks, Observation, Player
from reference.learning.settings import SIDES, Side, TrainerSettings
from reference.paper import Scenario
from reference.strategies import FireStrategy, RobotStrategy

PLAYER_STREAM: dict[Side, int] = {"robots": 1, "fire": 2}
"""Each side's actions have a generator of their own, beside the simulation's."""


@dataclass(frozen=True)
class Learned:
    """A side that a network plays: its settings, and weights as tensors by name.

    landmarks  what makes a pointer head's options; None for the Gaussian one
    """

    settings: TrainerSettings
    weights: dict[str, Any]
    landmarks: Landmarks | None = None


@dataclass(frozen=True)
class Job:
    """Episodes to play; robots and fire: a network, or a strategy.

    plan  the text of a floor file
    """

    plan: str
    scenario: Scenario
    robots: Learned | RobotStrategy
    fire: Learned | FireStrategy
    seeds: tuple[int, ...]

    def learned(self) -> dict[Side, Learned]:
        """The sides that a network plays."""
        who: dict[Side, Any] = {"robots": self.robots, "fire": self.fire}
        return {side: w for side, w in who.items() if isinstance(w, Learned)}


@dataclass(frozen=True)
class Episode:
    """One whole episode; no trajectory of a side that a script played.

    facts  group_reward and fire_reward (health points), survival (share of all),
           evacuated, died, refused, sources, seconds,
           length (decisions of the robots)
    """

    seed: int
    robots: Trajectory | None
    fire: Trajectory | None
    facts: dict[str, float]


def play(job: Job) -> list[Episode]:
    """All episodes of a job, in the order of their seeds."""
    building = building_of(job.plan)
    learned = job.learned()
    players = {
        side: _player(side, building, job.scenario, who)
        for side, who in learned.items()
    }
    scripts = [None if side in learned else getattr(job, side) for side in SIDES]
    runs = [
        _Run(Environment(building, job.scenario, *scripts), seed, tuple(players))
        for seed in job.seeds
    ]
    while running := [run for run in runs if run.goes_on]:
        for side, player in players.items():
            _decide(side, player, [run for run in running if run.acts(side)])
        for run in running:
            run.step()
    return [run.episode() for run in runs]


def _decide(side: Side, player: Player, runs: "list[_Run]") -> None:
    """One call of a side's network for all runs in which its turn has come."""
    if runs:
        seen = [run.seen(side) for run in runs]
        acted = player.act(seen, [run.rngs[side] for run in runs])
        for k, run in enumerate(runs):
            run.choose(side, seen[k], acted, k)


def _player(side: Side, building: Building, scenario: Scenario, who: Learned) -> Player:
    player = Player(side, building, scenario, who.settings, who.landmarks)
    player.load(who.weights)
    return player


class _Run:
    """One episode on its way, and what its sides have lived through."""

    def __init__(self, environment: Environment, seed: int, sides: Sequence[Side]):
        self.environment, self.seed = environment, seed
        seen, self.infos = environment.reset(seed)
        self.agents = {side: _agents(environment, side) for side in sides}
        self.rngs = {s: np.random.default_rng([seed, PLAYER_STREAM[s]]) for s in sides}
        self.records = {side: _Record() for side in sides}
        self.actions: dict[str, np.ndarray] = {}
        self.vectors = {
            side: np.stack([seen[agent]["vector"] for agent in agents])
            for side, agents in self.agents.items()
        }
        self.grid = self._grid(seen)
        self.truncated = False

    @property
    def goes_on(self) -> bool:
        """Somebody is still at work."""
        return not self.environment.simulation.done

    def acts(self, side: Side) -> bool:
        """Is what this side decides now read?"""
        there = set(self.environment.agents)
        return any(a in there and self.infos[a]["acts"] for a in self.agents[side])

    def seen(self, side: Side) -> Observation:
        """What the side's agents observe; those who left, what they saw last."""
        return self.vectors[side].copy(), self.grid

    def choose(self, side: Side, seen: Observation, acted: Acted, k: int) -> None:
        """Note the decision, row k of what was acted; it is carried out in `step`."""
        there = set(self.environment.agents)
        alive = np.array([agent in there for agent in self.agents[side]])
        self.records[side].decide(seen, alive, acted, k)
        chosen = zip(self.agents[side], acted.emitted[k], strict=True)
        self.actions.update((agent, a) for agent, a in chosen if agent in there)

    def step(self) -> None:
        """One step of the environment, and what it brings."""
        idle = {
            agent: np.zeros(action_size(agent), np.float32)
            for agent in self.environment.agents
        }
        seen, rewards, _, truncations, self.infos = self.environment.step(
            idle | self.actions
        )
        self.actions = {}
        self.truncated = any(truncations.values())
        self.grid = self._grid(seen)
        for side, agents in self.agents.items():
            there = [k for k, agent in enumerate(agents) if agent in seen]
            for k in there:
                self.vectors[side][k] = seen[agents[k]]["vector"]
            if there:
                self.records[side].gain(rewards[agents[there[0]]])

    def episode(self) -> Episode:
        """All of it, once it is over."""
        sides: dict[Side, Trajectory | None] = {
            side: record.trajectory(self.seen(side), self.truncated)
            for side, record in self.records.items()
        }
        return Episode(
            self.seed, sides.get("robots"), sides.get("fire"), _facts(self.environment)
        )

    def _grid(self, seen: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
        """Every agent sees the same grid."""
        for observation in seen.values():
            return observation["grid"].astype(np.uint8)
        return self.grid


@dataclass
class _Record:
    """Decisions of one side as they come."""

    seen: list[Observation] = field(default_factory=list)
    alive: list[np.ndarray] = field(default_factory=list)
    acted: list[tuple[Acted, int]] = field(default_factory=list)
    rewards: list[float] = field(default_factory=list)

    def decide(
        self, seen: Observation, alive: np.ndarray, acted: Acted, k: int
    ) -> None:
        """One more decision, not rewarded yet."""
        self.seen.append(seen)
        self.alive.append(alive)
        self.acted.append((acted, k))
        self.rewards.append(0.0)

    def gain(self, reward: float) -> None:
        """Reward belongs to the last decision; before the first one, to nobody."""
        if self.rewards:
            self.rewards[-1] += reward

    def trajectory(self, last: Observation, truncated: bool) -> Trajectory | None:
        """All of it, ending in this observation; None if nothing was decided."""
        if not self.rewards:
            return None
        vectors, grids = zip(*self.seen, last, strict=True)
        goes_on = self.alive[-1] & truncated

        def rows(name: str) -> np.ndarray:
            return np.stack([getattr(acted, name)[k] for acted, k in self.acted])

        pointer = self.acted[0][0].features is not None
        return Trajectory(
            vectors=np.stack(vectors),
            grids=np.stack(grids),
            alive=np.stack([*self.alive, goes_on]),
            actions=rows("actions"),
            shown=rows("shown"),
            log_probs=rows("log_probs"),
            rewards=np.array(self.rewards),
            features=rows("features") if pointer else None,
            action_mask=rows("action_mask") if pointer else None,
        )


def _agents(environment: Environment, side: Side) -> list[str]:
    name = "robot" if side == "robots" else "fire"
    return [a for a in environment.possible_agents if a.startswith(name)]


def _facts(environment: Environment) -> dict[str, float]:
    """What became of an episode, in numbers."""
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
