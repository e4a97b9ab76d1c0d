"""Learned policies as strategies: a checkpoint can replace a strategy's name.

Clauses: C5, C7, D2.  The interface is that of the hand-written ones; the network's
output, normalised coordinates in [−1, 1], is turned into metres.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from reference.building import Building, building_of
from reference.fire import Decision
from reference.game.environment import destination, fire_decision
from reference.game.interface import Moment
from reference.game.observations import fire_vector, robot_vectors
from reference.learning.players import Learned
from reference.learning.settings import Side
from reference.paper import Scenario
from reference.robots import Destinations
from reference.workshop.strategies import SCRIPTS
from reference.workshop.training.checkpoints import (
    Checkpoint,
    CheckpointError,
    load,
    must_fit,
)
from reference.workshop.workers import one_thread
from reference.world import Robot, World


class LearnedPolicy:
    """One side of a checkpoint; it remembers nothing from one decision to the next.

    learned  its network;  task  the training;  building, scenario  what it was in
    """

    side: Side

    def __init__(self, source: str | Path | Checkpoint, sample: bool = False):
        """Take the mean or most likely action; with `sample`, draw from the policy.

        Raises CheckpointError for a file that is no checkpoint, or one in which this
        side was not learned; OSError for a file that cannot be read.
        """
        checkpoint = source if isinstance(source, Checkpoint) else load(source)
        self.task, who = checkpoint.task, checkpoint.player(self.side)
        self.building = building_of(self.task.plan)
        self.scenario = self.task.settings.scenario
        if not isinstance(who, Learned):
            raise CheckpointError(
                f"nobody learned for the {self.side} in this checkpoint. Write "
                f"--{self.side} {who}, or name another checkpoint."
            )
        self.learned, self.sample = who, sample
        name = "the checkpoint" if source is checkpoint else source
        with must_fit(name, "its network is not of the shape its settings tell"):
            self.player = who.player(self.side, self.building, self.scenario)

    def __deepcopy__(self, memo: dict[int, Any]) -> "LearnedPolicy":
        """Itself: copies of a simulation share the network."""
        return self

    def refuse_elsewhere(self, building: Building, scenario: Scenario) -> None:
        """Raise CheckpointError unless the policy can read such a world.

        It needs the same drawing and numbers of people, robots, sources and seconds
        between decisions as in training. Where people start, how far they see, rule D6
        and the time limit may differ.
        """
        own = self.building
        if own.plan != building.plan:
            raise CheckpointError(
                f"the checkpoint has learned {own.title}, not this drawing of "
                f"{building.title}. Leave the building out, or name its own."
            )
        for what, number in _facts(building, scenario).items():
            if number != (trained := _facts(own, self.scenario)[what]):
                raise CheckpointError(
                    f"the checkpoint's {self.side} learned with {trained} {what}; here "
                    f"it is {number}. Take as many, or train for it."
                )

    def _emitted(
        self, vectors: np.ndarray, world: World, rng: np.random.Generator
    ) -> np.ndarray:
        """(G, A) actions in [−1, 1] for (G, V) observations."""
        alive = np.ones(len(vectors), dtype=bool)
        with one_thread():
            moment = Moment(vectors, alive, world, rng if self.sample else None)
            emitted, _ = self.player.act([moment])
        return np.asarray(emitted[0])


class LearnedRobots(LearnedPolicy):
    """Robots that a network guides [C5] [C7]."""

    side: Side = "robots"

    def decide(
        self, world: World, robots: Sequence[Robot], rng: np.random.Generator
    ) -> Destinations:
        """Choose the next destination of each of these robots, metres."""
        emitted = self._emitted(robot_vectors(world, self.scenario), world, rng)
        row = {robot.body: k for k, robot in enumerate(world.robots)}
        return [destination(self.building, emitted[row[r.body]]) for r in robots]


class LearnedFire(LearnedPolicy):
    """A fire that a network lights [D2]."""

    side: Side = "fire"

    def decide(self, world: World, rng: np.random.Generator) -> Decision:
        """Choose floor and metres of the next source."""
        emitted = self._emitted(fire_vector(world, self.scenario)[None], world, rng)
        return fire_decision(self.building, emitted[0])


POLICIES: dict[Side, Any] = {"robots": LearnedRobots, "fire": LearnedFire}


def _facts(building: Building, scenario: Scenario) -> dict[str, float]:
    """Collect the numbers that a network's inputs depend on."""
    return {
        "people": sum(scenario.start_counts(building.floors)),
        "robots": scenario.robots_per_floor * building.floors,
        "fire sources": scenario.sources,
        "seconds between decisions": scenario.decision_seconds,
    }


def fixed_player(
    word: str, side: Side, building: Building, scenario: Scenario
) -> Learned | str:
    """A strategy's name, or the network of a checkpoint; refuses one that misfits."""
    if word in SCRIPTS[side]:
        return word
    policy = POLICIES[side](word)
    policy.refuse_elsewhere(building, scenario)
    return policy.learned
