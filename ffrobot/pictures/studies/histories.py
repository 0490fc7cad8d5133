"""Bands over time, and the goal of one design after the other."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from ...common.arrays import Array, as_floats
from ..figures.palette import COLORS
from ..figures.style import legend, new_axes
from .diagrams import Band, Progress
from .looks import LOOKS


def draw_band(band: Band) -> Figure:
    """The worst case behind the band, the median, and the history all parameters at nominal values."""
    figure, axes = new_axes(band.title)
    axes.fill_between(
        band.time, band.lowest, band.highest, color=COLORS[5], alpha=0.3, linewidth=0.0, label=band.worst_label
    )
    axes.fill_between(band.time, band.low, band.high, color=COLORS[4], alpha=0.7, linewidth=0.0, label=band.band_label)
    axes.plot(band.time, band.median, color=COLORS[0], label="median")
    axes.plot(band.time, band.nominal, color=COLORS[6], linestyle=":", label="nominal values")
    axes.set_xlabel("Time (s)")
    axes.set_ylabel(band.y_label)
    axes.margins(x=0.0)
    legend(axes)
    return figure


def draw_progress(diagram: Progress) -> Figure:
    """A mark for each design, by its state, and the best so far as a line; of failed ones at the lower edge."""
    figure, axes = new_axes(diagram.title)
    number = np.arange(len(diagram.values))
    values = _numbers(diagram.values)
    axes.plot(number, _numbers(diagram.best), color=COLORS[0], drawstyle="steps-post", label="best so far")
    for state, look in LOOKS.items():
        mine = np.array([one == state for one in diagram.states])
        if state == "failed" and mine.any():
            axes.plot(
                number[mine], np.full(mine.sum(), 0.02), look.marker, color=look.color, label=look.label,
                transform=axes.get_xaxis_transform(),
            )  # fmt: skip
        elif mine.any():
            axes.plot(number[mine], values[mine], look.marker, color=look.color, label=look.label, zorder=3)
    if diagram.logarithmic:
        axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("design, in the order of the search")
    axes.set_ylabel(diagram.y_label)
    legend(axes)
    return figure


def _numbers(values: tuple[float | None, ...]) -> Array:
    return as_floats(np.array([np.nan if value is None else value for value in values]))
