"""Moment of a motor over its speed, with what it can do."""

from __future__ import annotations

from matplotlib.axes import Axes

from ...results.file import Results
from ..torque_speed import limit_curves, limits_of
from .figure_file import FigureRecord
from .palette import COLORS
from .reading import curve_points
from .style import legend, line_style


def draw_torque_speed(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every curve of `figure` over its `x`, and the limits of the motor of `figure.joint`."""
    assert figure.joint is not None
    speed = moment = 0.0
    for k, curve in enumerate(figure.curves):
        x, values = curve_points(results, curve, figure.scale)
        axes.plot(x, values[:, 0], label=curve.label, **line_style(k, len(x), alone=len(figure.curves) == 1))
        speed, moment = max(speed, float(abs(x).max())), max(moment, float(abs(values).max()))
    limits = limit_curves(limits_of(results, figure.joint, [curve.data for curve in figure.curves]), speed, moment)
    if len(limits):
        axes.plot(*limits.T, color=COLORS[1], linestyle="--", label="limits")
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    legend(axes)
