"""Runs under `mpirun`: which process this is, and work for the first one alone. mpi4py is loaded only there."""

import os
from collections.abc import Callable
from typing import TypeVar, cast

from .errors import FfrobotError

T = TypeVar("T")

# Set by Open MPI, MPICH, Intel MPI, Slurm.
_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_SIZE")
_RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")


_is_apart = False


def work_apart() -> None:
    """Have the processes of mpirun share, from now on, nothing but the jobs that the first one distributes."""
    global _is_apart
    _is_apart = True


def is_apart() -> bool:
    """Whether `work_apart` has been called: collective functions would then wait for ever."""
    return _is_apart


def processes() -> int:
    """Return the number of processes of mpirun; 1 without it, and where they share only jobs (`work_apart`)."""
    return 1 if _is_apart else _environment(_SIZES, 1)


def processors() -> int:
    """Number of processors available to this process."""
    return len(os.sched_getaffinity(0))


def is_first() -> bool:
    """Whether this is the process that reads, writes and prints."""
    return _is_apart or _environment(_RANKS, 0) == 0


def on_first(work: Callable[[], T]) -> T:
    """The result of `work`, done by the first process; its `FfrobotError` is raised on all. Collective."""
    if processes() == 1:
        return work()
    from mpi4py import MPI

    result: T | None = None
    error: FfrobotError | None = None
    if MPI.COMM_WORLD.rank == 0:
        try:
            result = work()
        except FfrobotError as failure:
            error = failure
    result, error = MPI.COMM_WORLD.bcast((result, error))
    if error is not None:
        raise error
    return cast(T, result)


def without_daemon() -> None:
    """Have Open MPI start no daemon for a process that runs alone, nor make folders; call it before loading mpi4py.

    A daemon takes 0.3 s to start. Where the process is killed, it complains on the terminal and folders stay.
    """
    if processes() == 1:
        os.environ.setdefault("OMPI_MCA_ess_singleton_isolated", "1")
        os.environ.setdefault("OMPI_MCA_orte_create_session_dirs", "0")


def environment_without_mpi() -> dict[str, str]:
    """Environment variables for a child process, without those by which it would join this process's MPI."""
    return {key: value for key, value in os.environ.items() if not key.startswith(("OMPI_", "PMIX_", "PMI_", "PRTE_"))}


def end_all() -> None:
    """End every process of the run: after an error that only this one has seen the others would wait for ever."""
    if processes() > 1:
        from mpi4py import MPI

        MPI.COMM_WORLD.Abort(1)


def _environment(names: tuple[str, ...], default: int) -> int:
    return next((int(os.environ[name]) for name in names if name in os.environ), default)
