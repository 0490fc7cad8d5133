"""Paths of points in the plane."""

from __future__ import annotations

from matplotlib.axes import Axes

from ...common.errors import InputError
from ...results.file import Results
from .figure_file import FigureRecord
from .style import legend, line_style


def draw_path(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every (x, y) dataset of `figure` as a path, with a legend."""
    draw_paths(axes, figure, results)
    legend(axes)


def draw_paths(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every (x, y) dataset of `figure` as a path, and label the axes."""
    for k, curve in enumerate(figure.curves):
        values = results.data(curve.data)
        if values.shape[1] != 2:
            raise InputError(
                f'{results.path}: figure "{figure.name}": expected two columns (x, y) in "{curve.data}", found'
                f" {values.shape[1]}"
            )
        axes.plot(*values.T, label=curve.label, **line_style(k, len(values)))
    axes.set_xlabel("x (m)")
    axes.set_ylabel(figure.y_label or "y (m)")
