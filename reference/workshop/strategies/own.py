"""Strategies of your own: code named `module:Name`, policies that learned elsewhere.

Clauses: C5, C7, D2.

    class Guide(FlatRobots):  # in mine.py: `evaluate --robots sweep mine:Guide`
        def __init__(self):
            super().__init__(policy, "tiny", Scenario(people=12))
"""

import os
import sys
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from importlib import import_module
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.random import Generator as Rng

from reference.building import Building
from reference.fire import Decision
from reference.game.environment import destination, fire_decision
from reference.game.observations import (
    fire_vector,
    robot_vectors,
    robots_at_work,
    vector_layout,
)
from reference.learning.settings import Side
from reference.paper import InputError, Scenario
from reference.robots import Destinations
from reference.workshop.maps import load
from reference.workshop.storage.runs import digests_of_code
from reference.world import Robot, World

CODE = "MODULE:NAME"
ASKED = {"robots": ("world", "robots", "rng"), "fire": ("world", "rng")}
ANSWERS = {
    "robots": "a list with (x, y) in metres, or None, for each of the robots",
    "fire": "(floor, x, y), in metres, or None",
}

# -- Code ---------------------------------------------------------------------------


def is_code(word: str) -> bool:
    """Does a word name code: `module:Name`, `package.module:Name`?"""
    module, _, name = word.partition(":")
    return all(part.isidentifier() for part in (name, *module.split(".")))


def from_code(word: str, side: Side) -> Any:
    """Make the strategy that a word names: an object with `decide`, or its class.

    Raises InputError for a module or name that is not there, and for what cannot
    decide; so does a decision that is none. What the code itself raises is not caught.
    """
    name, asked = word.partition(":")[2], ASKED[side]
    if (named := getattr(_module(word), name, None)) is None:
        raise InputError(f"{word}: {_file(word)} has no '{name}'.")
    decides = hasattr(named, "decide") and not isinstance(named, type)
    made = named if decides or not callable(named) else named()
    try:
        signature(made.decide).bind(*asked)
    except (AttributeError, TypeError):
        needs = f"decide({', '.join(asked)})"
        raise InputError(f"{word}: who plays the {side} has {needs}.") from None
    if isinstance(made, Trained):
        return made
    return Own(made, word, side)


class Own:
    """A strategy of your own, whose answers are checked before anybody acts on them."""

    def __init__(self, strategy: Any, word: str, side: Side):
        self.strategy, self.word, self.side = strategy, word, side

    def decide(self, world: World, *asked: Any) -> Any:
        """Decide as it does. Raises InputError for what is no decision of its side."""
        answer = self.strategy.decide(world, *asked)
        if self.side == "fire" and answer is None:
            return None
        try:
            if self.side == "fire":
                floor, x, y = answer
                return int(floor), *metres(x, y)
            each = zip(asked[0], answer, strict=True)  # one for each of the robots
            return [None if point is None else metres(*point) for _, point in each]
        except (TypeError, ValueError, OverflowError):
            raise InputError(
                f"{self.word}: decide returned {answer!r:.60}; it should be "
                f"{ANSWERS[self.side]}."
            ) from None


def metres(x: Any, y: Any) -> tuple[float, float]:
    """Read two finite numbers. Raises ValueError or TypeError for others."""
    read = float(x), float(y)
    if not np.isfinite(read).all():
        raise ValueError
    return read


def code_digests(word: str) -> dict[str, str]:
    """Digest the file of the module that a word names, and those that it imports.

    Raises as `_file` does.
    """
    return digests_of_code(word.partition(":")[0], _file(word))


def _file(word: str) -> Path:
    """The file of the module that a word names. Raises InputError if it has none."""
    if path := _module(word).__file__:
        return Path(path)
    raise InputError(f"{word}: name a module, not a folder.")


def _module(word: str) -> ModuleType:
    """Import a module, first from the current folder."""
    name = word.partition(":")[0]
    if sys.path[0] not in ("", os.getcwd()):
        sys.path.insert(0, os.getcwd())
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if not f"{name}.".startswith(f"{error.name}."):
            raise
        raise InputError(
            f"{word}: there is no module '{name}'. Write it here as mine:Guide for "
            "`class Guide` in mine.py."
        ) from None


# -- Policies that have learned -----------------------------------------------------


class Trained(ABC):
    """A policy of one building and scenario; it remembers no decision.

    name, building, scenario  what it has learned in
    """

    side: Side
    name: str
    building: Building
    scenario: Scenario

    def __deepcopy__(self, memo: dict[int, Any]) -> "Trained":
        """Itself: copies of a simulation share the network."""
        return self

    def refuse_elsewhere(self, building: Building, scenario: Scenario) -> None:
        """Raise InputError unless the policy can read such a world.

        It needs the same drawing and numbers of people, robots, sources and seconds
        between decisions as in training. Where people start, how far they see, rule D6
        and the time limit may differ.
        """
        own = self.building
        if own.drawing != building.drawing:
            raise InputError(
                f"it has learned in {own.title}, not in this drawing of "
                f"{building.title}. Name the building that it learned in."
            )
        trained = _counts(own, self.scenario)
        for name, count in _counts(building, scenario).items():
            if count != trained[name]:
                raise InputError(
                    f"its {self.side} learned with {trained[name]} {name}; here it is "
                    f"{count}. Take as many, or train for it."
                )

    @abstractmethod
    def emitted(self, vectors: np.ndarray, world: World, rng: Rng) -> np.ndarray:
        """(G, A) actions in [-1, 1] for (G, V) observations."""


class TrainedRobots(Trained):
    """Robots that a policy guides [C5] [C7]."""

    side: Side = "robots"

    def decide(self, world: World, robots: Sequence[Robot], rng: Rng) -> Destinations:
        """Choose the next destination of each of these robots, metres."""
        emitted = self.emitted(robot_vectors(world, self.scenario), world, rng)
        row = {robot.body: k for k, robot in enumerate(world.robots)}
        return [destination(self.building, emitted[row[r.body]]) for r in robots]


class TrainedFire(Trained):
    """A fire that a policy lights [D2]."""

    side: Side = "fire"

    def decide(self, world: World, rng: Rng) -> Decision:
        """Choose floor and metres of the next source."""
        emitted = self.emitted(fire_vector(world, self.scenario)[None], world, rng)
        return fire_decision(self.building, emitted[0])


def _counts(building: Building, scenario: Scenario) -> dict[str, float]:
    """Collect the numbers that a policy's inputs depend on."""
    return {
        "people": sum(scenario.start_counts(building.floors)),
        "robots": scenario.robots_per_floor * building.floors,
        "fire sources": scenario.sources,
        "seconds between decisions": scenario.decision_seconds,
    }


class Flat(Trained):
    """A policy on the observations of `parallel_env(..., flat=True)`.

    policy  (G, V) float32, a row for each agent of the side, zeros for who has left
            -> (G, A) in [-1, 1]
    """

    def __init__(
        self,
        policy: Callable[[np.ndarray], np.ndarray],
        building: str = "paper",
        scenario: Scenario | None = None,
    ):
        """building, scenario: those that it has learned in."""
        self.policy, self.scenario = policy, scenario or Scenario()
        self.name, self.building = building, load(building)
        self.layout = vector_layout(self.building, self.scenario)

    def emitted(self, vectors: np.ndarray, world: World, rng: Rng) -> np.ndarray:
        """(G, A) actions in [-1, 1] for (G, V) observations."""
        seen = self.layout.scaled(vectors).clip(-1, 1).astype(np.float32)
        if self.side == "robots":
            seen[~robots_at_work(world)] = 0
        return np.asarray(self.policy(seen), dtype=float)


class FlatRobots(Flat, TrainedRobots):
    """Robots that such a policy guides."""


class FlatFire(Flat, TrainedFire):
    """A fire that such a policy lights."""
