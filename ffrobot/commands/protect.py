"""What commands read is not written to."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import click

from ..common.outputs import protected


def protect(paths: Iterable[Path]) -> None:
    """Write to none of these files as long as the command runs."""
    click.get_current_context().with_resource(protected(paths))
