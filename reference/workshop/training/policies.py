"""Learned policies as strategies: a checkpoint can replace a strategy's name.

It decides as the hand-written ones do, in metres.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np

from reference.building import Building, building_of
from reference.game.codec import Moment, decided
from reference.learning.players import LearnedNetwork
from reference.learning.settings import Side
from reference.paper import Scenario
from reference.workshop.storage.files import errors_naming
from reference.workshop.storage.runs import other_numbers
from reference.workshop.storage.workers import one_thread
from reference.workshop.strategies import SCRIPTS
from reference.workshop.strategies.trained import Trained, TrainedFire, TrainedRobots
from reference.workshop.training.checkpoints import (
    Checkpoint,
    CheckpointError,
    load_checkpoint,
    must_fit,
)
from reference.world import World


class LearnedPolicy(Trained):
    """One side of a checkpoint.

    learned  its network;  task  the training
    """

    def __init__(self, source: str | Path | Checkpoint, sample: bool = False):
        """Take the mean or most likely action; with `sample`, draw from the policy.

        Raises CheckpointError for a file that is no checkpoint, or one in which this
        side was not learned; OSError for a file that cannot be read.
        """
        checkpoint = (
            source if isinstance(source, Checkpoint) else load_checkpoint(source)
        )
        self.task = checkpoint.task
        self.name = self.task.building
        self.building = building_of(self.task.plans[0])
        self.scenario = self.task.settings.scenario
        self.numbers = checkpoint.numbers

        who = checkpoint.player(self.side)
        name = "the checkpoint" if source is checkpoint else source
        if not isinstance(who, LearnedNetwork):
            raise CheckpointError(
                f"{name}: nobody learned for the {self.side} there. Write "
                f"--{self.side} {who}, or name another checkpoint."
            )
        self.learned = who
        self.sample = sample
        # Damaged files are refused here, not in the middle of an evaluation.
        with must_fit(name, "its network does not fit its settings"):
            self.player = who.player(self.side, self.building, self.scenario)

    def decisions(
        self, vectors: np.ndarray, world: World, rng: np.random.Generator
    ) -> list[Any]:
        """A decision for each agent of the side, from (G, V) observations."""
        alive = np.ones(len(vectors), dtype=bool)
        moment = Moment(vectors, alive, world, rng if self.sample else None)
        with one_thread():  # as when it was trained: sums in one order
            (rows,), _ = self.player.act([moment])
        return [decided(row) for row in rows]


class LearnedRobots(LearnedPolicy, TrainedRobots):
    """Robots that a network guides [C5] [C7]."""


class LearnedFire(LearnedPolicy, TrainedFire):
    """A fire that a network lights [D2]."""


POLICIES: dict[Side, Any] = {"robots": LearnedRobots, "fire": LearnedFire}


def fixed_player(
    word: str, side: Side, building: Building | None, scenario: Scenario
) -> LearnedNetwork | str:
    """A strategy's name, or the network of a checkpoint; refuses one that misfits.

    building: None for several, of which the training itself refuses networks.
    Says on stderr if it learned with other numbers of the paper.
    """
    if word in SCRIPTS[side]:
        return word
    policy = POLICIES[side](word)
    if building is not None:
        with errors_naming(f"{side} {word}"):
            policy.refuse_elsewhere(building, scenario)
    numbers = other_numbers(policy.numbers)
    if numbers:
        print(f"note: {side} {word}: learned with {numbers}", file=sys.stderr)
    return policy.learned
