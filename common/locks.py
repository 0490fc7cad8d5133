"""Locks that end with the process that holds them, and names of processes that are never used again."""

import os
import platform
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

try:
    import fcntl
except ImportError:  # no POSIX system: work is then done twice at worst
    fcntl = None  # type: ignore[assignment]

ASK_EVERY = 0.02  # s


@contextmanager
def held(path: Path, patience: float) -> Iterator[bool]:
    """Context that locks the file `path`; yields False after `patience` s in vain, or where no locks exist.

    The kernel ends the lock with this process, however that ends. It saves work that another process does at the same
    time: results have to be right without it.
    """
    descriptor = None
    with suppress(OSError):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    try:
        yield descriptor is not None and _locked(descriptor, patience)
    finally:
        if descriptor is not None:
            os.close(descriptor)


def _locked(descriptor: int, patience: float) -> bool:
    if fcntl is None:
        return False
    last = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > last:
                return False
            time.sleep(ASK_EVERY)
        except OSError:
            return False
        else:
            return True


def this_process() -> str:
    """Return a name of this process, `HOST-PID-START`, which no other process ever has."""
    return f"{platform.node()}-{os.getpid()}-{_start_of(os.getpid())}"


def is_running(process: str) -> bool:
    """Whether the process with this name of `this_process` still runs; True for one of another machine."""
    host, pid, start = process.rsplit("-", 2) if process.count("-") >= 2 else ("", "", "")
    if not pid.isdigit():
        return False
    return host != platform.node() or _start_of(int(pid)) == start


def _start_of(pid: int) -> str:
    """When a process began, in ticks since the machine did; empty where it does not run, or nobody can tell."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii", errors="replace").rpartition(")")[2].split()[19]
    except (OSError, IndexError):
        return ""
