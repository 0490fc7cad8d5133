"""What an output may replace: neither an input of the command nor a file of another kind."""

import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from io import BytesIO
from pathlib import Path
from typing import TextIO

from . import checksum
from .errors import InputError, is_own_fault
from .tables import shown

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_KINDS = {HDF5_SIGNATURE: "HDF5", b"\x89PNG": "PNG", b"%PDF": "PDF", b"PK\x03\x04": "zip", b"MATLAB": "MATLAB"}
DAMAGED = "HDF5 damaged"
_SPECIAL = {stat.S_ISFIFO: "a pipe (FIFO)", stat.S_ISSOCK: "a socket"}
_START = 4096  # bytes that tell the kind of a file

_inputs: ContextVar[tuple[Path, ...]] = ContextVar("inputs", default=())


@contextmanager
def protected(paths: Iterable[Path]) -> Iterator[None]:
    """Context in which no output may overwrite the files `paths`, by links or other names either."""
    token = _inputs.set((*_inputs.get(), *paths))
    try:
        yield
    finally:
        _inputs.reset(token)


def check_not_an_input(path: Path) -> None:
    """Raise `InputError` where `path` is, or links to, one of the `protected` files, or is a circle of links."""
    target = _target(path, "output: expected a file name")
    for source in _inputs.get():
        same = target == source.absolute() or target == _resolved(source)
        with suppress(OSError, ValueError):
            same = same or path.samefile(source)
        if same:
            raise InputError(f"{path}: output: expected another file than the input {source}, which would be lost")


def check_file_name(text: str) -> Path:
    """Return `text` as a path. Raises `InputError` unless it can be the name of a regular file."""
    path = Path(text)
    if not path.name and not (path := path.absolute()).name:
        raise InputError(f"{path}: expected the name of a file", "a folder")
    _target(path, "expected the name of a file")
    check_regular(path)
    return path


def _target(path: Path, expected: str) -> Path:
    """Where `path` leads. Raises `InputError` with what was `expected` where that is in a circle, or it is no name."""
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            os.stat(path)  # `exists` and, from Python 3.13 on, `resolve` are silent about circles
        return path.resolve()
    except (OSError, RuntimeError, ValueError) as error:
        about = getattr(error, "strerror", None) or str(error)
        is_circle = "loop" in about.lower() or "symbolic" in about
        raise InputError(
            f"{shown(str(path))}: {expected}", "links that lead in a circle" if is_circle else about
        ) from None


def check_regular(path: Path) -> None:
    """Raise `InputError` where a pipe, a device or a socket is at `path`: reading it may never end.

    Missing files, and folders, are accepted here.
    """
    with suppress(OSError, ValueError):
        mode = path.stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISDIR(mode)):
            kind = next((word for is_kind, word in _SPECIAL.items() if is_kind(mode)), "a device")
            raise InputError(f"{path}: expected a regular file", kind)


def check_same_kind(path: Path, content: bytes) -> None:
    """Raise `InputError` where `path` holds a file of another kind than `content`; empty files may be replaced."""
    if not path.exists():
        return
    old, new = kind_of_file(path), kind(content)
    if old not in ("empty", "unreadable", new) and not (old == DAMAGED and new.startswith("HDF5")):
        raise InputError(f"{path}: output: expected a new name or a file of kind {new}", f"one of kind {old}")


def kind(content: bytes) -> str:
    """Kind of a file by its `content`: "PNG", "JSON", "text", …; "HDF5 FORMAT" with the attribute `format`."""
    start = content[:_START]
    if start.startswith(HDF5_SIGNATURE):
        return f"HDF5 {_hdf5_format(BytesIO(content))}"
    binary = next((name for signature, name in _KINDS.items() if start.startswith(signature)), None)
    text = start.decode("utf-8", errors="replace").lstrip("\ufeff \t\r\n").lower()
    if binary or not start:
        return binary or "empty"
    if "\0" in text:
        return "binary"
    if text.startswith("<"):
        tag = re.search(r"<(?:!doctype +)?([a-z][\w:]*)", text)
        return tag[1] if tag else "markup"
    return "JSON" if re.match(r'[{\[]\s*["{\[\]}\d-]', text) else "text"


def kind_of_file(path: Path) -> str:
    """The kind of the file at `path`; see `kind`."""
    if not path.is_file():
        return "no regular file"  # a device, a socket: a rename would replace it
    try:
        with path.open("rb") as stream:
            start = stream.read(_START)
        return f"HDF5 {_hdf5_format(path)}" if start.startswith(HDF5_SIGNATURE) else kind(start)
    except OSError:
        return "unreadable"


def _hdf5_format(source: Path | BytesIO) -> str:
    import h5py

    try:
        if isinstance(source, Path) and checksum.state(source) == "damaged":
            return "damaged"
        with h5py.File(source, "r") as file:
            return str(file.attrs.get("format", "VTKHDF" if "VTKHDF" in file else "of another program"))
    except Exception as error:  # whatever h5py makes of a damaged one
        if is_own_fault(error):
            raise
        return "damaged"


def _resolved(path: Path) -> Path:
    with suppress(OSError, RuntimeError, ValueError):
        return path.resolve()
    return path.absolute()


def discard(stream: TextIO) -> None:
    """Discard what `stream` has not written yet, so that Python does not retry as it ends."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
