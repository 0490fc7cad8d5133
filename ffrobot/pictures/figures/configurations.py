"""The robot at selected times, and the paths of points, on the axes of the scene."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.plane import in_3d
from ...results.file import Results
from ..markers import ground_places
from ..motion import MovingBody, moving_bodies, size_of, visible_exaggeration
from ..shapes import line_shape, surface_shape
from .figure_file import Curve, FigureRecord
from .palette import COLORS
from .scene_axes import SceneAxes
from .style import SIZE, legend, line_style, shades

SIZE_3D = (1.3 * SIZE[0], 1.3 * SIZE[0])  # inches
GREY = "#8b95a3"


def draw_configurations(figure: FigureRecord, results: Results) -> Figure:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, and the curves of `figure` as paths.

    Without curves, the paths of the points that have trajectories. Deflections are to scale in planar scenes, else as
    large as can be seen, unless the figure says otherwise.
    """
    assert figure.analysis is not None
    outputs, is_plane = results.time(figure.analysis), results.space.is_plane
    frames = np.array([int(np.argmin(np.abs(outputs - time))) for time in figure.times], dtype=np.intp)
    bodies, shift = moving_bodies(results, figure.analysis, frames)
    shapes = [(surface_shape if is_plane else line_shape)(results, body, []) for body in bodies]
    s = figure.exaggeration or (1.0 if is_plane else _visible(bodies))
    is_bent = any(body.deflection.any() for body in bodies)
    picture, axes = _new(results, figure.title + (f", deflections × {s:g}" if s != 1.0 and is_bent else ""))
    for label, path, style in _paths(figure, results):
        axes.plot(path, label=label, **style)
    axes.plot(ground_places([results.scene]), "^", color=GREY, markersize=6, label="ground")
    for k, color in enumerate(shades(len(frames))):
        for body, shape, carried in zip(bodies, shapes, shift, strict=True):
            axes.body(shape.placed(body, carried, s)[k], shape.cells, color)
            ends = [i for i, name in enumerate(body.point_names) if not name.endswith(".mid")]
            axes.plot(body.exaggerated(carried, s)[k, ends], "o", color=color, markersize=2.5)
        axes.axes.plot([], [], color=color, linewidth=1.5, label=f"t = {outputs[frames[k]]:g} s")
    axes.finish()
    legend(axes.axes)
    return picture


def draw_path(figure: FigureRecord, results: Results) -> Figure:
    """Draw every dataset of `figure`, (x, y) or (x, y, z), as a path."""
    picture, axes = _new(results, figure.title)
    for label, path, style in _curves(figure, results):
        axes.plot(path, label=label, **style)
    axes.finish(is_equal=False)
    legend(axes.axes)
    return picture


def _new(results: Results, title: str) -> tuple[Figure, SceneAxes]:
    picture = Figure(figsize=SIZE if results.space.is_plane else SIZE_3D, layout="constrained")
    axes = SceneAxes(picture, results.space)
    axes.axes.set_title(title, loc="left")
    return picture, axes


Path = tuple[str | None, Array, dict[str, object]]
"""Its label, its places (T, 3), m, and how the line looks."""


def _paths(figure: FigureRecord, results: Results) -> list[Path]:
    """Those of the figure, else those of the points that have trajectories, to scale."""
    if figure.curves:
        return _curves(figure, results)
    points = [trajectory["point"] for trajectory in results.scene.get("trajectory", []) if "point" in trajectory]
    style: dict[str, object] = {"color": COLORS[1], "linestyle": "--", "linewidth": 0.8}
    return [
        ("path" if number == 0 else None, in_3d(results[f"{figure.analysis}/points/{point}/position"]), style)
        for number, point in enumerate(dict.fromkeys(points))
    ]


def _curves(figure: FigureRecord, results: Results) -> list[Path]:
    return [
        (curve.label, path := _path(results, figure, curve), line_style(k, len(path)))
        for k, curve in enumerate(figure.curves)
    ]


def _path(results: Results, figure: FigureRecord, curve: Curve) -> Array:
    """(T, 3) of the dataset of a curve, which has as many columns as the scene has axes."""
    values, names = results.data(curve.data), [f"{'xyz'[axis]}" for axis in results.space.translations]
    if values.shape[1] != len(names):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected {"two" if len(names) == 2 else "three"} columns'
            f' ({", ".join(names)}) in "{curve.data}", found {values.shape[1]}'
        )
    return in_3d(values)


def _visible(bodies: list[MovingBody]) -> float:
    largest = max((float(np.abs(body.deflection).max(initial=0.0)) for body in bodies), default=0.0)
    return visible_exaggeration(size_of(bodies), largest)
