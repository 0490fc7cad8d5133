"""The robot at selected times."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ...common.arrays import Array
from ...results.file import Results
from ..outline import points_outline
from .figure_file import FigureRecord
from .path import draw_paths
from .style import legend, shades


def draw_configurations(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, with the curves of `figure` as paths."""
    analysis = figure.analysis
    draw_paths(axes, figure, results)
    outputs = results.time(f"{analysis}/time")
    for time, color in zip(figure.times, shades(len(figure.times)), strict=True):
        k = int(np.argmin(np.abs(outputs - time)))
        label: str | None = f"t = {outputs[k]:g} s"
        for body in results.names(f"{analysis}/bodies"):
            shape, ends = body_shape(results, f"{analysis}/points", body, k)
            axes.plot(*shape.T, color=color, linewidth=1.5, label=label)
            axes.plot(*ends.T, "o", color=color, markersize=3)
            label = None
    axes.set_aspect("equal", adjustable="datalim")
    legend(axes)


def body_shape(results: Results, points: str, body: str, k: int) -> tuple[Array, Array]:
    """Outline (m, 2) of a body at output k and the points (n, 2) where joints attach, in global axes (m).

    The shape is that of `points_outline`.
    """
    names = {name.removeprefix(f"{body}."): name for name in results.names(points) if name.startswith(f"{body}.")}
    at = {label: results.data(f"{points}/{name}/position")[k] for label, name in names.items()}
    ends = np.array([position for label, position in at.items() if label != "mid"]).reshape(-1, 2)
    still = np.zeros((1, len(at), 2))
    return points_outline(list(at), np.array(list(at.values())).reshape(-1, 2), still).at, ends
