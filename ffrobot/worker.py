"""A process that solves scenes one after the other: `python -m ffrobot.worker`, for runs of sweeps and designs.

It loads the program once, and forks for every scene: what a run does to its process (a crash, memory, folder, modules
and caches of a scene's Python functions) ends with that run. Modal bodies that two runs have read, later ones find in
memory. Requests and answers are lines of JSON on the standard streams, `{"arguments": ["solve", …]}` and
`{"code": 0, "imported": {}}`, the exit code as `subprocess` has it and the run's `python_files.imported_files`. The
error stream is that of this process.
"""

import gc
import json
import os
import random
import signal
import sys
import warnings
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from types import FrameType
from typing import Any, BinaryIO, NoReturn

from .common.deferred import USED
from .common.errors import FfrobotError
from .common.interrupts import SIGNALS, EndOfCommand, end_process, end_with_parent
from .common.python_files import imported_files
from .fe_models.modal_body_file import keep_modal_body, read_files

LOADED = (  # by every run; what else a run has loaded, the next one finds
    "ffrobot.cli",
    "ffrobot.run.solve",
    "ffrobot.run.inputs",
    "ffrobot.results.write",
    "ffrobot.results.solving",
    "ffrobot.present.console",
    "ffrobot.present.start_postures",
    "ffrobot.present.summary",
    "ffrobot.fe_models.link",
)
KEPT = ("ffrobot.", "scipy.")  # packages of which the next run finds what one has loaded


def main() -> None:
    """Answer requests until there are no more or SIGTERM arrives, which first ends the current run."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: runs have it, whoever asks for them decides
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    nowhere = os.open(os.devnull, os.O_RDWR)
    for standard in (0, 1):  # of which others in this process get nothing
        os.dup2(nowhere, standard)
    os.close(nowhere)
    report = TemporaryFile()  # noqa: SIM115 (as long as the worker)
    _load(LOADED)
    gc.freeze()  # runs share what is loaded as long as none looks through it
    read_before = set[str]()
    for line in requests:
        report.truncate(0)
        report.seek(0)
        child = _fork()
        if child == 0:
            for stream in (requests, answers):  # of a worker that dies nothing may stay open
                stream.close()
            _run(json.loads(line)["arguments"], report)
        code, reported = _wait(child), _report(report)
        answers.write(json.dumps({"code": code, "imported": reported.get("imported", {})}).encode() + b"\n")
        answers.flush()
        _load(reported.get("loaded", []))
        for path in read_before.intersection(reported.get("read", [])):
            with suppress(FfrobotError):
                keep_modal_body(Path(path))
        read_before.update(reported.get("read", []))


def _report(report: BinaryIO) -> dict[str, Any]:
    """What a run has left in `report`: nothing where it was killed, or the disk is full."""
    report.seek(0)
    with suppress(ValueError):
        return json.loads(report.read())
    return {}


def _wait(child: int) -> int:
    """Exit code of a process, which is handed SIGTERM meanwhile; signals are blocked before."""

    def hand_on(number: int, frame: FrameType | None) -> None:
        with suppress(ProcessLookupError):
            os.kill(child, number)

    signal.signal(signal.SIGTERM, hand_on)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    signal.signal(signal.SIGTERM, EndOfCommand())
    return code


def _run(arguments: Sequence[str], report: BinaryIO) -> NoReturn:
    """`ffrobot ARGUMENTS` in the process of one run, which ends with it; what it has loaded it writes to `report`."""
    end_with_parent()  # nobody waits for the run any more, and another may write its file
    for number in SIGNALS:
        signal.signal(number, EndOfCommand())
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
    import numpy as np

    from .cli import main as command_line

    random.seed()  # numbers of its own where its scene's functions draw some: modules are seeded as they load
    np.random.seed()  # noqa: NPY002 (the one generator that there is without asking)
    before = set(sys.modules)
    sys.argv = ["ffrobot", *arguments]
    code = 0
    try:
        command_line()
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else 1
    loaded = set(sys.modules) - before
    names = sorted(name for name in loaded if name.startswith(KEPT))
    names += [f"{record.__module__}:{record.__qualname__}" for record in USED]
    imported = {str(file): digest for file, digest in imported_files().items()}
    with suppress(OSError):
        report.write(json.dumps({"loaded": names, "imported": imported, "read": [*map(str, read_files)]}).encode())
        report.flush()
    if "mpi4py.MPI" in loaded:  # it has to be finished where it was begun
        sys.exit(code)
    end_process(code)


def _fork() -> int:
    """As `os.fork`, with `SIGNALS` blocked in both processes.

    Python's warning of threads is left out: MPI has one, which waits for other processes.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        return os.fork()


def _load(names: Sequence[str]) -> None:
    """Load modules, and with MODULE:RECORD build validators; where one fails, the run that needs it says why."""
    for name in names:
        module, _, record = name.partition(":")
        with suppress(Exception):
            loaded = import_module(module)
            if record:
                getattr(loaded, record).model_rebuild()


if __name__ == "__main__":
    signal.signal(signal.SIGTERM, EndOfCommand())
    try:
        main()
    except KeyboardInterrupt:
        sys.exit(128 + signal.SIGTERM)
