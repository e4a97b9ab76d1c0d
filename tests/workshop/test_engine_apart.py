"""The process that compiles: it ends with the one that has started it."""

import os
import signal
import time
from subprocess import PIPE

import pytest

pytest.importorskip("numba")

from processes import ended, python

from reference.workshop.engine import apart

COMPILES = """
import pathlib
from reference.workshop.engine import apart
apart.PROGRAM = {program!r}
apart.compile_apart(pathlib.Path({folder!r}))
"""
WAITS = """
import os, pathlib, sys, time
sys.path[:] = {path!r}
from reference.workshop.engine.apart import end_with_parent
end_with_parent()
half = pathlib.Path({folder!r}, "half")
half.write_text(str(os.getpid()))
half.rename(half.with_name("begun"))
time.sleep(60)
"""


def is_there(process):
    """Has a process not ended?"""
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_it_ends_with_its_parent(number, tmp_path):
    """However that ends; nothing is left that goes on compiling."""
    program = COMPILES.format(program=WAITS, folder=str(tmp_path))
    parent = python("-c", program, stderr=PIPE)
    while not (tmp_path / "begun").exists():
        assert parent.poll() is None
        time.sleep(0.01)
    child = int((tmp_path / "begun").read_text())
    assert is_there(child)
    parent.send_signal(number)
    ended(parent)
    until = time.time() + 60
    while is_there(child):
        assert time.time() < until
        time.sleep(0.01)


@pytest.mark.parametrize("program", ["raise MemoryError", "this is not Python"])
def test_what_goes_wrong_there_is_no_error_here(program, tmp_path, monkeypatch):
    """The folder is empty then."""
    monkeypatch.setattr(apart, "PROGRAM", program)
    apart.compile_apart(tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("flag", ["-O", "-OO"])
def test_it_is_started_with_the_same_flags(flag, tmp_path):
    """What it compiles is of the same bytecode, and so found again."""
    program = """
import sys, pathlib
pathlib.Path({folder!r}, str(sys.flags.optimize)).touch()
"""
    command = COMPILES.format(program=program, folder=str(tmp_path))
    ended(python(flag, "-c", command))
    assert (tmp_path / str(flag.count("O"))).exists()


def test_without_a_program_of_its_own_nothing_is_started(tmp_path, monkeypatch):
    """As where Python is part of another program."""
    monkeypatch.setattr(apart.sys, "executable", None)
    begun = []
    monkeypatch.setattr(apart, "Popen", lambda *words, **more: begun.append(words))
    apart.compile_apart(tmp_path)
    assert begun == []
