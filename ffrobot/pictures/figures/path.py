"""Paths of points in the plane."""

from __future__ import annotations

from matplotlib.axes import Axes

from ...common.arrays import Array
from ...common.errors import InputError
from ...results.file import Results
from .figure_file import Curve, FigureRecord
from .style import legend, line_style


def draw_path(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every (x, y) dataset of `figure` as a path, with a legend."""
    draw_paths(axes, figure, results)
    legend(axes)


def draw_paths(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every (x, y) dataset of `figure` as a path, and label the axes."""
    for k, curve in enumerate(figure.curves):
        values = path_columns(results, figure, curve, "xy")
        axes.plot(*values.T, label=curve.label, **line_style(k, len(values)))
    axes.set_xlabel("x (m)")
    axes.set_ylabel(figure.y_label or "y (m)")


def path_columns(results: Results, figure: FigureRecord, curve: Curve, columns: str) -> Array:
    """The dataset of a curve with exactly these columns, "xy" or "xyz": (T, 2) or (T, 3)."""
    values = results.data(curve.data)
    if values.shape[1] != len(columns):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected {"two" if len(columns) == 2 else "three"} columns'
            f' ({", ".join(columns)}) in "{curve.data}", found {values.shape[1]}'
        )
    return values
