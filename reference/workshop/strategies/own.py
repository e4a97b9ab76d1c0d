"""Play code of your own, named `module:Name` and imported from the current folder.

class Guide:  # in mine.py: `evaluate --robots sweep mine:Guide`
    def decide(self, world, robots, rng):
        return [robot.position for robot in robots]

class Fire:  # floors count from 0 here: what a map calls floor 1 is 0
    def decide(self, world, rng):
        return 0, 1.5, -2.5

Name a class that is made without arguments, or an object.  Every run plays with a new
one, of a module imported anew, with those that it imports from its folder:

* What it remembers belongs in the object (`self.seen = set()` in `__init__`), not in
  the class or the module: nothing there stays from one run to the next, or passes
  between robots and fire.  So no run depends on which were played before it, or on the
  number of workers.
* Chance comes from `rng`, numpy's, not from `random` or `numpy.random`, which do not
  know the seed.
* The world is there to be looked at: `robot.position += 1` is refused.
* What it prints goes to stderr, also while it is imported, for each run anew.
* It is copied, where a run's fire is measured and futures are tried: leave open files,
  generators and locks out of it.
"""

import ast
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from copy import deepcopy
from importlib import import_module
from inspect import isgenerator, signature
from multiprocessing import parent_process
from pathlib import Path
from traceback import format_exception_only
from types import ModuleType
from typing import Any

import numpy as np

import reference
from reference import paper
from reference.building import Building
from reference.learning.settings import Side
from reference.paper import InputError, Scenario
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.records import did_you_mean
from reference.workshop.storage.runs import digests_of_code
from reference.workshop.storage.workers import is_being_stopped
from reference.workshop.strategies.trained import Trained
from reference.workshop.strategies.untouched import untouched
from reference.world import Robot, World

CODE = "MODULE:NAME"
"""How the help names code."""

ASKED = {"robots": ("world", "robots", "rng"), "fire": ("world", "rng")}
ANSWERS = {
    "robots": "a list with (x, y) in metres, or None, for each of the robots at work",
    "fire": "(floor, x, y), 0 for the lowest floor, in metres, or None",
}
UNREADABLE = (TypeError, ValueError, OverflowError)
"""What is raised where an answer is read that is no decision."""


def is_code(word: str) -> bool:
    """Tell whether a word names code: `module:Name`, `package.module:Name`."""
    module, _, name = word.partition(":")
    return all(part.isidentifier() for part in (name, *module.split(".")))


def class_in(file: Path, side: Side) -> str:
    """Name the first class of a file that plays a side; NAME where none is found.

    One that is alone may have its `decide` from another file.
    """
    with suppress(OSError, SyntaxError, ValueError):
        nodes = ast.parse(file.read_text("utf-8")).body
        classes = [node for node in nodes if isinstance(node, ast.ClassDef)]
        playing = [node for node in classes if _plays(node, side)]
        if playing:
            return playing[0].name
        if len(classes) == 1 and classes[0].bases:
            return classes[0].name
    return "NAME"


def _plays(node: ast.ClassDef, side: Side) -> bool:
    """Has a class a `decide` that takes what this side is asked?"""
    methods = [part for part in node.body if isinstance(part, ast.FunctionDef)]
    asked = 1 + len(ASKED[side])
    return any(m.name == "decide" and len(m.args.args) == asked for m in methods)


def from_code(word: str, side: Side) -> Any:
    """Make anew the strategy that a word names: an object with `decide`, or its class.

    Raises InputError for a module or name that is not there, for what cannot decide,
    and for code that ends the program; so does a decision that is none. What the code
    itself raises is not caught.
    """
    name = word.partition(":")[2]
    module = _import_anew(word)
    named = getattr(module, name, None)
    if named is None:
        close = did_you_mean(name, vars(module))
        raise InputError(f"{word}: {_file_of(word)} has no '{name}'.{close}")
    needs = f"decide(self, {', '.join(ASKED[side])})"
    with _own_code(word, "it"):
        made = _made(named, f"{word}: who plays the {side} has {needs}")
    try:
        signature(made.decide).bind(*ASKED[side])
    except (AttributeError, TypeError):
        raise InputError(f"{word}: who plays the {side} has {needs}.") from None
    kind = CheckedPolicy if isinstance(made, Trained) else CheckedStrategy
    checked = kind(made, word, side)
    deepcopy(checked)  # refused now, not at the end of a run
    return checked


def _made(named: Any, needs: str) -> Any:
    """Make the object that is named by its class; an object is it already."""
    decides = hasattr(named, "decide") and not isinstance(named, type)
    if decides or not callable(named):
        return named
    try:
        signature(named).bind()
    except TypeError:
        raise InputError(
            f"{needs}: name an object, or a class that is made without arguments."
        ) from None
    return named()


@contextmanager
def _own_code(word: str, what: str) -> Iterator[None]:
    """Let code print to stderr. Raises InputError where it ends the program.

    what: is running, for the message
    """
    try:
        with redirect_stdout(sys.stderr):
            yield
    except (SystemExit, KeyboardInterrupt) as end:
        if isinstance(end, KeyboardInterrupt) and is_being_stopped():
            raise
        raise InputError(
            f"{word}: {what} ends the program by {type(end).__name__}({end!s:.60}). "
            "Take that out."
        ) from end


class CheckedStrategy:
    """A strategy of your own, whose answers are checked before anybody acts on them."""

    def __init__(self, strategy: Any, word: str, side: Side):
        self.strategy = strategy
        self.word = word
        self.side = side

    def __deepcopy__(self, memo: dict[int, Any]) -> "CheckedStrategy":
        """Copy what it remembers. Raises InputError if it cannot be copied."""
        try:
            strategy = deepcopy(self.strategy, memo)
        except Exception as error:  # of any kind
            raise InputError(
                f"{self.word}: cannot be copied ({error!s:.99}). Leave out of it what "
                "is no plain data, such as open files."
            ) from error
        return type(self)(strategy, self.word, self.side)

    def decide(self, world: World, *asked: Any) -> Any:
        """Decide as it does. Raises InputError for what is no decision of its side."""
        answer = self._answer(world, *asked)
        if self.side == "robots":
            return self._destinations(answer, asked[0])
        return self._fire(answer, world.building.floors)

    def _answer(self, world: World, *asked: Any) -> Any:
        """Ask the strategy. Raises InputError where it changes the world."""
        # lists are its own to change
        given = [list(one) if isinstance(one, list) else one for one in asked]
        with _own_code(self.word, "decide"), untouched(world, self.word):
            try:
                answer = self.strategy.decide(world, *given)
                if isgenerator(answer):  # its code runs here, or nowhere
                    answer = list(answer)
            except Exception as error:
                told = f"{self.word}: decide raised this after {world.time:g} s"
                if isinstance(error, OSError | MemoryError):
                    # a command would tell it as its own, without the line
                    raise RuntimeError(told) from error
                error.add_note(told)
                raise
        return answer

    def _destinations(
        self, answer: Any, robots: Sequence[Robot]
    ) -> list[tuple[float, float] | None]:
        """Read a place in metres, or None, for each of the robots."""
        try:
            points = list(answer)
            _refuse_words(*points)
            each = zip(robots, points, strict=True)
            return [None if point is None else metres(*point) for _, point in each]
        except UNREADABLE:
            wanted = f"it should be {ANSWERS['robots']}, {len(robots)} now"
            raise self._refusal(answer, wanted) from None

    def _fire(self, answer: Any, floors: int) -> tuple[int, float, float] | None:
        """Read a floor and a place on it in metres, or None."""
        if answer is None:
            return None
        try:
            floor, x, y = answer
            _refuse_words(answer, floor)
            number = int(floor)
            point = metres(x, y)
            if number != floor:
                raise ValueError
        except UNREADABLE:
            wanted = f"it should be {ANSWERS['fire']}"
            raise self._refusal(answer, wanted) from None
        last = floors - 1
        if not 0 <= number <= last:
            several = f"there are floors 0 to {last}, the lowest first"
            raise self._refusal(answer, several if last else "there is floor 0 only")
        return number, *point

    def _refusal(self, answer: Any, why: str) -> InputError:
        """Word the error for an answer that is no decision."""
        return InputError(f"{self.word}: decide returned {_in_a_line(answer)}; {why}.")


class CheckedPolicy(CheckedStrategy):
    """A policy of your own, which tells where it has learned."""

    def __getattr__(self, name: str) -> Any:
        """Tell what the policy tells."""
        return getattr(vars(self)["strategy"], name)

    def playing_in(self, building: Building, scenario: Scenario) -> "CheckedPolicy":
        """Play there, still checked. Raises InputError where the policy cannot."""
        self.strategy = self.strategy.playing_in(building, scenario)
        return self


def metres(x: Any, y: Any) -> tuple[float, float]:
    """Read two finite numbers. Raises ValueError or TypeError for others."""
    _refuse_words(x, y)
    read = float(x), float(y)
    if not np.isfinite(read).all():
        raise ValueError
    return read


def _in_a_line(answer: Any) -> str:
    """Show the beginning of an answer, without the lines of an array."""
    return " ".join(repr(answer).split())[:60]


def _refuse_words(*values: Any) -> None:
    """Raise TypeError for words: "12" is two digits, and no place."""
    if any(isinstance(value, str | bytes) for value in values):
        raise TypeError


# -- Modules ------------------------------------------------------------------------


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


def _import_anew(word: str) -> ModuleType:
    """Import a module, and those that it imports from its folder, as if never before.

    The first time, it may change the paper's numbers; whoever plays has them already.
    """
    name = word.partition(":")[0]
    before = paper_numbers()
    again = name in sys.modules or parent_process() is not None
    if name in sys.modules and name.split(".")[0] != reference.__name__:
        file = _file_of(word)
        root = file.parents[name.count(".")]
        ours = {str(root / path) for path in code_digests(word)}
        for other, module in [*sys.modules.items()]:
            if getattr(module, "__file__", None) in ours:
                del sys.modules[other]
    module = _import_module(word)
    if again:
        for number, value in before.items():
            setattr(paper, number, value)
    return module


def _import_module(word: str) -> ModuleType:
    """Import a module, first from the current folder."""
    name = word.partition(":")[0]
    if sys.path[0] not in ("", os.getcwd()):  # as for a script that is started here
        sys.path.insert(0, os.getcwd())
    try:
        with _own_code(word, "its module"):
            return import_module(name)
    except SyntaxError as error:
        if not Path(error.filename or "").is_file():  # of code that a string holds
            raise
        page = "".join(format_exception_only(error)).rstrip()
        raise InputError(f"{word}: its module is no Python.\n{page}") from None
    except ModuleNotFoundError as error:
        if not f"{name}.".startswith(f"{error.name}."):
            raise  # it is there, but imports what is not
        raise InputError(
            f"{word}: there is no module '{name}'. Write it here as mine:Guide for "
            "`class Guide` in mine.py."
        ) from None
