"""Play code of your own, named `module:Name` and imported from the current folder.

class Guide:  # in mine.py: `evaluate --robots sweep mine:Guide`
    def decide(self, world, robots, rng):
        return [robot.position for robot in robots]

class Fire:  # floors count from 0 here: what a map calls floor 1 is 0
    def decide(self, world, rng):
        return 0, 1.5, -2.5  # metres east and north of the building's middle

A source that is decided in a wall, outside, where it burns or somebody stands, or too
near a way out, is lit in another free cell, on any floor [D6]; which cells are free
tells `reference.fire.free_places`.  A destination that is no floor means the nearest
place that is.

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
* A fire is asked until its sources are lit: where h is measured, as by `evaluate`, also
  when nobody is inside any more.
"""

import ast
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, redirect_stdout, suppress
from copy import deepcopy
from importlib import import_module
from inspect import signature
from itertools import islice
from math import nan
from multiprocessing import parent_process
from pathlib import Path
from traceback import format_exception_only
from types import ModuleType
from typing import Any

from numpy.random import Generator as Rng

import reference
from reference import paper
from reference.building import Building
from reference.fire import Decision, lightable, snapped
from reference.learning.settings import Side
from reference.paper import InputError, Scenario, check_player
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.runs import (
    INSTALLED,
    digests_of_code,
    folder_of_code,
)
from reference.workshop.storage.words import did_you_mean
from reference.workshop.storage.workers import is_being_stopped
from reference.workshop.strategies.trained import Trained
from reference.workshop.strategies.untouched import untouched
from reference.world import Robot, World

CODE = "MODULE:NAME"
_NOTED = set[str]()  # words whose fires were decided where none may start
"""How the help names code."""

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
    asked = 1 + len(paper.DECIDES[side])
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
    with _own_code(word, "it"):
        made = _made(named, word)
        check_player(made, side, f"{word}: ")
    kind = CheckedPolicy if isinstance(made, Trained) else CheckedStrategy
    checked = kind(made, word, side)
    deepcopy(checked)  # refused now, not at the end of a run
    return checked


def _made(named: Any, word: str) -> Any:
    """Make the object that is named by its class; an object is it already."""
    decides = hasattr(named, "decide") and not isinstance(named, type)
    if decides or not callable(named):
        return named
    try:
        signature(named).bind()
    except TypeError:
        raise InputError(
            f"{word}: name an object with `decide`, or a class that is made without "
            "arguments."
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
    except BaseException as end:
        stopped = isinstance(end, KeyboardInterrupt) and is_being_stopped()
        if isinstance(end, Exception) or stopped:
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
            with _own_code(self.word, "copying it"):
                strategy = deepcopy(self.strategy, memo)
            if not hasattr(strategy, "decide"):
                raise TypeError(f"its copy is {strategy!r:.60}")
        except InputError:
            raise
        except Exception as error:  # of any kind
            raise InputError(
                f"{self.word}: cannot be copied ({error!s:.99}). Leave out of it what "
                "is no plain data, such as open files."
            ) from error
        return type(self)(strategy, self.word, self.side)

    def decide(self, world: World, *asked: Any) -> Any:
        """Decide as it does. Raises InputError for what is no decision of its side."""
        with _own_code(self.word, "decide"):
            if self.side == "robots":
                return self._destinations(world, *asked)
            return self._fire(world, *asked)

    def _destinations(
        self, world: World, robots: Sequence[Robot], rng: Rng
    ) -> list[tuple[float, float] | None]:
        """Ask for a place in metres, or None, for each of the robots."""
        count = len(robots)
        answer, points = self._answer(world, [*robots], rng, lengths=(count, 2))
        try:
            if len(points) != count:
                raise ValueError
            return [None if point is None else metres(*point) for point in points]
        except UNREADABLE:
            wanted = (
                "a list with (x, y) in metres, or None, for each of the robots at "
                f"work, {count} now"
            )
            raise self._refusal(answer, points, wanted) from None

    def _fire(self, world: World, rng: Rng) -> tuple[int, float, float] | None:
        """Ask for a floor and a place on it in metres, or None."""
        answer, place = self._answer(world, rng, lengths=(3,))
        floors = range(world.building.floors)
        if place is None:
            return None
        try:
            floor, x, y = place
            if floor not in floors:
                raise ValueError
            decided = int(floor), *metres(x, y)
            self._note_if_none_starts_there(world.building, decided)
            return decided
        except UNREADABLE:
            wanted = (
                f"(floor, x, y), floor 0 to {floors[-1]}, the lowest first, and "
                "metres, or None"
            )
            raise self._refusal(answer, place, wanted) from None

    def _note_if_none_starts_there(self, building: Building, decided: Decision) -> None:
        """Say once on stderr that a wall, or what is outside, never burns [D6]."""
        floor, x, y = decided
        cell = (floor, *building.cell(snapped(x), snapped(y)))
        may_start = lightable(building)
        inside = all(0 <= k < n for k, n in zip(cell, may_start.shape, strict=True))
        if self.word in _NOTED or (inside and may_start[cell]):
            return
        _NOTED.add(self.word)
        print(
            f"note: {self.word} decided floor {floor}, ({x:g}, {y:g}), where no fire "
            "may start: a wall, outside or too near a way out. Another free cell is "
            "lit instead, on any floor [D6].",
            file=sys.stderr,
        )

    def _answer(
        self, world: World, *given: Any, lengths: tuple[int, ...]
    ) -> tuple[Any, Any]:
        """Ask the strategy: return its answer, and how `_plain` reads it.

        All its code runs here. Raises InputError where that changes the world.
        """
        with untouched(world, self.word):
            try:
                answer = self.strategy.decide(world, *given)
                return answer, _plain(answer, *lengths)
            except Exception as error:
                told = f"{self.word}: decide raised this after {world.time:g} s"
                if isinstance(error, OSError | MemoryError):
                    # a command would tell it as its own, without the line
                    raise RuntimeError(told) from error
                error.add_note(told)
                raise

    def _refusal(self, answer: Any, read: Any, wanted: str) -> InputError:
        """Word the error for an answer that is no decision, and was read like this."""
        lazy = isinstance(answer, Iterator)
        words = repr(read if lazy else answer).split()
        shown = " ".join(words)[:60]  # without the lines of an array
        told = f"{self.word}: decide returned {shown}; it should be {wanted}."
        return InputError(told)


class CheckedPolicy(CheckedStrategy):
    """A policy of your own, which tells where it has learned."""

    def __getattr__(self, name: str) -> Any:
        """Tell what the policy tells; while a copy is made, there is none yet."""
        if "strategy" not in vars(self):
            raise AttributeError(name)
        return getattr(self.strategy, name)

    def playing_in(self, building: Building, scenario: Scenario) -> "CheckedPolicy":
        """Play there, still checked. Raises InputError where the policy cannot."""
        with _own_code(self.word, "playing_in"):
            self.strategy = self.strategy.playing_in(building, scenario)
        return self


def _plain(answer: Any, *lengths: int) -> Any:
    """Read an answer now, also a lazy one: None, or lists of None and floats.

    lengths: of a list and those in it; of each, one item too many at most is read.
    Raises what the answer's own code raises. What cannot be read so is nan.
    """
    if hasattr(answer, "tolist"):  # an array; masked values are None
        answer = answer.tolist()
    if answer is None:
        return None
    if isinstance(answer, str | bytes):  # "12" is two digits, and no place
        return nan
    try:
        read: Any = iter(answer) if lengths else float(answer)
    except UNREADABLE as error:
        if error.__traceback__.tb_next:  # type: ignore[union-attr] # in its own code
            raise
        return nan
    if not lengths:
        return read
    most, *others = lengths
    return [_plain(one, *others) for one in islice(read, most + 1)]


def metres(x: float, y: float) -> tuple[float, float]:
    """Take two numbers of metres. Raises ValueError or TypeError for others."""
    if not (abs(x) < paper.LONGEST and abs(y) < paper.LONGEST):
        raise ValueError
    return x, y


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


IMPORTED: set[str] = set()
"""Modules that were first imported because a word names them."""


def _import_anew(word: str) -> ModuleType:
    """Import a module, and those that it imports from its folder, as if never before.

    The first time, it may change the paper's numbers; whoever plays has them already.
    Raises InputError for a module that this program needs as it is.
    """
    name = word.partition(":")[0]
    if name in sys.modules and name not in IMPORTED and _is_of_others(name):
        raise InputError(
            f"{word}: '{name}' is no code of yours, but Python's own, or installed. "
            "Call your file otherwise, as mine.py, and name it mine:Guide."
        )
    before = paper_numbers()
    again = name in sys.modules or parent_process() is not None
    if name in sys.modules and name.split(".")[0] != reference.__name__:
        root = folder_of_code(name, _file_of(word))
        ours = {str(root / path) for path in code_digests(word)}
        for other, module in [*sys.modules.items()]:
            if getattr(module, "__file__", None) in ours:
                del sys.modules[other]
    module = _import_module(word)
    if again:
        for number, value in before.items():
            setattr(paper, number, value)
    return module


def _is_of_others(name: str) -> bool:
    """Tell whether a module that is imported is Python's own, or installed."""
    file = getattr(sys.modules[name], "__file__", None)
    if file is None:  # a folder of one's own, or built in
        return name in sys.builtin_module_names
    standard = Path(os.__file__).parent
    path = Path(file)
    return path.is_relative_to(standard) or bool({*INSTALLED} & {*path.parts})


def _import_module(word: str) -> ModuleType:
    """Import a module, first from the current folder."""
    name = word.partition(":")[0]
    if name not in sys.modules:
        IMPORTED.add(name)
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
        how = "Write it here as mine:Guide for `class Guide` in mine.py."
        if name.endswith(".py"):
            how = f"Leave .py out: write {name.removesuffix('.py')}{word[len(name) :]}."
        raise InputError(f"{word}: there is no module '{name}'. {how}") from None
