"""Compiled code on disk: found again, and nothing that can go wrong with it matters."""

import os
import time
from contextlib import suppress
from threading import Event, Thread

import pytest

pytest.importorskip("numba")

import numba
from trainings import room_for

from reference.workshop.engine import mirrors, storing


def twice(number):
    """What is compiled here in the place of a tick: it takes a moment only."""
    return number + number


@pytest.fixture
def home(tmp_path, monkeypatch):
    """The folder of all folders of compiled code."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    return tmp_path / "cache" / "fire-rescue"


@pytest.fixture
def ready(home, monkeypatch):
    """A function: compile or load as a new process does; return what it says.

    What another process would compile for it is compiled in this one.
    """

    def begin(entry):
        monkeypatch.setattr(storing, "ENTRIES", [entry])
        return lambda: entry(21)

    def make_ready():
        mine = mirrors.compiled(twice, entry=True)

        def compile_apart(folder):
            other = mirrors.compiled(twice, entry=True)
            with suppress(OSError):
                storing.compile_here(begin(other), folder)
            begin(mine)

        said = []
        storing.make_ready(begin(mine), compile_apart, said.append)
        assert mine(21) == 42
        return said

    monkeypatch.setattr(mirrors, "ENTRIES", [])
    return make_ready


def files(home):
    """What is kept in all folders, by the ends of names."""
    kept = (path.suffix for path in home.rglob("*") if path.is_file())
    return sorted(suffix for suffix in kept if suffix != ".lock")


def test_what_is_compiled_once_is_loaded_by_the_next_process(ready, home):
    """The first says what takes so long, and where it is kept."""
    (said,) = ready()
    assert said.startswith("compiling the engine") and str(home) in said
    assert ready() == []
    assert files(home) == [".nbc", ".nbi"]


def test_the_cache_of_other_code_stays_where_it_is(ready, monkeypatch):
    """Somebody's own compiled functions are kept where they were."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", "elsewhere")
    ready()
    assert numba.config.CACHE_DIR == "elsewhere"


def beside(home):
    """What another checkout of the same code has compiled."""
    path = storing.folder_of_this_code() / "engine_of_another" / "advance.nbc"
    path.parent.mkdir(parents=True)
    path.touch()
    return path


@pytest.mark.parametrize("suffix", [".nbc", ".nbi"])
@pytest.mark.parametrize("left", [b"", b"\x80\x05half", None])
def test_a_damaged_file_costs_a_compilation(suffix, left, ready, home):
    """And is whole again afterwards; another checkout's files stay."""
    ready()
    (path,) = home.rglob(f"*{suffix}")
    path.write_bytes(path.read_bytes()[:100] if left is None else left)
    others = beside(home)
    assert len(ready()) == 1
    assert ready() == []
    assert others.exists()


def test_a_folder_that_cannot_be_written_costs_a_compilation(ready, home):
    """Here a file is in its place; the rights of a folder do not stop everybody."""
    home.parent.mkdir()
    home.touch()
    (said,) = ready()
    assert "cannot be written" in said
    assert len(ready()) == 1


def test_without_a_home_nothing_is_kept(ready, monkeypatch, tmp_path):
    """Nor is a folder `~` made where one happens to be."""
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setattr(storing.Path, "expanduser", no_home)
    monkeypatch.chdir(tmp_path)
    assert "cannot be written" in ready()[0]
    assert list(tmp_path.iterdir()) == []


def test_a_relative_path_is_no_home(monkeypatch, tmp_path):
    """The rules of XDG_CACHE_HOME say so: the folder would be another one each time."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", "cache")
    assert storing.folder_of_this_code().parent == tmp_path / ".cache" / "fire-rescue"


def no_home(path):
    """What Python raises then."""
    raise RuntimeError("Could not determine home directory.")


def test_a_full_disk_costs_another_compilation(ready, home):
    """No file has more than a few bytes, and it is said."""
    with room_for(10):
        first, then = ready()
    assert first.startswith("compiling the engine") and str(home) in first
    assert then.startswith("nothing could be kept") and str(home) in then
    assert files(home) == []
    assert len(ready()) == 1
    assert ready() == []


def test_a_stop_leaves_nothing_half_written(ready, home, monkeypatch):
    """Such as Ctrl-C while numba writes."""

    def stopped(source, target):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", stopped)
        with pytest.raises(KeyboardInterrupt):
            ready()
    assert files(home) == []
    assert len(ready()) == 1


def test_a_stop_leaves_what_is_whole(home, monkeypatch):
    """What was compiled before it, here and in another checkout."""
    monkeypatch.setattr(mirrors, "ENTRIES", [])
    mine = mirrors.compiled(twice, entry=True)
    monkeypatch.setattr(storing, "ENTRIES", [mine])
    others = beside(home)

    def stopped(folder):
        mine(21)
        half = mine._cache.cache_path + "/advance.nbc.tmp.0123456789abcdef"
        open(half, "w").close()
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        storing.make_ready(lambda: mine(21), stopped, [].append)
    assert others.exists()
    assert files(home) == [".nbc", ".nbc", ".nbi"]


def test_what_other_versions_have_left_is_removed_after_a_week(ready, home):
    """Only ours, only when something is compiled, and never what is in use."""
    names = ["0123456789abcdef", "fedcba9876543210", "somebody's own"]
    for name in names:
        (home / name).mkdir(parents=True)
    long_ago = time.time() - 8 * 24 * 3600
    for name in (names[0], names[2]):
        os.utime(home / name, (long_ago, long_ago))
    ready()
    mine = storing.folder_of_this_code().name
    assert {path.name for path in home.iterdir()} == {mine, *names[1:]}
    os.utime(home / names[1], (long_ago, long_ago))
    ready()
    assert (home / names[1]).exists()


def test_other_constants_and_settings_are_kept_in_another_folder(home, monkeypatch):
    """numba itself would not hear of them."""
    folders = {storing.folder_of_this_code()}
    monkeypatch.setattr(mirrors, "BOOK", "another.")
    folders.add(storing.folder_of_this_code())
    monkeypatch.setenv("NUMBA_OPT", "1")
    folders.add(storing.folder_of_this_code())
    monkeypatch.setenv("NUMBA_CACHE_DIR", "anywhere")
    folders.add(storing.folder_of_this_code())
    assert len(folders) == 3


def test_who_waits_for_another_process_is_told(tmp_path, monkeypatch):
    """Once, and not at once: one that only loads has done so by then."""
    monkeypatch.setattr(storing, "PATIENCE", 0.1)
    told = []
    with storing._alone_in(tmp_path, told.append):
        assert told == []

    begun = Event()
    heard = Event()

    def hold():
        with storing.lock_in(tmp_path):
            begun.set()
            heard.wait(60)

    def hear(text):
        told.append(text)
        heard.set()

    other = Thread(target=hold)
    other.start()
    begun.wait()
    with storing._alone_in(tmp_path, hear):
        assert told == ["another process is compiling the engine: waiting for it"]
    other.join()


def test_nobody_waits_for_another_checkout(tmp_path, monkeypatch):
    """The files of one are not those of the other, though they share a folder."""
    monkeypatch.setattr(storing, "PATIENCE", 0.0)
    told = []
    with storing.lock_in(tmp_path), monkeypatch.context() as patch:
        patch.setattr(storing, "ENGINE", tmp_path / "another" / "engine")
        with storing._alone_in(tmp_path, told.append):
            assert told == []
