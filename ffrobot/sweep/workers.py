"""Processes that perform runs, kept from one run to the next: `ffrobot.worker`."""

from __future__ import annotations

import json
import os
import sys
import weakref
from contextlib import suppress
from pathlib import Path
from subprocess import PIPE, Popen
from tempfile import TemporaryFile
from threading import Lock
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
    """Of a run: exit code, error messages, SHA-256 of the modules that the scene's Python files imported, by file."""

    code: int
    messages: str
    imported: dict[str, str]


class Worker:
    """One such process, with the environment and in the folder of its making."""

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
        """`ffrobot ARGUMENTS`; exit code and messages are those of the worker where it ends with the run."""
        self._messages.seek(0)
        self._messages.truncate()
        answer = b""
        with suppress(BrokenPipeError):
            self._requests.write(json.dumps({"arguments": arguments}).encode() + b"\n")
            self._requests.flush()
            answer = self._answers.readline()
        found: dict[str, Any] = json.loads(answer) if answer.endswith(b"\n") else {}
        code = int(found["code"]) if found else self._process.wait()
        self._messages.seek(0)
        return Done(code, self._messages.read().decode(errors="replace"), found.get("imported", {}))

    @property
    def is_alive(self) -> bool:
        """Whether it takes another run."""
        return self._process.poll() is None

    def stop(self) -> None:
        """Ask the run under way to end, or the worker itself."""
        self._process.terminate()

    def close(self) -> None:
        """End it, with nothing under way."""
        with suppress(BrokenPipeError):
            self._requests.close()
        self._answers.close()
        self._process.wait()
        self._messages.close()


class Workers:
    """Workers as they are needed, ended with this object."""

    def __init__(self) -> None:
        self._idle: list[Worker] = []
        self._busy: set[Worker] = set()
        self._lock = Lock()
        weakref.finalize(self, _close, self._idle)

    def perform(self, arguments: list[str]) -> Done:
        """As `Worker.perform`, by any of them; from several threads at once."""
        worker = self._take()
        try:
            return worker.perform(arguments)
        finally:
            with self._lock:
                self._busy.discard(worker)
                if worker.is_alive:
                    self._idle.append(worker)

    def stop(self) -> None:
        """Ask all runs under way to end."""
        with self._lock:
            for worker in self._busy:
                worker.stop()

    def _take(self) -> Worker:
        with self._lock:
            fit = [worker for worker in self._idle if worker.place == _place() and worker.is_alive]
            _close([worker for worker in self._idle if worker not in fit])
            self._idle[:] = fit
            worker = self._idle.pop() if self._idle else Worker()
            self._busy.add(worker)
        return worker


def _close(idle: list[Worker]) -> None:
    while idle:
        idle.pop().close()


def _place() -> tuple[Path, dict[str, str]]:
    return Path.cwd(), dict(os.environ)
