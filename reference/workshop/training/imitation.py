"""Imitation: robots that first copy a hand-written strategy, as an option [E1, chosen].

It is never the default, since the paper has nothing like it.  The actor is fitted to
what the strategy would have decided: at first where the strategy itself leads, then,
round after round, where the copy leads (DAgger, Ross et al. 2011).  Then the critic
learns alone for some rounds, and then both learn as always.

    G, S  as in `players`
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import torch
from torch import Tensor

from reference.building import Building
from reference.game.codec import RAW_LIMIT, Moment
from reference.game.observations import from_normalised
from reference.learning.experience import Decisions, Record, Trajectory, decisions_of
from reference.learning.players import LearnedNetwork, Player
from reference.learning.ppo import Learner
from reference.learning.settings import Side, TrainerSettings
from reference.paper import Scenario
from reference.robots import RobotStrategy, actual_target
from reference.workshop.anchors.frame import (
    in_body,
    robot_destinations,
    to_normalised,
)
from reference.workshop.anchors.settings import RobotsFrame
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.guides import GROUP_RADIUS
from reference.workshop.training.batches import averaged, strips

CLONING_RATE = 1e-3  # [C7, chosen] learning rate of the fit
CLONING_BATCH = 64  # [C7, chosen] group decisions of its minibatches


@dataclass(frozen=True)
class Demonstration(LearnedNetwork):
    """Robots whose recorded decisions are those of a hand-written strategy [C5].

    settings, weights  of the learner, who plays; without weights the teacher does
    teacher  the strategy's name
    """

    teacher: str

    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make the player that records the teacher."""
        learner = super().player(side, building, scenario) if self.weights else None
        return _Teacher(self.teacher, learner, side, building, scenario, self.settings)


class _Teacher(Player):
    """Robots guided by a strategy, a fresh one in each episode, or by its pupil."""

    def __init__(
        self,
        name: str,
        pupil: Player | None,
        side: Side,
        building: Building,
        scenario: Scenario,
        settings: TrainerSettings,
    ):
        super().__init__(side, building, scenario, settings)
        self.name = name
        self.pupil = pupil
        self.guides: dict[int, tuple[RobotStrategy, np.random.Generator]] = {}

    def act(self, moments: Sequence[Moment]) -> tuple[np.ndarray, list[Record]]:
        """Let the pupil act, if there is one, else the teacher; record the teacher.

        Returns (S, G, 2) metres of who acts, nan to keep a destination, and records of
        what the teacher decided, as actions of the pupil's head.
        """
        wanted = [self._decided(moment) for moment in moments]
        seen = self.codec.read(moments)
        grids = self.codec.grids(moments)
        records = list(map(self._recorded, moments, wanted, seen, grids))
        if self.pupil is None:
            return np.stack(wanted), records
        done, _ = self.pupil.act_on(seen, grids, moments)
        return done, records

    def _decided(self, moment: Moment) -> np.ndarray:
        """(G, 2) metres, the teacher's; nan where it keeps the old destination."""
        world = moment.world
        # Strategies remember, so each episode has one of its own.
        seed = _seed_of(moment)
        if seed not in self.guides:
            self.guides[seed] = ROBOTS[self.name](), np.random.default_rng(seed)
        strategy, rng = self.guides[seed]
        building = self.codec.building
        metres = np.full((len(world.robots), 2), np.nan)
        active = [k for k, robot in enumerate(world.robots) if robot.active]
        decided = strategy.decide(world, [world.robots[k] for k in active], rng)
        for k, destination in zip(active, decided, strict=True):
            if destination is not None:
                floor = world.robots[k].floor
                target = actual_target(building, floor, *destination)
                metres[k] = in_body(building, np.array(target))
        return metres

    def _recorded(
        self, moment: Moment, wanted: np.ndarray, seen: np.ndarray, grid: np.ndarray
    ) -> Record:
        """Record actions as the head's, with log_probs of 0.

        A robot that keeps its destination counts as choosing it again, or its own place
        if it has none. What the head cannot express is left out, `alive` False: for a
        mixture what is near no anchor, for a Gaussian to keep a destination.
        """
        kept = np.isnan(wanted).any(axis=1)
        building = self.codec.building
        old = from_normalised(building, robot_destinations(moment.world).astype(float))
        aims = np.where(kept[:, None], old, wanted)
        taught = moment.alive.copy()
        if isinstance(self.codec, RobotsFrame):
            actions = np.nan_to_num(self.codec.raw(aims, moment.vectors))
            taught &= self.codec.off_anchors(actions, seen) <= GROUP_RADIUS
        else:
            actions = np.nan_to_num(to_normalised(building, aims) * RAW_LIMIT)
            taught &= ~kept
        return {
            "vectors": seen,
            "grids": grid,
            "alive": taught,
            "actions": actions.astype(np.float32),
            "log_probs": np.zeros_like(actions),  # `clone` does not read them
        }


def _seed_of(moment: Moment) -> int:
    """The episode's seed, with which the seeds of its generators begin."""
    if moment.rng is None:
        return 0
    seeds: Any = moment.rng.bit_generator.seed_seq
    seed: int = seeds.entropy[0]
    return seed


def clone(
    learner: Learner, demonstrations: Sequence[Trajectory], epochs: int
) -> list[float]:
    """Fit the learner's actor to demonstrations; return each epoch's mean loss.

    The loss is the negative log-likelihood of what the teacher did. The normalisers
    see the demonstrations first, those of earlier rounds again.
    """
    learner.update_normalisers(demonstrations)
    taught = _taught(learner, demonstrations)
    # An optimiser of its own: the learner's has moments of another loss.
    optimiser = torch.optim.Adam(learner.actor.parameters(), CLONING_RATE)
    losses = []
    for _ in range(epochs):
        total = 0.0
        for which in strips(taught, CLONING_BATCH, learner.rng):
            batch = taught.rows(which)
            loss = averaged(batch, partial(_unlikelihood, learner))
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            total += float(loss.detach()) * len(batch)
        losses.append(total / len(taught))
    return losses


def _taught(learner: Learner, demonstrations: Sequence[Trajectory]) -> Decisions:
    """Join the decisions; those that teach nobody would make batches of nothing."""
    everything = learner.joined([decisions_of(t) for t in demonstrations])
    return everything.rows(everything.alive.any(dim=1).nonzero()[:, 0])


def _unlikelihood(learner: Learner, batch: Decisions) -> Tensor:
    """The mean negative log-likelihood of what was demonstrated."""
    policy = learner.actor(batch.vectors, batch.grids)
    return -policy.log_probs(batch.actions)[batch.alive].mean()
