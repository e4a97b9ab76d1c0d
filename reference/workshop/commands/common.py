"""What the commands share: printing figures, workers, how to go on."""

import json
import os
import shlex
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor
from contextlib import ExitStack, contextmanager, suppress
from errno import ENOSPC
from pathlib import Path
from typing import Any

from reference.paper import InputError
from reference.workshop.commands.options import CORES
from reference.workshop.comparing.results import align_columns
from reference.workshop.comparing.runs import DECIMALS_WRITTEN
from reference.workshop.storage.files import message_of
from reference.workshop.storage.runs import LOCK_FILE, ContradictionError, locked
from reference.workshop.storage.workers import cluster, workers

NO_BUGS = (InputError, OSError, UnicodeError, MemoryError, BrokenExecutor)
STOPPED = "stopped; nothing half-written is left"


def exit_status(run: Callable[[], object]) -> int:
    """Run something to its end; return the exit status.

    0 done, 1 wrong input, told in a line, 2 a wrong command line, 130 when stopped.
    """
    try:
        try:
            run()
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt as stopped:  # its text, if any, says what is kept
        return complain(str(stopped) or STOPPED, 130)
    except NO_BUGS as error:
        _drop_unprinted()
        if isinstance(error, BrokenPipeError):  # `| head -1` has closed the pipe
            return 1
        if isinstance(error, OSError) and error.errno == ENOSPC and not error.filename:
            error.filename = "stdout"  # every other file is named
        status = 2 if isinstance(error, ContradictionError) else 1
        return complain(message_of(error) or "there is not enough memory", status)
    return 0


def complain(message: str, status: int) -> int:
    """Print a message to stderr; return the status."""
    with suppress(OSError):  # stderr is closed
        print(message, file=sys.stderr)
    return status


def _drop_unprinted() -> None:
    """Drop output that cannot be printed: Python would retry it loudly at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def print_report(arguments: Namespace, report: dict[Any, Any], text: str) -> None:
    """Print a report as JSON where that is asked for, else as text."""
    print(json.dumps(_rounded(report)) if arguments.json else text)


def _rounded(value: Any) -> Any:
    """A report with its numbers as long as those in tables of runs."""
    if isinstance(value, dict):
        return {name: _rounded(each) for name, each in value.items()}
    if isinstance(value, list | tuple):
        return [_rounded(each) for each in value]
    return round(value, DECIMALS_WRITTEN) if isinstance(value, float) else value


def print_note(words: str) -> None:
    """Print a note to stderr."""
    print(words, file=sys.stderr)


def one_terminal() -> bool:
    """Whether notes and figures are seen together: nothing need be told on both."""
    return sys.stdout.isatty() and sys.stderr.isatty()


def format_figure(value: float | str | None) -> str:
    """Write a figure with two decimals if it has any, a word as it is, "-" for None."""
    if isinstance(value, str):
        return value
    return "-" if value is None else f"{value:z,.2f}".removesuffix(".00")


def format_table(values: Sequence[Sequence[float | str | None]], align: str) -> str:
    """Write figures and words in rows, aligned.

    In a row all figures have two decimals if one has any.
    """
    return align_columns([_format_row(row) for row in values], align)


def _format_row(values: Sequence[float | str | None]) -> list[str]:
    """Write the figures of a row alike."""
    words = [format_figure(value) for value in values]
    figures = [not isinstance(value, str | None) for value in values]
    pairs = list(zip(words, figures, strict=True))
    if not any(figure and "." in word for word, figure in pairs):
        return words
    return [
        f"{word}.00" if figure and "." not in word else word for word, figure in pairs
    ]


def shell_line(*words: object) -> str:
    """Write a command line that can be typed into a shell."""
    return shlex.join(["python", "-m", "reference", *map(str, words)])


def _has_begun(folder: Path) -> bool:
    """Is there anything in a run's folder to go on with?"""
    return folder.is_dir() and any(p.name != LOCK_FILE for p in folder.iterdir())


@contextmanager
def run_in_folder(
    arguments: Namespace,
    folder: Path | None,
    start: Callable[[], Any],
    *words: object,
    meanwhile: Callable[[Executor], None] | None = None,
) -> Iterator[tuple[Any, Executor]]:
    """Start or resume a run in its folder; yield it and workers.

    When it is stopped, a worker has died or the disk is full, it says how to go on.

    words: of the command line that resumes it, without --resume and --out
    meanwhile: what a pool's workers do while the run starts
    """
    address: str = getattr(arguments, "cluster", None) or ""  # of experiments only
    pool = None if address else workers(arguments.workers)
    same: Sequence[object] = ()
    if address:
        same = ("--cluster", address)
    elif arguments.workers != CORES:
        same = ("--workers", arguments.workers)

    def advice(by: Sequence[object] = same) -> str:
        """Say how to go on, and by whom."""
        if not folder:
            return "Nothing is kept without --out."
        finish = "Workers finish what they are at, and keep it. " if address else ""
        line = shell_line(*words, *by, "--resume", "--out", folder)
        return f"{finish}Go on with:\n  {line}"

    try:
        with ExitStack() as stack:
            if pool and meanwhile:
                stack.enter_context(pool)  # also if the run does not start
                meanwhile(pool)
            run = stack.enter_context(locked(folder, arguments.resume, start))
            # last, so that it ends before the folder is unlocked
            executor = stack.enter_context(pool or cluster(address))
            yield run, executor
    except BrokenExecutor as error:
        raise InputError(
            "a worker has died, perhaps for want of memory: take fewer. "
            + advice(same if address else ("--workers", arguments.workers // 2))
        ) from error
    except OSError as error:
        worded = error.strerror is None  # what could not be written, and why
        if worded and folder and _has_begun(folder):
            raise OSError(f"{error} {advice()}") from error
        raise
    except KeyboardInterrupt:
        if folder and not _has_begun(folder):  # nothing to go on with
            raise
        raise KeyboardInterrupt(f"stopped. {advice()}") from None
