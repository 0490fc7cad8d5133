"""The zero dynamics along a path: its zeros about quasi-static links, and whether past or future tells their motions.

With p(t) given the joints follow from the path, and modal forces r(t, p, ṗ, p̈) that motors do not supply have to vanish
(Blajer and Kolodziejczyk 2004; Seifried 2014, ch. 4): docs/theory.md, Torque-only tracking.
"""

from functools import cached_property

import numpy as np

from ...common.arrays import Array, Booleans, ComplexArray, NDArray
from ...common.errors import SolveError
from ...common.libraries import scipy
from ...common.structs import struct
from ..linear.statics import static_shapes
from ..model.system import MultibodySystem
from ..posture.posture import shape_in_redundant_loops
from .servo import Servo

CENTRE = 1e-6  # |Re s| / |s| of zeros that count as undamped


@struct
class LinearDynamics:
    """M δp̈ + D δṗ + K δp = 0 of the internal dynamics at `times` (N,), s: each (N, n, n), SI units."""

    times: Array
    M: Array
    D: Array
    K: Array

    def __call__(self, times: Array) -> Array:
        """M, D, K (3, T, n, n) at any `times` (T,), s, straight lines between those that are known."""
        inside = times.clip(self.times[0], self.times[-1])
        return scipy.interpolate.make_interp_spline(self.times, [self.M, self.D, self.K], 1, axis=1)(inside)


def linear_dynamics(servo: Servo, times: Array, p: Array, v: Array, a: Array) -> LinearDynamics:
    """Derivatives by p̈, ṗ and p of modal forces that motors do not supply: M, D, K (N, n, n), at `times` (N,), s.

    p, ṗ = v and p̈ = a are (N, n), m·√kg and s.
    """
    return LinearDynamics(times, *(x[:, : p.shape[1]] for x in servo.slopes(times, p, v, a)))


def equilibrium(servo: Servo, t: float) -> Array:
    """Shape p (n,), m·√kg, at rest under path and loads of time t, s. Raises `SolveError` where there is none."""
    p, is_met = _shapes(servo, np.array([t]))
    if is_met[0]:
        return p[0]
    soft = "the links are too soft for their loads there: stiffen them, or take less payload"
    cause = cause_in_posture(servo) or soft
    raise SolveError(f"no equilibrium under the motors was found at t = {t:g} s: {cause}")


def _shapes(servo: Servo, times: Array) -> tuple[Array, Booleans]:
    """Shapes p (N, n) at `times` (N,) with which motors alone bear the loads: r(t, p, 0, 0) = 0; which are met (N,)."""
    return static_shapes(
        servo.scale,
        servo.mode_sizes,
        lambda p, at: servo.residuals(times[at], p, 0 * p, 0 * p),
        lambda p, at: servo.slopes(times[at], p, 0 * p, 0 * p)[2][:, : p.shape[1]],
        len(times),
    )


def cause_in_posture(servo: Servo) -> str:
    """Why bent links leave the output without a posture, and a remedy; "" for other causes."""
    if servo.doubt:
        return f"{servo.doubt}, and cannot where links bend. Move the path, or start in another posture"
    return shape_in_redundant_loops(servo.model, servo.near[0], MultibodySystem(servo.model).integrated.rows)


def first_order(dynamics: LinearDynamics, scale: Array) -> Array:
    """Matrices 𝒜 (N, 2n, 2n), 1/s, of ẏ = 𝒜 y for y = (ω p, ṗ); `scale` ω (n,), 1/s."""
    N, n = len(dynamics.M), len(scale)
    A = np.zeros((N, 2 * n, 2 * n))
    A[:, :n, n:] = np.diag(scale)
    A[:, n:, :n] = -np.linalg.solve(dynamics.M, dynamics.K / scale)
    A[:, n:, n:] = -np.linalg.solve(dynamics.M, dynamics.D)
    return A


def is_unstable(s: ComplexArray) -> Booleans:
    """Whether zeros s (…,), 1/s, are in the right half plane, beyond round-off."""
    return s.real > CENTRE * np.abs(s)


SAMPLES = 33  # of the linear dynamics along the path
LIGHT = 0.1  # |Re s| / |s| of a lightly damped vibration
GROWTH = 1.0  # ln of what it may grow by along a path and count as bounded
JUMP = 0.5  # of the size of a zero, between two samples: it passed through infinity
TINY = 1e-300


@struct
class Linearisation:
    """Linear internal dynamics at N times of the path, about the quasi-static `shape` (N, n), m·√kg, of the links.

    `scale` (n,), rad/s: frequencies of the modes.
    """

    dynamics: LinearDynamics
    shape: Array
    scale: Array

    @cached_property
    def zeros(self) -> ComplexArray:
        """Zeros (N, 2n) from motors to path, 1/s, at each time: those on the left first, the slowest of each side."""
        s = np.linalg.eigvals(first_order(self.dynamics, self.scale)).astype(complex)
        side: Array = is_unstable(s).astype(int) - is_unstable(-s)
        return np.take_along_axis(s, np.lexsort((s.imag, np.abs(s), side), axis=1), axis=1)

    @cached_property
    def is_future(self) -> Booleans:
        """Whether zeros (N, 2n) belong to motions that the future determines.

        Those in the right half plane do. Zeros of lightly damped vibrations may cross the imaginary axis along the
        path: they do only where they grow too far over all of it (docs/theory.md, Torque-only tracking).
        """
        places, jumps = self._followed
        s, T = np.take_along_axis(self.zeros, places, axis=1), float(self.times[-1])
        most = np.maximum(GROWTH, np.log(np.maximum(np.abs(s).mean(axis=0) * T / 100, TINY)))
        light = np.take_along_axis(self.is_light, places, axis=1)
        growth = 0.5 * np.diff(self.times) @ (s.real[1:] + s.real[:-1])
        future = np.where(light.any(axis=0), growth > most, is_unstable(s[0]))
        later = np.empty_like(light)
        np.put_along_axis(later, places, np.where(jumps, is_unstable(s) & ~light, future), axis=1)
        apart = np.abs(self.zeros[:, :, None] - self.zeros[:, None].conj())
        is_parted = later != np.take_along_axis(later, apart.argmin(axis=2), axis=1)  # two real ones have met
        return np.where(is_parted, is_unstable(self.zeros) & ~self.is_light, later)

    @property
    def _followed(self) -> tuple[NDArray[np.int_], Booleans]:
        """Where the zeros at t = 0 stand (N, 2n) at all times, those that move least, and which of them jump (2n,).

        Ways are relative, so that fast zeros, which pass through infinity, do not outweigh others.
        """
        places = np.tile(np.arange(self.zeros.shape[1]), (len(self.zeros), 1))
        jumps = np.zeros(self.zeros.shape[1], dtype=bool)
        for k in range(1, len(places)):
            before, now = self.zeros[k - 1, places[k - 1]][:, None], self.zeros[k]
            ways = np.abs(before - now) / np.maximum(np.abs(before) + np.abs(now), TINY)
            rows, places[k] = scipy.optimize.linear_sum_assignment(ways)
            if k - 1 in self.singular_after:
                jumps |= ways[rows, places[k]] > JUMP
        return places, jumps

    @property
    def is_light(self) -> Booleans:
        """Whether zeros (N, 2n) are those of lightly damped or slowly growing vibrations."""
        return np.abs(self.zeros.real) <= LIGHT * np.abs(self.zeros)

    @property
    def singular_after(self) -> tuple[int, ...]:
        """Indices of the last times before a zero passes through infinity, where det M changes its sign."""
        sides = np.linalg.slogdet(self.dynamics.M)[0]
        return tuple(int(k) for k in np.flatnonzero(sides[1:] != sides[:-1]))

    @property
    def times(self) -> Array:
        """Times (N,) from 0 to the end of the path, s."""
        return self.dynamics.times


def shape_along(servo: Servo, times: Array) -> Array:
    """Quasi-static modal coordinates p (N, n), m·√kg, of links at `times` (N,), s: residual forces are zero.

    Raises `SolveError` where links are too soft.
    """
    p, is_met = _shapes(servo, times)
    _check(servo, times, is_met)
    return p


def linearise(servo: Servo, end: float, samples: int = SAMPLES) -> Linearisation:
    """The linear internal dynamics about quasi-static links at `samples` times of the path, up to `end`, s.

    Raises `SolveError` where links are too soft.
    """
    times = np.linspace(0.0, end, samples)
    p = shape_along(servo, times)
    dynamics = linear_dynamics(servo, times, p, 0 * p, 0 * p)
    _check(servo, times, np.isfinite([dynamics.M, dynamics.D, dynamics.K]).all(axis=(0, 2, 3)))
    return Linearisation(dynamics, p, servo.scale)


def _check(servo: Servo, times: Array, is_met: Booleans) -> None:
    if not is_met.all():
        cause = cause_in_posture(servo) or "the links are too soft for their loads there; slow the path down"
        t = times[is_met.argmin()]
        raise SolveError(f"motor torques alone cannot follow the path at t = {t:g} s: {cause}")
