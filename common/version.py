"""The version of the program, as installed."""

from __future__ import annotations

from functools import cache


@cache
def program_version() -> str:
    """As files and reports state it. Read where it is asked for: the lookup takes longer than importing the package."""
    from importlib.metadata import version

    return version("ffrobot")
