"""The robot in space at selected times, seen from a corner: one metre is as long on all three axes."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

from ...common.arrays import Array
from ...mbs.fields.field_types import GROUND
from ...results.file import Results
from ..drawn_3d.shapes import Shape, line_shape
from ..motion import MovingBody, moving_bodies, visible_exaggeration
from .figure_file import FigureRecord
from .palette import COLORS
from .path import path_columns
from .style import SIZE, legend, shades

SCENE_SIZE = (1.3 * SIZE[0], 1.3 * SIZE[0])  # inches
VIEW = (25.0, -55.0)  # degrees: elevation and azimuth of the viewer
MARGIN = 0.04  # of the largest extent, around the robot
ZOOM = 0.86  # leaves room for the labels of the axes, which the layout of figures does not know of
GREY = "#8b95a3"


def draw_configurations_3d(figure: FigureRecord, results: Results) -> Figure:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, exaggerated, and the paths of points."""
    assert figure.analysis is not None
    outputs = results.time(figure.analysis)
    frames = np.array([int(np.argmin(np.abs(outputs - time))) for time in figure.times], dtype=np.intp)
    bodies, shift = moving_bodies(results, figure.analysis, frames)
    shapes = [line_shape(results, body, []) for body in bodies]
    s = figure.exaggeration or _exaggeration(bodies)
    picture = Figure(figsize=SCENE_SIZE, layout="constrained")
    axes = picture.add_subplot(projection="3d", computed_zorder=False)
    axes.set_title(figure.title + (f", deflections × {s:g}" if s != 1.0 and _moves(bodies) else ""), loc="left")
    drawn = [*_draw_paths(axes, figure.analysis, results), *_draw_ground(axes, results)]
    for k, color in enumerate(shades(len(frames))):
        for body, shape, carried in zip(bodies, shapes, shift, strict=True):
            drawn += _draw_body(axes, body, shape, carried, s, k, color)
        axes.plot([], [], [], color=color, linewidth=1.5, label=f"t = {outputs[frames[k]]:g} s")
    _equal_axes(axes, np.concatenate(drawn))
    legend(axes)
    return picture


def draw_path_3d(figure: FigureRecord, results: Results) -> Figure:
    """Draw every (x, y, z) dataset of `figure` as a path."""
    picture = Figure(figsize=SCENE_SIZE, layout="constrained")
    axes = picture.add_subplot(projection="3d")
    axes.set_title(figure.title, loc="left")
    paths = [path_columns(results, figure, curve, "xyz") for curve in figure.curves]
    for k, (curve, path) in enumerate(zip(figure.curves, paths, strict=True)):
        axes.plot(*path.T, color=COLORS[k % len(COLORS)], linewidth=1.0, label=curve.label)
    _equal_axes(axes, np.concatenate(paths) if paths else np.zeros((1, 3)))
    legend(axes)
    return picture


def _exaggeration(bodies: list[MovingBody]) -> float:
    points = np.concatenate([body.global_points.reshape(-1, 3) for body in bodies])
    largest = max((float(np.abs(body.deflection).max(initial=0.0)) for body in bodies), default=0.0)
    return visible_exaggeration(float(np.ptp(points, axis=0).max()) if len(points) else 0.0, largest)


def _moves(bodies: list[MovingBody]) -> bool:
    return any(body.deflection.any() for body in bodies)


def _draw_body(
    axes: Any, body: MovingBody, shape: Shape, carried: Array, s: float, k: int, color: Any  # noqa: ANN401
) -> list[Array]:  # fmt: skip
    """Its lines and the points where joints attach, at the k-th output; returns what was drawn, (n, 3)."""
    at = shape.placed(body, carried, s)[k]
    if shape.cells.shape[1] > 1:
        axes.add_collection3d(Line3DCollection(at[shape.cells], colors=[color], linewidths=1.5))
    ends = [i for i, name in enumerate(body.point_names) if not name.endswith(".mid")]
    turned = np.einsum("ij,kj->ki", body.axes[k], body.points + s * body.deflection[k])
    points = (body.position[k] + (s - 1.0) * carried[k] + turned)[ends]
    axes.plot(*points.T, "o", color=color, markersize=2.5)
    return [at, points]


def _draw_paths(axes: Any, analysis: str, results: Results) -> list[Array]:  # noqa: ANN401
    """Where the points of trajectories go, to scale."""
    drawn = []
    points = [trajectory["point"] for trajectory in results.scene.get("trajectory", []) if "point" in trajectory]
    for number, point in enumerate(dict.fromkeys(points)):
        path = results[f"{analysis}/points/{point}/position"]
        label = "path" if number == 0 else None
        axes.plot(*path.T, "--", color=COLORS[1], linewidth=0.8, label=label)
        drawn.append(path)
    return drawn


def _draw_ground(axes: Any, results: Results) -> list[Array]:  # noqa: ANN401
    joints = [joint for joint in results.scene.get("joint", []) if GROUND in joint["between"]]
    places = np.array([joint.get("at", (0.0, 0.0, 0.0)) for joint in joints], dtype=float).reshape(-1, 3)
    if len(places):
        axes.plot(*places.T, "^", color=GREY, markersize=6, label="ground")
    return [places]


def _equal_axes(axes: Any, points: Array) -> None:  # noqa: ANN401
    """Ranges that hold all points, a box as long as they are."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * max(float((high - low).max()), 1e-9)
    # an axis along which nothing is has a tenth of the largest extent, so that its box can be seen
    half = np.maximum(0.5 * (high - low) + margin, 0.1 * float((high - low).max()) + margin)
    middle = 0.5 * (low + high)
    for name, center, way in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(center - way, center + way)
        getattr(axes, f"set_{name}label")(f"{name} (m)", labelpad=5.0)
        axes.tick_params(axis=name, labelsize=7, pad=0)
        axes.locator_params(axis=name, nbins=max(2, int(5 * way / half.max())))
    axes.set_box_aspect(half, zoom=ZOOM)
    axes.set_proj_type("ortho")
    axes.view_init(*VIEW)
