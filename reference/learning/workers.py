"""Workers: jobs go out, results come back in the jobs' order, whoever does them.

Clause: E6.  Any `concurrent.futures.Executor` will do; here are a pool of processes
and this process itself.
"""

import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from threading import Lock, Thread
from typing import Any, TypeVar

import torch

POLL = 0.2  # seconds between two looks at whether to stop

Made = TypeVar("Made")
Given = TypeVar("Given")


def in_order(
    executor: Executor,
    work: Callable[[Given], Made],
    jobs: Iterable[Given],
    stop: Callable[[], bool],
) -> list[Made] | None:
    """The results in the order of the jobs; None if told to stop before all are there.

    Raises what the work raises, and BrokenExecutor for a worker that has died.
    """
    futures: list[Future[Made]] = []
    for job in jobs:
        if stop():
            return None
        with _uninterrupted():
            futures.append(executor.submit(work, job))
    while waiting := [future for future in futures if not future.done()]:
        if stop():
            return None
        wait(waiting, timeout=POLL)
    return [future.result() for future in futures]


@contextmanager
def one_thread() -> Iterator[None]:
    """Small networks want one thread; sums then come in one order everywhere."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


# -- Executors ----------------------------------------------------------------------


class Here(Executor):
    """Does a job at once, in this process: slower, but a debugger can step into it."""

    def submit(
        self, fn: Callable[..., Made], /, *args: Any, **kwargs: Any
    ) -> Future[Made]:
        """Done before it returns."""
        future: Future[Made] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def workers(count: int) -> Iterator[Executor]:
    """A pool of so many processes with a thread each; 0: this process.

    They begin anew (spawn), since torch's threads do not survive a fork; they do not
    hear Ctrl-C; and they end with the block, or with this process if it is killed.
    """
    if count == 0:
        yield Here()
        return
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")
    context = get_context("spawn")
    far, near = context.Pipe(duplex=False)
    pool = Pool(count, context, _begin_work, (far,))
    try:
        yield pool
    finally:
        near.close()
        pool.shutdown()


class Pool(ProcessPoolExecutor):
    """A process pool whose workers know when they are in the middle of a job."""

    def submit(
        self, fn: Callable[..., Made], /, *args: Any, **kwargs: Any
    ) -> Future[Made]:
        """As any executor's."""
        return super().submit(_at_work, fn, *args, **kwargs)


_working = Lock()


def _at_work(fn: Callable[..., Made], /, *args: Any, **kwargs: Any) -> Made:
    with _working:
        return fn(*args, **kwargs)


def _begin_work(lifeline: Connection) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    torch.set_num_threads(1)
    Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    """Ends this worker when the other end of the line is closed.

    Not while a result is on its way: the pool would wait for the rest of it forever.
    """
    lifeline.poll(None)
    parent = parent_process()
    while parent is not None and parent.is_alive() and not _working.locked():
        time.sleep(POLL / 4)
    os._exit(1)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Ctrl-C waits: a process that begins in here never hears it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
