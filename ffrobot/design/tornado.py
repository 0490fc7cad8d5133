"""Tornado diagrams: how many percent a goal changes with one percent of each key, the largest on top."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..pictures.figures.palette import COLORS
from ..pictures.figures.plot import write_figure
from ..pictures.figures.style import literal, style
from .record import Sensitivity, ranked

BARS = 15  # the largest
WIDTH, BAR, REST = 5.0, 0.22, 0.8  # inches: of the figure, of a bar, of title and axis
ROOM = 0.2  # of the axis, beside the longest bars: for their numbers


def write_tornados(found: Sensitivity, folder: Path) -> list[Path]:
    """A figure for each goal, as PNG and PDF; the files written."""
    written: list[Path] = []
    with style():
        for g, goal in enumerate(found.goals):
            name = "tornado_" + re.sub(r"\W+", "_", goal).strip("_")
            written += write_figure(literal(draw_tornado(found, g)), folder, name)
    return written


def draw_tornado(found: Sensitivity, g: int) -> Figure:
    """Bars of percent per percent of goal g, keys without one left out."""
    known = [k for k in ranked(found, g) if np.isfinite(found.logarithmic[g, k])][:BARS]
    values = found.logarithmic[g, known]
    picture = Figure(figsize=(WIDTH, REST + BAR * max(1, len(known))), layout="constrained")
    axes = picture.subplots()
    reading = found.readings[g]
    axes.set_title(f"{found.goals[g]}: {reading.value:.5g} {reading.unit}".rstrip(), loc="left")
    bars = axes.barh(range(len(known)), values, color=[COLORS[0] if value >= 0.0 else COLORS[1] for value in values])
    numbers = [f"{value:+.3g}".replace("-", "−") if value else "0" for value in values]
    axes.bar_label(bars, numbers, padding=2, fontsize=7)
    axes.margins(x=ROOM)
    axes.locator_params(axis="x", nbins=7)
    axes.set_yticks(range(len(known)), [found.keys[k] for k in known])
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_axisbelow(True)
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel("change of the goal (%) with +1 % of the key")
    return picture
