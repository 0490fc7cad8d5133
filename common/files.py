"""Writing files so that a failure leaves either the old file or the new one, never half of it."""

import os
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

from .errors import InputError, SolveError, either
from .outputs import DAMAGED, check_not_an_input, check_same_kind, kind_of_file

PIECE = 1 << 22  # bytes

AnyPath = str | PathLike[str]


def write_atomically(
    path: Path, content: bytes, what: str, *, make_folder: bool = False, ours: bool = False, private: bool = False
) -> None:
    """Write `content` to a temporary name in the same folder, then rename it to `path`.

    HDF5 files come as images made in memory: HDF5 itself does not survive a full disk. Raises `SolveError` with the
    file, `what` it is, and the reason; `InputError` where an input of the command (see `outputs.protected`) would be
    lost, or a file of another kind. `ours`: any kind may be replaced, as in the cache. `private`: for this user alone.
    """
    check_not_an_input(path)
    if not ours:
        check_same_kind(path, content)
    target = path.resolve()  # a symbolic link stays one
    temporary = target.with_name(f".{target.name[:100]}.{uuid4().hex}.tmp")
    try:
        if make_folder:
            target.parent.mkdir(parents=True, exist_ok=True)
        with _without_name(temporary, 0o600 if private else 0o666) as stream:
            for start in range(0, len(content), PIECE):  # Ctrl-C is answered between two
                stream.write(content[start : start + PIECE])
            stream.flush()
            os.fsync(stream.fileno())
            _name(stream, temporary)
        temporary.replace(target)
    except OSError as error:
        raise SolveError(f"{path}: cannot write the {what}: {error.strerror or error}") from None
    finally:  # after Ctrl-C too
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _without_name(temporary: Path, mode: int) -> BinaryIO:
    """A file in the folder of `temporary` that is gone with this process, however that ends; named where need be."""
    if hasattr(os, "O_TMPFILE") and os.path.isdir("/proc/self/fd"):
        with suppress(OSError):  # not on this file system
            return os.fdopen(os.open(temporary.parent, os.O_TMPFILE | os.O_RDWR, mode), "wb")
    return os.fdopen(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_RDWR, mode), "wb")


def _name(stream: BinaryIO, temporary: Path) -> None:
    """Give a complete file without a name that of `temporary`."""
    if temporary.exists():
        return
    folder = os.open(temporary.parent, os.O_RDONLY)
    try:
        os.link(f"/proc/self/fd/{stream.fileno()}", temporary.name, src_dir_fd=folder, dst_dir_fd=folder)
    finally:
        os.close(folder)


def check_output(path: Path, file_format: str) -> None:
    """Raise `InputError`, before any work is done, if an output cannot be written or would overwrite another file.

    An existing file is replaced only where it is no input, and is empty, an HDF5 file whose attribute `format` is
    `file_format`, or one too damaged to tell.
    """
    check_parent(path)
    replaceable = ("empty", "unreadable", f"HDF5 {file_format}", DAMAGED)
    if path.exists() and not (path.is_file() and kind_of_file(path) in replaceable):  # no device, ever
        raise InputError(
            f'{path}: output: expected a new name or an earlier file of format "{file_format}"',
            "a folder" if path.is_dir() else "a file of another kind",
        )


def check_parent(path: Path) -> None:
    """Raise `InputError` for an output that is an input, or whose folder is missing or cannot be written."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: output: expected a file in a folder that exists", f"no folder {path.parent}")
    _check_writable(path, path.resolve().parent)


def _check_writable(path: Path, folder: Path) -> None:
    check_not_an_input(path)
    nearest = next(place for place in (folder, *folder.resolve().parents) if place.exists())
    try:
        with tempfile.TemporaryFile(dir=nearest):
            pass
    except OSError as error:
        raise InputError(f"{path}: output: expected a writable folder, found: {error.strerror or error}") from None


def check_ending(path: Path, label: str, endings: Sequence[str]) -> None:
    """Refuse an output that is a folder or an input, or whose name has none of the `endings`. Raises `InputError`."""
    if path.is_dir():
        raise InputError(f"{path}: {label}: expected a file name", "a folder")
    if path.suffix.lower() not in endings:
        raise InputError(f"{path}: {label}: expected a name that ends in {either(endings)}", f'"{path.name}"')
    _check_writable(path, path.parent)


def check_new_file(path: Path, *, replace: bool) -> None:
    """Raise `InputError` where an output would overwrite an input, or, unless `replace`, another file."""
    check_parent(path)
    if path.exists() and not (replace and path.is_file()):
        raise InputError(f"{path}: output: expected a new name, or --force to replace it", "a file there")


def holds(path: Path, content: bytes) -> bool:
    """Whether the file at `path` has this `content`."""
    with suppress(OSError):
        return path.is_file() and path.stat().st_size == len(content) and path.read_bytes() == content
    return False


def check_folder(folder: Path) -> None:
    """Raise `InputError` where an output folder is a file or an input, or cannot be written; it may be missing."""
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: output: expected a folder", "a file")
    _check_writable(folder, folder)


def check_new_folder(folder: Path) -> None:
    """Raise `InputError` for an output folder that is not empty; a missing one is accepted."""
    check_folder(folder)
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder}: output: expected a new or empty folder", "one with files in it")
