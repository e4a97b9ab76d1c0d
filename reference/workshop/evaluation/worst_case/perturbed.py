"""Robots whose observations are perturbed, by the worst error that a search finds.

Clauses: F4, C1, E1.  Eq. 5 as it is meant there: what the robots observe is off by δ,
‖δ‖∞ ≤ ε, the worst that can be found at each decision on its own (GWC).

    o    observations (G, V);  δ  their error, 0 or ± ε, metres
    b    baseline of MA-POCA's critic: the value of the group when all but one have
         decided, without knowing what that one does
    G  robots;  V  numbers that a robot observes;  K  tries
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import torch
from numpy.random import Generator as Rng

from reference.building import Building
from reference.game.moments import Moment
from reference.game.observations import robots_at_work, vector_layout
from reference.learning.networks import one_thread
from reference.learning.poca import GroupCritic
from reference.paper import InputError, Scenario
from reference.workshop.evaluation.worst_case.critic import critic_of
from reference.workshop.training.checkpoints import CheckpointError
from reference.workshop.training.policies import CheckpointLike, LearnedRobots
from reference.world import World

EPSILON = 1.0
"""[F4, chosen] metres: a cell of the grid, about the error of indoor positioning."""

TRIES = 4
"""[F4, chosen] corners of its ball that are tried for each robot."""


class Attack(NamedTuple):
    """The worst perturbation that was found at one decision.

    seen     (G, V) float32, o + δ;  emitted  (G, 2) what the robots then do
    value    mean of b, scaled return: what the critic expects of that
    """

    seen: np.ndarray
    emitted: np.ndarray
    value: float


class PerturbedRobots(LearnedRobots):
    """A checkpoint's robots whose observations are off by at most ε [F4, Eq. 5].

    The error may affect x and y of every person, robot and fire source that is there:
    2 (40 + 6 + 8) = 108 of the paper's 167 numbers at most. Storeys, counts, the time,
    the rows of those who are gone, the grid and the order of people stay as they are.

    [F4, chosen] The search is greedy over the robots: it tries some corners of the ball
    around each one's vector and keeps the one whose joint action has the lowest value,
    the mean of MA-POCA's baselines. A better search might find a worse δ: the reward
    under this attack is an upper bound of Eq. 5's. A robot alone at work has no
    baseline, so it is not deceived.
    """

    critic: GroupCritic
    tries = TRIES

    def __init__(self, source: CheckpointLike, epsilon: float = EPSILON):
        """epsilon: metres, 0 or more; the robots take their likeliest actions.

        Raises ValueError for other numbers, and CheckpointError as `LearnedRobots`
        does and for robots that learned by PPO, whose critic judges no actions.
        """
        if not 0 <= epsilon < np.inf:
            raise InputError(f"{epsilon:g} m: give metres from 0 upwards")
        super().__init__(source)
        self.epsilon, critic = epsilon, critic_of(self)
        if not isinstance(critic, GroupCritic):
            raise CheckpointError(
                "these robots learned by ppo, whose critic judges no actions. Name "
                "robots that learned by poca."
            )
        self.critic = critic

    def _emitted(self, vectors: np.ndarray, world: World, rng: Rng) -> np.ndarray:
        """Choose actions (G, 2) under the attack, or without it where ε = 0."""
        if not self.epsilon:
            return super()._emitted(vectors, world, rng)
        truth = Moment.of(world, vectors, robots_at_work(world))
        return self.attack(truth, rng).emitted

    def attack(self, truth: Moment, rng: Rng) -> Attack:
        """Search, robot by robot, for the observations of lowest value."""
        emitted, values = self._evaluate(truth, truth.vectors[None])
        worst = Attack(truth.vectors, emitted[0], float(values[0]))
        for g in np.flatnonzero(truth.alive).tolist():
            seen = np.tile(worst.seen, (self.tries, 1, 1))
            seen[:, g] = self._perturbed(truth.vectors[g], rng)
            emitted, values = self._evaluate(truth, seen)
            k = int(values.argmin())
            if values[k] < worst.value:
                worst = Attack(seen[k], emitted[k], float(values[k]))
        return worst

    def _perturbed(self, vector: np.ndarray, rng: Rng) -> np.ndarray:
        """Draw (K, V) corners of the ball around a vector (V,), clipped to the map."""
        delta = rng.choice([-self.epsilon, self.epsilon], (self.tries, len(vector)))
        layout = vector_layout(self.building, self.scenario)
        below = np.nextafter(layout.high, layout.low)
        seen = (vector + delta).clip(layout.low, below)
        free = perturbable(vector, self.building, self.scenario)
        return np.where(free, seen, vector).astype(np.float32)

    def _evaluate(
        self, truth: Moment, seen: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Compute actions (K, G, 2) on seen (K, G, V), and their true value (K,)."""
        with one_thread(), torch.no_grad():
            moments = [replace(truth, vectors=each) for each in seen]
            emitted, decisions = self.player.act(moments)
            shown = torch.from_numpy(np.stack([each.shown for each in decisions]))
            vectors, grids, alive = (
                torch.from_numpy(part).expand(len(seen), *part.shape)
                for part in (self.player.seen(truth), truth.grid, truth.alive)
            )
            _, b = self.critic.with_baselines(vectors, grids, alive, shown)
            values = b[:, torch.from_numpy(truth.alive)].mean(dim=1)
        return emitted, values.numpy()


def perturbable(
    vector: np.ndarray, building: Building, scenario: Scenario
) -> np.ndarray:
    """Mark x and y of the points in a robot's vector that are there: (V,) bool."""
    free = np.zeros(len(vector), dtype=bool)
    for slot in vector_layout(building, scenario).slots:
        if slot.stop - slot.start == 3 and vector[slot.stop - 1] >= 0:
            free[slot.start : slot.stop - 1] = True
    return free
