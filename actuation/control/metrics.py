"""How well a closed loop did: error of the tip, settling, vibration, effort."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...mbs.analysis.outcome import Outcome
from ...mbs.quantities.joint_space import motor_rates
from ...mbs.quantities.observation import point_motion
from .controllers import Setup
from .loop import Loop

SETTLED = 0.05  # of the largest error
WINDOW, CUBIC = 0.1, 3  # s, over which motion that a cubic follows is no vibration: below about 80 rad/s
GROWTH = 4.0  # of the vibration's peak, from the second quarter of a run to its last


@dataclass(frozen=True)
class Metrics:
    """One run in numbers.

    Attributes:
        verdict: "stable", "grows" (vibration, quarter by quarter of an undisturbed run) or "diverges".
        tip_error_rms, tip_error_max: distance of the tip from its place, m.
        settling_time: s, after which that stays below 5 % of its largest value; NaN where it does not before the end.
        vibration: root mean square of the tip's error, less the cubics that follow it best over 0.1 s, m.
        residual: the largest such difference in 0.1 s near the end, m.
        motor_work: ∫ Σ |τ γ̇| dt, J.
        voltage_effort: ∫ Σ V² dt, V² s.
        peak_moment: N·m; peak_voltage: V.
        saturated: part of the samples at which a command was cut.
    """

    verdict: str
    tip_error_rms: float
    tip_error_max: float
    settling_time: float
    vibration: float
    residual: float
    motor_work: float
    voltage_effort: float
    peak_moment: float
    peak_voltage: float
    saturated: float


def measure(
    outcome: Outcome, source: Outcome, tip: str | None, setup: Setup, loop: Loop, held: Array, is_disturbed: bool
) -> tuple[Array, Metrics]:
    """Distance of the tip from its place (T,), and the metrics.

    `tip` is the point that the scene names, if any; `held` (T, inputs) are the commands at the outputs.
    """
    error = _tip_error(outcome, source, tip or default_tip(outcome))
    distance = np.linalg.norm(error, axis=1)
    t, motors = outcome.time, len(setup.model.motors)
    shaking = np.linalg.norm(error - _slow(t, error), axis=1)
    taken = slice(loop.taken)
    moments, volts = loop.commands[taken, :motors], loop.commands[taken, motors:]
    work = np.abs(held[:, :motors] * motor_rates(outcome)).sum(axis=1)
    cut = (loop.commands[taken] != loop.wanted[taken]).any(axis=1)
    return distance, Metrics(
        _verdict(outcome, shaking, is_disturbed),
        float(np.sqrt(np.mean(distance**2))),
        float(distance.max()),
        _settling(t, distance),
        float(np.sqrt(np.mean(shaking**2))),
        _residual(t, shaking),
        float(((work[1:] + work[:-1]) / 2 * np.diff(t)).sum()),
        float((volts**2).sum() * setup.sample_time),
        float(np.abs(moments).max(initial=0.0)),
        float(np.abs(volts).max(initial=0.0)),
        float(cut.mean()),
    )


def default_tip(outcome: Outcome) -> str:
    """The point whose error is reported: that of the first trajectory of a point, or the last tip."""
    scene = outcome.assembly.model.scene
    driven = [trajectory.point for trajectory in scene.trajectory if trajectory.point is not None]
    if driven:
        return driven[0]
    body = outcome.assembly.model.links[-1]
    return f"{body.name}.{'tip' if 'tip' in body.points else next(iter(body.points))}"


def _tip_error(outcome: Outcome, source: Outcome, point: str) -> Array:
    """(T, 2) m; where the tip should be is where its trajectory says, or where it is in the inverse analysis."""
    place = _interpolated(outcome.time, source.time, point_motion(source, point).position)
    on_path = np.clip(outcome.time, 0.0, outcome.analysis.last_time)
    for trajectory in outcome.assembly.model.scene.trajectory:
        if trajectory.point == point:  # held where it is before the path and after it
            for component, target in trajectory.components.items():
                place[:, "xy".index(component)] = target.sample(on_path)[0]
    error: Array = point_motion(outcome, point).position - place
    return error


def _interpolated(times: Array, known: Array, values: Array) -> Array:
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def _slow(t: Array, values: Array) -> Array:
    """The part of (T, columns) that is no vibration: least-squares cubics over `WINDOW` (Savitzky and Golay 1964)."""
    from scipy.signal import savgol_filter

    count = 2 * round(WINDOW / (2 * (t[1] - t[0]))) + 1 if len(t) > 1 else 1
    if not CUBIC < count <= len(t):
        return np.broadcast_to(values.mean(axis=0), values.shape)
    smooth: Array = savgol_filter(values, count, CUBIC, axis=0)
    return smooth


def _residual(t: Array, shaking: Array) -> float:
    late = (t > t[-1] - 1.5 * WINDOW) & (t < t[-1] - 0.5 * WINDOW)
    return float(shaking[late].max(initial=0.0))


def _settling(t: Array, distance: Array) -> float:
    outside = np.flatnonzero(distance > SETTLED * distance.max())
    if not outside.size:
        return 0.0
    return float(t[outside[-1] + 1]) if outside[-1] + 1 < len(t) else float("nan")


def _verdict(outcome: Outcome, shaking: Array, is_disturbed: bool) -> str:
    if outcome.status != "completed":
        return "diverges"
    quarters = [part.max(initial=0.0) for part in np.array_split(shaking, 4)]
    growing = quarters[1] < quarters[2] < quarters[3] and quarters[3] > GROWTH * quarters[1]
    return "grows" if growing and not is_disturbed else "stable"
