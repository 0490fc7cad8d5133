"""A front as a table and as CSV."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.files import write_atomically
from ..common.tables import TableWriter
from ..present.tables import print_table
from .front import Front, FrontPoint
from .study_parts import with_unit


def print_front(found: Front, console: Console) -> None:
    """A line for each design: both goals, what the second one costs, the keys; how it was found."""
    print_table(console, front_headings(found), front_rows(found))
    for line in front_remarks(found):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def front_headings(found: Front) -> tuple[str, ...]:
    """Of the columns of `front_rows`."""
    price = " per ".join(unit or "1" for unit in found.units)
    return (*map(with_unit, found.goals, found.units), f"price ({price})", *found.keys, "")


def front_rows(found: Front) -> Iterator[tuple[str, ...]]:
    """Of each design both goals, what one unit less of the second costs, the keys, and what is not as it should be."""
    for one in found.points:
        cost = f"{-one.price:.4g}" if np.isfinite(one.price) else ""
        keys = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in one.point]
        yield (f"{one.goal:.6g}", f"{one.against:.6g}", cost, *keys, _state(one))


def front_remarks(found: Front) -> Iterator[str]:
    """How it was found, and what to mind."""
    how = f"{len(found.points)} designs by slsqp, {found.runs} runs with a tolerance of at most {found.tolerance:g}"
    yield f"how        {how}"
    for one in found.points:
        if one.message and not one.converged:
            yield f"note       {found.goals[1]} {one.against:.6g}: {one.message}"


def write_front(found: Front, path: Path) -> None:
    """One line for each design, as CSV; `price` is ∂goal/∂against along the front."""
    text = io.StringIO()
    writer = TableWriter(text)
    writer.writerow([*found.goals, "price", *found.keys, "converged", "feasible", "message"])
    for one in found.points:
        price = one.price if np.isfinite(one.price) else ""
        states = ("yes" if state else "no" for state in (one.converged, one.feasible))
        writer.writerow([one.goal, one.against, price, *one.point, *states, one.message])
    write_atomically(path, text.getvalue().encode(), "table of the front", ours=True)


def _state(one: FrontPoint) -> str:
    return "beyond a limit" if not one.feasible else "" if one.converged else "not converged"
