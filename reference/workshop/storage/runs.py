"""Begin or resume runs in folders, trainings and evaluations alike.

One run at a time works in a folder.  A run is resumed by the version that began it,
with the same options, and with the same files behind the words that it was begun with.
"""

import ast
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeVar

from filelock import FileLock, Timeout

import reference
from reference.paper import InputError
from reference.workshop.storage.files import (
    errors_naming,
    folder_for_block,
    remove_parts,
)
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.records import checked_mapping


class ContradictionError(InputError):
    """Options contradict each other, or those that a resumed run began with."""


Started = TypeVar("Started")
RESUME_HINT = "Name another folder, or add --resume to go on with what is in it."
LOCK_FILE = ".lock"  # in a run's folder while it runs


@contextmanager
def locked(
    folder: Path | None, resume: bool, start: Callable[[], Started]
) -> Iterator[Started]:
    """Start a run and lock its folder, if any, until the block ends.

    A new run's folder is empty or not there yet; if nothing is written, none is left.
    Raises InputError for another folder, before the run starts, or if another process
    holds the lock; OSError if the folder cannot be made.
    """
    if folder is None:
        yield start()
        return
    if resume:
        with _lock(folder):
            yield start()
        return
    if folder.exists():  # now, since a start may take long
        with _lock(folder):
            refuse_used(folder)
    started = start()  # what it refuses leaves no folder behind
    with _lock(folder):
        refuse_used(folder)  # somebody may have come first
        yield started


@contextmanager
def _lock(folder: Path) -> Iterator[None]:
    """Lock a folder until the block ends, or refuse one that is locked.

    The lock ends with the process, too. What one that was killed has left half-written
    is removed.
    """
    path = folder / LOCK_FILE
    try:
        with folder_for_block(folder), FileLock(path, blocking=False):
            remove_parts(folder)
            try:
                yield
            finally:
                path.unlink(missing_ok=True)
    except Timeout:
        raise InputError(
            f"{folder}: another run is at work in it. Wait for its end, or name "
            "another folder."
        ) from None


def remove_left_lock(folder: Path) -> None:
    """Remove what a killed run has left: its lock, and what it was writing.

    One at work keeps its own.
    """
    path = folder / LOCK_FILE
    if path.exists():
        with suppress(Timeout, OSError), FileLock(path, blocking=False):
            remove_parts(folder)
            path.unlink()


def refuse_used(folder: Path, instead: str = RESUME_HINT) -> None:
    """Raise InputError for a folder that is not empty: a new run needs its own."""
    if folder.exists() and any(path.name != LOCK_FILE for path in folder.iterdir()):
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


def other_numbers(begun: Mapping[str, Any]) -> str:
    """Say which numbers of the paper are others now, and both values; or nothing.

    begun: by name. A number that is only in one of the two is no difference.
    """
    now = paper_numbers()
    words = []
    for name, number in begun.items():
        was = tuple(number) if isinstance(number, list) else number
        if name in now and was != now[name]:
            words.append(f"{name}={was!s:.40} (here {now[name]})")
    return ", ".join(words)


def refuse_numbers(path: Path, kept: Any) -> None:
    """Raise InputError for what was begun with other numbers of the paper.

    kept: the numbers by name, as a file has them; None where it has none
    """
    with errors_naming(path):
        words = other_numbers(checked_mapping(kept, "numbers"))
    if words:
        raise InputError(
            f"{path}: was begun with {words}. Go on with these numbers in "
            "reference/paper.py, or begin anew in another folder."
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


# -- What words mean ----------------------------------------------------------------

Digests = Mapping[str, Mapping[str, str]]
"""Of each word, the files that it means by name, the first one before those that this
one needs; of each file a digest."""

CHANGED = " has changed since. Take another folder for it."
INSTALLED = ("site-packages", "dist-packages")
MODULES_KEPT = 256  # whose imports were read last
DIGESTS_KEPT = 256  # of networks' files


def digest_of(content: bytes) -> str:
    """Digest the content of a file."""
    return sha256(content).hexdigest()


FileState = tuple[Path, int, int]
"""A file's whole path, the nanosecond of its last change, and its size."""


def file_state(path: Path) -> FileState | None:
    """By what one sees whether a file is as it was; None if there is none."""
    if not path.is_file():
        return None
    file = path.stat()
    return path.resolve(), file.st_mtime_ns, file.st_size


def digest_of_file(path: Path) -> str:
    """Digest a file; read it only if it has changed. Raises OSError."""
    state = file_state(path)
    return _digest_kept(path, state) if state else digest_of(path.read_bytes())


@lru_cache(maxsize=DIGESTS_KEPT)
def _digest_kept(path: Path, state: FileState) -> str:
    return digest_of(path.read_bytes())


def refuse_changed(begun: Digests, now: Digests) -> None:
    """Raise InputError for the first file that is another one now.

    A word that has no file any more is no difference: who needs the file says so. Nor
    is another path to the same content.
    """
    for word, files in begun.items():
        today = now.get(word, {})
        if not files or not today:
            continue
        (first, digest), *needed = files.items()
        (first_now, digest_now), *needed_now = today.items()
        if digest != digest_now:
            raise InputError(f"{first_now}{CHANGED}")
        changed = {name for name, _ in {*needed} ^ {*needed_now}}
        if changed:
            raise InputError(f"{min(changed)}, which {first} imports,{CHANGED}")


def digests_of_code(module: str, file: Path) -> dict[str, str]:
    """Digest a module's file and all that it imports from its folder, by their names.

    module: as it is imported, `mine` or `package.mine`; its folder is where the first
    part lies. Imports are read, not run: also those in functions. What is installed,
    and this package, are not one's own.
    """
    root = folder_of_code(module, file)
    found = dict[Path, str]()
    waiting = [(module, file)]
    while waiting:
        name, path = waiting.pop()
        if path in found:
            continue
        content = path.read_bytes()
        found[path] = digest_of(content)
        for imported in _imports(name, path, content):
            ours = imported.split(".")[0] != reference.__name__
            if ours and not (set(INSTALLED) & {*root.parts}):
                waiting += _files_of(imported, root)
    return {path.relative_to(root).as_posix(): found[path] for path in found}


def folder_of_code(module: str, file: Path) -> Path:
    """Find the folder from which a module is imported: where its first part lies."""
    above = module.count(".")
    if file.name == "__init__.py":  # the module is a folder itself
        above += 1
    return file.parents[above]


@lru_cache(maxsize=MODULES_KEPT)
def _imports(name: str, path: Path, content: bytes) -> tuple[str, ...]:
    """List the modules that a module's code may import, by their whole names."""
    try:
        tree = ast.parse(content)
    except (SyntaxError, ValueError):  # compiled, perhaps
        return ()
    package = name.split(".")
    if path.name != "__init__.py":
        package = package[:-1]

    imports = [".".join(package)] if package else []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            start = ".".join([*above, *filter(None, [node.module])])
            imports += [start, *(f"{start}.{alias.name}" for alias in node.names)]
    return tuple(name.strip(".") for name in imports if name.strip("."))


def _files_of(name: str, root: Path) -> list[tuple[str, Path]]:
    """Find the files in a folder that Python runs to import a module of this name."""
    found = []
    parts = name.split(".")
    for k in range(1, len(parts) + 1):
        place = root.joinpath(*parts[:k])
        for file in (place / "__init__.py", place.with_name(f"{place.name}.py")):
            if file.is_file():
                found.append((".".join(parts[:k]), file))
                break
    return found
