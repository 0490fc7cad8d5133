"""On what, and with what, numbers were measured; no dates: the same machine and program give the same record."""

from __future__ import annotations

import hashlib
import os
import platform
from importlib import import_module
from pathlib import Path

from ..mbs import _core

LIBRARIES = ("ffrobot", "numpy", "scipy", "h5py")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")


def about_machine() -> dict[str, object]:
    """Processor, cores, operating system, compiler and flags of the core, versions, threads."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.platform(),
        "compiler": _core.build,
        "versions": {"python": platform.python_version(), **{name: _version(name) for name in LIBRARIES}},
        "threads": {name: os.environ.get(name) for name in THREADS},
    }


def load() -> float:
    """Processes that want to run, mean of the last minute: beside the numbers it says how quiet the machine was."""
    return os.getloadavg()[0]


def content_hash(text: str) -> str:
    """SHA-256 of a text."""
    return hashlib.sha256(text.encode()).hexdigest()


def _version(library: str) -> str:
    return str(import_module(library).__version__)  # Debian's packages need not have metadata


def _processor() -> str:
    information = Path("/proc/cpuinfo")
    if information.is_file():
        for line in information.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()
