"""What the commands share: printing figures, workers and Ctrl-C."""

import json
import shlex
import signal
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager
from pathlib import Path
from time import monotonic
from typing import Any

from reference.workshop.runs import RunError, held
from reference.workshop.workers import STOPS, InProcess, cluster, workers

TWICE = 1.0  # s from one signal to the next, if they are two


def tell(arguments: Namespace, facts: dict[str, Any], text: str) -> None:
    """Print facts as JSON where that is asked for, else as text."""
    print(json.dumps(facts) if arguments.json else text)


def note(words: str) -> None:
    """Print what is no result."""
    print(words, file=sys.stderr)


def figure(value: float | str | None) -> str:
    """Write a figure with two decimals if it has any, a word as it is, "-" for None."""
    if isinstance(value, str):
        return value
    return "-" if value is None else f"{value:,.2f}".removesuffix(".00")


def table(values: Sequence[Sequence[float | str | None]], align: str) -> str:
    """Lay out rows in columns as wide as their words; align: < or > for each column."""
    rows = [[figure(value) for value in row] for row in values]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    form = "  ".join(f"{{:{a}{width}}}" for a, width in zip(align, widths, strict=True))
    return "\n".join(form.format(*row).rstrip() for row in rows)


def again(*words: object) -> str:
    """Write a command line that can be typed into a shell."""
    return shlex.join(["python", "-m", "reference", *map(str, words)])


@contextmanager
def resumable(
    arguments: Namespace, folder: Path | None, start: Callable[[], Any], *words: object
) -> Iterator[tuple[Any, Executor, Callable[[], bool]]]:
    """Start or resume a run in its folder; yield it, workers and a check for Ctrl-C.

    When it is stopped, or a worker has died, it says how to go on.

    words: of the command line that resumes it, without --resume and --out
    """
    on, address = "Nothing is kept without --out.", getattr(arguments, "cluster", None)
    words += ("--cluster", address) if address else ()
    if folder:
        on = f"Go on with:\n  {again(*words, '--resume', '--out', folder)}"
    if address:
        on = f"Workers finish what they are at, and keep it. {on}"
    with held(folder, arguments.resume, start) as run:
        hands = cluster(address) if address else workers(arguments.workers)
        try:
            with ctrl_c() as stop, hands as executor:
                yield run, executor, stop
        except BrokenExecutor as error:
            what = "a worker has died, perhaps for want of memory: take fewer"
            raise RunError(f"{what}. {on}") from error
        if stop():
            raise KeyboardInterrupt(f"stopped. {on}")


@contextmanager
def ctrl_c() -> Iterator[Callable[[], bool]]:
    """Note Ctrl-C and other signals to stop, and go on; a second one stops at once.

    Those that this process ignores, as `nohup` has it, stay ignored. One that comes
    within TWICE of the first belongs to it: `timeout`, for one, tells the process and
    its group.
    """
    pressed, stderr = list[float](), sys.stderr  # a job may redirect it

    def heard(number: int, frame: Any) -> None:
        """Handle a signal."""
        if not pressed:
            pressed.append(monotonic())
            print("\nstopping; Ctrl-C once more drops what is unsaved", file=stderr)
            if InProcess.busy:
                raise KeyboardInterrupt
        elif monotonic() - pressed[0] > TWICE:
            restore()
            signal.raise_signal(number)

    def restore() -> None:
        for stop, handler in before.items():
            signal.signal(stop, handler)

    heeded = [stop for stop in STOPS if signal.getsignal(stop) != signal.SIG_IGN]
    before = {stop: signal.signal(stop, heard) for stop in heeded}
    try:
        yield lambda: bool(pressed)
    finally:
        restore()
