"""Declare commands: what argparse is told, and options that several of them have."""

import os
from argparse import (
    Action,
    ArgumentError,
    ArgumentParser,
    ArgumentTypeError,
    Namespace,
)
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

from reference import paper
from reference.paper import InputError
from reference.workshop.comparing.named import (
    DESCRIPTIONS,
    PLAYER_NAMES,
    Side,
    refuse_unknown,
)
from reference.workshop.storage.files import refuse_unwritable
from reference.workshop.storage.runs import ContradictionError
from reference.workshop.storage.scenarios import read_stated
from reference.workshop.strategies.own import CODE

Option = tuple[list[str], dict[str, Any]]
"""Its names, and what argparse is told of it besides."""


class Command(NamedTuple):
    """What a command does, which its docstring says too; how its help ends; options."""

    run: Callable[[Namespace], None]
    end: str
    options: tuple[Option, ...]


def command(
    example: str, *options: Option, end: str = ""
) -> Callable[[Callable[[Namespace], None]], Command]:
    """Return a decorator that makes a Command.

    end: text below the example in its help
    """
    told = f"example:\n  python -m reference {example}\n{end}"
    return lambda run: Command(run, told, options)


def option(names: str, note: str, **told: Any) -> Option:
    """Declare an option, such as "-o --output".

    told: further arguments of argparse's `add_argument`
    """
    return names.split(), {"help": note, **told}


def flag(name: str, note: str, **told: Any) -> Option:
    """Declare an option without a value."""
    return option(name, note, action="store_true", **told)


def folder(name: str, note: str, **told: Any) -> Option:
    """Declare an option that names a folder."""
    return option(name, note, type=Path, metavar="DIR", **told)


MANY = 10**6  # a bound that nobody need be told
LARGEST_SEED = 2**53  # the largest whole number that every reader of JSON keeps exact


def number(name: str, least: int, note: str, most: int = MANY, **told: Any) -> Option:
    """Declare an option that takes a whole number in these bounds."""
    if most < MANY:
        note = f"{least:,} to {most:,}; {note}"
    return option(name, note, type=whole(least, most), metavar="N", **told)


def whole(least: int, most: int = LARGEST_SEED) -> Callable[[str], int]:
    """Make what reads a whole number in these bounds from a command line."""

    def read(text: str) -> int:
        """Refuse what is no whole number, or out of bounds."""
        with suppress(ValueError):  # a word is refused below, in the same words
            if least <= int(text) <= most:
                return int(text)
        wanted = f"a whole number from {least:,} to {most:,}"
        raise ArgumentTypeError(f"'{text}': it must be {wanted}")

    return read


def output(names: str, ends: str, note: str, default: Path | None = None) -> Option:
    """Declare an option that names a file to write; ends: such as ".png, .pdf"."""

    def writable(text: str) -> Path:
        """Refuse what cannot be written; commands ask of their default."""
        path = Path(text)
        if path.suffix.lower() not in ends.split(", "):
            raise ArgumentTypeError(f"'{text}' does not end in one of {ends}")
        refuse_unwritable(path)
        return path

    note += f" ({ends}); default: {default}" if default else f" ({ends})"
    return option(names, note, type=writable, metavar="FILE", default=default)


def player(
    side: Side, note: str, known: Sequence[str] | None = None, **told: Any
) -> Option:
    """Declare --robots or --fire; known: names that the command takes, if not all."""
    words = known or PLAYER_NAMES[side]

    def somebody(text: str) -> str:
        """Refuse who is not known."""
        try:
            refuse_unknown(text, side, words)
        except InputError as error:
            raise ArgumentTypeError(str(error)) from None
        return text

    files = "FILE: a checkpoint, a training's folder"
    if CODE in words:
        files += f"; {CODE}: your code, from the current folder"
    note = f"{', '.join(words)} ({files}); {note}"
    return option(f"--{side}", note, type=somebody, metavar="S", **told)


class _Stated(Action):
    """Collects KEY=VALUE words, of one option or several, as fields of a scenario."""

    def __call__(
        self,
        parser: ArgumentParser,
        namespace: Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Refuse what no scenario can have."""
        already = getattr(namespace, self.dest) or {}
        try:
            setattr(namespace, self.dest, read_stated(values, already))
        except InputError as error:
            raise ArgumentError(self, str(error)) from None


def scenario(default: str) -> Option:
    """Declare --scenario; default: what it changes."""
    return option(
        "--scenario",
        f"such as sight_range=8 people=60, KEYs: end of --help; changes {default}",
        action=_Stated,
        nargs="+",
        metavar="KEY=VALUE",
    )


def list_players() -> str:
    """List everybody who can play, with what they do."""
    rows = list[str]()
    for side, words in DESCRIPTIONS.items():
        rows += ["", f"{side}:"]
        rows += [f"  {word:<12}{does}" for word, does in words.items()]
    return "\n".join(rows)


def evaluation_options(arguments: Namespace) -> dict[str, Any]:
    """Collect what was asked for of an evaluation's place and runs, by name."""
    names = ("building", "people", "seed", "episodes", "sample", "errors", "scenario")
    asked = {name: getattr(arguments, name) for name in names}
    _refuse_two_counts(arguments.people, arguments.scenario or {})
    # What was not typed is left to the checkpoint that plays, or to `begin`.
    return {name: value for name, value in asked.items() if value is not None}


def _refuse_two_counts(people: int | None, stated: Mapping[str, Any]) -> None:
    """Raise ContradictionError where --people and --scenario say different numbers."""
    counted = "people_per_floor" in stated or stated.get("people", people) != people
    if people is not None and counted:
        raise ContradictionError(
            "--people, --scenario: they count people differently. Leave one out."
        )


PICTURES = ".png, .svg, .pdf"
FILMS = ".gif, .html, .mp4"
MAP_FILE = option("file", "a map, by path or by the name of one that ships")


def _cores() -> int:
    """Count the processor's cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not on macOS and Windows
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


CORES = _cores()


def building(default: str) -> Option:
    """Declare the option that takes a map; default: which it is otherwise."""
    return option("--building", f"where; default: {default}", metavar="MAP")


BUILDING_HELP = (
    "where, and under what scenario; default: those in which the checkpoints learned, "
    "which must agree, else paper and its scenario"
)
BUILDING = option("--building", BUILDING_HELP, metavar="MAP")
SEVERAL_HELP = f"{BUILDING_HELP}; several are compared with the first"
BUILDINGS = option("--building", SEVERAL_HELP, nargs="+", metavar="MAP")
SCENARIO = scenario("the checkpoints', else the paper's")
LEAST_PEOPLE, MOST_PEOPLE = map(int, paper.limits()["people"][:2])
PEOPLE_OPTION = number(
    "--people",
    LEAST_PEOPLE,
    f"default: the checkpoints', else {paper.PEOPLE}",
    most=MOST_PEOPLE,
)
SAMPLE = flag(
    "--sample", "draw a learned policy's actions, not the likeliest", default=None
)
ERRORS_HELP = (
    "robots misjudge positions by up to N metres: before each decision a few random "
    "errors are tried out, and the most harmful is used; default: 0"
)
ERRORS = number("--errors", 0, ERRORS_HELP, most=40)
WORKERS_HELP = (
    "how many processes, which changes no result; 0: this one; default: all cores"
)
WORKERS = number("--workers", 0, WORKERS_HELP, most=1000, default=CORES)


def seed(default: str = "0") -> Option:
    """Declare the option of the seed; default: what is told of it."""
    note = f"all chance follows from N; default: {default}"
    return number("--seed", 0, note, most=LARGEST_SEED)


SEED = seed()


def json(*names: str) -> Option:
    """Declare --json; names: of what its object has, in words where they differ."""
    return flag("--json", f"print one JSON object: {', '.join(names)}")
