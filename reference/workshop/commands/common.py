"""What the commands share: checks, numbers in words, workers and Ctrl-C."""

import shlex
import signal
import sys
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from pathlib import Path
from threading import Event
from time import monotonic
from typing import Any, NamedTuple

from reference.paper import InputError
from reference.workshop.commands.options import Table
from reference.workshop.runs import ContradictionError, RunError
from reference.workshop.workers import STOPS, InProcess, workers

TWICE = 1.0  # s from one signal to the next, if they are two


class Command(NamedTuple):
    """A command: what it does, its options, one example.

    numbers  whether it has --json;  chance  whether it has --seed
    """

    run: Callable[[Namespace], None]
    options: Table
    example: str
    numbers: bool = True
    chance: bool = True


def writable(path: Path, what: str = "a picture", formats: Iterable[str] = ()) -> None:
    """Refuse a file that cannot be written, before there is anything to write.

    formats: suffixes, by default those of pictures. Raises ContradictionError for
    another suffix, else RunError.
    """
    from reference.workshop.drawing.page import PICTURES, with_suffix

    try:
        with_suffix(path, formats or PICTURES, what)
    except InputError as error:
        raise ContradictionError(str(error)) from error
    if path.is_dir():
        raise RunError(f"{path}: is a folder. Name a file in it.")
    try:
        tempfile.TemporaryFile(dir=path.parent).close()
    except OSError as error:
        raise RunError(
            f"{path}: cannot be written ({error.strerror}). "
            "Name a file in a folder that exists and is yours."
        ) from error


# -- What is told ------------------------------------------------------------------


def counted(number: int, plural: str) -> str:
    """A number with its noun: 1 door, 2 doors."""
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
    """Quote a path for a shell, and so that it does not look like an option."""
    text = str(path)
    return shlex.quote(f"./{text}" if text.startswith("-") else text)


def again(command: str, **options: str | Path | None) -> str:
    """The command line that resumes a command, with those options that are given."""
    words = [f"--{k} {quoted(word)}" for k, word in options.items() if word is not None]
    return " ".join(["python -m reference", command, "--resume", *words])


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Note Ctrl-C and other signals to stop, and go on; a second one stops at once.

    Those that this process ignores, as `nohup` has it, stay ignored. One that comes
    within TWICE of the first belongs to it: `timeout`, for one, tells the process and
    its group.
    """
    pressed, first, stderr = Event(), 0.0, sys.stderr  # a job may redirect it
    handlers = {stop: signal.getsignal(stop) for stop in STOPS}
    before = {s: known for s, known in handlers.items() if known != signal.SIG_IGN}

    def note(number: int, frame: Any) -> None:
        """Handle a signal."""
        nonlocal first
        if pressed.is_set():
            if monotonic() - first > TWICE:
                restore()
                signal.raise_signal(number)
            return
        pressed.set()
        first = monotonic()
        print("\nstopping; Ctrl-C once more drops what is unsaved", file=stderr)
        if InProcess.busy:
            raise KeyboardInterrupt

    def restore() -> None:
        for stop, handler in before.items():
            signal.signal(stop, handler)

    for stop in before:
        signal.signal(stop, note)
    try:
        yield pressed.is_set
    finally:
        restore()


@contextmanager
def workforce(
    count: int, about: str, again: str = "Take fewer:"
) -> Iterator[tuple[Executor, Callable[[], bool]]]:
    """Yield workers for a command, and a check for Ctrl-C.

    about: what they do, for stderr; again: how to go on when one has died.
    """
    print(f"{about}; {counted(count, 'workers')}", file=sys.stderr)
    with ctrl_c() as stop, workers(count) as executor:
        try:
            yield executor, stop
        except BrokenExecutor as error:
            raise RunError(
                "a worker has died, perhaps for want of memory. "
                f"{again} --workers {max(1, count // 2)}"
            ) from error
