"""Workers: jobs go out, results come back, and nobody stays behind."""

import os
import pickle
import signal
import sys
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import redirect_stderr
from io import StringIO
from multiprocessing import active_children
from pickle import PicklingError
from queue import Empty, SimpleQueue
from subprocess import DEVNULL, PIPE

import pytest
from processes import ended, python

from reference import paper
from reference.rewards import group_reward
from reference.workshop.storage.numbers import paper_numbers
from reference.workshop.storage.workers import (
    STOPS,
    InProcess,
    import_early,
    is_being_stopped,
    map_as_done,
    stop,
    stop_delayed,
    workers,
)
from reference.world import Died


def test_results_can_come_as_they_are_done():
    """Each with the number of its job, so that it can be kept at once."""
    with ThreadPoolExecutor(2) as executor:
        found = map_as_done(executor, time.sleep, [0.5, 0.0])
        assert [number for number, _ in found] == [1, 0]


class Later(Executor):
    """Keeps futures, for who ends them."""

    def __init__(self):
        self.futures = []

    def submit(self, fn, /, *given):
        """Do nothing yet."""
        self.futures.append(Future())
        return self.futures[-1]


def test_what_is_done_is_found_without_looking_through_all_that_wait():
    """Of thousands of jobs that end one by one; that took minutes."""
    executor = Later()

    def jobs():
        yield from range(8000)
        executor.futures[0].set_result(None)

    begin = time.process_time()
    for number, _ in map_as_done(executor, str, jobs()):
        for following in executor.futures[number + 1 : number + 2]:
            following.set_result(None)
    assert number == 7999
    assert time.process_time() - begin < 3


def test_a_job_may_raise_what_an_empty_queue_does():
    """It is told, not waited for."""

    def look(job):
        return SimpleQueue().get(block=False)

    with ThreadPoolExecutor(1) as executor, pytest.raises(Empty):
        list(map_as_done(executor, look, ["one"]))


def test_here_a_result_comes_before_the_next_job_begins():
    """What is done can be kept, though nobody works beside this process."""
    begun = []
    results = map_as_done(InProcess(), begun.append, ["first", "second"])
    assert (next(results), begun) == ((0, None), ["first"])


def test_workers_hear_numbers_that_have_changed_here(monkeypatch):
    """Also those that change between two lots of jobs, in the same process."""
    deaths = [[Died(time=9.0, person=0, floor=0)]]
    rewards = []
    with workers(1) as pool:
        for penalty in (1000.0, 7.0):
            monkeypatch.setattr(paper, "FIXED_PENALTY", penalty)
            rewards += [reward for _, reward in map_as_done(pool, group_reward, deaths)]
    assert rewards == [-1000, -7]


class Pickling(InProcess):
    """Hands jobs over as another process gets them."""

    def submit(self, fn, /, *given):
        """Do a job from a pickle."""
        return super().submit(*pickle.loads(pickle.dumps((fn, *given))))


def test_numbers_that_have_not_changed_stay_the_same_objects():
    """Else the engine digests the whole book anew, 0.2 s for each job."""
    before = paper_numbers()
    list(map_as_done(Pickling(), str, ["one"]))
    after = paper_numbers()
    assert all(after[name] is number for name, number in before.items())


def test_a_stop_ends_a_job_in_this_process():
    """It is dropped, as those are that have not begun."""
    begun = []

    def work(job):
        begun.append(job)
        signal.raise_signal(signal.SIGINT)
        pytest.fail("it went on")

    with pytest.raises(KeyboardInterrupt), workers(0) as executor:
        list(map_as_done(executor, work, ["one", "two"]))
    assert begun == ["one"]


def test_a_stop_waits_until_what_must_not_be_disturbed_is_over():
    """Also one that comes again; in other threads, which hear none, nothing changes."""
    over = []
    with pytest.raises(KeyboardInterrupt), stop_delayed():
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)
        over.append("this")
    assert over == ["this"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    with ThreadPoolExecutor(1) as thread:
        thread.submit(stop_delayed().__enter__).result()
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_what_a_stop_waits_for_is_told_in_the_terminal(monkeypatch):
    """Also where what a training says goes into a log."""
    terminal = StringIO()
    monkeypatch.setattr(sys, "__stderr__", terminal)
    with (
        pytest.raises(KeyboardInterrupt),
        redirect_stderr(StringIO()) as log,
        stop_delayed("a moment"),
    ):
        signal.raise_signal(signal.SIGINT)
    assert (terminal.getvalue(), log.getvalue()) == ("\na moment\n", "")


def test_a_stop_that_waits_is_known_as_one_that_does_not(monkeypatch):
    """A library may lose its exception, too: then it is raised again."""
    monkeypatch.setattr("reference.workshop.storage.workers.STOPPED_BY", [])
    before = signal.signal(signal.SIGINT, stop)
    try:
        with pytest.raises(KeyboardInterrupt), stop_delayed():
            assert not is_being_stopped()
            signal.raise_signal(signal.SIGINT)
            assert is_being_stopped()
    finally:
        signal.signal(signal.SIGINT, before)


def test_a_stop_waits_until_a_job_is_submitted(monkeypatch):
    """Else it may leave a lock of the pool's threads in between."""
    submitted = []

    def submit(pool, *job):
        signal.raise_signal(signal.SIGINT)
        submitted.append(job)

    monkeypatch.setattr(ThreadPoolExecutor, "submit", submit)
    with pytest.raises(KeyboardInterrupt), workers(1) as pool:
        pool.submit(len, "")
    assert submitted


# -- Processes ----------------------------------------------------------------------

PROGRAM = """
import os, time
from reference.workshop.storage.workers import workers

if __name__ == "__main__":
    with workers(1) as pool:
        pool.submit(exec, "import sys; assert 'torch' not in sys.modules").result()
        threads = pool.submit(os.getenv, "OMP_NUM_THREADS").result()
        print(threads, os.getenv("OMP_NUM_THREADS"), flush=True)
        pool.submit(time.sleep, 600).result()
"""


def test_a_worker_has_one_thread_and_ends_with_a_process_that_is_killed(tmp_path):
    """It does not load torch, and holds the output open as long as it lives."""
    (tmp_path / "program.py").write_text(PROGRAM)
    program = tmp_path / "program.py"
    threads = {"OMP_NUM_THREADS": "3"}
    running = python(program, env=threads, stdout=PIPE, stderr=DEVNULL)
    assert running.stdout.readline() == "1 3\n"
    running.kill()
    ended(running)


LARGE = """
from time import sleep
from reference.workshop.storage.workers import workers
with workers(1) as pool:
    job = pool.submit(len, bytes(10**6))
    while not job.running():
        sleep(0.01)
"""


def test_workers_import_what_is_slow_before_their_first_job():
    """What is not there is no matter until a job needs it."""
    modules = "{*__import__('sys').modules}"
    with workers(1) as pool:
        import_early(pool, ["colorsys", "nowhere"], most=9)
        assert "colorsys" in pool.submit(eval, modules).result()
        with pytest.raises(ModuleNotFoundError):
            pool.submit(__import__, "nowhere").result()
    with workers(0) as executor:
        import_early(executor, ["nowhere"], most=1)


def test_workers_that_import_end_with_the_pool():
    """Though there never was a job; and twice, as if once."""
    with workers(2) as pool, pool:
        import_early(pool, ["torch"], most=9)
        while len(started := active_children()) < 2:
            time.sleep(0.001)
    assert not any(process.is_alive() for process in started)


def test_a_job_that_no_worker_has_read_is_not_waited_for():
    """The worker is still being started, and a large job waits in a pipe."""
    assert python("-c", LARGE).wait(120) == 0


def test_a_result_that_is_half_written_is_not_waited_for():
    """The pipe is full, since it is larger, and its worker is ended meanwhile."""
    with workers(1) as pool:
        first, *_ = [pool.submit(bytes, 10**7) for _ in range(20)]
        assert len(first.result()) == 10**7


def test_a_worker_hears_no_signal_not_even_while_it_starts():
    """Ctrl-C in a terminal reaches all processes; only this one answers."""
    with workers(1) as pool:
        job = pool.submit(len, "done")
        while not (started := active_children()):
            time.sleep(0.001)
        for number in STOPS:
            os.kill(started[0].pid, number)
        assert job.result() == 4
    assert not started[0].is_alive()


class Enough(BaseException):
    """An exception of one's own that `except Exception` does not catch."""


def raise_enough(*_):
    """Do no job."""
    raise Enough("said")


def test_what_is_no_error_ends_a_job_but_no_worker():
    """Nor this process, with a status that says that all is well."""
    with workers(1) as pool:
        for job, told in ((raise_enough, "Enough: said"), (sys.exit, "SystemExit: 0")):
            with pytest.raises(RuntimeError, match=told) as raised:
                pool.submit(job, 0).result()
            assert "In a worker" in raised.value.__notes__[0]


def test_a_pool_that_lost_a_worker_ends():
    """Though another is busy; what could not be sent or done is told by its future."""
    with pytest.raises(BrokenExecutor, match="has died"), workers(2) as pool:
        with pytest.raises((AttributeError, PicklingError), match="local object"):
            pool.submit(lambda: "nobody can read this").result()
        with pytest.raises(ZeroDivisionError) as raised:
            pool.submit(divmod, 1, 0).result()
        assert "In a worker" in raised.value.__notes__[0]
        pool.submit(time.sleep, 600)
        list(map_as_done(pool, os._exit, [1]))
