"""The robot at selected times."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import PathPatch

from ...common.arrays import Array
from ...results.file import Results
from ..drawn_body import drawn_bodies
from ..outline import points_outline
from .figure_file import FigureRecord
from .filled import closed_path
from .path import draw_paths
from .style import legend, shades


def draw_configurations(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, with the curves of `figure` as paths."""
    analysis = figure.analysis
    draw_paths(axes, figure, results)
    assert analysis is not None
    outputs = results.time(f"{analysis}/time")
    frames = np.abs(outputs[:, None] - figure.times).argmin(axis=0)
    bodies = drawn_bodies(results, analysis, frames, [])
    for k, color in enumerate(shades(len(frames))):
        label: str | None = f"t = {outputs[frames[k]]:g} s"
        for body in bodies:
            corners = body.corners(k)
            if body.outline.filled:
                axes.add_patch(PathPatch(closed_path(corners), facecolor=color, alpha=0.2, linewidth=0.0))
            axes.plot(*corners.T, color=color, linewidth=0.8 if body.outline.filled else 1.5, label=label)
            axes.plot(*body.joints(k).T, "o", color=color, markersize=3)
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
