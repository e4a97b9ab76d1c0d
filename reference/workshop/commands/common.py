"""What the commands share: their errors, options and ways to say numbers."""

import os
import shlex
import signal
import sys
import tempfile
from argparse import ArgumentParser, ArgumentTypeError, Namespace
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from typing import Any, NamedTuple

from reference.workshop.evaluation.contestants import NAMES, Side, refuse_nobody
from reference.workshop.evaluation.crossplay import Evaluation, unlike_training
from reference.workshop.runs import ContradictionError

MAP = "a map, by path or by the name of one that ships"


class CommandError(Exception):
    """One message for people; the command ends with this exit status."""

    def __init__(self, message: str, status: int = 1) -> None:
        super().__init__(message)
        self.status = status


class Command(NamedTuple):
    """A command: what it does, its options, one example, whether it tells numbers."""

    run: Callable[[Namespace], None]
    options: Callable[[ArgumentParser], None]
    example: str
    numbers: bool = True


# -- Options ----------------------------------------------------------------------


def player_option(
    parser: ArgumentParser,
    side: Side,
    note: str,
    default: str | None = None,
    several: bool = False,
    words: Sequence[str] = (),
) -> None:
    """--robots or --fire: somebody, or several of them, by name or in a file.

    words: those that this command knows, if not all.
    """
    known = words or NAMES[side]
    what = f"{', '.join(known)}; {note}"
    parser.add_argument(
        f"--{side}",
        type=_somebody(side, known),
        default=default,
        nargs="+" if several else None,
        metavar="S",
        help=what,
    )


def _somebody(side: Side, words: Sequence[str]) -> Callable[[str], str]:
    """A word that names somebody; what is in a file is looked at later."""

    def known(text: str) -> str:
        try:
            refuse_nobody(text, side, words)
        except ValueError as error:
            raise ArgumentTypeError(str(error)) from None
        return text

    return known


def whole_from(least: int) -> Callable[[str], int]:
    """A whole number that is not below the least."""

    def number(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise ArgumentTypeError(f"'{text}' is not a whole number from {least} on")
        return int(text)

    return number


def writable(path: Path, formats: Iterable[str], what: str) -> None:
    """Refuse a file that cannot be written, before there is anything to write."""
    from reference.workshop.drawing.page import with_suffix

    try:
        with_suffix(path, formats, what)
    except ValueError as error:
        raise CommandError(str(error), 2) from error
    if path.is_dir():
        raise CommandError(f"{path}: is a folder. Name a file in it.")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise CommandError(
            f"{path}: cannot be written ({error.strerror}). "
            "Name a file in a folder that exists and is yours."
        ) from error


# -- What is told ------------------------------------------------------------------


@contextmanager
def for_people() -> Iterator[None]:
    """Turn what is wrong with the input into one message instead of a traceback."""
    try:
        yield
    except ContradictionError as error:
        raise CommandError(str(error), 2) from error
    except ValueError as error:
        raise CommandError(str(error)) from error


def noted(evaluation: Evaluation) -> None:
    """What one should know of those who take part; on stderr, where numbers are not."""
    for line in unlike_training(evaluation):
        print(f"note: {line}", file=sys.stderr)


def counted(number: int, plural: str) -> str:
    """1 door, 2 doors."""
    return f"{number} {plural[:-1] if number == 1 else plural}"


def figures(values: list[float | None]) -> str:
    """Figures of one row, all with the same number of decimals."""
    known = [value for value in values if value is not None]
    whole = all(value == int(value) for value in known)
    largest = max(map(abs, known), default=0)
    decimals = 0 if whole or largest >= 1000 else 1 if largest >= 10 else 2
    cells = ("-" if value is None else f"{value:,.{decimals}f}" for value in values)
    return "".join(f"{cell:>10}" for cell in cells)


def quoted(path: str | Path) -> str:
    """As a shell wants to read it."""
    return shlex.quote(str(path))


def cores() -> int:
    """Cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Has Ctrl-C been pressed? Pressed once more, it stops at once."""
    pressed, before = Event(), signal.getsignal(signal.SIGINT)

    def note(number: int, frame: Any) -> None:
        pressed.set()
        signal.signal(signal.SIGINT, before)
        print("\nstopping; Ctrl-C once more drops what is unsaved", file=sys.stderr)

    signal.signal(signal.SIGINT, note)
    try:
        yield pressed.is_set
    finally:
        signal.signal(signal.SIGINT, before)
