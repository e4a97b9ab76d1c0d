"""Compiled code, kept on disk from one process to the next.

Nobody waits for it twice, workers not at all: who starts them has compiled by then.
What goes wrong with files is no error; it costs a compilation.
"""

import os
import shutil
import sys
import tempfile
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from enum import EnumMeta
from hashlib import sha256
from pathlib import Path
from time import time
from typing import Any

import numba
from filelock import FileLock
from numba.core import event
from numba.core.registry import cpu_target

from reference.workshop.engine.mirrors import ENTRIES

ENGINE = Path(__file__).parent
CONFIG: Any = numba.config
UNUSED_DAYS = 7  # until what another version has compiled is removed
HALF_WRITTEN = "*/*.tmp.*"  # by numba
SETTINGS = "NUMBA_"  # begins the names of variables that change what numba makes


def make_ready(first_call: Callable[[], None], say: Callable[[str], None]) -> None:
    """Load what was compiled before, or compile, and say so; then nothing is slow.

    first_call: calls every entry of the engine.
    """
    folder = _folder()
    there = _is_writable(folder)
    kept = f"once; kept in {folder}" if there else f"as {folder} cannot be written"
    listener = _Once(f"compiling the engine, half a minute or more, {kept}", say)
    waiting = _alone_in(folder) if there else nullcontext()
    with waiting, event.install_listener("numba:compile", listener):
        # damaged files are removed; if that does not help, nothing is kept
        for where in (folder, folder, None) if there else (None,):
            _keep_entries_in(where)
            try:
                first_call()
            except Exception:  # of any kind, from a damaged file or a full disk
                if where is None:
                    raise
                _remove(folder.glob("*/*"))
            except KeyboardInterrupt:
                # entries compiled before the stop are whole, but not all
                _remove(folder.glob("*/*" if listener.told else HALF_WRITTEN))
                raise
            else:
                break
    if listener.told:
        _remove_what_nobody_uses(folder)


def _folder() -> Path:
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
    home = os.environ.get("XDG_CACHE_HOME") or "~/.cache"
    with suppress(RuntimeError):  # there is no home
        home = str(Path(home).expanduser())
    return Path(home, "fire-rescue", made_of.hexdigest()[:16])


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


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Let others wait meanwhile, who then load what is compiled here."""
    with ExitStack() as stack:
        with suppress(OSError, NotImplementedError):  # a disk that knows no locks
            stack.enter_context(FileLock(folder / "compiling.lock"))
        yield


class _Once(event.Listener):
    """Hears that a compilation begins."""

    def __init__(self, text: str, say: Callable[[str], None]):
        self.text = text
        self.say = say
        self.told = False

    def on_start(self, begun: Any) -> None:
        """Say so, the first time."""
        if not self.told:
            self.told = True
            self.say(self.text)

    def on_end(self, ended: Any) -> None:
        """Say nothing."""


def _remove(paths: Iterable[Path]) -> None:
    """Remove files and folders, as far as they can be removed."""
    for path in paths:
        with suppress(OSError):
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def _remove_what_nobody_uses(mine: Path) -> None:
    """Remove what other versions have left, and what was half written when killed."""
    long_ago = time() - UNUSED_DAYS * 24 * 3600
    others = [path for path in mine.parent.glob("[0-9a-f]*") if len(path.name) == 16]
    for path in {*others, *mine.glob(HALF_WRITTEN)} - {mine}:
        with suppress(OSError):
            if path.stat().st_mtime < long_ago:
                _remove([path])
