"""Horizontal bars: tornado diagrams and shares."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import BarContainer
from matplotlib.figure import Figure

from ...common.arrays import Array, as_floats
from ..figures.palette import COLORS
from ..figures.style import legend
from .diagrams import Bars, Series

MOST = 15  # the largest
WIDTH, BAR, REST = 5.0, 0.22, 0.8  # inches: of the figure, of a bar, of title and axis
ROOM = 0.2  # of the axis, beside the longest bars: for their numbers


def draw_bars(diagram: Bars) -> Figure:
    """The first labels, on top the first of all."""
    labels, count = diagram.labels[:MOST], len(diagram.series)
    rows = max(1, len(labels)) * (1 if count == 1 else 0.8 * count)
    picture = Figure(figsize=(WIDTH, REST + BAR * (rows + (count > 1))), layout="constrained")
    axes = picture.subplots()
    axes.set_title(diagram.title, loc="left")
    height = 0.8 / count
    for k, series in enumerate(diagram.series):
        at = as_floats(np.arange(len(labels)) + (k - 0.5 * (count - 1)) * height)
        _label(axes, _bars(axes, diagram, series, at, height, COLORS[k]), series, "+" if diagram.signed else "")
    axes.margins(x=ROOM)
    axes.locator_params(axis="x", nbins=7)
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_axisbelow(True)
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(diagram.x_label)
    legend(axes)
    return picture


def _bars(axes: Axes, diagram: Bars, series: Series, at: Array, height: float, color: str) -> BarContainer:
    values = [value or 0.0 for value in series.values[:MOST]]
    colors = [COLORS[1] if diagram.signed and value < 0.0 else color for value in values]
    errors = list(series.errors[:MOST]) or None
    return axes.barh(
        at, values, height, xerr=errors, color=colors, label=series.label or None,
        error_kw={"elinewidth": 0.7, "capsize": 1.5},
    )  # fmt: skip


def _label(axes: Axes, bars: BarContainer, series: Series, sign: str) -> None:
    """The number of each bar at its end."""
    numbers = [_number(value, sign) for value in series.values[:MOST]]
    axes.bar_label(bars, numbers, padding=2, fontsize=7)


def _number(value: float | None, sign: str) -> str:
    return "none" if value is None else f"{value:{sign}.3g}".replace("-", "−") if value else "0"
