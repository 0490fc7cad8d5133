"""Named points: the curve of two goals, effects of keys and their scatter."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ..figures.palette import COLORS
from ..figures.style import new_axes
from .diagrams import Points

NAMED = 12  # the first: more hide each other


def draw_points(diagram: Points) -> Figure:
    """Points with their names or joined by a line; those that are not sure hollow."""
    figure, axes = new_axes(diagram.title)
    x, y = np.array(diagram.x), np.array(diagram.y)
    sure = np.array(diagram.sure or (True,) * len(x), dtype=bool)
    if diagram.joined:
        axes.plot(x, y, color=COLORS[0])
    if diagram.x_errors:
        axes.errorbar(x, y, xerr=diagram.x_errors, fmt="none", ecolor=COLORS[4], elinewidth=0.8)
    axes.plot(x[sure], y[sure], "o", color=COLORS[0])
    axes.plot(x[~sure], y[~sure], "o", color=COLORS[0], markerfacecolor="white")
    if diagram.named:
        for label, place in list(zip(diagram.labels, zip(x, y, strict=True), strict=True))[:NAMED]:
            left = place[0] > 0.5 * x.max()
            axes.annotate(
                label, place, (-4 if left else 4, 3), textcoords="offset points", fontsize=6,
                ha="right" if left else "left",
            )  # fmt: skip
        axes.set_xlim(left=0.0)
        axes.set_ylim(bottom=0.0)
        axes.margins(0.1)
    axes.set_xlabel(diagram.x_label)
    axes.set_ylabel(diagram.y_label)
    return figure
