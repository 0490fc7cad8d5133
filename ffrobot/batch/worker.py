"""The worker of a thread: a process (`ffrobot.worker`) in which it solves scenes, one after the other."""

import json
import os
import sys
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE, Popen
from tempfile import TemporaryFile
from threading import local
from typing import Any, NamedTuple

from ..common.parallel import environment_without_mpi

ALONE = {
    "OMP_NUM_THREADS": "1",  # several runs go side by side
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": "33554432",  # of glibc: a run keeps memory that it frees, and pages come in once
    "MALLOC_TRIM_THRESHOLD_": "268435456",
    "OMPI_MCA_pml": "ob1",  # Open MPI opens no network, and nothing that several processes share: runs are one process
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_ess_singleton_isolated": "1",  # nor a daemon
}


class Done(NamedTuple):
    """End of a run: exit code, error messages, SHA-256 of modules that the scene's Python files imported, by file."""

    code: int
    messages: str
    imported: dict[str, str]


class Worker:
    """A process `ffrobot.worker`, with the folder and environment of this process when it was made."""

    def __init__(self) -> None:
        self.place = _place()
        self._messages = TemporaryFile()  # noqa: SIM115 (as long as the worker, which writes where this process is in it)
        command = [sys.executable, "-m", "ffrobot.worker"]
        environment = environment_without_mpi() | ALONE
        self._process = Popen(command, env=environment, stdin=PIPE, stdout=PIPE, stderr=self._messages)
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._requests, self._answers = self._process.stdin, self._process.stdout

    def perform(self, arguments: list[str]) -> Done:
        """Run `ffrobot ARGUMENTS` in the worker. If the worker ends with the run, the exit code is the worker's."""
        self._messages.seek(0)
        self._messages.truncate()
        answer = b""
        with suppress(BrokenPipeError):
            self._requests.write(json.dumps({"arguments": arguments}).encode() + b"\n")
            self._requests.flush()
            answer = self._answers.readline()
        answered: dict[str, Any] = json.loads(answer) if answer.endswith(b"\n") else {}
        code = int(answered["code"]) if answered else self._process.wait()
        self._messages.seek(0)
        return Done(code, self._messages.read().decode(errors="replace"), answered.get("imported", {}))

    def stop(self) -> None:
        """Ask the current run to end, or, without one, the worker itself."""
        self._process.terminate()

    def close(self) -> None:
        """End the idle worker."""
        with suppress(BrokenPipeError):
            self._requests.close()
        self._answers.close()
        self._process.wait()
        self._messages.close()


_own = local()


def own_worker() -> Worker:
    """The worker of this thread; a new one if that has ended, or this process's folder or environment has changed."""
    worker: Worker | None = getattr(_own, "worker", None)
    if worker is None or worker._process.poll() is not None or worker.place != _place():
        end_own_worker()
        _own.worker = worker = Worker()
    return worker


def stop_own_worker() -> None:
    """Ask the current run of this thread to end."""
    if (worker := getattr(_own, "worker", None)) is not None:
        worker.stop()


def end_own_worker() -> None:
    """End this thread's idle worker."""
    if (worker := getattr(_own, "worker", None)) is not None:
        worker.close()


def _place() -> tuple[Path, dict[str, str]]:
    return Path.cwd(), dict(os.environ)
