"""Robots that are deceived about where everybody is, as much as does most harm.

Clauses: F4, C1, E1.  Eq. 5 as it is meant there: what the robots observe is off by δ,
‖δ‖∞ ≤ ε, the worst that can be found at each decision on its own (GWC).

    o    observations (G, V);  δ  what they are off by, 0 or ± ε, metres
    b    baseline of MA-POCA's critic: the value of the group when all but one have
         decided, without knowing what that one does
    G  robots;  V  numbers that a robot observes;  K  tries;  E  shown to the critic
"""

from typing import NamedTuple

import numpy as np
import torch

from reference.building import Building
from reference.game.observations import grid, robot_layout, robots_at_work
from reference.learning.networks import GroupCritic, one_thread
from reference.learning.rollouts import Moment
from reference.paper import Scenario
from reference.workshop.evaluation.worst_case.critic import critic_of
from reference.workshop.training.checkpoints import Checkpoint, CheckpointError, load
from reference.workshop.training.policies import LearnedRobots, Source
from reference.world import World

EPSILON = 1.0
"""[F4, chosen] metres: a cell of the grid, about what positioning indoors is off by."""

TRIES = 4
"""[F4, chosen] for each robot, corners of its ball that are looked at."""


class Attack(NamedTuple):
    """The worst that was found at one decision.

    seen     (G, V) float32, o + δ;  emitted  (G, 2) what the robots then do
    value    mean of b, scaled return: what the critic expects of that
    plain    the same for what they would do undeceived
    """

    seen: np.ndarray
    emitted: np.ndarray
    value: float
    plain: float


class PerturbedRobots(LearnedRobots):
    """A checkpoint's robots, deceived by at most ε at each decision [F4, Eq. 5].

    What may be off is x and y of every person, robot and fire source that is there:
    2 (40 + 6 + 8) = 108 of the paper's 167 numbers at most. Storeys, counts, the time,
    what stands for those who are gone, and the grid are as they are; so is the order
    of people. Each robot's vector is off on its own.

    [F4, chosen] The search is greedy over the robots, in turn: some corners of the
    ball around a robot's own vector are tried, and the joint action of lowest value
    stays. So every δ that is found exists, but a better search might find a worse one:
    the reward under this attack is an upper bound of Eq. 5's. MA-POCA's baselines
    judge the actions: each tells the group's value given what the others do, and
    the value is their mean. A robot that is alone at work is judged by nobody, so it is
    not deceived.
    """

    critic: GroupCritic

    def __init__(self, source: Source, epsilon: float = EPSILON, tries: int = TRIES):
        """epsilon: metres, 0 or more; the robots take their likeliest actions.

        Raises ValueError for other numbers, and CheckpointError as `LearnedRobots`
        does and for robots that learned by PPO, whose critic judges no actions.
        """
        if not 0 <= epsilon < np.inf or tries < 1:
            raise ValueError(
                f"observations off by {epsilon:g} m, {tries} tries: "
                "give metres from 0 upwards, and at least one try"
            )
        checkpoint = source if isinstance(source, Checkpoint) else load(source)
        super().__init__(checkpoint)
        self.epsilon, self.tries = epsilon, tries
        critic = critic_of(checkpoint, self)
        if not isinstance(critic, GroupCritic):
            raise CheckpointError(
                "these robots learned by ppo: their critic judges no actions, so the "
                "worst action cannot be told. Name robots that learned by poca."
            )
        self.critic = critic

    def _emitted(
        self, vectors: np.ndarray, world: World, rng: np.random.Generator
    ) -> np.ndarray:
        """(G, 2) what they do when deceived; without deception what they would do."""
        if not self.epsilon:
            return super()._emitted(vectors, world, rng)
        return self.attack(vectors, grid(world), robots_at_work(world), rng).emitted

    def attack(
        self,
        vectors: np.ndarray,
        cells: np.ndarray,
        alive: np.ndarray,
        rng: np.random.Generator,
    ) -> Attack:
        """vectors (G, V), the truth; cells, the grid; alive (G,) bool, at work."""
        emitted, shown = self._act(vectors[None], cells, alive)
        plain = float(self._value(vectors, cells, alive, shown)[0])
        worst = Attack(vectors, emitted[0], plain, plain)
        for g in np.flatnonzero(alive).tolist():
            seen = np.tile(worst.seen, (self.tries, 1, 1))
            seen[:, g] = self._off(vectors[g], rng)
            emitted, shown = self._act(seen, cells, alive)
            value = self._value(vectors, cells, alive, shown)
            k = int(value.argmin())
            if value[k] < worst.value:
                worst = Attack(seen[k], emitted[k], float(value[k]), plain)
        return worst

    def _off(self, vector: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """(K, V) corners of the ball around a vector (V,), cut off at the drawing."""
        building, scenario = self.building, self.scenario
        delta = rng.choice([-self.epsilon, self.epsilon], (self.tries, len(vector)))
        layout = robot_layout(building, scenario)
        below = np.nextafter(layout.high, layout.low)
        seen = (vector + delta).clip(layout.low, below)
        free = may_be_off(vector, building, scenario)
        return np.where(free, seen, vector).astype(np.float32)

    def _act(
        self, seen: np.ndarray, cells: np.ndarray, alive: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """What the policy does on (K, G, V): emitted, and shown to critics."""
        with one_thread():
            emitted, decisions = self.player.act(
                [Moment(vectors, cells, alive) for vectors in seen]
            )
        return emitted, np.stack([decision.shown for decision in decisions])

    def _value(
        self,
        vectors: np.ndarray,
        cells: np.ndarray,
        alive: np.ndarray,
        shown: np.ndarray,
    ) -> np.ndarray:
        """(K,) mean baseline of those at work, given the truth and the actions."""
        K, there = len(shown), torch.from_numpy(alive)
        truth, grids = torch.from_numpy(vectors), torch.from_numpy(cells)
        with one_thread(), torch.no_grad():
            _, b = self.critic.with_baselines(
                truth.expand(K, *truth.shape),
                grids.expand(K, *grids.shape),
                there.expand(K, -1),
                torch.from_numpy(shown),
            )
        mean: np.ndarray = b[:, there].mean(dim=1).numpy()
        return mean


def may_be_off(
    vector: np.ndarray, building: Building, scenario: Scenario
) -> np.ndarray:
    """(V,) bool: x and y of the points in a robot's vector that are there."""
    free = np.zeros(len(vector), dtype=bool)
    for slot in robot_layout(building, scenario).slots:
        if slot.stop - slot.start == 3 and vector[slot.stop - 1] >= 0:
            free[slot.start : slot.stop - 1] = True
    return free
