"""The robot at selected times, and the paths of points, on the axes of the scene."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import in_3d
from ...results.file import Results
from ..markers import ground_places
from ..motion import MovingBody, moving_bodies, size_of, visible_exaggeration
from ..projection import FRONT, PLANE, SIDE, SPACE
from ..shapes import line_shape, surface_shape
from .figure_file import Curve, FigureRecord
from .palette import COLORS
from .scene_axes import SceneAxes
from .style import SIZE, legend, line_style, new_axes, shades

SIZE_3D = (2 * SIZE[0], 1.6 * SIZE[1])  # inches
GREY = "#8b95a3"


def draw_configurations(figure: FigureRecord, results: Results) -> Figure:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, and the curves of `figure` as paths.

    Without curves, the paths of the points that have trajectories or tools. Deflections are to scale in planar scenes,
    else as large as can be seen, unless the figure says otherwise. Postures between the first and the last are lines.
    """
    assert figure.analysis is not None
    outputs = results.time(figure.analysis)
    frames = np.array([int(np.argmin(np.abs(outputs - time))) for time in figure.times], dtype=np.intp)
    bodies, shift = moving_bodies(results, figure.analysis, frames)
    s = figure.exaggeration or (1.0 if results.space.is_plane else _visible(bodies))
    is_bent = any(body.deflection.any() for body in bodies)
    exaggerated = f", deflections × {s:g}" if s != 1.0 and is_bent else ""
    places = np.concatenate([body.global_points for body in bodies], axis=1)
    picture, views = _new(results, figure.title + exaggerated, places)
    lines, surfaces = ([shape(results, body, []) for body in bodies] for shape in (line_shape, surface_shape))
    paths, ground, colors = _paths(figure, results), ground_places([results.scene]), shades(len(frames))
    for axes in views:
        for label, path, style in paths:
            axes.plot(path, label=label, **style)
        axes.plot(ground, "^", color=GREY, markersize=6, label="ground")
        for k, color in enumerate(colors):
            has_surface = axes is views[0] and k in (0, len(frames) - 1)
            for body, shape, carried in zip(bodies, surfaces if has_surface else lines, shift, strict=True):
                axes.body(shape.placed(body, carried, s)[k], shape.cells, color)
                ends = [i for i, name in enumerate(body.point_names) if not name.endswith(".mid")]
                axes.plot(body.exaggerated(carried, s)[k, ends], "o", color=color, markersize=2.5)
            axes.axes.plot([], [], color=color, linewidth=1.5, label=f"t = {outputs[frames[k]]:g} s")
        axes.finish()
    legend(views[0].axes)
    return picture


def draw_path(figure: FigureRecord, results: Results) -> Figure:
    """Draw every dataset of `figure`, (x, y) or (x, y, z), as a path."""
    curves = _curves(figure, results)
    picture, views = _new(results, figure.title, np.concatenate([path for _, path, _ in curves]))
    for axes in views:
        for label, path, style in curves:
            axes.plot(path, label=label, **style)
        axes.finish(is_equal=not results.space.is_plane)
    legend(views[0].axes)
    return picture


def _new(results: Results, title: str, points: Array) -> tuple[Figure, list[SceneAxes]]:
    """Of planar scenes one view; of 3D ones from a corner, and, to tell depth, from above and from where more is seen.

    `points` (…, 3), m, are those to be drawn.
    """
    if results.space.is_plane:
        picture, axes = new_axes(title)
        return picture, [SceneAxes(axes, PLANE)]
    picture = Figure(figsize=SIZE_3D, layout="constrained")
    grid = picture.add_gridspec(2, 2, width_ratios=[1.7, 1.0])
    extent = np.ptp(points.reshape(-1, 3), axis=0)
    level, name = (FRONT, "from the front") if extent[0] >= extent[1] else (SIDE, "from the side")
    views = []
    for place, heading, view in (
        (grid[:, 0], title, SPACE), (grid[0, 1], "from above", PLANE), (grid[1, 1], name, level),
    ):  # fmt: skip
        views.append(SceneAxes(picture.add_subplot(place), view))
        views[-1].axes.set_title(heading, loc="left")
    return picture, views


Path = tuple[str | None, Array, dict[str, object]]
"""Its label, its places (T, 3), m, and how the line looks."""


def _paths(figure: FigureRecord, results: Results) -> list[Path]:
    """Those of the figure, else those of the points that have trajectories or tools, to scale."""
    if figure.curves:
        return _curves(figure, results)
    marked = [*results.scene.get("trajectory", []), *results.scene.get("tool", [])]
    points = [entry["point"] for entry in marked if "point" in entry]
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
