"""Who does the jobs of a command: processes of this machine, those of mpirun, or the workers of a dask scheduler.

All of them are executors of `concurrent.futures`. A job is a function of a module with one argument; both and its
result pickle. What it returns does not depend on who does it.
"""

import logging
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager, nullcontext
from multiprocessing import connection, get_context
from types import FrameType
from typing import Any, NoReturn, TypeVar

from ..common.errors import InputError, SolveError
from ..common.interrupts import end_with_parent
from ..common.parallel import processes, processors, work_apart
from ..common.version import VERSION
from .worker import end_own_worker, stop_own_worker

J = TypeVar("J")
R = TypeVar("R")

TRIES = 3  # executors in a row that break before any job is done
AGAIN = 1.0  # s, between signals to processes that have not ended


class Batch:
    """The jobs of a command, done by an executor; `make` starts one for the first job, and after one has broken."""

    def __init__(self, make: Callable[[], Executor]) -> None:
        self._make = make
        self._executor: Executor | None = None
        self._futures: dict[Future[Any], int] = {}

    def __enter__(self) -> "Batch":
        return self

    def __exit__(self, *of_error: object) -> None:
        """Begin no job that has not begun, and end the processes of this machine, with the jobs under way."""
        if isinstance(self._executor, Processes):
            self._executor.shutdown(cancel_futures=True)
            return
        for future in self._futures:  # Python 3.11 fails at cancelled jobs of processes that end
            future.cancel()

    def results(self, function: Callable[[J], R], jobs: Sequence[J]) -> Iterator[tuple[int, R]]:
        """Yield number and result of every job, in the order in which they end; jobs of killed processes run again.

        Raises what `function` raises, and `SolveError` where executors keep breaking.
        """
        left, broken = dict(enumerate(jobs)), 0
        while left:
            try:
                self._executor = executor = self._executor or self._make()
                self._futures = {executor.submit(_done, VERSION, function, job): n for n, job in left.items()}
                for future in as_completed(self._futures):
                    number, result = self._futures[future], future.result()
                    del left[number]
                    broken = 0
                    yield number, result
            except BrokenExecutor as error:
                self._executor, broken = None, broken + 1
                if broken == TRIES:
                    raise SolveError(f"the processes that do the jobs were ended {TRIES} times: {error}") from error


_is_busy = _is_stopping = False  # of a process of `Processes`


def _done(version: str, function: Callable[[J], R], job: J) -> R:
    """The result of a job. Raises `InputError` where another version has sent it."""
    global _is_busy
    if version != VERSION:
        raise InputError(f"expected workers with ffrobot {version}", f"one with {VERSION}")
    _is_busy = True
    try:
        return function(job)
    finally:
        _is_busy = False
        if _is_stopping:
            _leave()


class Processes(ProcessPoolExecutor):
    """Executor with `count` processes, forked from this one with the modules and models that it has."""

    def __init__(self, count: int) -> None:
        super().__init__(count, mp_context=get_context("fork"), initializer=_serve, initargs=(os.getpid(),))

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes, and ask runs under way to end."""
        left = list((self._processes or {}).values())
        while left:  # a signal that comes just before a process waits for the lock of another one, ended, is not seen
            for process in left:
                process.terminate()
            connection.wait([process.sentinel for process in left], AGAIN if wait else 0.0)
            left = [process for process in left if wait and process.is_alive()]
        super().shutdown(wait, cancel_futures=cancel_futures)


def _serve(parent: int) -> None:
    """Leave Ctrl-C to the parent, end with SIGTERM and with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _stop)
    end_with_parent()
    if os.getppid() != parent:
        os._exit(1)


def _stop(number: int, frame: FrameType | None) -> None:
    """Leave, after the job under way, whose run is asked to end."""
    global _is_stopping
    if not _is_busy:
        _leave()
    if not _is_stopping:
        _is_stopping = True
        stop_own_worker()


def _leave() -> NoReturn:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # within a wait for the worker it would wait again, forever
    end_own_worker()
    os._exit(0)


@contextmanager
def batch_of(count: int | None = None, scheduler: str | None = None) -> Iterator[Batch]:
    """Context of a batch for `count` processes, by default one for each processor, or workers of a dask `scheduler`.

    Under mpirun its processes do the jobs, and all call this: the first has the batch, the others serve it and end.
    Raises `InputError` for two of these at once, and for a scheduler that does not answer.
    """
    if processes() > 1 and (count or scheduler):
        option = "--processes" if count else "--scheduler"
        raise InputError(
            f"{option}: expected none under mpirun: its {processes()} processes do the jobs", count or scheduler
        )
    if count and scheduler:
        raise InputError("--processes: expected none with --scheduler, whose workers do the jobs", count)
    here = nullcontext(lambda: Processes(count or processors()))
    kind = _of_mpi() if processes() > 1 else _of_dask(scheduler) if scheduler else here
    with kind as make, Batch(make) as batch:
        yield batch


@contextmanager
def _of_mpi() -> Iterator[Callable[[], Executor]]:
    from mpi4py.futures import MPICommExecutor

    work_apart()
    with MPICommExecutor() as executor:  # None but on the first process: the others serve it until it is done
        if executor is not None:
            yield lambda: executor
            return
    raise SystemExit(0)


@contextmanager
def _of_dask(address: str) -> Iterator[Callable[[], Executor]]:
    try:
        from distributed import Client, KilledWorker
        from distributed.comm import CommClosedError
    except ModuleNotFoundError:
        raise InputError("--scheduler: expected dask.distributed", "none: pip install distributed") from None
    for logger in ("distributed", "distributed.client"):  # it prints stacks of what is an error of ours below
        logging.getLogger(logger).setLevel(logging.CRITICAL)
    try:
        client = Client(address, timeout=10, set_as_default=False)  # s, for an answer
    except (OSError, ValueError) as error:
        raise InputError("--scheduler: expected the address of a dask scheduler", f'"{address}": {error}') from None
    with client:
        try:
            yield client.get_executor
        except (CancelledError, CommClosedError, KilledWorker) as error:
            why = str(error) or "the scheduler has ended"
            raise SolveError(f"--scheduler {address}: {why}; the same command resumes what is done") from error
