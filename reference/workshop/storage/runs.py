"""Begin or resume runs in folders, trainings and evaluations alike.

One run at a time works in a folder.  A run is resumed by the version that began it, and
with the same options.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, TypeVar

from filelock import FileLock, Timeout

import reference
from reference.paper import InputError
from reference.workshop.storage.files import make_folder


class ContradictionError(InputError):
    """Options contradict each other, or those that a resumed run began with."""


Started = TypeVar("Started")
OR_RESUME = "Name another folder, or add --resume to go on with what is in it."
LOCK = ".lock"  # in a run's folder while it runs


@contextmanager
def held(
    folder: Path | None, resume: bool, start: Callable[[], Started]
) -> Iterator[Started]:
    """Start a run and lock its folder, if any, until the block ends.

    A new run's folder is empty or not there yet; if nothing is written, none is left.
    Raises InputError for another folder, or if another process holds the lock; OSError
    if the folder cannot be made.
    """
    if folder is None:
        yield start()
        return
    if not resume:
        started = start()  # what it refuses leaves no folder behind
    ours = not folder.exists()
    make_folder(folder)
    try:
        with FileLock(folder / LOCK, blocking=False):  # ends with the process, too
            try:
                if resume:
                    started = start()
                else:
                    refuse_used(folder)
                yield started
            finally:
                (folder / LOCK).unlink(missing_ok=True)
    except Timeout:
        raise InputError(
            f"{folder}: another run is at work in it. Wait for its end, or name "
            "another folder."
        ) from None
    finally:
        if ours:
            with suppress(OSError):
                folder.rmdir()


def refuse_used(folder: Path, instead: str = OR_RESUME) -> None:
    """Raise InputError for a folder that is not empty: a new run needs its own."""
    if folder.exists() and any(path.name != LOCK for path in folder.iterdir()):
        raise InputError(f"{folder}: is not empty. {instead}")


def refuse_version(path: Path, version: object, game: object = reference.GAME) -> None:
    """Raise InputError for what another version, or another game, wrote."""
    if (version, game) != (reference.__version__, reference.GAME):
        raise InputError(
            f"{path}: was written by version {version!s:.40} of game {game!s:.40}, "
            f"this is {reference.__version__} of game {reference.GAME}, in which runs "
            "may end differently. Go on with the version that wrote it, or begin anew "
            "in another folder."
        )


def refuse_options(
    given: Mapping[str, Any],
    begun: Mapping[str, Any],
    instead: str = "begin anew in another folder",
) -> None:
    """Raise ContradictionError for options that differ from those of a resumed run.

    given: by name, None where nothing was asked for;  begun: what is known of the run
    """
    named = [f"--{k}" for k, v in given.items() if v not in (None, begun.get(k))]
    if named:
        raise ContradictionError(
            f"{', '.join(named).replace('_', '-')}: a resumed run keeps its options. "
            f"Leave this out, or {instead}."
        )
