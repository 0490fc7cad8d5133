"""Parallel coordinates of designs: a line for each, the best one on top; failed ones end where goals would begin."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ...common.arrays import Array
from .diagrams import LOOKS, Axis, Look, Parallel, wrapped

WIDTH, HEIGHT = 1.25, 3.4  # inches: of an axis, of the figure
LETTERS, LINE = 18, 9  # of a name, in a line; points that a line takes
FAINT = 0.35  # opacity of many lines


def draw_parallel(diagram: Parallel) -> Figure:
    """Axes side by side."""
    count = len(diagram.axes)
    figure = Figure(figsize=(max(3.5, WIDTH * (count + 0.3)), HEIGHT), layout="constrained")
    axes = figure.subplots()
    lines = max(len(wrapped(axis.label, LETTERS)) for axis in diagram.axes)
    axes.set_title(diagram.title, loc="left", pad=8 + LINE * lines)
    axes.set_axis_off()
    axes.set_xlim(-0.35, count - 0.75)
    axes.set_ylim(-0.03, 1.03)
    places = np.column_stack([axis.places for axis in diagram.axes])
    for state, look in LOOKS.items():
        for row in (k for k, one in enumerate(diagram.states) if one == state):
            _line(axes, places[row], look, FAINT if state == "kept" and len(places) > 30 else 1.0)
    for k, axis in enumerate(diagram.axes):
        _axis(axes, k, axis)
    present = {state: look for state, look in LOOKS.items() if state in diagram.states}
    samples = [
        Line2D(
            [], [], color=look.color, linestyle=look.dash, linewidth=look.width,
            label=diagram.best_label if state == "best" else look.label,
        )
        for state, look in present.items()
    ]  # fmt: skip
    if any(axis.limit is not None for axis in diagram.axes):
        samples.append(Line2D([], [], linewidth=1.6, label="limit, pointing beyond it", **_beyond(1)))
    figure.legend(handles=samples, loc="outside lower center", ncols=len(samples))
    return figure


def _line(axes: Axes, places: Array, look: Look, opacity: float) -> None:
    """As far as its values are known, with a mark where they end."""
    known = np.isfinite(places)
    x = np.flatnonzero(known)
    axes.plot(x, places[known], look.dash, color=look.color, linewidth=look.width, alpha=opacity, clip_on=False)
    if not known.all() and x.size:
        axes.plot(x[-1], places[x[-1]], look.marker, color=look.color, markersize=4)


def _axis(axes: Axes, k: int, axis: Axis) -> None:
    """A vertical line with ticks at its left and its name above; a limit as a mark to the side that is forbidden."""
    axes.plot([k, k], [0.0, 1.0], color="black", linewidth=0.8, clip_on=False)
    for place, text in axis.ticks:
        axes.plot([k - 0.02, k], [place, place], color="black", linewidth=0.6, clip_on=False)
        axes.text(
            k - 0.035, place, text, ha="right", va="center", fontsize=6,
            bbox={"facecolor": "white", "alpha": 0.7, "linewidth": 0.0, "pad": 0.5},
        )  # fmt: skip
    axes.text(k, 1.05, "\n".join(wrapped(axis.label, LETTERS)), ha="center", va="bottom", fontsize=7)
    if axis.limit is not None:
        place = float(axis.place(np.array(axis.limit)))
        axes.plot([k, k + 0.1], [place, place], color="black", linewidth=1.6)
        axes.plot(k + 0.1, place, **_beyond(axis.sense))


def _beyond(sense: int) -> dict[str, Any]:
    """The mark of a limit, which points to the side that is forbidden."""
    return {"marker": "^" if sense > 0 else "v", "color": "black", "markersize": 4}
