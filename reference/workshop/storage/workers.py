"""Workers: do jobs in other processes, or in this one.

Clause: E6.  Any `concurrent.futures.Executor` will do; here are a pool of processes,
a Dask cluster and this process itself.
"""

import logging
import os
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
)
from concurrent.futures import wait as wait_for
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from threading import RLock, Thread, Timer, current_thread, main_thread
from typing import Any, NoReturn, TypeVar

from tqdm import tqdm

import reference
from reference.paper import InputError

STOPS = [signal.SIGINT, signal.SIGTERM]  # end a command
STOPS += [signal.SIGHUP] if hasattr(signal, "SIGHUP") else []  # the terminal is gone
STOPPED_BY: list[int] = []  # those that `stop` has heard

POLL = 0.2  # seconds: not every system hears Ctrl-C while it waits
ANSWER = 10  # seconds to wait for a scheduler
_mask = getattr(signal, "pthread_sigmask", lambda how, which: which)  # POSIX alone

Made = TypeVar("Made")
Given = TypeVar("Given")


def chunks(items: Sequence[Given], size: int) -> list[tuple[Given, ...]]:
    """Split what there is to do into jobs of at most `size`, in order."""
    return [tuple(items[k : k + size]) for k in range(0, len(items), size)]


def stop(number: int, frame: Any) -> NoReturn:
    """Handle a signal as Ctrl-C is; keep it, since a library may lose the exception."""
    STOPPED_BY.append(number)
    raise KeyboardInterrupt


def stop_again(lost: Any) -> None:
    """Stop a moment later, where Python has ignored the exception: in a destructor."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        Timer(0.01, signal.raise_signal, STOPPED_BY[-1:]).start()
    else:
        sys.__unraisablehook__(lost)


@contextmanager
def undisturbed(told: str = "") -> Iterator[None]:
    """Delay a KeyboardInterrupt, from any signal, to the end; say `told` at once."""
    heard = list[int]()

    def later(number: int, frame: Any) -> None:
        """Handle a signal."""
        heard.append(number)
        if told:
            print(f"\n{told}", file=sys.stderr)

    heeded = STOPS if current_thread() is main_thread() else []  # it alone hears any
    handlers = {number: signal.getsignal(number) for number in heeded}
    raising = (stop, signal.default_int_handler)
    before = {s: handler for s, handler in handlers.items() if handler in raising}
    for number in before:
        signal.signal(number, later)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if heard:
        raise KeyboardInterrupt


@contextmanager
def one_thread() -> Iterator[None]:
    """Run torch on one thread: quickest for small networks, and sums in one order."""
    import torch  # late: commands that do not learn start at once

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def in_order(
    executor: Executor,
    work: Callable[[Sequence[Given]], Sequence[Made]],
    items: Sequence[Given],
) -> list[Made]:
    """Give each worker an even share; return results in order.

    Where the number of workers is unknown, each item is a share. Raises as `as_done`.
    """
    size = -(-len(items) // getattr(executor, "workers", len(items)))
    shares = chunks(items, size)
    made = dict(as_done(executor, work, shares))
    return [one for k in range(len(shares)) for one in made[k]]


def as_done(
    executor: Executor, work: Callable[[Given], Made], jobs: Iterable[Given]
) -> Iterator[tuple[int, Made]]:
    """Yield number and result of each job as it is done.

    Raises what the work raises, and BrokenExecutor for a worker that has died. Jobs
    that are not done by then are left to whoever ends the executor.
    """
    waiting: dict[Future[Made], int] = {}
    for number, job in enumerate(jobs):
        waiting[future := executor.submit(work, job)] = number
        if future.done():  # in this process
            yield waiting.pop(future), future.result()
    while waiting:
        for future in wait_for(waiting, POLL, FIRST_COMPLETED).done:
            yield waiting.pop(future), future.result()


class InProcess(Executor):
    """Does a job at once, in this process: slower, but a debugger can step into it."""

    workers = 1

    def submit(
        self, fn: Callable[..., Made], /, *args: Any, **kwargs: Any
    ) -> Future[Made]:
        """Do a job before returning."""
        future: Future[Made] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


# -- A pool of processes ------------------------------------------------------------


@contextmanager
def workers(count: int) -> Iterator[Executor]:
    """Yield a pool of `count` processes with a thread each; 0: this process.

    They are spawned, since torch's threads do not survive a fork. They ignore Ctrl-C,
    and end with the block, or with this process if it is killed. Raises InputError
    where the system lends no shared memory.
    """
    if count == 0:
        yield InProcess()
        return
    others = {*active_children()}
    try:
        with _deaf():  # and so is Python's tracker of semaphores, which starts here
            pool = _Pool(count, get_context("spawn"), _begin_work)
    except OSError as error:
        raise InputError(
            f"no worker can be started ({error.strerror}; on Linux they need to write "
            "to /dev/shm). Make that possible, or take --workers 0."
        ) from error
    results: Any = pool._result_queue
    pool.workers = count
    try:
        yield pool
    finally:
        for worker in {*active_children()} - others:
            worker.kill()
        results._writer.close()  # else the pool awaits the rest of half a result
        pool.shutdown(cancel_futures=True)


class _Pool(ProcessPoolExecutor):
    workers = 1

    def submit(
        self, fn: Callable[..., Made], /, *args: Any, **kwargs: Any
    ) -> Future[Made]:
        """Submit a job; Ctrl-C does not end a worker that is started for it."""
        with _deaf():
            return super().submit(fn, *args, **kwargs)


@contextmanager
def _deaf() -> Iterator[None]:
    """Block signals here, so that processes that start now ignore them.

    This process hears them afterwards: another of its threads may not block them.
    """
    with undisturbed():
        before = _mask(signal.SIG_BLOCK, STOPS)
        try:
            yield
        finally:
            _mask(signal.SIG_SETMASK, before)


def _begin_work() -> None:
    """Set up a worker, before it loads numpy and torch."""
    os.environ.update(OMP_NUM_THREADS="1", OMP_WAIT_POLICY="PASSIVE")
    for number in STOPS:
        if number != signal.SIGTERM:  # with which a pool that lost a worker ends others
            signal.signal(number, signal.SIG_IGN)
    _mask(signal.SIG_UNBLOCK, STOPS)
    tqdm.set_lock(RLock())  # its own, shared by processes, would leak
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent_process().join()  # type: ignore[union-attr]
    os._exit(1)


# -- A cluster ----------------------------------------------------------------------


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Yield the workers of a Dask scheduler, once there are any.

    Needs the extra `cluster`. Raises InputError without it, without an answer, and for
    workers that fail, or have another version of this package or none.
    """
    try:
        from distributed import Client, KilledWorker

        for name in ("distributed", "distributed.client"):  # we tell it, in a sentence
            logging.getLogger(name).setLevel(logging.CRITICAL)
        client = Client(address, timeout=ANSWER)
    except (ImportError, OSError, ValueError, TypeError) as error:
        raise InputError(
            f"{address}: no Dask scheduler answers ({error!s:.99}). Start one there, "
            "and here pip install dask distributed."
        ) from error
    with client:
        _refuse_other_workers(client, address)
        executor = client.get_executor(pure=False)
        try:
            yield executor
        except (CancelledError, ImportError, KilledWorker) as error:
            why = f" ({error!s:.200})" if str(error) else ""
            raise InputError(
                f"{address}: the scheduler is gone, or a worker failed{why}. Repair "
                "it, and go on with --resume."
            ) from error
        finally:
            executor.shutdown(wait=False)


def _refuse_other_workers(client: Any, address: str) -> None:
    """Wait for a worker; raise InputError if one has another version, or none."""
    if not client.nthreads():
        print(f"{address}: waiting for a worker; start one", file=sys.stderr)
        client.wait_for_workers(1)
    try:
        versions = {*client.run(_version).values()}
    except Exception as error:  # of any kind, from the worker
        versions = {f"none ({error})"}
    if versions != {_version()}:
        raise InputError(
            f"{address}: its workers have version {', '.join(sorted(versions))} of "
            f"this package; here it is {_version()}. Install the same everywhere."
        )


def _version() -> str:
    return reference.__version__
