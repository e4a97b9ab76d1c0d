"""Options that commands share, and short ways to declare them to argparse."""

import os
from argparse import SUPPRESS, ArgumentParser, ArgumentTypeError
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from reference.paper import PEOPLE, InputError
from reference.workshop.crossplay.contestants import NAMES, Side, refuse_unknown

Table = dict[str, dict[str, Any]]
"""Names of options, such as "-o/--output", and what argparse is told of each."""

MAP = "a map, by path or by the name of one that ships"
SEVERAL = {"nargs": "+"}
MANY = 1_000_000  # of anything


def add(parser: ArgumentParser, options: Table) -> None:
    """Add options to a parser."""
    for names, told in options.items():
        parser.add_argument(*names.split("/"), **told)


def cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def player(side: Side, note: str, words: Sequence[str] = (), **more: Any) -> Table:
    """Declare --robots or --fire: a strategy by name or in a file.

    words: those that this command knows, if not all.
    """
    known = words or NAMES[side]

    def somebody(text: str) -> str:
        """Refuse a name that nobody has."""
        try:
            refuse_unknown(text, side, known)
        except InputError as error:
            raise ArgumentTypeError(str(error)) from None
        return text

    what = f"{', '.join(known)}; {note}"
    if "FILE" in known:
        what += "; FILE: a checkpoint or a training's folder"
    return {f"--{side}": {"type": somebody, "metavar": "S", "help": what, **more}}


def number(least: int, note: str, most: int = MANY, **more: Any) -> dict[str, Any]:
    """An option that takes a whole number in these bounds."""

    def whole(text: str) -> int:
        """Read a number; refuse one out of bounds."""
        number = int(text) if text.isdecimal() and len(text) < 20 else -1
        if not least <= number <= most:
            what = f"a whole number from {least} to {most}"
            raise ArgumentTypeError(f"'{text}' is not {what}")
        return number

    return {"type": whole, "metavar": "N", "help": note, **more}


def path(metavar: str, note: str, **more: Any) -> dict[str, Any]:
    """An option that takes a path."""
    return {"type": Path, "metavar": metavar, "help": note, **more}


def choice(words: Iterable[str], note: str, **more: Any) -> dict[str, Any]:
    """An option that takes one of some words."""
    return {"choices": tuple(words), "help": note, **more}


def flag(note: str, **more: Any) -> dict[str, Any]:
    """An option without a value."""
    return {"action": "store_true", "help": note, **more}


def picture(default: str) -> Table:
    """-o: where the picture goes."""
    return {"-o/--output": path("FILE", f".png, .svg or .pdf; default: {default}")}


BUILDING: Table = {"--building": {"help": f"{MAP}; default: paper", "default": "paper"}}
PLACE: Table = {
    "--building": {"help": f"{MAP}; default: the checkpoint's, else paper"},
    "--people": number(1, f"default: the checkpoint's, else {PEOPLE}"),
}
SAMPLE: Table = {
    "--sample": flag(
        "draw a learned policy's actions instead of taking the likeliest", default=None
    )
}
WORKERS: Table = {
    "--workers": number(
        0,
        "processes that play, results are the same; 0: none but this one; "
        "default: the number of cores",
        most=1000,
        default=cores(),
    )
}
SEED: Table = {
    "--seed": number(
        0,
        "same seed, same run; default: 0",
        most=2**53,  # JSON carries those exactly
        default=SUPPRESS,
    )
}
JSON: Table = {"--json": flag("print one JSON object", default=SUPPRESS)}
