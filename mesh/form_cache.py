"""Compiled finite element forms in the user's cache, which no end of a process, however sudden, leaves unusable.

FFCx locks a form by creating its `.c` file, and waits in vain for a process that died before the form was ready. Here
it compiles into a folder that belongs to this process alone; a form that is complete goes to the cache in one step, as
a folder of its own with the checksums of its files. Entries depend on interpreter, machine and dolfinx, as forms do.
"""

from __future__ import annotations

import atexit
import json
import os
import platform
import shutil
import sys
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from errno import ENOSPC
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from platformdirs import user_cache_path

from ..common.errors import SolveError
from ..common.locks import held, is_running, this_process

if TYPE_CHECKING:
    from mpi4py import MPI

READY = ".c.cached"  # FFCx writes it last
CHECKSUMS = "checksums.json"
OWN = ".of-"  # begins the names of folders of single processes
ROOM = 32 << 20  # bytes that compiling takes at most
LEAST = 2 << 20  # bytes: with less a compilation has failed for want of them
PATIENCE = 60.0  # s, then a form that another process compiles is compiled twice


@contextmanager
def form_folder(comm: MPI.Comm, compiler: str) -> Iterator[Path]:
    """The folder in which FFCx finds what has been compiled before and compiles the rest; collective on `comm`.

    `compiler` names its version. Where the cache cannot be written, forms are compiled for this process alone.
    """
    if comm.rank != 0:
        yield Path(comm.bcast(None))
        return
    shared, own = _folders(compiler)
    if comm.size > 1:
        comm.bcast(str(own))
    with held(shared / "compiling.lock", PATIENCE):  # others wait, and find what this process compiles
        _forget_unfinished(own)
        _fetch(shared, own)
        try:
            yield own
        except Exception as error:  # of FFCx, cffi or the compiler
            if full := [place for place in (own, tempfile.gettempdir()) if shutil.disk_usage(place).free < LEAST]:
                raise SolveError(f"{full[0]}: cannot compile finite elements: {os.strerror(ENOSPC)}") from error
            raise
        _publish(own, shared)


@cache
def _folders(compiler: str) -> tuple[Path, Path]:
    """The cache, and a new folder of this process, gone when it ends; those of processes that were killed are removed.

    They are where the environment says at first: what has been loaded from there cannot move.
    """
    shared = user_cache_path("ffrobot") / "forms" / f"{sys.implementation.cache_tag}-{platform.machine()}-{compiler}"
    try:
        shared.mkdir(parents=True, exist_ok=True)
        if shutil.disk_usage(shared).free < ROOM:
            raise OSError(ENOSPC, os.strerror(ENOSPC))
        for folder in shared.glob(f"{OWN}*"):
            if not is_running(folder.name.removeprefix(OWN).rpartition(".")[0]):
                shutil.rmtree(folder, ignore_errors=True)
        own = tempfile.mkdtemp(prefix=f"{OWN}{this_process()}.", dir=shared)
    except OSError:  # read-only, full, or a file in its place
        own = tempfile.mkdtemp(prefix="ffrobot-forms-")
    atexit.register(shutil.rmtree, own, ignore_errors=True)
    return shared, Path(own)


def _forget_unfinished(own: Path) -> None:
    """What an interrupted compilation of this very process has left: FFCx would wait for it."""
    names = set(os.listdir(own))
    for name in names:
        if name.endswith(".c") and name.replace(".c", READY) not in names:
            (own / name).unlink()


def _fetch(shared: Path, own: Path) -> None:
    """Bring in forms that others have compiled; damaged ones are left out and removed."""
    with suppress(OSError):
        there = set(os.listdir(own))
        for entry in (shared / name for name in sorted(os.listdir(shared)) if name + READY not in there):
            if entry.name.startswith(".") or not entry.is_dir():
                continue
            if not _is_sound(entry):
                shutil.rmtree(entry, ignore_errors=True)
                continue
            for file in sorted(entry.iterdir(), key=lambda file: file.name.endswith(READY)):  # which goes last
                if file.name != CHECKSUMS:
                    _give(file, own / file.name)


def _give(file: Path, name: Path) -> None:
    try:
        name.hardlink_to(file)
    except OSError:
        shutil.copyfile(file, name)


def _publish(own: Path, shared: Path) -> None:
    """Give others what this process has compiled; a cache that cannot be written does no harm."""
    with suppress(OSError):
        known = set(os.listdir(shared))
        for name in (file.removesuffix(READY) for file in os.listdir(own) if file.endswith(READY)):
            if name in known:
                continue
            made = Path(tempfile.mkdtemp(prefix=".new-", dir=own))
            files = [file for file in own.glob(f"{name}.*") if file.suffix in (".c", ".so", ".cached")]
            for file in files:
                shutil.copyfile(file, made / file.name)
            sums = {file.name: zlib.crc32(file.read_bytes()) for file in files}
            (made / CHECKSUMS).write_text(json.dumps(sums), encoding="utf-8")
            made.chmod(0o755)
            with suppress(OSError):  # another process may have been first
                made.rename(shared / name)


def _is_sound(entry: Path) -> bool:
    try:
        sums = json.loads((entry / CHECKSUMS).read_text(encoding="utf-8"))
        return bool(sums) and all(zlib.crc32((entry / name).read_bytes()) == value for name, value in sums.items())
    except (OSError, ValueError, AttributeError):
        return False
