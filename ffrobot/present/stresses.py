"""The table of largest stresses in the summary of a solve."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rich.table import Table

from ..common.arrays import Array
from ..mbs.quantities.stress import BodyStress
from .tables import plain_table


def stress_table(analyses: Iterable[tuple[str, Array, Mapping[str, BodyStress]]]) -> Table:
    """Of each analysis its name, times (T,) in s, and stresses by body."""
    table = plain_table("stress in", "of", "largest von Mises (MPa)", "at", "t (s)", "by")
    for name, time, stresses in analyses:
        for body, stress in stresses.items():
            value, k, place = stress.largest()
            table.add_row(name, body, f"{value / 1e6:.4g}", place, f"{time[k]:g}", stress.recovery.method)
    return table
