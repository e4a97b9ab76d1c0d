"""Imitation: robots that first copy a hand-written strategy, as an option [E1, chosen].

Clauses: C5, C7.  A named aid, never the default: what it teaches is not the paper's.
The actor is fitted to what the strategy would have decided; afterwards the critic
learns alone for some rounds, and then both go on as always.

    T, G, V, K, O, F  as in `experience`
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from reference.building import building_of
from reference.game.environment import Environment
from reference.game.observations import to_normalised
from reference.learning.experience import Decisions, Trajectory, decisions_of
from reference.learning.networks import RAW_LIMIT
from reference.learning.players import Player
from reference.learning.ppo import Learner
from reference.learning.settings import TrainerSettings
from reference.paper import Scenario
from reference.strategies import RobotStrategy
from reference.workshop.landmarks import Options, landmarks_for
from reference.workshop.strategies import fire_named, robots_named

CLONING_RATE = 1e-3  # [C7, chosen] learning rate of the fit
CLONING_BATCH = 64  # [C7, chosen] group decisions of its minibatches


@dataclass(frozen=True)
class Demonstration:
    """Episodes in which a hand-written strategy guides, against a scripted fire.

    plan  the text of a floor file;  settings  of the learner
    """

    plan: str
    scenario: Scenario
    settings: TrainerSettings
    teacher: str
    fire: str
    seeds: tuple[int, ...]


def demonstrate(lesson: Demonstration) -> list[Trajectory]:
    """What the robots saw and their teacher did, as the learner's head would put it.

    `alive` is where there was a new decision; shown, log_probs and rewards are empty.
    """
    building = building_of(lesson.plan)
    player = Player(
        "robots",
        building,
        lesson.scenario,
        lesson.settings,
        landmarks_for("robots", lesson.settings),
    )
    environment = Environment(building, lesson.scenario, fire=fire_named(lesson.fire))
    return [_episode(environment, player, lesson.teacher, s) for s in lesson.seeds]


def _episode(
    environment: Environment, player: Player, teacher: str, seed: int
) -> Trajectory:
    strategy = robots_named(teacher)
    rng = np.random.default_rng(seed)
    agents = environment.possible_agents
    observations, _ = environment.reset(seed)
    vectors = np.stack([observations[agent]["vector"] for agent in agents])
    rows: list[tuple[Any, ...]] = []
    while environment.agents:
        for k, agent in enumerate(agents):
            if agent in observations:
                vectors[k] = observations[agent]["vector"]
        grid = observations[environment.agents[0]]["grid"].astype(np.uint8)
        wanted = _decided(environment, strategy, rng)
        rows.append((vectors.copy(), grid, *_as_head(player, vectors, grid, wanted)))
        there = [(agent, wanted[agents.index(agent)]) for agent in environment.agents]
        observations, *_ = environment.step(dict(there))
    return _trajectory(rows)


def _decided(
    environment: Environment,
    strategy: RobotStrategy,
    rng: np.random.Generator,
) -> np.ndarray:
    """(G, 2) the teacher's actions; nan where it keeps the old destination."""
    world = environment.simulation.world
    actions = np.full((len(world.robots), 2), np.nan, dtype=np.float32)
    active = [k for k, robot in enumerate(world.robots) if robot.active]
    decided = strategy.decide(world, [world.robots[k] for k in active], rng)
    for k, destination in zip(active, decided, strict=True):
        if destination is not None:
            spot = to_normalised(environment.building, np.array(destination))
            actions[k] = spot.clip(-1, 1)
    return actions


def _as_head(
    player: Player, vectors: np.ndarray, grid: np.ndarray, wanted: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Options | None]:
    """Who decided (G,), what the head would have stored (G, K), and its options."""
    decided = ~np.isnan(wanted).any(axis=1)
    if player.options is None:
        return decided, np.nan_to_num(wanted) * RAW_LIMIT, None
    options = player.options(vectors, grid)
    off = np.linalg.norm(options.places - np.nan_to_num(wanted)[:, None], axis=-1)
    nearest = np.where(options.action_mask, off, np.inf).argmin(axis=1)
    return decided, nearest[:, None].astype(np.float32), options


def _trajectory(rows: list[tuple[Any, ...]]) -> Trajectory:
    vectors, grids, alive, actions, options = map(list, zip(*rows, strict=True))
    T, (G, K) = len(rows), actions[0].shape
    pointer = options[0] is not None
    return Trajectory(
        vectors=np.stack([*vectors, vectors[-1]]),
        grids=np.stack([*grids, grids[-1]]),
        alive=np.stack([*alive, np.zeros(G, dtype=bool)]),
        actions=np.stack(actions),
        shown=np.zeros((T, G, 0), dtype=np.float32),
        log_probs=np.zeros((T, G, K), dtype=np.float32),
        rewards=np.zeros(T),
        features=np.stack([o.features for o in options]) if pointer else None,
        action_mask=np.stack([o.action_mask for o in options]) if pointer else None,
    )


def clone(learner: Learner, lessons: Sequence[Trajectory], epochs: int) -> list[float]:
    """Fit the learner's actor to the lessons; the mean loss of each epoch.

    The loss is the negative log-likelihood of what the teacher did. The normalisers
    see the lessons first.
    """
    learner.observe(lessons)
    everything = Decisions.joined([decisions_of(lesson) for lesson in lessons])
    taught = everything.rows(everything.alive.any(dim=1).nonzero()[:, 0])
    optimiser = torch.optim.Adam(learner.actor.parameters(), CLONING_RATE)
    losses = []
    for _ in range(epochs):
        order = torch.randperm(len(taught), generator=learner.rng)
        total = 0.0
        for which in order.split(CLONING_BATCH):
            batch = taught.rows(which)
            policy = learner.actor(batch.vectors, batch.grids, batch.options)
            loss = -policy.log_probs(batch.actions)[batch.alive].mean()
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            total += float(loss.detach()) * len(batch)
        losses.append(total / len(taught))
    return losses
