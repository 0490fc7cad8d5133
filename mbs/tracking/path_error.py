"""A path that points may leave by a tolerance: the robot on the displaced path, and what its forces owe to that."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Array, Indices
from ...common.structs import struct
from .._core import TimeFunction
from ..inversion.servo import PIECES, Servo, through

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

TIME = 0.005  # s, T_e where nothing is said
NEAR = 1e-5  # of the robot's size: the displacement by which forces are differentiated


@struct
class Tolerance:
    """Largest error (m) of each coordinate of points, and T_e (s): |e| ≤ error, |ë| ≤ error/T_e²."""

    error: float
    time: float = TIME

    @property
    def acceleration(self) -> float:
        """Largest |ë|, m/s²."""
        return self.error / self.time**2


def rows_of_points(servo: Servo) -> Indices:
    """Return which constraint equations prescribe coordinates of points, m."""
    rows = servo.model.rows
    return np.flatnonzero([row.is_trajectory and row.kind == "point" and row.target is not None for row in rows])


def displaced_at(servo: Servo, times: Array, off: Array) -> Servo:
    """The robot with points off their paths by e, ė, ë (3, T, k), SI units, at just these ascending `times` (T,), s."""
    times, first = np.unique(times, return_index=True)
    breaks, off = np.append(times, times[-1] + 1.0), off[:, first]

    def moved(target: TimeFunction, of: Array) -> TimeFunction:
        y, rate, acceleration = target.sample(times) + of
        return TimeFunction.polynomial(breaks, np.column_stack([0.5 * acceleration, rate, y]))

    return _with_targets(servo, [moved(target, off[:, :, k]) for k, target in enumerate(_targets(servo))])


def displaced_along(servo: Servo, error: PPoly) -> Servo:
    """The robot with points off their paths by `error` (k,), m, up to round-off: quintic Hermite pieces."""
    start, end = error.x[[0, -1]]
    times = np.union1d(error.x, np.linspace(start, end, PIECES + 1))
    off = np.array([error(times, order) for order in range(3)])
    return _with_targets(
        servo,
        [through(times, target.sample(times) + off[:, :, k]) for k, target in enumerate(_targets(servo))],
    )


def forces_off_path(servo: Servo, times: Array, motion: Sequence[Array], off: Array) -> tuple[Array, Array]:
    """(r, τ) (T, n + torques) with e, ė, ë `off` (3, T, k) at `times` (T,), s, and their slopes (3, T, n + torques, k).

    By differences, which are exact for ë and off by about `NEAR` for e and ė.
    """
    now = np.hstack(displaced_at(servo, times, off).forces(times, *motion))
    slopes, size = np.zeros((3, *now.shape, off.shape[2])), NEAR * servo.model.size
    for order, step in enumerate((size, size / servo.end, size / servo.end**2)):
        for k in range(off.shape[2]):
            moved = off.copy()
            moved[order, :, k] += step
            there = displaced_at(servo, times, moved).forces(times, *motion)
            slopes[order, :, :, k] = (np.hstack(there) - now) / step
    return now, slopes


def _targets(servo: Servo) -> list[TimeFunction]:
    targets = [servo.model.rows[k].target for k in rows_of_points(servo)]
    return [target for target in targets if target is not None]


def _with_targets(servo: Servo, targets: Sequence[TimeFunction]) -> Servo:
    rows = list(servo.model.rows)
    for k, target in zip(rows_of_points(servo), targets, strict=True):
        rows[k] = replace(rows[k], target=target)
    return replace(servo, model=replace(servo.model, rows=tuple(rows)))
