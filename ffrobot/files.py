"""Writing files so that a failure leaves either the old file or the new one, never half of it."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from pathlib import Path

from .errors import InputError, SolveError


def write_atomically(path: Path, content: bytes, what: str, *, make_folder: bool = False) -> None:
    """Write `content` to a temporary name in the same folder, then rename it to `path`.

    HDF5 files are handed over as images made in memory: a full disk then is an ordinary failed write, which HDF5
    itself does not survive. Raises `SolveError` naming the file, `what` it is, and the reason.
    """
    temporary: Path | None = None
    try:
        if make_folder:
            path.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".tmp", dir=path.parent)
        temporary = Path(name)
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.chmod(0o666 & ~_umask())  # mkstemp's own mode is private
        temporary.replace(path)
        temporary = None
    except OSError as error:
        raise SolveError(f"{path}: cannot write the {what}: {error.strerror or error}") from None
    finally:  # after Ctrl-C too
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink()


def check_writable(path: Path) -> None:
    """Refuse, before any work is done, an output that could not be written. Raises `InputError`."""
    if path.is_dir():
        raise InputError(f"{path}: output: expected a file name, found a folder")
    if not path.parent.is_dir():
        raise InputError(f"{path}: output: expected a file in a folder that exists, found no folder {path.parent}")
    try:
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise InputError(f"{path}: output: expected a writable folder, found: {error.strerror or error}") from None


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
