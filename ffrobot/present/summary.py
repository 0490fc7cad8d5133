"""Where summaries are printed."""

from __future__ import annotations

import sys

from rich.console import Console

PLAIN_WIDTH = 120  # columns where the output is no terminal


def summary_console() -> Console:
    """The standard output; names in a scene are no markup, and what goes to a file is not squeezed into 80 columns."""
    width = None if sys.stdout.isatty() else PLAIN_WIDTH
    return Console(width=width, markup=False, highlight=False, emoji=False)
