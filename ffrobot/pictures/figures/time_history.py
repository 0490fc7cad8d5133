"""Figures of curves: histories over time, torques over speed, and what patches reach along a link."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.image import NonUniformImage

from ...common.arrays import Array
from ...common.errors import InputError
from ...results.file import Results
from ..projection import COLORS, LIMIT
from .figure_file import Curve, FigureRecord
from .shared import curve_points, motor_limits, read_points
from .style import DASHES, legend, line_style, shades

MANY, OFTEN = 4, 0.2  # columns, and part of the time at limits, above which lines hide each other
NEAR = 1e-3  # of a limit: how close values are that are at it
SHADE = 0.25  # opacity
NAMED = 6  # columns: of more, the legend has the first and the last


def draw_time_history(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every curve of `figure` over time; a dataset with several columns as one shade for each.

    The times at which a value is at a limit are shaded.
    """
    for k, curve in enumerate(figure.curves):
        if curve.file is not None:
            time, values = read_points(curve.file, curve.data)
            (points,) = axes.plot(time, figure.scale * values, "x", color="black", markersize=5, label=curve.label)
            points.set(zorder=4, clip_on=figure.x_range is not None)
        else:
            _draw_columns(axes, curve, k, figure, results)
    axes.set_xlabel(figure.x_label)
    if not axes.images:
        for k, limit in enumerate(figure.limits):
            axes.axhline(limit, color=LIMIT, linestyle="--", label="limit" if k == 0 else None)
        axes.set_ylabel(figure.y_label)
        legend(axes)


def _draw_columns(axes: Axes, curve: Curve, k: int, figure: FigureRecord, results: Results) -> None:
    time, values = curve_points(results, curve, figure.scale)
    axes.margins(x=0)
    if is_crowded(values, figure.limits):
        _draw_map(axes, time, values, curve.label, figure)
        return
    if len(time) > 1 and (at := is_at_limit(values, figure.limits).any(axis=1)).any():
        label = None if axes.collections else "at a limit"
        look: dict[str, Any] = {"color": LIMIT, "alpha": SHADE, "linewidth": 0, "label": label}
        axes.fill_between(time, 0.0, 1.0, where=at, transform=axes.get_xaxis_transform(), **look)
    count = values.shape[1]
    if count == 1:
        axes.plot(time, values[:, 0], label=curve.label, **line_style(k, len(values), alone=len(figure.curves) == 1))
        return
    for column, color in enumerate(shades(count)):
        label = f"{curve.label} {column + 1}" if count <= NAMED or column in (0, count - 1) else None
        dashes = DASHES[column % len(DASHES)] if count <= MANY else "-"
        axes.plot(time, values[:, column], color=color, linestyle=dashes, linewidth=0.7, label=label)


def is_at_limit(values: Array, limits: tuple[float, ...]) -> Array:
    """Where values (T, n) are at one of the limits: (T, n). What goes beyond them passes them, and is at none."""
    near = np.isclose(values[..., None], limits or np.inf, rtol=NEAR, atol=0.0)
    is_within = np.abs(values).max(initial=0.0) <= (1.0 + NEAR) * np.abs(limits).max(initial=0.0)
    return np.asarray(near.any(axis=-1) & is_within)


def is_crowded(values: Array, limits: tuple[float, ...]) -> bool:
    """Whether many columns of values (T, n) go from limit to limit, so that the last line hides the others."""
    return values.shape[1] > MANY and bool(limits) and bool(is_at_limit(values, limits).mean() > OFTEN)


def _draw_map(axes: Axes, time: Array, values: Array, label: str, figure: FigureRecord) -> None:
    """A row for each column, in the color of its value: red at the upper limit, blue at the lower one."""
    count, limit = values.shape[1], max(map(abs, figure.limits))
    picture = NonUniformImage(axes, cmap="RdBu_r", extent=(time[0], time[-1], 0.5, count + 0.5))
    picture.set_data(time, np.arange(1, count + 1), values.T)
    picture.set_clim(-limit, limit)
    axes.add_image(picture)
    axes.set_xlim(time[0], time[-1])
    axes.set_ylim(0.5, count + 0.5)
    axes.set_yticks(range(1, count + 1))
    axes.grid(visible=False)
    axes.set_ylabel(label)
    axes.figure.colorbar(picture, ax=axes, label=figure.y_label)


def draw_torque_speed(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw every curve of `figure` over its `x`, and the limits of the motor of `figure.joint`."""
    for k, curve in enumerate(figure.curves):
        x, values = curve_points(results, curve, figure.scale)
        axes.plot(x, values[:, 0], label=curve.label, **line_style(k, len(x), alone=len(figure.curves) == 1))
    if len(limits := motor_limits(results, figure)):
        axes.plot(*limits.T, color=LIMIT, linestyle="--", label="limits")
    axes.set_xlabel(figure.x_label)
    axes.set_ylabel(figure.y_label)
    legend(axes)


def draw_placement(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Reach of a single patch along the link by mode; below, the patches found and those spread evenly."""
    group = f"{figure.analysis}/placement"
    if not results.has(group):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected an analysis of kind = "placement", found'
            f' "{figure.analysis}"'
        )
    body = results.attributes(group)["body"]
    length = next(layout["length"] for layout in results.scene["pzt"] if layout["body"] == body)
    centers, frequency = results[f"{group}/candidates"], results[f"{group}/frequency"]
    for reach, f, color in zip(results[f"{group}/candidate_reach"], frequency, shades(len(frequency)), strict=True):
        axes.plot(centers, reach, color=color, label=f"{f:.4g} Hz")
    for k, (key, label) in enumerate((("best", "found"), ("even", "evenly spaced"))):
        places = [(x - length / 2, length) for x in results[f"{group}/{key}/centers"]]
        axes.broken_barh(places, (-0.12 * (k + 1), 0.08), facecolor=COLORS[k], edgecolor="white", label=label)
    axes.set_yticks([0.0, 0.25, 0.5, 0.75, 1.0])
    axes.set_xlabel(f"distance along {body} (m)")
    axes.set_ylabel("controllability by one patch")
    legend(axes)
