"""The standard output as a console; importing this loads nothing of an analysis."""

from __future__ import annotations

import os
import sys
from shutil import get_terminal_size
from typing import TYPE_CHECKING, TextIO

if TYPE_CHECKING:
    from rich.console import Console

PLAIN_WIDTH = 120  # columns where the output is no terminal


def summary_width() -> int:
    """Columns of the terminal, or those of the variable COLUMNS; output to a file is not squeezed into 80."""
    return get_terminal_size().columns if sys.stdout.isatty() or "COLUMNS" in os.environ else PLAIN_WIDTH


def plain_console(file: TextIO, width: int) -> Console:
    """A console of so many columns; names in a scene are no markup."""
    from rich.console import Console

    return Console(file=file, width=width, markup=False, highlight=False, emoji=False)


def summary_console() -> Console:
    """The standard output."""
    return plain_console(sys.stdout, summary_width())
