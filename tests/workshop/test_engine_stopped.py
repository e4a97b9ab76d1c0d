"""Stopped or killed at any moment, it leaves nothing half-written, and goes on."""

import os
import signal
import threading
import time
from concurrent.futures import BrokenExecutor
from subprocess import PIPE

import pytest
from conftest import ROOT
from processes import ended, python

from reference.__main__ import main
from reference.workshop.comparing import begin_evaluation, play_evaluation
from reference.workshop.storage.workers import InProcess, workers

pytest.importorskip("numba")

TINY = "--building tiny --people 8 --robots sweep escort --fire random busiest"
EVALUATE = f"evaluate {TINY} --episodes 40 --workers 1"
TRAIN = "train --preset tiny --workers 1 --seed 5"
STOPPED_BY = {signal.SIGINT: 130, signal.SIGTERM: 130, signal.SIGKILL: -signal.SIGKILL}


def begun(command, tmp_path, **env):
    """A command that has begun, in a folder of its own."""
    words = [*command.split(), "--out", "out"]
    return python("-m", "reference", *words, env=env, cwd=tmp_path, stderr=PIPE)


INTERRUPTED = """
import signal, time
from functools import cache
from equality import simulation, unlike
from reference.workshop import engine

def begun():
    return simulation("tiny", "none", "none", 1, people=20, time_limit=60.0, sources=0)

@cache
def book_at(ticks):
    book = begun()
    for _ in range(ticks):
        book.step()
    return book

def interrupted(run, seconds):
    try:
        signal.setitimer(signal.ITIMER_REAL, seconds)  # may ring before it returns
        engine.run_to_end([run])
        time.sleep(60)
    except KeyboardInterrupt:
        return
    raise AssertionError("nothing is heard")

signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
engine.run_to_end([begun()])
first = begun()
clock = time.perf_counter()
engine.run_to_end([first])
seconds = time.perf_counter() - clock
for k in range(1, 31):
    run = begun()
    interrupted(run, k / 30 * seconds)
    assert unlike(book_at(run.ticks), run) == "", run
"""


def test_a_stop_while_this_process_plays_leaves_a_world_as_the_book_has_it():
    """At any moment; Python does not crash, and the clock tells the truth."""
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
    process = python("-c", INTERRUPTED, env={"PYTHONPATH": path}, stderr=PIPE)
    _, err = ended(process)
    assert process.returncode == 0, err


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "delay"), [(signal.SIGINT, 3.0), (signal.SIGTERM, 11.0)]
)
@pytest.mark.parametrize("command", [EVALUATE, TRAIN])
def test_a_stop_while_it_compiles_ends_it_at_once(number, delay, command, tmp_path):
    """Status 130, one message, and no file that is half written."""
    cache = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    # a crash of a library tells where it was
    process = begun(command, tmp_path, **cache, PYTHONFAULTHANDLER="1")
    while "compiling the engine" not in process.stderr.readline():
        assert process.poll() is None
    time.sleep(delay)
    process.send_signal(number)
    _, err = ended(process)
    assert process.returncode == 130, err
    assert "stopped. Go on with:" in err and "Traceback" not in err
    assert not [*(tmp_path / "cache").rglob("*.tmp.*")]
    assert not [*tmp_path.rglob(".*-part*")]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "delay"), [*zip(STOPPED_BY, (0.1, 0.7, 1.5), strict=True)]
)
@pytest.mark.parametrize(
    ("command", "table"), [(EVALUATE, "runs.csv"), (TRAIN, "summaries.csv")]
)
def test_what_was_stopped_while_it_played_goes_on_to_the_same_end(
    number, delay, command, table, tmp_path, monkeypatch
):
    """However it was stopped, and at several moments."""
    process = begun(command, tmp_path)
    while not (tmp_path / "out" / table).exists():
        assert process.poll() is None
        time.sleep(0.01)
    time.sleep(delay)
    process.send_signal(number)
    _, err = ended(process)
    assert process.returncode in (0, STOPPED_BY[number])
    assert "Traceback" not in err

    monkeypatch.chdir(tmp_path)
    name = command.split()[0]
    assert main([name, "--resume", "--out", "out", "--workers", "0"]) == 0
    assert main([*command.split(), "--out", "whole"]) == 0
    assert (tmp_path / "out" / table).read_bytes() == (
        tmp_path / "whole" / table
    ).read_bytes()
    assert not [*tmp_path.rglob(".*-part*")]


@pytest.mark.slow
def test_a_worker_that_is_killed_while_it_plays_costs_what_it_played(tmp_path):
    """The rows that are there stay; the others are played again."""
    evaluation = begin_evaluation(
        ("sweep", "escort"), ("random", "busiest"), building="tiny", episodes=60
    )
    whole = play_evaluation(evaluation, None, InProcess())
    with pytest.raises(BrokenExecutor), workers(2) as pool:

        def kill_one():
            while not (tmp_path / "runs.csv").exists() or len(pool.processes) < 2:
                time.sleep(0.01)
            time.sleep(0.1)
            os.kill(pool.processes[1].pid, signal.SIGKILL)

        threading.Thread(target=kill_one, daemon=True).start()
        play_evaluation(evaluation, tmp_path, pool)
    assert play_evaluation(evaluation, tmp_path, InProcess()) == whole
