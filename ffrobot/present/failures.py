"""What the command line says of errors that are not the program's own, and streams that it can always write to."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper

from ..common.errors import FfrobotError
from ..common.extras import missing


def describe(error: Exception) -> str | None:
    """The message of an error that comes from the user's input or the machine; None where it is a fault of ffrobot."""
    if isinstance(error, FfrobotError):
        return str(error)
    if isinstance(error, ModuleNotFoundError):
        return missing(error)
    if isinstance(error, ImportError) and ".so" in f"{error.path} {error}":  # a library that it needs is not there
        return f"a library cannot be loaded: {error}"
    if isinstance(error, MemoryError):
        return "not enough memory: fewer outputs, elements or modes take less"
    if isinstance(error, OSError) and error.strerror:
        return f"{error.filename or 'a file that a library reads or writes'}: {error.strerror}"
    return None


class _Output(TextIOWrapper):
    """Standard output whose errors have its name: libraries raise others without one."""

    def write(self, text: str, /) -> int:
        with _named():
            return super().write(text)

    def flush(self) -> None:
        with _named():
            super().flush()


@contextmanager
def _named() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        error.filename = "standard output"
        raise


def ready_streams() -> None:
    """Have streams that take every character and are there: one that was closed is as good as none."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if stream is None:
            setattr(sys, name, open(os.devnull, "w", encoding="utf-8"))  # noqa: SIM115 (for good)
        elif hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")
    if type(sys.stdout) is TextIOWrapper:
        encoding, at_lines = sys.stdout.encoding, sys.stdout.line_buffering
        sys.stdout = _Output(sys.stdout.detach(), encoding, "backslashreplace", line_buffering=at_lines)


def without_output() -> None:
    """Forget what is still to be printed where it cannot be, so that Python does not try again at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
