"""Jumps of trajectories: no finite force moves a robot along them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import InputError
from .._core import TimeFunction

SAMPLES = 2001
LOOKED_INTO = 5  # intervals between samples, the roughest ones
HALVINGS = 25
JUMP = 1e-4  # in terms of the largest value or velocity: less is rounded numbers in an expression
SMOOTH = 0.1  # of that: what misses less in one of those intervals has no jump
RESTING = 1e-6  # of the largest value, within the run: a path that moves less stands still, and what jumps is rounding


def check_smooth(path: Path, targets: Iterable[tuple[str, TimeFunction]], end: float) -> None:
    """Raise `InputError` for a target, with its label, that jumps in value or velocity between t = 0 and `end` (s).

    `path` is that of the scene. Accelerations may jump. What is looked into are the intervals that the trapezoidal rule
    on the exact derivatives describes worst; a jump is what stays however far they are halved.
    """
    for label, target in targets:
        for order, quantity in enumerate(("value", "velocity")):
            found = _jump(target, end, order)
            if found is not None:
                t, before, after = found
                raise InputError(
                    f"{path}: {label}: expected a continuous {quantity}, found a jump from {before:.6g} to {after:.6g}"
                    f" at t = {t:.9g} s: no finite force can make the robot follow; round it off (waypoints make a"
                    " smooth curve)"
                )


def _jump(function: TimeFunction, end: float, order: int) -> tuple[float, float, float] | None:
    """Time, value before and after of the first jump that is found in a derivative of that order; None without one."""
    times = as_floats(np.linspace(0.0, end, SAMPLES))
    derivatives = function.sample(times)
    samples, still = derivatives[order], RESTING * float(np.abs(derivatives[0]).max())
    size = max(float(np.ptp(samples)), still) if order == 0 else max(float(np.abs(samples).max()), still / end)
    if not (np.isfinite(samples).all() and size > 0):
        return None
    missed = misfits(function, times, order)
    rough = np.argsort(-missed)[:LOOKED_INTO]
    rough = rough[missed[rough] > SMOOTH * JUMP * size]
    if rough.size == 0:
        return None
    a, b = times[rough], times[rough + 1]
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        halves = misfits(function, np.stack([a, middle, b]), order)
        a, b = np.where(halves[0] > halves[1], (a, middle), (middle, b))
    jumps = misfits(function, np.stack([a, b]), order)[0] > JUMP * size
    if not jumps.any():
        return None
    first = np.flatnonzero(jumps)[np.argmin(b[jumps])]
    before, after = function.sample(np.array([a[first], b[first]]))[order]
    return float(b[first]), float(before), float(after)


def misfits(function: TimeFunction, times: Array, order: int) -> Array:
    """What the trapezoidal rule on the next derivative misses of each change between neighbouring times.

    Of times (T, …) along the first axis; (T − 1, …).
    """
    value, slope = function.sample(times.ravel())[order : order + 2].reshape(2, *times.shape)
    missed: Array = np.abs(np.diff(value, axis=0) - 0.5 * np.diff(times, axis=0) * (slope[1:] + slope[:-1]))
    return np.nan_to_num(missed, nan=0.0, posinf=0.0)
