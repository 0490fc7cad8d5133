"""Figures of linear models: frequency responses, and the mode shapes of the robot."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.plane import perpendicular, rotation
from ...results.file import Results
from .configurations import body_shape
from .figure_file import FigureRecord
from .style import SIZE, legend, shades

POINTS = 4000  # of a frequency response
DECADE_BELOW, MODES_SHOWN = 10.0, 8  # range: from a tenth of the lowest frequency to beyond the eighth
SHAPES = 6  # of modes that are drawn at most
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
    for (source, target), color in zip(figure.transfers, shades(len(figure.transfers)), strict=True):
        response = model.frequency_response(2 * np.pi * hertz, source, target)[:, 0, 0]
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
    columns = 3
    rows = max(1, -(-len(shown) // columns))
    picture = Figure(figsize=(2 * SIZE[0], 2.1 * rows), layout="constrained")
    if not len(shown):
        picture.suptitle("no mode vibrates")
    for place, mode in enumerate(shown, 1):
        axes = picture.add_subplot(rows, columns, place)
        axes.set_title(f"{mode + 1}: {frequency[mode]:.4g} Hz", loc="left")
        _draw_mode(axes, results, figure.analysis, k, int(mode))
        axes.set_aspect("equal", adjustable="datalim")
        axes.tick_params(labelsize=6)
        axes.set_xlabel("x (m)", fontsize=6)
        axes.set_ylabel("y (m)", fontsize=6)
    return picture


def _draw_mode(axes: Axes, results: Results, analysis: str, k: int, mode: int) -> None:
    lines = [_lines(results, analysis, body, k, mode) for body in results.names(f"{analysis}/bodies")]
    everything = np.vstack([places for places, _ in lines])
    size = np.ptp(everything, axis=0).max()
    largest = max(float(np.linalg.norm(way, axis=1).max()) for _, way in lines)
    scale = AMPLITUDE * size / max(largest, 1e-300)
    for places, way in lines:
        axes.plot(*places.T, color=GHOST, linewidth=0.8)
        for sign, color in zip((1.0, -1.0), shades(3)[:2], strict=True):
            axes.plot(*(places + sign * scale * way).T, color=color, linewidth=1.2)


def _lines(results: Results, analysis: str, body: str, k: int, mode: int) -> tuple[Array, Array]:
    """Places (m, 2) along a body at output k, and how they move in a mode; straight between points where rigid."""
    motion = f"{analysis}/bodies/{body}"
    shape = f"{analysis}/linear/modes/{body}"
    position, angle, p = (results[f"{motion}/{key}"][k] for key in ("position", "angle", "modal"))
    d_position, d_angle, d_p = (results[f"{shape}/{key}"][k, mode] for key in ("position", "angle", "modal"))
    if not len(p):
        places, _ = body_shape(results, f"{analysis}/points", body, k)
        arm = places - position
        return places, d_position + float(d_angle) * perpendicular(arm)
    stations = results.modal_body(body).stations
    Phi = stations.translation[:, :2]
    A = rotation(angle)
    arm = (stations.position[:, :2] + Phi @ p) @ A.T
    return position + arm, d_position + d_angle * perpendicular(arm) + (Phi @ d_p) @ A.T


def _nearest(results: Results, figure: FigureRecord) -> int:
    """The output nearest to the figure's time. Raises `InputError` where the analysis has no linear model."""
    if not results.has(f"{figure.analysis}/linear"):
        raise InputError(
            f'{results.path}: figure "{figure.name}": expected a linear analysis, found "{figure.analysis}"'
        )
    outputs = results.time(f"{figure.analysis}/time")
    return int(np.abs(outputs - (figure.times[0] if figure.times else outputs[0])).argmin())
