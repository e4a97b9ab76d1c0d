"""Imitation: robots that first copy a hand-written strategy, as an option [E1, chosen].

Clauses: C5, C7, E1.  An aid to ask for, never the default: what it teaches is not the
paper's.  The actor is fitted to what the strategy would have decided; then the critic
learns alone for some rounds, and then both learn as always.

    G, O, A  as in `players`
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

from reference.building import Building
from reference.game.frame import UNIT
from reference.game.moments import Moment
from reference.game.observations import from_normalised, to_normalised
from reference.learning.experience import (
    Decisions,
    GroupDecision,
    Trajectory,
    decisions_of,
)
from reference.learning.networks import RAW_LIMIT
from reference.learning.players import Player, Recorded
from reference.learning.ppo import Learner
from reference.learning.settings import Side, TrainerSettings
from reference.paper import Scenario
from reference.robots import actual_target
from reference.strategies import RobotStrategy
from reference.workshop.landmarks import landmarks_for
from reference.workshop.landmarks.of_robots import RobotOption
from reference.workshop.strategies import ROBOTS
from reference.workshop.strategies.robots import GROUP_RADIUS

CLONING_RATE = 1e-3  # [C7, chosen] learning rate of the fit
CLONING_BATCH = 64  # [C7, chosen] group decisions of its minibatches


@dataclass(frozen=True)
class Demonstration(Recorded):
    """A hand-written strategy plays; its decisions are recorded as a learner's.

    settings  of the learner;  teacher  the strategy's name
    """

    settings: TrainerSettings
    teacher: str

    def player(self, side: Side, building: Building, scenario: Scenario) -> Player:
        """Make the player that records the teacher."""
        marks = landmarks_for(side, self.settings)
        return _Teacher(self.teacher, side, building, scenario, self.settings, marks)


class _Teacher(Player):
    """Robots guided by a strategy, a fresh one in each episode."""

    def __init__(self, name: str, *learner: Any):
        super().__init__(*learner)
        self.name = name
        self.guides: dict[int, tuple[RobotStrategy, np.random.Generator]] = {}

    def act(
        self, moments: Sequence[Moment]
    ) -> tuple[np.ndarray, list[GroupDecision[np.ndarray]]]:
        """Play the strategy: (S, G, 2) actions, nan to keep a destination, and the same
        as decisions of the learner's head, `alive` where they can be taught."""
        wanted = [self._decided(moment) for moment in moments]
        return np.stack(wanted), list(map(self._recorded, moments, wanted))

    def _decided(self, moment: Moment) -> np.ndarray:
        """(G, 2) the teacher's actions; nan where it keeps the old destination."""
        world, seed = moment.world, moment.seed
        assert world is not None
        if seed not in self.guides:
            self.guides[seed] = ROBOTS[self.name](), np.random.default_rng(seed)
        strategy, rng = self.guides[seed]
        actions = np.full((len(world.robots), 2), np.nan, dtype=np.float32)
        active = [k for k, robot in enumerate(world.robots) if robot.active]
        decided = strategy.decide(world, [world.robots[k] for k in active], rng)
        for k, destination in zip(active, decided, strict=True):
            if destination is not None:
                target = actual_target(
                    self.building, world.robots[k].floor, *destination
                )
                spot = to_normalised(self.building, np.array(target))
                actions[k] = spot.clip(-1, 1)
        return actions

    def _recorded(
        self, moment: Moment, wanted: np.ndarray
    ) -> GroupDecision[np.ndarray]:
        """Record actions as the head's, with log_probs of 0.

        Those are a pointer's nearest option, or the spot; and "keep" where the teacher
        keeps a destination. What the head does not offer is left out, `alive` False:
        to go where no option or anchor is near, to keep if it cannot, to stay put.
        """
        new, spots = ~np.isnan(wanted).any(axis=1), np.nan_to_num(wanted)
        actions, features, action_mask = spots * RAW_LIMIT, None, None
        if self.frame:
            actions = self._in_frame(moment, wanted)
        taught = new
        (seen,), (choices,) = self.read([moment])
        if choices is not None:
            features, action_mask = choices.features, choices.action_mask
            kept = ~new & action_mask[:, RobotOption.KEEP]
            if self.settings.head == "mixture":
                off = np.linalg.norm(features - actions[:, None], axis=-1)
                off = np.where(action_mask, off, np.inf).min(axis=1)
                new = (off * UNIT <= GROUP_RADIUS) & moment.alive
            elif self.chooser is None:
                actions = np.concatenate([actions, new[:, None]], axis=1)
            else:
                ends, aims = (
                    from_normalised(self.building, spot.astype(float))
                    for spot in (choices.places, spots[:, None])
                )
                off = np.linalg.norm(ends - aims, axis=-1)
                meant = action_mask | (np.arange(off.shape[1]) == RobotOption.STAY)
                nearest = np.where(meant, off, np.inf).argmin(axis=1)
                each = np.arange(len(new)), nearest
                new = new & action_mask[each] & (off[each] <= GROUP_RADIUS)
                actions = np.where(kept, RobotOption.KEEP, nearest)[:, None]
            taught = new | kept
        actions = actions.astype(np.float32)
        return GroupDecision(
            vectors=seen,
            grids=moment.grid,
            alive=taught,
            actions=actions,
            shown=actions[:, :0],
            log_probs=np.zeros_like(actions),
            features=features,
            action_mask=action_mask,
        )

    def _in_frame(self, moment: Moment, wanted: np.ndarray) -> np.ndarray:
        """(G, 2) units from the robot; where none is wanted, where it is headed to.

        If it is not, its own place.
        """
        assert self.frame is not None
        aims = np.where(np.isnan(wanted), moment.headed, wanted)
        return np.nan_to_num(self.frame.actions(moment.vectors, aims))


def clone(
    learner: Learner, demonstrations: Sequence[Trajectory], epochs: int
) -> list[float]:
    """Fit the learner's actor to demonstrations; return each epoch's mean loss.

    The loss is the negative log-likelihood of what the teacher did. The normalisers
    see the demonstrations first.
    """
    learner.update_normalisers(demonstrations)
    everything = Decisions.joined([decisions_of(t) for t in demonstrations])
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
