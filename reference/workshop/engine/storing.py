"""Compiled code, kept on disk from one process to the next.

Nobody waits for it twice, workers not at all: who starts them has compiled by then.
What goes wrong with files is no error; it costs a compilation.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from enum import EnumMeta
from hashlib import sha256
from pathlib import Path
from time import time
from typing import Any

import numba
from filelock import FileLock, Timeout
from numba.core import event
from numba.core.registry import cpu_target

from reference.workshop.engine.mirrors import ENTRIES
from reference.workshop.storage.workers import stop_delayed

ENGINE = Path(__file__).absolute().parent
CONFIG: Any = numba.config
PATIENCE = 3.0  # seconds until one is told for what one waits; loading takes one
UNUSED_DAYS = 7  # until what another version has compiled is removed
HALF_WRITTEN = "*.tmp.*"  # by numba
SETTINGS = "NUMBA_"  # begins the names of variables that change what numba makes


def make_ready(
    first_call: Callable[[], None],
    compile_apart: Callable[[Path], None],
    say: Callable[[str], None],
) -> None:
    """Load what was compiled before, or compile, and say so; then nothing is slow.

    first_call: calls every entry of the engine.
    compile_apart: lets another process keep all in a folder, by `compile_here`.
    """
    folder = folder_of_this_code()
    there = _is_writable(folder)
    kept = f"once; kept in {folder}" if there else f"as {folder} cannot be written"
    text = f"compiling the engine, half a minute or more, {kept}"
    if there:
        with _alone_in(folder, say):
            _keep_entries_in(folder)
            if _load(first_call):
                return
            say(text)
            try:
                compile_apart(folder)
            except KeyboardInterrupt:
                # what was compiled before the stop is whole
                _remove(_kept(HALF_WRITTEN))
                raise
            _remove_what_nobody_uses(folder)
            if _load(first_call):
                return
            say(f"nothing could be kept in {folder}: compiling again, for this run")
    else:
        say(text)
    # what no other process can make, or keep, is made for this one only
    _keep_entries_in(None)
    first_call()


def compile_here(first_call: Callable[[], None], folder: Path) -> None:
    """Compile into a folder, if it is the one of this code."""
    if folder == folder_of_this_code():
        _keep_entries_in(folder)
        first_call()


def _load(first_call: Callable[[], None]) -> bool:
    """Load what is kept; False: something is missing, or damaged and removed.

    It takes a second, in which a stop waits: in the middle of it Python may crash.
    """
    with stop_delayed():
        try:
            with event.install_listener("numba:compile", _Refuse()):
                first_call()
        except _MissingError:
            return False
        except Exception:  # of any kind, from a damaged file
            _remove(_kept("*"))
            return False
    return True


class _MissingError(Exception):
    """Something would have to be compiled."""


class _Refuse(event.Listener):
    """Refuses to compile."""

    def on_start(self, begun: Any) -> None:
        """Stop what would begin."""
        raise _MissingError

    def on_end(self, ended: Any) -> None:
        """Say nothing."""


def folder_of_this_code() -> Path:
    """A folder named by all that goes into compiled code.

    numba itself hears of changes in one file only: not of those in helpers and
    constants.
    """
    made_of = sha256()
    for path in sorted(ENGINE.glob("*.py")):
        made_of.update(path.name.encode() + path.read_bytes())
    settings = {key: os.environ[key] for key in os.environ if key.startswith(SETTINGS)}
    settings.pop("NUMBA_CACHE_DIR", None)
    processor = cpu_target.target_context.codegen().magic_tuple()
    facts = [numba.__version__, sys.version, processor, *sorted(settings.items())]
    made_of.update(repr([*facts, *_constants()]).encode())
    return _home() / "fire-rescue" / made_of.hexdigest()[:16]


def _home() -> Path:
    """Where a user's programs keep such things: by XDG's rules, no relative path is."""
    home = Path(os.environ.get("XDG_CACHE_HOME", ""))
    with suppress(RuntimeError):  # there is no home
        return home if home.is_absolute() else Path("~/.cache").expanduser()
    return Path("~/.cache")


def _constants() -> Iterator[tuple[str, str, str]]:
    """Yield what compiled functions may have frozen, wherever it was defined."""
    for name, module in sorted(sys.modules.items()):
        if name.startswith(__package__) and module:
            for key, thing in sorted(vars(module).items()):
                if isinstance(thing, EnumMeta):
                    yield name, key, str(list(thing))
                elif isinstance(thing, int | float | str) and key[:2] != "__":
                    yield name, key, repr(thing)


def _is_writable(folder: Path) -> bool:
    """Can something be written there?"""
    if not folder.is_absolute():
        return False
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder) as file:
            file.write(b"x")
        os.utime(folder)  # it is in use
    except OSError:
        return False
    return True


def _keep_entries_in(folder: Path | None) -> None:
    """Let numba keep our entries in a folder, or nowhere; others' stay as they are."""
    if not folder:
        for entry in ENTRIES:
            entry._cache.disable()
        return
    before = CONFIG.CACHE_DIR
    CONFIG.CACHE_DIR = str(folder)
    try:
        for entry in ENTRIES:
            entry.enable_caching()
    finally:
        CONFIG.CACHE_DIR = before


def lock_in(folder: Path) -> FileLock:
    """Make this checkout's lock: numba keeps what others compile in their own files."""
    checkout = sha256(str(ENGINE).encode()).hexdigest()[:16]
    return FileLock(folder / f"{checkout}.lock")


@contextmanager
def _alone_in(folder: Path, say: Callable[[str], None]) -> Iterator[None]:
    """Let others wait meanwhile, who then load what is compiled here."""
    with ExitStack() as stack:
        with suppress(OSError, NotImplementedError):  # a disk that knows no locks
            lock = lock_in(folder)
            try:
                lock.acquire(timeout=PATIENCE)
            except Timeout:
                say("another process is compiling the engine: waiting for it")
                lock.acquire()
            stack.callback(lock.release)
        yield


def _kept(pattern: str) -> Iterator[Path]:
    """Yield files of our entries; another checkout's lie in a subfolder of its own."""
    for subfolder in {Path(entry._cache.cache_path) for entry in ENTRIES}:
        yield from subfolder.glob(pattern)


def _remove(paths: Iterable[Path]) -> None:
    """Remove files and folders, as far as they can be removed."""
    for path in paths:
        with suppress(OSError):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _remove_what_nobody_uses(mine: Path) -> None:
    """Remove what other versions have left, and what was half written when killed."""
    long_ago = time() - UNUSED_DAYS * 24 * 3600
    others = [path for path in mine.parent.glob("[0-9a-f]*") if len(path.name) == 16]
    for path in {*others, *mine.glob(f"*/{HALF_WRITTEN}")} - {mine}:
        with suppress(OSError):
            if path.stat().st_mtime < long_ago:
                _remove([path])
