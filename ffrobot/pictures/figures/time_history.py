"""Figures over time: motion, deflections, forces, moments, voltages."""

from __future__ import annotations

from matplotlib.axes import Axes

from ...results.file import Results
from .figure_file import Curve, FigureRecord
from .palette import COLORS
from .reading import curve_points, read_points
from .style import legend, line_style, shades


def draw_time_history(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every curve of `figure` over time; a dataset with several columns as one shade for each."""
    for k, curve in enumerate(figure.curves):
        if curve.file is not None:
            time, values = read_points(curve.file, curve.data)
            axes.plot(time, values, "x", color="black", markersize=5, zorder=4, label=curve.label)
        else:
            _draw_columns(axes, curve, k, figure, results)
    for k, limit in enumerate(figure.limits):
        axes.axhline(limit, color=COLORS[1], linestyle="--", label="limit" if k == 0 else None)
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    legend(axes)


def _draw_columns(axes: Axes, curve: Curve, k: int, figure: FigureRecord, results: Results) -> None:
    time, values = curve_points(results, curve, figure.scale)
    axes.margins(x=0)
    if values.shape[1] == 1:
        axes.plot(time, values[:, 0], label=curve.label, **line_style(k, len(values), alone=len(figure.curves) == 1))
        return
    for column, color in enumerate(shades(values.shape[1])):
        axes.plot(time, values[:, column], color=color, linewidth=0.7, label=f"{curve.label} {column + 1}")
