"""Begin or resume runs in folders, trainings and evaluations alike.

A resumed run must keep the version and the options it was begun with.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from typing import Any, TypeVar

import reference
from reference.building import plan_of
from reference.paper import InputError
from reference.workshop.files import make_folder
from reference.workshop.maps import load

try:
    import fcntl
except ImportError:  # no POSIX: nothing is locked
    fcntl = None  # type: ignore[assignment]


class RunError(InputError):
    """A run that can neither begin nor resume; one message for people."""


class ContradictionError(RunError):
    """Options that contradict each other, or the run that was begun."""


Started = TypeVar("Started")
OR_RESUME = "Name another folder, or add --resume to go on with what is in it."
LOCK = ".lock"  # in a run's folder while it runs; holds the process id


@contextmanager
def held(
    folder: Path | None, resume: bool, start: Callable[[], Started]
) -> Iterator[Started]:
    """Start a run and lock its folder, if any, until the block ends.

    A new run's folder is empty or not there yet; if it writes nothing, no folder is
    left. Raises RunError for another, or if another process holds the lock; OSError if
    the folder cannot be made.
    """
    if folder is None:
        yield start()
    elif resume:
        with _lock(folder) if folder.is_dir() else nullcontext():
            yield start()
    else:
        refuse_used(folder)
        started, ours = start(), not folder.exists()
        make_folder(folder)
        try:
            with _lock(folder):
                refuse_used(folder)  # another process may have been quicker
                yield started
        finally:
            with suppress(OSError):
                if ours:
                    folder.rmdir()


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Lock a folder; the lock ends with the process, even if it is killed."""
    if fcntl is None:
        yield
        return
    path = folder / LOCK
    with path.open("a+", errors="replace") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            held = os.path.samestat(os.fstat(file.fileno()), path.stat())
        except OSError:
            held = False
        if not held:
            file.seek(0)
            raise RunError(
                f"{folder}: process {file.read(20)} is at work in it. Wait for its "
                "end, or name another folder."
            )
        file.truncate(0)
        file.write(str(os.getpid()))
        file.flush()
        try:
            yield
        finally:
            path.unlink(missing_ok=True)


def refuse_used(folder: Path, instead: str = OR_RESUME) -> None:
    """Raise RunError for a folder that is not empty: a new run needs its own."""
    if folder.exists() and not folder.is_dir():
        raise RunError(f"{folder}: is a file. Name a folder.")
    if folder.exists() and any(path.name != LOCK for path in folder.iterdir()):
        raise RunError(f"{folder}: is not empty. {instead}")


def refuse_version(path: Path, version: object, game: object = reference.GAME) -> None:
    """Raise RunError for what another version, or another game, wrote."""
    if (version, game) != (reference.__version__, reference.GAME):
        raise RunError(
            f"{path}: was written by version {version!s:.40} of game {game!s:.40}, "
            f"this is {reference.__version__} of game {reference.GAME}, in which runs "
            "may end otherwise. Go on with the version that wrote it, or begin anew in "
            "another folder."
        )


def refuse_contradictions(run: str, asked: Iterable[tuple[str, Any, Any]]) -> None:
    """Raise ContradictionError for the first option that differs from the run's.

    run    such as "the training in out"
    asked  option, what was asked for (None: nothing), and what the run has
    """
    for option, here, there in asked:
        if here is not None and here != there:
            raise ContradictionError(
                f"{option}: {here} was asked for, but {run} has {there}. "
                "Leave it out, or begin anew in another folder."
            )


def rows_of_both(
    here: Mapping[str, Any], there: Any, name: str
) -> Iterator[tuple[str, Any, Any]]:
    """Compare nested rows by their dotted names, for `refuse_contradictions`.

    In a whole record None is a value: "nothing".
    """
    for key, value in here.items():
        other = there.get(key) if isinstance(there, Mapping) else None
        if isinstance(value, Mapping):
            yield from rows_of_both(value, other, f"{name}{key}.")
        else:
            one, another = ("nothing" if v is None else v for v in (value, other))
            yield name + key, one, another


def building_asked(name: str | None, begun: str, plan: str) -> tuple[str, Any, Any]:
    """Compare --building by its drawing, for `refuse_contradictions`.

    begun  the building's name in the run;  plan  its floor file's text
    """
    same = name is not None and plan_of(load(name)) == plan
    return "--building", name, name if same else f"{begun}, drawn otherwise"
