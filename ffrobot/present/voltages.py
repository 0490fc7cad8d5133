"""The table of voltages in the summary of a solve."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from rich.table import Table

from ..actuation.patches.patches import PatchArray
from ..actuation.patches.voltages import Voltages
from .tables import plain_table


def voltage_table(found: Iterable[tuple[str, str, PatchArray, Voltages]]) -> Table:
    """Of analyses and layouts, by name, with their patches."""
    table = plain_table("voltages of", "on", "largest (V)", "limit (V)", "required /\nlimit", "condition\nnumber")
    for analysis, layout, patches, values in found:
        limit = patches.limit.min()
        table.add_row(
            analysis,
            layout,
            f"{values.largest:.0f}" if values.largest >= 1e3 else f"{values.largest:.3g}",
            "none" if limit == np.inf else f"{limit:g}",
            "" if limit == np.inf else f"{np.abs(values.required / patches.limit).max():.3g}",
            f"{patches.condition_number:.3g}",
        )
    return table
