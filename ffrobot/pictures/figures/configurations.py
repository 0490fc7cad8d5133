"""The robot in figures: at selected times with the paths of points, its mode shapes, and its frequency responses."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import in_3d
from ...results.file import Results
from ..motion import ground_places, largest_deflection, moving_bodies, size_of, visible_exaggeration
from ..projection import COLORS, FRONT, PLANE, SIDE, SPACE
from ..shapes import Shape, line_shape, surface_shape
from .shared import FigureRecord, check_part
from .style import SIZE, SceneAxes, legend, line_style, new_axes, shades

SIZE_3D = (2 * SIZE[0], 1.6 * SIZE[1])  # inches


def draw_configurations(figure: FigureRecord, results: Results) -> Figure:
    """Draw the bodies of an analysis at the outputs nearest to `figure.times`, with paths.

    Paths are the curves of `figure`, by default those of points with trajectories or tools. Deflections are to scale in
    planar scenes, else exaggerated for visibility. Postures between the first and the last are lines.
    """
    assert figure.analysis is not None
    outputs = results.time(figure.analysis)
    frames = np.array([int(np.argmin(np.abs(outputs - time))) for time in figure.times], dtype=np.intp)
    bodies = moving_bodies(results, figure.analysis, frames)
    largest = largest_deflection(bodies)
    s = figure.exaggeration or (1.0 if results.space.is_plane else visible_exaggeration(size_of(bodies), largest))
    exaggerated = f", deflections × {s:g}" if s != 1.0 and largest > 0.0 else ""
    places = np.concatenate([body.global_points for body in bodies], axis=1)
    picture, views = _new(results, figure.title + exaggerated, places)
    lines, surfaces = ([shape(results, body, []) for body in bodies] for shape in (line_shape, surface_shape))
    paths, ground, colors = list(_paths(figure, results)), ground_places([results.scene]), shades(len(frames))
    for axes in views:
        for label, path, style in paths:
            axes.plot(path, label=label, **style)
        if len(ground):  # else the robot floats
            axes.plot(ground, "^", color="#8b95a3", markersize=6, label="ground")
        for k, color in enumerate(colors):
            has_surface = axes is views[0] and k in (0, len(frames) - 1)
            for shape in surfaces if has_surface else lines:
                axes.body(shape.placed(s)[k], shape.cells, color)
                ends = [i for i, name in enumerate(shape.body.point_names) if not name.endswith(".mid")]
                axes.plot(shape.body.exaggerated(s)[k, ends], "o", color=color, markersize=2.5)
            axes.axes.plot([], [], color=color, linewidth=1.5, label=f"t = {outputs[frames[k]]:g} s")
        axes.finish()
    legend(views[0].axes)
    return picture


def draw_path(figure: FigureRecord, results: Results) -> Figure:
    """Draw every dataset of `figure`, (x, y) or (x, y, z), as a path."""
    curves = list(_paths(figure, results))
    picture, views = _new(results, figure.title, np.concatenate([path for _, path, _ in curves]))
    for axes in views:
        for label, path, style in curves:
            axes.plot(path, label=label, **style)
        axes.finish(is_equal=not results.space.is_plane)
    legend(views[0].axes)
    return picture


def _new(results: Results, title: str, points: Array) -> tuple[Figure, list[SceneAxes]]:
    """Views: one of planar scenes; of 3D ones from a corner, from above, and from the side that shows more.

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
        (grid[:, 0], title, SPACE),
        (grid[0, 1], "from above", PLANE),
        (grid[1, 1], name, level),
    ):
        views.append(SceneAxes(picture.add_subplot(place), view))
        views[-1].axes.set_title(heading, loc="left")
    return picture, views


def _paths(figure: FigureRecord, results: Results) -> Iterator[tuple[str | None, Array, dict[str, object]]]:
    """Labels, places (T, 3), m, and looks of the curves, else of the points that have trajectories or tools."""
    names = ["xyz"[axis] for axis in results.space.translations]
    for k, curve in enumerate(figure.curves):
        values = results.data(curve.data)
        if values.shape[1] != len(names):
            raise InputError(
                f'{results.path}: figure "{figure.name}": expected {"two" if len(names) == 2 else "three"} columns'
                f' ({", ".join(names)}) in "{curve.data}"',
                values.shape[1],
            )
        yield curve.label, in_3d(values), line_style(k, len(values))
    marked = [*results.scene.get("trajectory", []), *results.scene.get("tool", [])]
    points = dict.fromkeys(entry["point"] for entry in marked if "point" in entry)
    style: dict[str, object] = {"color": COLORS[1], "linestyle": "--", "linewidth": 0.8}
    for number, point in enumerate(points if not figure.curves else ()):
        yield "path" if number == 0 else None, in_3d(results[f"{figure.analysis}/points/{point}/position"]), style


DECADE_BELOW, MODES_SHOWN = 10.0, 8  # range: from a tenth of the lowest frequency to beyond the eighth
SHAPES, COLUMNS = 6, 3  # modes that are drawn at most, and beside each other
AMPLITUDE = 0.12  # of the robot's size: the largest displacement as drawn


def draw_bode(figure: FigureRecord, results: Results) -> Figure:
    """Draw magnitude (SI units of output over input) and phase of `figure.transfers` over the frequency."""
    assert figure.analysis is not None
    k = _nearest(results, figure)
    model = results.linear(figure.analysis)[k]
    frequency = results[f"{figure.analysis}/linear/frequency"][k]
    flexible = frequency[frequency > 0.0]
    first, last = (flexible[0], flexible[min(MODES_SHOWN, len(flexible)) - 1]) if len(flexible) else (1.0, 1.0)
    hertz = np.geomspace(first / DECADE_BELOW, 1.3 * last, 4000)
    picture = Figure(figsize=(2 * SIZE[0], 1.5 * SIZE[1]), layout="constrained")
    magnitude, phase = picture.subplots(2, 1, sharex=True, height_ratios=[2, 1])
    magnitude.set_title(figure.title, loc="left")
    sources, targets = (list(dict.fromkeys(names)) for names in zip(*figure.transfers, strict=True))
    responses = model.frequency_response(2 * np.pi * hertz, sources, targets)
    for (source, target), color in zip(figure.transfers, shades(len(figure.transfers)), strict=True):
        response = responses[:, targets.index(target), sources.index(source)]
        magnitude.loglog(hertz, np.abs(response), color=color, label=f"{source} → {target}", linewidth=0.9)
        phase.semilogx(hertz, np.degrees(np.angle(response)), color=color, linewidth=0.9)
    phase.margins(x=0)
    phase.set(yticks=[-180, -90, 0, 90, 180], xlabel="frequency (Hz)", ylabel="phase (°)")
    magnitude.set_ylabel(figure.y_label or "magnitude (SI)")
    legend(magnitude)
    return picture


def draw_robot_modes(figure: FigureRecord, results: Results) -> Figure:
    """Draw the lowest vibration modes of the robot in both directions, over its configuration (gray)."""
    assert figure.analysis is not None
    k, group = _nearest(results, figure), f"{figure.analysis}/linear"
    frequency = results[f"{group}/frequency"][k]
    shown = np.flatnonzero(frequency > 0.0)[:SHAPES]
    rows = max(1, -(-len(shown) // COLUMNS))
    picture = Figure(figsize=(2 * SIZE[0], (2.1 if results.space.is_plane else 2.6) * rows), layout="constrained")
    if not len(shown):
        picture.suptitle("no mode vibrates")
    shapes = [line_shape(results, body, []) for body in moving_bodies(results, figure.analysis, np.array([k]))]
    places = [shape.placed()[0] for shape in shapes]
    size = np.ptp(np.vstack(places), axis=0).max()
    for number, mode in enumerate(shown, 1):
        axes = SceneAxes(picture.add_subplot(rows, COLUMNS, number), PLANE if results.space.is_plane else SPACE)
        axes.axes.set_title(f"{mode + 1}: {frequency[mode]:.4g} Hz", loc="left")
        ways = [_way(results, f"{group}/modes", shape, k, int(mode)) for shape in shapes]
        scale = AMPLITUDE * size / max(np.linalg.norm(np.vstack(ways), axis=1).max(), 1e-300)
        for at, shape, way in zip(places, shapes, ways, strict=True):
            axes.body(at, shape.cells, "#9a9a9a", 0.8)
            for sign, color in zip((1.0, -1.0), shades(3)[:2], strict=True):
                axes.body(at + sign * scale * way, shape.cells, color, 1.2)
        axes.finish(label_size=6)
    return picture


def _way(results: Results, group: str, shape: Shape, k: int, mode: int) -> Array:
    """(p, 3) how the points of a body move in a mode: δR + δφ × A (x + Φ p) + A Φ δp, in global axes."""
    body, turning = shape.body, "angle" if results.space.is_plane else "rotation"
    d_position, turn, d_p = (results[f"{group}/{body.name}/{key}"][k, mode] for key in ("position", turning, "modal"))
    turn = np.array([0.0, 0.0, float(turn)]) if results.space.is_plane else turn
    arm = shape.placed()[0] - body.position[0]
    is_flexible = len(d_p) == shape.shapes.shape[2]  # bodies drawn through their points do not show it
    bent = body.turned((shape.shapes @ d_p)[None])[0] if is_flexible else np.zeros_like(arm)
    return in_3d(d_position) + np.cross(turn, arm) + bent


def _nearest(results: Results, figure: FigureRecord) -> int:
    """The output nearest to the figure's time. Raises `InputError` where the analysis has no linear model."""
    check_part(results, figure, "linear", "a linear analysis")
    outputs = results.time(f"{figure.analysis}/time")
    return int(np.abs(outputs - (figure.times[0] if figure.times else outputs[0])).argmin())
