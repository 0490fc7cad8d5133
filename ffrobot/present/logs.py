"""Logs of commands: `--verbose` on the error stream, `--log-file` with times in a file.

The library logs to loggers named as its modules, below "ffrobot", without handlers.
"""

import logging
import os
import platform
import re
import sys
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from typing import TextIO, TypeVar

import click

from ..common.errors import FfrobotWarning
from ..common.outputs import check_file_name, discard


class _FileName(click.Path):
    """The name of a file, there or not; what can be none is refused."""

    def convert(self, value: str | PathLike[str], param: click.Parameter | None, ctx: click.Context | None) -> Path:
        return check_file_name(os.fspath(value))


# Shared by all commands: click looks for a translation of each type's name.
FILE = _FileName(path_type=Path)
_LOG = click.Path(dir_okay=False, writable=True, path_type=Path)

F = TypeVar("F", bound=Callable[..., object])

VERBOSE = f"{__name__}.verbose"
"""Key in the metadata of a click context: whether `--verbose` is given."""

LOGGER = logging.getLogger("ffrobot")
LOGGER.addHandler(logging.NullHandler())


def together(*options: Callable[[F], F]) -> Callable[[F], F]:
    """Decorator: add several options to a command."""

    def add(command: F) -> F:
        for option in options:
            command = option(command)
        return command

    return add


def _allow_python(context: click.Context, parameter: click.Parameter, paths: tuple[Path, ...]) -> None:
    from ..common.python_files import allow_python

    allow_python(paths)


python_option = click.option(
    "--allow-python",
    metavar="PATH",
    multiple=True,
    type=click.Path(path_type=Path, exists=True),
    expose_value=False,
    callback=_allow_python,
    help="Run Python files that the scene names from here too [its own folder]; repeatable.",
)
"""Option of commands that solve scenes."""


def _verbose(context: click.Context, parameter: click.Parameter, verbose: bool) -> None:
    context.meta[VERBOSE] = verbose
    if verbose:
        handler = logging.StreamHandler()
        handler.addFilter(lambda record: record.levelno < logging.ERROR)  # the command prints its errors itself
        _add(handler, "%(message)s")


def _log_file(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    if path is None:
        return
    if not _is_log(path):
        raise click.BadParameter(f"expected a new file or a log, found {path}, a file of another kind")
    try:
        _add(_LogFile(path, encoding="utf-8"), "%(asctime)s %(levelname)s %(message)s")
    except OSError as error:
        raise click.BadParameter(f"cannot write {path}: {error.strerror}") from None
    from ..common.version import VERSION

    LOGGER.info("ffrobot %s, Python %s, %s", VERSION, platform.python_version(), platform.platform())
    LOGGER.info("%s", " ".join(sys.argv))


class _LogFile(logging.FileHandler):
    """A log that ends where it cannot be written, with one message: what it is about goes on."""

    def handleError(self, record: logging.LogRecord) -> None:
        error = sys.exc_info()[1]
        LOGGER.removeHandler(self)
        click.echo(
            f"ffrobot: {self.baseFilename}: log ends here: {getattr(error, 'strerror', None) or error}", err=True
        )
        assert self.stream is not None
        discard(self.stream)


def log_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Replace `warnings.showwarning`: warnings of libraries go to the log, those of ffrobot to the user."""
    if issubclass(category, FfrobotWarning):
        click.echo(f"ffrobot: {message}", err=True)
    LOGGER.info("%s line %d: %s: %s", filename, lineno, category.__name__, message)


def _is_log(path: Path) -> bool:
    """Whether lines may be added to `path`: a new file, an empty one, an earlier log, a device."""
    try:
        if path.is_symlink() and not path.exists():
            path.resolve(strict=True)
        if not path.is_file():
            return True
        with path.open("rb") as stream:
            return re.match(rb"$|\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} [A-Z]+ ", stream.read(80)) is not None
    except FileNotFoundError:
        return True
    except (OSError, RuntimeError):  # links in a circle, for one
        return False


def _add(handler: logging.Handler, layout: str) -> None:
    handler.setFormatter(logging.Formatter(layout))
    LOGGER.addHandler(handler)
    LOGGER.setLevel(logging.INFO)


logging_options = together(
    click.option(
        "--log-file", metavar="FILE", type=_LOG, expose_value=False, callback=_log_file, help="Append a log to FILE."
    ),
    click.option("-v", "--verbose", is_flag=True, expose_value=False, callback=_verbose, help="Verbose output."),
)
