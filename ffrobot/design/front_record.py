"""A front as a table, as CSV and as a picture."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from rich.console import Console

from ..common.files import write_atomically
from ..pictures.figures.palette import COLORS
from ..pictures.figures.plot import write_figure
from ..pictures.figures.style import literal, new_axes, style
from ..present.tables import plain_table
from .front import Front, FrontPoint


def print_front(found: Front, console: Console) -> None:
    """A line for each design: both goals, what the second one costs, the keys; how it was found."""
    price = " per ".join(unit or "1" for unit in found.units)
    table = plain_table(*map(_headed, found.goals, found.units), f"price ({price})", *found.keys, "")
    for one in found.points:
        cost = f"{-one.price:.4g}" if np.isfinite(one.price) else ""
        keys = [f"{value:.6g}" if isinstance(value, float) else str(value) for value in one.point]
        table.add_row(f"{one.goal:.6g}", f"{one.against:.6g}", cost, *keys, _state(one))
    console.print(table, highlight=False)
    how = f"{len(found.points)} designs by slsqp, {found.runs} runs with a tolerance of at most {found.tolerance:g}"
    console.print(f"\nhow        {how}", soft_wrap=True, markup=False, highlight=False)
    for one in found.points:
        if one.message and not one.converged:
            text = f"note       {found.goals[1]} {one.against:.6g}: {one.message}"
            console.print(text, soft_wrap=True, markup=False, highlight=False)


def write_front(found: Front, path: Path) -> None:
    """One line for each design, as CSV; `price` is ∂goal/∂against along the front."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*found.goals, "price", *found.keys, "converged", "feasible", "message"])
    for one in found.points:
        price = one.price if np.isfinite(one.price) else ""
        states = ("yes" if state else "no" for state in (one.converged, one.feasible))
        writer.writerow([one.goal, one.against, price, *one.point, *states, one.message])
    write_atomically(path, text.getvalue().encode(), "table of the front", ours=True)


def draw_front(found: Front, folder: Path) -> list[Path]:
    """The curve of both goals, designs that have not converged hollow, as PNG and PDF; the files written."""
    with style():
        return write_figure(literal(_figure(found)), folder, "front")


def _figure(found: Front) -> Figure:
    figure, axes = new_axes(f"{found.goals[0]} against {found.goals[1]}")
    goal, against = found.values.T
    axes.plot(against, goal, color=COLORS[0])
    filled = np.array([one.converged and one.feasible for one in found.points])
    axes.plot(against[filled], goal[filled], "o", color=COLORS[0])
    axes.plot(against[~filled], goal[~filled], "o", color=COLORS[0], markerfacecolor="white")
    axes.set_xlabel(_headed(found.goals[1], found.units[1]))
    axes.set_ylabel(_headed(found.goals[0], found.units[0]))
    return figure


def _headed(goal: str, unit: str) -> str:
    return f"{goal} ({unit})" if unit else goal


def _state(one: FrontPoint) -> str:
    return "beyond a limit" if not one.feasible else "" if one.converged else "not converged"
