"""Compiled finite element forms in the user's cache, which no end of a process, however sudden, leaves unusable.

FFCx locks a form by creating its `.c` file, and waits in vain for a process that died before the form was ready. Here
one process compiles at a time, under a lock that ends with it, so that a form which is not ready then is nobody's. A
ready one carries the checksum of its library. Entries depend on interpreter, machine and dolfinx, as forms do.
Forms that came with the installation (`fe_models.forms`) are taken into the cache.
"""

import os
import platform
import shutil
import sys
import tempfile
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from errno import ENOSPC
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from ..common.cache import cache_folder, is_own, own_folder
from ..common.errors import SolveError
from ..common.locks import held

if TYPE_CHECKING:
    from mpi4py import MPI

READY = ".c.cached"  # FFCx makes this file last, and never reads it: it takes the checksum
ROOM = 32 << 20  # bytes that compiling takes at most
LEAST = 2 << 20  # bytes: with less a compilation has failed for want of them
PATIENCE = 60.0  # s, then a form that another process compiles is compiled twice

_sound: set[str] = set()  # folder and name of the forms that this process has checked


@contextmanager
def form_folder(comm: "MPI.Comm", compiler: str) -> Iterator[Path]:
    """Context of the folder in which FFCx finds and keeps compiled forms; collective on `comm`.

    `compiler`: its version. Where the cache cannot be written, forms are compiled for this process alone.
    """
    if comm.rank != 0:
        yield Path(comm.bcast(None))
        return
    of = f"{sys.implementation.cache_tag}-{platform.machine()}-{compiler}"
    folder = cache_folder("forms", of)
    with held(folder / "compiling.lock", PATIENCE) as is_alone:  # others wait, and find what this process compiles
        if not is_alone or shutil.disk_usage(folder).free < ROOM:
            folder = own_folder("forms")
        _take(installed_forms() / of, folder)
        _forget_unsound(folder)
        if comm.size > 1:
            comm.bcast(str(folder))
        try:
            yield folder
        except Exception as error:  # of FFCx, cffi or the compiler
            if full := [place for place in (folder, tempfile.gettempdir()) if shutil.disk_usage(place).free < LEAST]:
                raise SolveError(f"{full[0]}: cannot compile finite elements: {os.strerror(ENOSPC)}") from error
            raise
        with suppress(OSError):  # a form without its checksum is compiled again
            for form, files in _unchecked(folder).items():
                if (ready := Path(form + READY)) in files:
                    ready.write_bytes(_checksum(files))
                    for file in files:
                        file.chmod(0o600)
                    _sound.add(form)


def installed_forms() -> Path:
    """Folder of compiled forms in the installation, with a folder for each interpreter, machine and version."""
    return Path(sys.prefix, "share", "ffrobot", "forms")


@cache
def _take(installed: Path, folder: Path) -> None:
    """Copy the forms that `folder` does not have; once for each process."""
    with suppress(OSError):  # what is incomplete is unsound
        for file in installed.iterdir():
            if not (folder / file.name).exists():
                shutil.copyfile(file, folder / file.name)
                (folder / file.name).chmod(0o600)


def _forget_unsound(folder: Path) -> None:
    """Remove forms that nobody has finished, damaged ones, and those that another user has made or may change."""
    for form, files in _unchecked(folder).items():
        ready = Path(form + READY)
        if Path(f"{form}.c") not in files:
            continue
        if ready in files and all(map(is_own, files)) and ready.read_bytes() == _checksum(files):
            _sound.add(form)
        else:
            for file in files:
                file.unlink()


def _unchecked(folder: Path) -> dict[str, list[Path]]:
    """Files of each form that this process has not checked, by their name without ending."""
    forms: dict[str, list[Path]] = {}
    for name in os.listdir(folder):  # patterns for each form would take a third of the time of a link
        form = f"{folder}/{name.partition('.')[0]}"
        if form not in _sound:
            forms.setdefault(form, []).append(folder / name)
    return forms


def _checksum(files: Sequence[Path]) -> bytes:
    """Of the library among the files of a form; empty where there is none."""
    return b"".join(b"%08x" % zlib.crc32(file.read_bytes()) for file in files if file.suffix == ".so")
