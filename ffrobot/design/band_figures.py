"""Histories with the band that keys which are spread make of them."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from ..pictures.figures.palette import COLORS
from ..pictures.figures.plot import write_figure
from ..pictures.figures.style import legend, literal, new_axes, style
from .uncertainty import Band, Uncertainty
from .uncertainty_record import NAMES, file_name


def write_bands(found: Uncertainty, folder: Path) -> list[Path]:
    """A figure for each history, as PNG and PDF; the files written."""
    written: list[Path] = []
    with style():
        for band in found.bands:
            written += write_figure(literal(draw_band(band)), folder, f"band_{file_name(band.name)}")
    return written


def draw_band(band: Band) -> Figure:
    """From the lowest to the highest quantile, the median, and the history with all keys in the middle."""
    figure, axes = new_axes(band.name)
    low, median, high = band.statistics.quantiles
    axes.fill_between(
        band.time, low, high, color=COLORS[4], alpha=0.45, linewidth=0.0, label=f"{NAMES[0]} to {NAMES[-1]}"
    )
    axes.plot(band.time, median, color=COLORS[0], label="median")
    axes.plot(band.time, band.nominal, color=COLORS[6], linestyle=":", label="keys in the middle")
    axes.set_xlabel("Time (s)")
    axes.set_ylabel(f"({band.unit})" if band.unit else "")
    axes.margins(x=0.0)
    legend(axes)
    return figure
