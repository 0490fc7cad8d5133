"""Figures of linear models: frequency responses, and the mode shapes of the robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import in_3d
from ...results.file import Results
from ..motion import MovingBody, moving_bodies
from ..projection import PLANE, SPACE
from ..shapes import Shape, line_shape
from .figure_file import FigureRecord
from .scene_axes import SceneAxes
from .style import SIZE, legend, shades

POINTS = 4000  # of a frequency response
DECADE_BELOW, MODES_SHOWN = 10.0, 8  # range: from a tenth of the lowest frequency to beyond the eighth
SHAPES, COLUMNS = 6, 3  # modes that are drawn at most, and beside each other
AMPLITUDE = 0.12  # of the robot's size: the largest displacement as drawn
GHOST = "#9a9a9a"


def draw_bode(figure: FigureRecord, results: Results) -> Figure:
    """Magnitude (SI units of output over input) and phase of `figure.transfers` over the frequency, at one time."""
    assert figure.analysis is not None
    k = _nearest(results, figure)
    model = results.linear(figure.analysis)[k]
    frequency = results[f"{figure.analysis}/linear/frequency"][k]
    flexible = frequency[frequency > 0.0]
    first, last = (flexible[0], flexible[min(MODES_SHOWN, len(flexible)) - 1]) if len(flexible) else (1.0, 1.0)
    hertz = np.geomspace(first / DECADE_BELOW, 1.3 * last, POINTS)
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
    phase.set_yticks([-180, -90, 0, 90, 180])
    phase.set_xlabel("frequency (Hz)")
    phase.set_ylabel("phase (°)")
    magnitude.set_ylabel(figure.y_label or "magnitude (SI)")
    legend(magnitude)
    return picture


def draw_robot_modes(figure: FigureRecord, results: Results) -> Figure:
    """The lowest modes of the robot that vibrate, over its configuration (grey), in both directions."""
    assert figure.analysis is not None
    k = _nearest(results, figure)
    frequency = results[f"{figure.analysis}/linear/frequency"][k]
    shown = np.flatnonzero(frequency > 0.0)[:SHAPES]
    rows = max(1, -(-len(shown) // COLUMNS))
    picture = Figure(figsize=(2 * SIZE[0], (2.1 if results.space.is_plane else 2.6) * rows), layout="constrained")
    if not len(shown):
        picture.suptitle("no mode vibrates")
    bodies, _ = moving_bodies(results, figure.analysis, np.array([k]))
    shapes = [line_shape(results, body, []) for body in bodies]
    for place, mode in enumerate(shown, 1):
        axes = SceneAxes(picture.add_subplot(rows, COLUMNS, place), PLANE if results.space.is_plane else SPACE)
        axes.axes.set_title(f"{mode + 1}: {frequency[mode]:.4g} Hz", loc="left")
        group = f"{figure.analysis}/linear/modes"
        ways = [_way(results, group, body, shape, k, int(mode)) for body, shape in zip(bodies, shapes, strict=True)]
        _draw_mode(axes, [shape.placed(body)[0] for body, shape in zip(bodies, shapes, strict=True)], shapes, ways)
        axes.finish(label_size=6)
    return picture


def _draw_mode(axes: SceneAxes, places: Sequence[Array], shapes: Sequence[Shape], ways: Sequence[Array]) -> None:
    size = np.ptp(np.vstack(places), axis=0).max()
    largest = max(float(np.linalg.norm(way, axis=1).max()) for way in ways)
    scale = AMPLITUDE * size / max(largest, 1e-300)
    for at, shape, way in zip(places, shapes, ways, strict=True):
        axes.body(at, shape.cells, GHOST, 0.8)
        for sign, color in zip((1.0, -1.0), shades(3)[:2], strict=True):
            axes.body(at + sign * scale * way, shape.cells, color, 1.2)


def _way(results: Results, group: str, body: MovingBody, shape: Shape, k: int, mode: int) -> Array:
    """(p, 3) how the points of a body move in a mode: δR + δφ × A (x + Φ p) + A Φ δp, in global axes."""
    turning = "angle" if results.space.is_plane else "rotation"
    d_position, turn, d_p = (results[f"{group}/{body.name}/{key}"][k, mode] for key in ("position", turning, "modal"))
    turn = np.array([0.0, 0.0, float(turn)]) if results.space.is_plane else turn
    arm = shape.placed(body)[0] - body.position[0]
    is_flexible = len(d_p) == shape.shapes.shape[2]  # bodies drawn through their points do not show it
    bent = body.turned((shape.shapes @ d_p)[None])[0] if is_flexible else np.zeros_like(arm)
    found: Array = in_3d(d_position) + np.cross(turn, arm) + bent
    return found


def _nearest(results: Results, figure: FigureRecord) -> int:
    """The output nearest to the figure's time. Raises `InputError` where the analysis has no linear model."""
    if not results.has(f"{figure.analysis}/linear"):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected a linear analysis, found "{figure.analysis}"'
        )
    outputs = results.time(f"{figure.analysis}/time")
    return int(np.abs(outputs - (figure.times[0] if figure.times else outputs[0])).argmin())
