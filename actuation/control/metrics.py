"""How well a closed loop did: error of the tip, settling, vibration, effort."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.arrays import Array
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


@dataclass(frozen=True)
class Followed:
    """What a loop did, at the outputs of its run.

    Attributes:
        time: (T,) s.
        error: (T, d) m, of the tip from its place.
        rates: (T, motors) rad/s, m/s.
        held: (T, inputs) commands.
        completed: whether it came to its end.
        is_disturbed: by loads that the reference does not know.
    """

    time: Array
    error: Array
    rates: Array
    held: Array
    completed: bool
    is_disturbed: bool


def measure(run: Followed, setup: Setup, loop: Loop) -> tuple[Array, Metrics]:
    """Distance of the tip from its place (T,), and the metrics."""
    t, motors = run.time, len(setup.robot.motors)
    distance = np.linalg.norm(run.error, axis=1)
    shaking = np.linalg.norm(run.error - _slow(t, run.error), axis=1)
    taken = slice(loop.taken)
    moments, volts = loop.commands[taken, :motors], loop.commands[taken, motors:]
    work = np.abs(run.held[:, :motors] * run.rates).sum(axis=1)
    cut = (loop.commands[taken] != loop.wanted[taken]).any(axis=1)
    return distance, Metrics(
        _verdict(run, shaking),
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


def place_of_tip(time: Array, end: float, known: tuple[Array, Array], paths: Sequence[Mapping[str, Any]]) -> Array:
    """(T, d) m: where its `paths`, functions of time by component, say, which are held before 0 and after `end` (s).

    Else where it is in the inverse analysis, `known` as its times (K,) and positions (K, d).
    """
    place = _interpolated(time, *known)
    on_path = np.clip(time, 0.0, end)
    for components in paths:
        for component, target in components.items():
            place[:, "xyz".index(component)] = target.sample(on_path)[0]
    return place


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


def _verdict(run: Followed, shaking: Array) -> str:
    if not run.completed:
        return "diverges"
    quarters = [part.max(initial=0.0) for part in np.array_split(shaking, 4)]
    growing = quarters[1] < quarters[2] < quarters[3] and quarters[3] > GROWTH * quarters[1]
    return "grows" if growing and not run.is_disturbed else "stable"
