"""Rollouts: pure jobs from weights, scenario and seeds to whole episodes.

Clauses: C5, C8, D2, E3, E6.  A job plays its episodes in lockstep, so that one call of
a network serves all of them; an episode's randomness depends on its own seed alone.
Both heads end in the environment's action, numbers in [−1, 1].

    S    episodes played at once;  T  decisions of an episode;  G  agents of a side
    A    numbers of the environment's action;  V, K, E, O, F  as in `networks`
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import Building, building_of
from reference.events import FireRefused
from reference.game.environment import (
    Environment,
    action_size,
    until_next_decision,
)
from reference.game.moments import Choices, Moment
from reference.game.observations import (
    fire_layout,
    grid_shape,
    headed,
    robot_layout,
    summary,
    summary_size,
)
from reference.game.rewards import fire_reward, shaping
from reference.learning.experience import GroupDecision, Trajectory, trajectory_of
from reference.learning.networks import RAW_LIMIT, Actor, Options, Policy, Sizes
from reference.learning.settings import SIDES, Side, TrainerSettings
from reference.paper import Scenario
from reference.simulation import Simulation
from reference.strategies import FireStrategy, RobotStrategy

PLAYER_STREAM: dict[Side, int] = {"robots": 1, "fire": 2}
"""Each side's actions have a generator of their own, beside the simulation's."""

AXES = 2  # [C5] [D2] two continuous numbers: x and y

Advance = Callable[[Sequence[Simulation]], None]
"""Runs simulations up to their next decision or their end, in whatever order."""

Landmarks = Callable[[Building, Scenario], Any]
"""Makes, for a building, what turns observations into options of a pointer head."""


# -- Who plays a side ---------------------------------------------------------------


class Player:
    """One side's actor, with the map its options are on."""

    def __init__(
        self,
        side: Side,
        building: Building,
        scenario: Scenario,
        settings: TrainerSettings,
        landmarks: Landmarks | None = None,
    ):
        """landmarks: what makes a pointer head's options; None for the Gaussian one."""
        self.side, self.building, self.scenario = side, building, scenario
        self.settings = settings
        self.options = landmarks and landmarks(building, scenario)
        self.keeps = settings.commitment > 0 and not self.options
        self.sizes = self._sizes()
        self.actor = Actor(self.sizes, settings).eval()

    def load(self, weights: dict[str, Any]) -> None:
        """Take over a learner's weights, tensors or arrays, by name.

        Raises RuntimeError for another shape.
        """
        tensors = {name: torch.as_tensor(array) for name, array in weights.items()}
        self.actor.load_state_dict(tensors)

    def seen(self, moment: Moment) -> np.ndarray:
        """(G, V) float32: vectors, and what the settings add to them."""
        vectors, s = moment.vectors, self.settings
        parts = [vectors]
        if s.summary:
            parts.append(summary(vectors, moment.grid, self.building, self.scenario))
        if s.own_state:
            under_way = ~np.isnan(moment.headed[:, :1])
            parts += [np.nan_to_num(moment.headed), under_way.astype(np.float32)]
        return np.concatenate(parts, axis=1)

    @torch.no_grad()
    def act(
        self, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, list[GroupDecision[np.ndarray]]]:
        """Decide at all these moments by one call of the network.

        Returns (S, G, A) float32, the environment's actions, and what to record.
        """
        seen = [self.seen(m) for m in moments]
        found = [choices for m in moments if (choices := self._choices(m))]
        options = found and Options(
            _stacked([choices.features for choices in found]),
            _stacked([choices.action_mask for choices in found]),
        )
        policy = self.actor(
            _stacked(seen),
            _stacked([m.grid for m in moments]),
            options or None,
        )
        actions = policy.act(_noise(moments, policy))
        raw, log_probs = actions.numpy(), policy.log_probs(actions).numpy()
        if self.options:
            places = np.stack([choices.places for choices in found])
            index = raw.astype(np.intp)[..., None]
            emitted = shown = np.take_along_axis(places, index, axis=2)[:, :, 0]
        else:
            emitted, shown = self._emitted(raw, moments)
        return emitted, [
            GroupDecision(
                vectors=seen[k],
                grids=m.grid,
                alive=m.alive,
                actions=raw[k],
                shown=shown[k],
                log_probs=log_probs[k],
                features=found[k].features if found else None,
                action_mask=found[k].action_mask if found else None,
            )
            for k, m in enumerate(moments)
        ]

    def _choices(self, moment: Moment) -> Choices | None:
        """A pointer head's landmarks; for Gaussians "keep", if under way, and "new"."""
        if self.options:
            choices: Choices = self.options(moment)
            return choices
        if not self.keeps:
            return None
        under_way = ~np.isnan(moment.headed[:, 0])
        none = np.zeros((len(under_way), 2, 0), dtype=np.float32)
        return Choices(none, none, np.stack([under_way, under_way | True], axis=1))

    def _emitted(
        self, raw: np.ndarray, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Gaussians: clamp(a, −3, 3)/3 [E3]; the fire's branch, its floor, first.

        Also what a critic is shown, the raw numbers; a kept destination in both.
        """
        shown = raw[..., :AXES]
        axes = shown.clip(-RAW_LIMIT, RAW_LIMIT) / RAW_LIMIT
        if self.side == "fire":
            floor = (2 * raw[..., AXES:] + 1) / self.building.floors - 1
            return np.concatenate([floor, axes], axis=-1), shown
        if self.keeps:
            kept, old = raw[..., AXES:] == 0, np.nan_to_num([m.headed for m in moments])
            axes, shown = np.where(kept, old, axes), np.where(kept, old, shown)
        return axes, shown

    def _sizes(self) -> Sizes:
        """What networks of this side see and say."""
        building, scenario, s = self.building, self.scenario, self.settings
        of_robots = self.side == "robots"
        layout = robot_layout if of_robots else fire_layout
        branches = (2,) * self.keeps if of_robots else (building.floors,)
        added = summary_size(building) * s.summary + (AXES + 1) * s.own_state
        sizes = Sizes(layout(building, scenario).size + added, grid_shape(building))
        if not self.options:
            return replace(sizes, continuous=AXES, branches=branches, shown=AXES)
        emitted = AXES if of_robots else 1 + AXES
        return replace(sizes, features=self.options.features, shown=emitted)


def _stacked(arrays: Sequence[np.ndarray]) -> Tensor:
    return torch.from_numpy(np.stack(arrays))


def _noise(moments: Sequence[Moment], policy: Policy) -> Tensor | None:
    """(S, G, C + sum n), each episode's from its own generator: see `Policy.act`."""
    agents, continuous = policy.gaussian.mean.shape[-2:]
    counts = sum(branch.logits.shape[-1] for branch in policy.branches)
    rows = []
    for rng in (m.rng for m in moments if m.rng is not None):
        normal = rng.standard_normal((agents, continuous), dtype=np.float32)
        gumbel = rng.gumbel(size=(agents, counts)).astype(np.float32)
        rows.append(np.concatenate([normal, gumbel], axis=1))
    return _stacked(rows) if rows else None


class Recorded(ABC):
    """A side whose decisions become trajectories."""

    @abstractmethod
    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make a new player of this side."""


@dataclass(frozen=True)
class Learned(Recorded):
    """A side that a network plays: its settings, and weights as tensors by name.

    landmarks  what makes a pointer head's options; None for the Gaussian one
    """

    settings: TrainerSettings
    weights: dict[str, Any]
    landmarks: Landmarks | None = None

    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """A network with these weights. Raises RuntimeError for another shape."""
        player = Player(side, building, scenario, self.settings, self.landmarks)
        player.load(self.weights)
        return player


# -- Episodes -----------------------------------------------------------------------


@dataclass(frozen=True)
class Job:
    """Episodes to play; robots and fire: who is recorded, or a strategy.

    plan  the text of a floor file
    """

    plan: str
    scenario: Scenario
    robots: Recorded | RobotStrategy
    fire: Recorded | FireStrategy
    seeds: tuple[int, ...]


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


def play(job: Job, advance: Advance = until_next_decision) -> list[Episode]:
    """All episodes of a job, in the order of their seeds."""
    building = building_of(job.plan)
    players: dict[Side, Player] = {}
    scripts: list[Any] = []
    for side in SIDES:
        who = getattr(job, side)
        if isinstance(who, Recorded):
            players[side] = who.player(side, building, job.scenario)
        scripts.append(None if side in players else who)
    runs = [
        _Run(Environment(building, job.scenario, *scripts), seed, players)
        for seed in job.seeds
    ]
    while running := [run for run in runs if run.goes_on]:
        for side, player in players.items():
            if asked := [run for run in running if run.acts(side)]:
                emitted, decisions = player.act([run.moment(side) for run in asked])
                for run, actions, decision in zip(
                    asked, emitted, decisions, strict=True
                ):
                    run.choose(side, actions, decision)
        for run in running:
            run.act()
        advance([run.environment.simulation for run in running])
        for run in running:
            run.see()
    return [run.episode() for run in runs]


class _Run:
    """One episode on its way, and its sides' decisions and rewards."""

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
        """Somebody is still at work."""
        return not self.environment.simulation.done

    def acts(self, side: Side) -> bool:
        """Is what this side decides now read?"""
        there = set(self.environment.agents)
        return any(a in there and self.infos[a]["acts"] for a in self.agents[side])

    def moment(self, side: Side) -> Moment:
        """What the side's player is asked."""
        there, world = set(self.environment.agents), self.environment.simulation.world
        return Moment(
            self.vectors[side].copy(),
            self.grid,
            np.array([agent in there for agent in self.agents[side]]),
            headed(world),
            world,
            self.rngs[side],
            self.seed,
        )

    def choose(
        self, side: Side, actions: np.ndarray, decision: GroupDecision[np.ndarray]
    ) -> None:
        """Record a decision, not rewarded yet; it is carried out in `act`."""
        self.decisions[side].append(decision)
        self.rewards[side].append(0.0)
        self.actions.update(zip(self.agents[side], actions, strict=True))

    def act(self) -> None:
        """Begin a step of the environment with what was chosen."""
        world = self.environment.simulation.world
        self.before = world.time, sum(world.occupancy)
        actions = {
            agent: self.actions.get(agent, np.zeros(action_size(agent), np.float32))
            for agent in self.environment.agents
        }
        self.environment.take(actions)
        self.actions = {}

    def see(self) -> None:
        """End the step; its rewards belong to the last decision."""
        (time, inside), world = self.before, self.environment.simulation.world
        seen, rewards, _, truncations, self.infos = self.environment.told()
        self.truncated = any(truncations.values())
        self.grid = self._grid(seen)
        for side, agents in self.agents.items():
            there = [k for k, agent in enumerate(agents) if agent in seen]
            for k in there:
                self.vectors[side][k] = seen[agents[k]]["vector"]
            if there and self.rewards[side]:
                shaped = self._shaping(side, time, inside - sum(world.occupancy))
                self.rewards[side][-1] += rewards[agents[there[0]]] + shaped

    def _shaping(self, side: Side, time: float, gone: int) -> float:
        """What a side's settings add to its reward of the decision since `time`."""
        s, seconds = self.players[side].settings, self.environment.scenario
        return s.shaping * shaping(gone, time, seconds.decision_seconds, s.gamma)

    def episode(self) -> Episode:
        """All of it, once it is over."""
        sides: dict[str, Trajectory | None] = {"robots": None, "fire": None}
        for side, decisions in self.decisions.items():
            if decisions:
                seen = self.players[side].seen(self.moment(side))
                last = {"vectors": seen, "grids": self.grid}
                last["alive"] = decisions[-1].alive & self._cut_off(side)
                sides[side] = trajectory_of(decisions, self.rewards[side], last)
        return Episode(seed=self.seed, facts=_facts(self.environment), **sides)

    def _cut_off(self, side: Side) -> bool:
        """Has time ended the episode while there was something left to decide?"""
        environment = self.environment
        lit = len(environment.simulation.world.flames.sources)
        left = side == "robots" or lit < environment.scenario.sources
        return self.truncated and left

    def _grid(self, seen: dict[str, dict[str, np.ndarray]]) -> np.ndarray:
        """Every agent sees the same grid."""
        for observation in seen.values():
            return observation["grid"].astype(np.uint8)
        return self.grid


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
