"""Types of options, and options that commands which make many runs share."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TypeVar

import click

from ..common.outputs import protected
from ..common.parallel import processors
from ..present.logs import FILE

F = TypeVar("F", bound=Callable[..., object])

POSITIVE = click.FloatRange(0.0, min_open=True)


def runs_options(folder: str, of: str = "Folder") -> Callable[[F], F]:
    """Give a command `-j`, `--retry` and `-o`, by default `folder`; `of`: what is in it."""

    def add(command: F) -> F:
        for option in (
            click.option("-o", "--output", metavar="DIR", type=FILE, help=f"{of} [{folder} next to the input]."),
            click.option("--retry", is_flag=True, help="Repetition of failed runs."),
            click.option(
                "-j",
                "--processes",
                type=click.IntRange(1, 1000),
                default=processors,
                show_default="one for each processor",
                help="Number of parallel runs.",
            ),
        ):
            command = option(command)
        return command

    return add


def protect(paths: Iterable[Path]) -> None:
    """Write to none of these files as long as the command runs."""
    click.get_current_context().with_resource(protected(paths))
