"""Play code of your own, named `module:Name` and imported from the current folder.

class Guide:  # in mine.py: `evaluate --robots sweep mine:Guide`
    def decide(self, world, robots, rng):
        return [robot.position for robot in robots]

class Fire:  # floors count from 0 here: what a map calls floor 1 is 0
    def decide(self, world, rng):
        return 0, 1.5, -2.5
"""

import os
import sys
from importlib import import_module
from inspect import signature
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from reference.learning.settings import Side
from reference.paper import InputError
from reference.workshop.storage.runs import digests_of_code
from reference.workshop.strategies.trained import Trained
from reference.world import World

CODE = "MODULE:NAME"
"""How the help names code."""

ASKED = {"robots": ("world", "robots", "rng"), "fire": ("world", "rng")}
ANSWERS = {
    "robots": "a list with (x, y) in metres, or None, for each of the robots",
    "fire": "(floor, x, y), 0 for the lowest floor, in metres, or None",
}


def is_code(word: str) -> bool:
    """Tell whether a word names code: `module:Name`, `package.module:Name`."""
    module, _, name = word.partition(":")
    return all(part.isidentifier() for part in (name, *module.split(".")))


def from_code(word: str, side: Side) -> Any:
    """Make the strategy that a word names: an object with `decide`, or its class.

    Raises InputError for a module or name that is not there, and for what cannot
    decide; so does a decision that is none. What the code itself raises is not caught.
    """
    name = word.partition(":")[2]
    named = getattr(_import_module(word), name, None)
    if named is None:
        raise InputError(f"{word}: {_file_of(word)} has no '{name}'.")
    decides = hasattr(named, "decide") and not isinstance(named, type)
    made = named if decides or not callable(named) else named()
    try:
        signature(made.decide).bind(*ASKED[side])
    except (AttributeError, TypeError):
        needs = f"decide({', '.join(ASKED[side])})"
        raise InputError(f"{word}: who plays the {side} has {needs}.") from None
    if isinstance(made, Trained):
        return made
    return CheckedStrategy(made, word, side)


class CheckedStrategy:
    """A strategy of your own, whose answers are checked before anybody acts on them."""

    def __init__(self, strategy: Any, word: str, side: Side):
        self.strategy = strategy
        self.word = word
        self.side = side

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

    Raises as `_file_of` does.
    """
    return digests_of_code(word.partition(":")[0], _file_of(word))


def _file_of(word: str) -> Path:
    """Find the file of the module that a word names; InputError if it has none."""
    if path := _import_module(word).__file__:
        return Path(path)
    raise InputError(f"{word}: name a module, not a folder.")


def _import_module(word: str) -> ModuleType:
    """Import a module, first from the current folder."""
    name = word.partition(":")[0]
    if sys.path[0] not in ("", os.getcwd()):  # as for a script that is started here
        sys.path.insert(0, os.getcwd())
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        if not f"{name}.".startswith(f"{error.name}."):
            raise  # it is there, but imports what is not
        raise InputError(
            f"{word}: there is no module '{name}'. Write it here as mine:Guide for "
            "`class Guide` in mine.py."
        ) from None
