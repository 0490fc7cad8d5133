"""Standard streams, consoles, progress, and messages of errors of input and machine.

Progress is a bar on a terminal, else a line now and then. Importing this loads nothing of an analysis.
"""

import logging
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from io import TextIOWrapper
from shutil import get_terminal_size
from typing import TYPE_CHECKING, TextIO

from ..common.errors import FfrobotError
from ..common.libraries import missing
from ..common.outputs import discard
from ..common.parallel import is_first
from ..run.watcher import Watcher

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress, TaskID

PLAIN_WIDTH = 120  # columns where the output is no terminal


def summary_width() -> int:
    """Return the number of columns for output: those of the terminal or of COLUMNS, else 120 (files, pipes)."""
    return get_terminal_size().columns if sys.stdout.isatty() or "COLUMNS" in os.environ else PLAIN_WIDTH


def plain_console(file: TextIO, width: int) -> "Console":
    """Return a console of `width` columns without markup: brackets in names are printed as they are."""
    from rich.console import Console

    return Console(file=file, width=width, markup=False, highlight=False, emoji=False)


def summary_console() -> "Console":
    """Return a console on the standard output."""
    return plain_console(sys.stdout, summary_width())


logger = logging.getLogger(__name__)

EVERY = 30.0  # s between lines where the error stream is no terminal


class Display(Watcher):
    """Progress on the error stream: the current stage, and a bar with the remaining time of an analysis."""

    def __init__(self) -> None:
        self._progress: Progress | None = None
        self._task: TaskID | None = None
        self._title = ""
        self._began = self._last_shown = time.monotonic()

    def __enter__(self) -> "Display":
        if sys.stderr.isatty() and is_first():
            from rich.console import Console
            from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeRemainingColumn

            columns = (SpinnerColumn(), TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
            self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
            self._progress.start()
            self._progress.console.show_cursor()  # for a kill leaves it as it is
        return self

    def __exit__(self, *error: object) -> None:
        if self._progress:
            self._progress.stop()

    def stage(self, title: str) -> None:
        """Show `title` in place of the last stage, with a pulse until a time is known."""
        logger.info("%s", title)
        self._title = title
        if self._progress is None:
            self._tell()
            return
        if self._task is not None:
            self._progress.remove_task(self._task)
        self._task = self._progress.add_task(title, total=None)

    def stopping(self, number: int) -> None:
        """Announce that the run is stopping."""
        super().stopping(number)
        # not by Python's streams, which the signal may have interrupted
        os.write(sys.stderr.fileno(), b"ffrobot: stopping, and keeping what was computed (again: not keeping it)\n")

    def advance(self, t: float, end: float) -> bool:
        """Update the bar to `t` of `end` (s, or a count), or print a line now and then; True: the run continues."""
        if self._progress is not None and self._task is not None:
            self._progress.update(self._task, completed=t, total=end)
        elif self._progress is None:
            self._tell(f", {t:.4g} of {end:g}")
        return True

    def _tell(self, reached: str = "") -> None:
        """A line on the error stream where the last one is long ago: nothing of short runs."""
        now = time.monotonic()
        if now - self._last_shown > EVERY and is_first():
            self._last_shown = now
            print(f"ffrobot: {self._title}{reached} ({now - self._began:.0f} s)", file=sys.stderr, flush=True)


def describe(error: Exception) -> str | None:
    """Return the message of an error of the user's input or the machine; None for a fault of ffrobot."""
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
    """Make standard output and error accept every character, and replace closed ones by the null device."""
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
    """Discard unprinted output after a broken pipe, so that Python does not retry at exit."""
    try:
        sys.stdout.flush()
    except OSError:
        discard(sys.stdout)
