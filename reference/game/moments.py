"""Moments and choices: what a side decides upon, and the options it has.

Clauses: C1, C5, C7, D1, D2.  Whoever plays a side, a network or a teacher, decides upon
a `Moment`; a pointer head chooses among `Choices`, and a mixture draws around them.

    G   agents of a side;  V  numbers of a vector;  A  numbers of an action
    O   options of an agent;  F  features of an option;  R  robots, the fire's G is 1
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from reference.game.observations import grid, headed
from reference.world import World


@dataclass(frozen=True)
class Moment:
    """What a side has to decide upon in one episode.

    vectors  (G, V) float32; for agents that have left, what they saw last
    grid     (channels, height, width) uint8, shared
    alive    (G,) bool, who has not left
    headed   (R, 2) normalised, where robots under way go, nan for the others
    world    what is observed: networks do not read it
    rng      what actions are sampled with; None: the mean or most likely action
    seed     of the episode
    """

    vectors: np.ndarray
    grid: np.ndarray
    alive: np.ndarray
    headed: np.ndarray
    world: World | None = None
    rng: np.random.Generator | None = None
    seed: int = 0

    @classmethod
    def of(
        cls,
        world: World,
        vectors: np.ndarray,
        alive: np.ndarray,
        rng: np.random.Generator | None = None,
    ) -> "Moment":
        """What there is to decide in a world, outside of any episode."""
        return cls(vectors, grid(world), alive, headed(world), world, rng)


@dataclass(frozen=True)
class Choices:
    """What agents choose among.

    places       (G, O, A) float32, the action that each option emits, in [-1, 1]
    features     (G, O, F) float32, of size about 1; of a mixture's anchors x and y
    action_mask  (G, O) bool, False for padding; at least one is True in a row
    """

    places: np.ndarray
    features: np.ndarray
    action_mask: np.ndarray


class Chooser(Protocol):
    """Finds, on one map, the options of a side's agents.

    features  F, how many numbers describe an option
    """

    features: int

    def __call__(self, moment: Moment) -> Choices:
        """Options of all agents of a side at one moment."""
