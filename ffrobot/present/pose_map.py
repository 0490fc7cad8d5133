"""What `ffrobot map` prints: how far each quantity ranges over the grid, and where its worst pose is."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from rich.console import Console

from ..map.map_file import quantities
from ..map.pose_map import STATUS, PoseMap
from .lines import print_table


def print_map(found: PoseMap, console: Console) -> None:
    """A table of quantities: the worst and the best value with the poses; then how many poses there are."""
    console.print(f"{found.plan.point} over {' and '.join(axis.name for axis in found.plan.axes)}", soft_wrap=True)
    print_table(console, ("quantity", "worst", "at", "best", "at"), _rows(found))
    counts = ", ".join(f"{int((found.status == k).sum())} {name}" for k, name in enumerate(STATUS))
    console.print(f"poses      {counts}", soft_wrap=True)


def _rows(found: PoseMap) -> Iterator[tuple[str, ...]]:
    for quantity in quantities(found).values():
        if quantity.everywhere:
            yield quantity.title, quantity.everywhere, "everywhere", "", ""
        elif np.isfinite(quantity.values).any():
            ends = ((f"{quantity.values[k]:.4g}", _place(found, k)) for k in (quantity.worst, quantity.best))
            yield quantity.title, *(cell for end in ends for cell in end)


def _place(found: PoseMap, number: int) -> str:
    place = np.unravel_index(number, found.plan.shape)
    pairs = zip(found.plan.axes, place, strict=True)
    numbers = ((axis, axis.values[k]) for axis, k in pairs if len(axis.values) > 1)
    return ", ".join(f"{one:.3g} m" if axis.unit == "m" else f"{np.degrees(one):.3g}°" for axis, one in numbers)
