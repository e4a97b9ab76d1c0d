"""Workers: do jobs in other processes, or in this one.

Any `concurrent.futures.Executor` will do [E6]; here are a pool of processes,
a Dask cluster and this process itself.
"""

import logging
import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import (
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ThreadPoolExecutor,
)
from contextlib import AbstractContextManager, contextmanager, suppress
from importlib import import_module
from itertools import chain
from multiprocessing import get_context, parent_process, resource_tracker
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from queue import Empty, SimpleQueue
from threading import Lock, RLock, Thread, Timer, current_thread, local, main_thread
from traceback import format_exc
from typing import Any, NoReturn, TypeVar

from tqdm import tqdm

import reference
from reference import paper
from reference.paper import InputError
from reference.workshop.storage.numbers import paper_numbers

STOPS: list[int] = [signal.SIGINT, signal.SIGTERM]  # end a command
STOPS += [signal.SIGHUP] if hasattr(signal, "SIGHUP") else []  # the terminal is gone
STOPPED_BY: list[int] = []  # heard by `stop`, also while it is delayed

STOP_CHECK_SECONDS = 0.2  # seconds: not every system hears Ctrl-C while it waits
ANSWER_SECONDS = 10  # seconds to wait for a scheduler

Result = TypeVar("Result")
Given = TypeVar("Given")


def chunks(items: Sequence[Given], size: int) -> list[tuple[Given, ...]]:
    """Split what there is to do into jobs of at most `size`, in order."""
    return [tuple(items[k : k + size]) for k in range(0, len(items), size)]


def stop(number: int, frame: Any) -> NoReturn:
    """Handle a signal as Ctrl-C is; keep it, since a library may lose the exception."""
    STOPPED_BY.append(number)
    raise KeyboardInterrupt


def is_being_stopped() -> bool:
    """Whether a KeyboardInterrupt may be somebody's: code can raise it by itself."""
    default = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    return bool(STOPPED_BY) or default


def stop_again(lost: Any) -> None:
    """Stop a moment later, where Python has ignored the exception: in a destructor."""
    if isinstance(lost.exc_value, KeyboardInterrupt):
        Timer(0.01, signal.raise_signal, STOPPED_BY[-1:]).start()
    else:
        sys.__unraisablehook__(lost)


@contextmanager
def stop_delayed(told: str = "") -> Iterator[None]:
    """Delay a KeyboardInterrupt, from any signal, to the end; say `told` at once."""
    heard = list[int]()

    def later(number: int, frame: Any) -> None:
        """Handle a signal."""
        heard.append(number)
        if before[number] is stop:
            STOPPED_BY.append(number)
        if told:
            print(f"\n{told}", file=sys.__stderr__)  # sys.stderr may be a log

    heeded = STOPS if current_thread() is main_thread() else []  # it alone hears any
    raising = (stop, signal.default_int_handler)
    before = dict[int, Any]()
    for number in heeded:
        handler = signal.getsignal(number)
        if handler in raising:
            before[number] = handler
    for number in before:
        signal.signal(number, later)
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if heard:
        raise KeyboardInterrupt


def one_thread() -> AbstractContextManager[None]:
    """Run torch on one thread: quickest for small networks, and sums in one order."""
    return torch_threads(1)


@contextmanager
def torch_threads(number: int) -> Iterator[None]:
    """Run torch on so many threads, whatever the machine has."""
    import torch  # late: commands that do not learn start at once

    before = torch.get_num_threads()
    torch.set_num_threads(number)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def map_in_shares(
    executor: Executor,
    work: Callable[[Sequence[Given]], Sequence[Result]],
    items: Sequence[Given],
) -> list[Result]:
    """Give each worker an even share; return results in order.

    Where the number of workers is unknown, each item is a share. Raises as
    `map_as_done`.
    """
    size = -(-len(items) // getattr(executor, "workers", len(items)))
    return [*chain(*map_in_order(executor, work, chunks(items, size)))]


def map_in_order(
    executor: Executor, work: Callable[[Given], Result], jobs: Iterable[Given]
) -> list[Result]:
    """Do each job where there is time for it; return results in order.

    Raises as `map_as_done`.
    """
    made = dict(map_as_done(executor, work, jobs))
    return [made[k] for k in range(len(made))]


def map_as_done(
    executor: Executor, work: Callable[[Given], Result], jobs: Iterable[Given]
) -> Iterator[tuple[int, Result]]:
    """Yield number and result of each job as it is done, under the numbers as here.

    Raises what the work raises, and BrokenExecutor for a worker that has died. Jobs
    that are not done by then are left to whoever ends the executor.
    """
    done: SimpleQueue[Future[Result]] = SimpleQueue()
    waiting: dict[Future[Result], int] = {}
    for number, job in enumerate(jobs):
        submitted = executor.submit(_under_numbers, paper_numbers(), work, job)
        waiting[submitted] = number
        submitted.add_done_callback(done.put)
        while not done.empty():
            future = done.get()
            yield waiting.pop(future), future.result()
    while waiting:
        try:
            future = done.get(timeout=STOP_CHECK_SECONDS)
        except Empty:
            continue  # a stop is heard now
        yield waiting.pop(future), future.result()


def _under_numbers(
    numbers: Mapping[str, Any], work: Callable[[Given], Result], job: Given
) -> Result:
    """Do a job under the paper's numbers of who asks; another process has its own.

    A number that is the same already stays the object that it is: the engine takes a
    new one for a changed rule, and digests the whole book anew.
    """
    mine = paper_numbers()
    for name, number in numbers.items():
        if repr(mine.get(name)) != repr(number):
            setattr(paper, name, number)
    return work(job)


class InProcess(Executor):
    """Does a job at once, in this process: slower, but a debugger can step into it."""

    workers = 1

    def submit(
        self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any
    ) -> Future[Result]:
        """Do a job before returning."""
        future: Future[Result] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future


# -- A pool of processes ------------------------------------------------------------


def workers(count: int) -> Executor:
    """Make a pool of `count` processes with a thread each; 0: this process.

    They are spawned, since torch's threads do not survive a fork. They ignore Ctrl-C,
    and end with `with workers(2) as pool:`, or with this process if it is killed.
    """
    return _Pool(count) if count else InProcess()


def import_early(executor: Executor, modules: Sequence[str], most: int) -> None:
    """Let up to so many processes of a pool start now, and import modules meanwhile.

    What they cannot import is told by the first job that needs it.
    """
    if isinstance(executor, _Pool):
        for _ in range(min(most, executor.workers)):
            executor.submit(_import_all, modules)


def _import_all(modules: Sequence[str]) -> None:
    for module in modules:
        import_module(module)


class _Pool(ThreadPoolExecutor):
    """Threads, each of which sends its jobs to a process of its own, and waits.

    Who has died answers with BrokenExecutor. So nothing is shared by processes: no
    queue is left half-written by one that is killed.
    """

    def __init__(self, workers: int):
        super().__init__(workers)
        self.workers = workers
        self.lines = local()  # to a thread's process
        self.processes = list[SpawnProcess]()
        self.starting = Lock()
        self.ended = False

    def submit(
        self, fn: Callable[..., Result], /, *args: Any, **kwargs: Any
    ) -> Future[Result]:
        """Submit a job; a stop waits until threads have agreed who does it."""
        with stop_delayed():
            return super().submit(self._ask, fn, args, kwargs)

    def _ask(self, *job: Any) -> Any:
        """Have a job done, by a process that the thread's first job starts."""
        if not hasattr(self.lines, "own"):
            self.lines.own = self._start()
        line = self.lines.own
        asked = pickle.dumps(job)
        try:
            line.send_bytes(asked)
            result, error = pickle.loads(line.recv_bytes())
        except (EOFError, OSError) as gone:
            raise BrokenExecutor("a worker has died") from gone
        if error is not None:
            raise error
        return result

    def _start(self) -> Connection:
        """Start a process that hears no signal, as this thread; return the line."""
        if hasattr(signal, "pthread_sigmask"):
            resource_tracker.ensure_running()  # later it would unblock them
            signal.pthread_sigmask(signal.SIG_BLOCK, STOPS)
        spawn = get_context("spawn")
        here, there = spawn.Pipe()
        with self.starting, there:
            if self.ended:
                raise BrokenExecutor("no worker is started any more")
            process = spawn.Process(target=_work, args=(there,))
            process.start()
            self.processes.append(process)
        return here

    def __exit__(self, *raised: object) -> None:
        """End, whether or not jobs are left."""
        self.end()

    def end(self) -> None:
        """End all processes, whatever they are at; drop all jobs. Twice is once."""
        with self.starting:
            self.ended = True
        for process in self.processes:
            process.kill()
        self.shutdown(cancel_futures=True)
        for process in self.processes:
            process.join()


def _work(line: Connection) -> None:
    """Do jobs until nobody asks for more, with numpy and torch on one thread."""
    os.environ.update(OMP_NUM_THREADS="1", OMP_WAIT_POLICY="PASSIVE")
    for number in STOPS:
        signal.signal(number, signal.SIG_IGN)
    tqdm.set_lock(RLock())  # its own, shared by processes, would leak
    Thread(target=_end_with_parent, daemon=True).start()
    with suppress(EOFError, OSError):
        while True:
            line.send_bytes(_answer(line.recv_bytes()))


def _answer(job: bytes) -> bytes:
    """Do a job; return what came of it, or the exception with its traceback."""
    try:
        fn, args, kwargs = pickle.loads(job)
        return pickle.dumps((fn(*args, **kwargs), None))
    except BaseException as error:  # signals are ignored: it is the job's own
        error.add_note(f"In a worker:\n{format_exc()}")
        return pickle.dumps((None, _that_travels(error)))


def _that_travels(error: BaseException) -> Exception:
    """The exception, or an error with its text.

    That is for what cannot be pickled and read again, and for what is no error, such
    as SystemExit: it would end the process that has asked.
    """
    with suppress(Exception):  # of any kind
        pickle.loads(pickle.dumps(error))
        if isinstance(error, Exception):
            return error
    told = RuntimeError(f"{type(error).__name__}: {error}")
    told.add_note(error.__notes__[-1])
    return told


def _end_with_parent() -> None:
    parent_process().join()  # type: ignore[union-attr]
    os._exit(1)


# -- A cluster ----------------------------------------------------------------------


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """Yield the workers of a Dask scheduler, once there are any.

    Needs the extra `cluster`. Raises InputError without it, without an answer, and for
    workers that fail, have several threads, or another version of this package or none.
    """
    try:
        from distributed import Client, KilledWorker

        for name in ("distributed", "distributed.client"):  # we tell it, in a sentence
            logging.getLogger(name).setLevel(logging.CRITICAL)
        client = Client(address, timeout=ANSWER_SECONDS)
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
    """Wait for a worker; raise InputError for another version or several threads."""
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
    # stderr and torch's number of threads belong to a process, so to all its jobs
    if max(client.nthreads().values(), default=1) > 1:
        raise InputError(f"{address}: start its workers with --nthreads 1.")


def _version() -> str:
    return reference.__version__
