"""Writing files so that a failure leaves either the old file or the new one, never half of it."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from .errors import InputError, SolveError

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"


def write_atomically(path: Path, content: bytes, what: str, *, make_folder: bool = False) -> None:
    """Write `content` to a temporary name in the same folder, then rename it to `path`.

    HDF5 files are handed over as images made in memory: a full disk then is an ordinary failed write, which HDF5
    itself does not survive. Raises `SolveError` naming the file, `what` it is, and the reason.
    """
    target = path.resolve()  # a symbolic link stays one
    temporary = target.with_name(f".{target.name}.{uuid4().hex}.tmp")
    try:
        if make_folder:
            target.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("xb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except OSError as error:
        raise SolveError(f"{path}: cannot write the {what}: {error.strerror or error}") from None
    finally:  # after Ctrl-C too
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def check_output(path: Path, file_format: str, *, force: bool = False) -> None:
    """Refuse, before any work is done, an output that could not be written or would cost a file of another kind.

    An existing file is replaced only where it is empty, an HDF5 file whose attribute `format` is `file_format`, or one
    too damaged to tell; or any file if `force`. Raises `InputError`.
    """
    if path.is_dir():
        raise InputError(f"{path}: output: expected a file name, found a folder")
    if not path.parent.is_dir():
        raise InputError(f"{path}: output: expected a file in a folder that exists, found no folder {path.parent}")
    if path.exists() and not (path.is_file() and (force or _is_of_format(path, file_format))):  # no device, ever
        raise InputError(
            f'{path}: output: expected a new name or an earlier file of format "{file_format}", found a file of another'
            " kind"
        )
    try:
        with tempfile.TemporaryFile(dir=path.resolve().parent):
            pass
    except OSError as error:
        raise InputError(f"{path}: output: expected a writable folder, found: {error.strerror or error}") from None


def check_folder(folder: Path) -> None:
    """Refuse an output folder whose place a file has; one that is absent is made later. Raises `InputError`."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: output: expected a folder, found a file")


def _is_of_format(path: Path, file_format: str) -> bool:
    with suppress(OSError), path.open("rb") as stream:
        signature = stream.read(len(HDF5_SIGNATURE))
        if signature != HDF5_SIGNATURE:
            return signature == b""
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return bool(file.attrs.get("format") == file_format)
    except OSError:
        return True
