"""Files of parts, read in a process of its own: what a library does to that process ends with it.

The process starts in an empty folder (nothing that lies where a user works is imported) and without MPI's environment
variables. It ends with its parent, and at a limit of processor time.
"""

import os
import pickle
import resource
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar

from ..common.errors import FfrobotError, InputError
from ..common.interrupts import end_with_parent
from ..common.parallel import environment_without_mpi

Found = TypeVar("Found")

# Processor time, s: to read a file and a further MB of it, to mesh and for a further tetrahedron. Sound files need a
# tenth of it; OpenCASCADE does not end on some damaged ones. The variable of the environment takes the place of both.
READING, READING_MB = 30.0, 30.0
MESHING, MESHING_CELL = 60.0, 1e-3
SECONDS = "FFROBOT_CAD_SECONDS"
_is_apart = False  # whether this is such a process


def read_apart(read: Callable[..., Found], file: Path, *arguments: object) -> Found:
    """Call `read(file, *arguments)`, a module's function, in another process; arguments and result are pickled.

    The time allowed grows with the size of the file. Raises `InputError` where `read` has raised it, or its process has
    crashed, or has not ended in the processor time allowed.
    """
    size = file.stat().st_size if file.is_file() else 0
    request = pickle.dumps((read, (file, *arguments), READING + READING_MB * size / 1e6))
    environment = environment_without_mpi() | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-c", f"from {__name__} import main; main()"]
        done = subprocess.run(command, input=request, capture_output=True, check=False, cwd=folder, env=environment)
    if done.returncode == 0:
        answer = pickle.loads(done.stdout)
        if isinstance(answer, FfrobotError):
            raise answer
        return answer
    if done.returncode == -signal.SIGXCPU:
        seconds = done.stderr.decode().split()[-1]
        raise InputError(
            f"expected a part that is read and meshed within {float(seconds):.0f} s of processor time",
            f"no end: a damaged file, or one that needs longer, which {SECONDS}=SECONDS in the environment allows",
        )
    if done.returncode < 0:
        name = signal.Signals(-done.returncode).name
        raise InputError(f"expected an undamaged file; the reader crashed with {name}")
    reason = [*done.stderr.decode(errors="replace").splitlines(), "no reason"][-2 if done.stderr else -1].strip()
    raise InputError(f"expected an undamaged file; the reader reports: {reason}")


def allow(seconds: float) -> None:
    """Allow a process of `read_apart` so many `seconds` of processor time from now on; elsewhere do nothing."""
    if not _is_apart:
        return
    with suppress(KeyError, ValueError):
        seconds = float(os.environ[SECONDS])
    usage, (_, most) = resource.getrusage(resource.RUSAGE_SELF), resource.getrlimit(resource.RLIMIT_CPU)
    limit = int(usage.ru_utime + usage.ru_stime + seconds) + 1
    limit = limit if most == resource.RLIM_INFINITY else min(limit, most)
    resource.setrlimit(resource.RLIMIT_CPU, (limit, most))
    sys.stderr.write(f"{limit}\n")  # told by the parent where the limit is met
    sys.stderr.flush()


def main() -> None:
    """Call the function of `read_apart`, pickled on standard input, and write its pickled result."""
    global _is_apart
    _is_apart = True
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal: the parent decides
    end_with_parent()
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # OpenCASCADE writes to it
    read, arguments, seconds = pickle.load(sys.stdin.buffer)
    allow(seconds)
    reply: Any
    try:
        reply = read(*arguments)
    except FfrobotError as error:
        reply = error
    except MemoryError:
        reply = InputError("expected a part that fits into memory, found one that does not")
    answer.write(pickle.dumps(reply))
    answer.flush()
