"""Largest depths of cut without chatter: by averaged cutting forces, and by semi-discretization.

The forces on the tool are F = a C(φ) (r(t) − r(t − τ)) with the depth of cut a, the tooth period τ and r = (x, y): x is
along the feed, y normal to it, and teeth turn from y to x. Averaged over φ, with the receptance G(iω) of r, vibration
at ω persists where 1 = a (1 − exp(−iωτ)) ν with an eigenvalue ν of C̄ G: a = 1/(2 Re ν) (Y. Altintas and E. Budak,
CIRP Annals 44, 1995). Of turning, C̄ = −K_s, that is −1/(2 K_s Re G).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, ComplexArray, as_floats
from ..common.errors import InputError
from ..common.libraries import scipy
from ..common.structs import struct

NEAREST, FARTHEST = 0.03, 10.0  # frequencies off a mode: half-bandwidths and its frequency, between them
NEAR, FAR = 100, 250  # as many frequencies on each side, within a half-bandwidth and beyond it
LEAST = 1e-9  # damping ratio: without any, no depth is stable
FINE = 0.5  # rad, of the fastest mode in a step of semi-discretization
STEPS = (80, 400)  # of a tooth period, at least and at most
RISE = 1.25  # from depth to depth, until one has chatter: above it may be others without
THINNEST = 1e-12  # m: below it no depth is stable


@struct
class Cutter:
    """A cutter of `teeth` equal straight ones that cut from angle `entry` to `exit`, rad, 0 at the normal to the feed.

    `tangential`, `radial`: cutting coefficients, N/m².
    """

    teeth: int
    tangential: float
    radial: float
    entry: float
    exit: float

    def mean_forces(self, first: Array, last: Array) -> Array:
        """Means of C (…, 2, 2), N/m², of one tooth while it turns from angles `first` to `last` within [0, 2π]."""
        low, high = (np.clip(angle, self.entry, self.exit) for angle in (first, last))
        return (self._integral(high) - self._integral(low)) / np.asarray(last - first)[..., None, None]

    def _integral(self, angle: Array) -> Array:
        c, s, t, r = np.cos(2 * angle), np.sin(2 * angle), self.tangential, self.radial
        less, more = angle - s / 2, angle + s / 2  # of 1 − cos 2φ and 1 + cos 2φ
        rows = [[t * c / 2 - r * less, r * c / 2 - t * more], [t * less + r * c / 2, -t * c / 2 - r * more]]
        return as_floats(0.5 * np.moveaxis(np.array(rows), (0, 1), (-2, -1)))

    @property
    def average(self) -> Array:
        """C̄ (2, 2), N/m², of all teeth."""
        return self.teeth * self.mean_forces(np.array(0.0), np.array(2 * np.pi))


class Tip(NamedTuple):
    """q̈ + D q̇ + K q = Jᵀ F with r = J q: K, D (m, m), J (d, m)."""

    K: Array
    D: Array
    J: Array

    def response(self) -> tuple[Array, ComplexArray]:
        """ω (F,), rad/s, dense about the modes, and G(iω) (F, d, d), m/N."""
        m = len(self.K)
        A = np.block([[np.zeros((m, m)), np.eye(m)], [-self.K, -self.D]])
        poles, V = np.linalg.eig(A)
        left = np.linalg.inv(V)[:, m:] @ self.J.T
        right = self.J @ V[:m]
        some = poles[(poles.imag >= 0.0) & (poles != 0.0)]  # real ones, too: strong damping leaves depths a limit
        size = np.abs(some)
        bandwidth = np.maximum(np.abs(some.real), LEAST * size)
        near = np.geomspace(NEAREST * bandwidth, bandwidth, NEAR)
        off = np.concatenate([near, np.geomspace(bandwidth, FARTHEST * size, FAR)])
        omega = np.concatenate([size - off, size + off]).ravel()
        omega = np.unique(omega[omega > 0.0])
        residues = right.T[:, :, None] * left[:, None, :]
        return as_floats(omega), np.tensordot(1.0 / (1j * omega[:, None] - poles), residues, axes=1)


class StabilityLimits(NamedTuple):
    """Depths (F, k), m, at the edge of stability at frequencies `omega` (F,), rad/s; infinite where there is none.

    `phase` (F, k): ωτ between 0 and 2π there.
    """

    omega: Array
    depth: Array
    phase: Array

    @property
    def least(self) -> float:
        """The depth, m, up to which no spindle speed has chatter."""
        return float(self.depth.min(initial=np.inf))

    def lobes(self, teeth: int, speed: Array) -> Array:
        """Depths (S,), m, at spindle speeds (S,), rad/s: the lowest of all lobes there."""
        found = np.full(len(speed), np.inf)
        turned = 2 * np.pi * self.omega / (teeth * speed[:, None])  # ωτ
        for depth, phase in zip(np.where(np.isfinite(self.depth), self.depth, 0.0).T, self.phase.T, strict=True):
            first = (turned[:, :-1] - phase[:-1]) / (2 * np.pi)  # whole where a lobe is
            rise = (np.diff(turned) - ((np.diff(phase) + np.pi) % (2 * np.pi) - np.pi)) / (2 * np.pi)
            low, high = np.minimum(first, first + rise), np.maximum(first, first + rise)
            crossed = (depth[:-1] * depth[1:] > 0.0) & (np.ceil(low) <= high)
            least_first = (rise > 0.0) == (np.diff(depth) > 0.0)  # of several lobes between two frequencies
            lobe = np.where(least_first, np.ceil(low), np.floor(high))
            share = (lobe - first) / np.where(crossed & (rise != 0.0), rise, 1.0)
            between = depth[:-1] + share * np.diff(depth)
            found = np.minimum(found, np.where(crossed, between, np.inf).min(axis=1, initial=np.inf))
        return found


def stability_limits(C: Array, omega: Array, G: ComplexArray) -> StabilityLimits:
    """Edges of stability for averaged forces `C` (d, d), N/m², from G (F, d, d), m/N, at `omega` (F,), rad/s."""
    nu = _continuous(_eigenvalues(C @ G))
    with np.errstate(divide="ignore", invalid="ignore"):
        depth = np.where(nu.real > 0.0, 0.5 / nu.real, np.inf)
        delayed = 1.0 - 1.0 / (depth * nu)  # exp(−iωτ)
    return StabilityLimits(omega, as_floats(depth), as_floats(-np.angle(delayed) % (2 * np.pi)))


def _eigenvalues(A: ComplexArray) -> ComplexArray:
    """Of matrices (F, 1, 1) or (F, 2, 2): (F, 1) or (F, 2)."""
    if A.shape[1] == 1:
        return A[:, :, 0]
    mean, det = (A[:, 0, 0] + A[:, 1, 1]) / 2, A[:, 0, 0] * A[:, 1, 1] - A[:, 0, 1] * A[:, 1, 0]
    root = np.sqrt(mean**2 - det)
    return np.stack([mean + root, mean - root], axis=1)


def _continuous(values: ComplexArray) -> ComplexArray:
    """Eigenvalues (F, 1) or (F, 2) in an order in which each changes least from one to the next."""
    kept, turned = (np.abs(values[1:] - other).sum(axis=1) for other in (values[:-1], values[:-1, ::-1]))
    is_turned = np.append(False, np.cumsum(turned < kept) % 2 == 1)
    return np.where(is_turned[:, None], values[:, ::-1], values)


def growth(tip: Tip, cutter: Cutter, depth: float, speed: float) -> float:
    """Largest |eigenvalue| by which a tooth period multiplies small vibrations, above 1 with chatter.

    By semi-discretization (T. Insperger and G. Stépán, Int. J. Numer. Meth. Engng 61, 2004): modes couple, and teeth
    enter and leave the cut. `depth` in m, `speed` of the spindle in rad/s. In a step, r one tooth period ago has the
    mean and the rise of a cubic through four of its values, so that a wave may have few steps. Raises `InputError`
    where vibrations have too many waves in a tooth period.
    """
    (K, D, J), m, pitch = tip, len(tip.K), 2 * np.pi / cutter.teeth
    fastest = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max(initial=0.0)))
    if (turned := fastest * pitch / speed) > FINE * STEPS[1]:
        raise InputError(
            f"milling: semi-discretization: expected modes within {FINE * STEPS[1]:g} rad of a tooth period",
            f"{turned:.4g} rad at {speed * 30 / np.pi:g} rev/min: lower the key highest, or average forces",
        )
    steps = max(STEPS[0], int(np.ceil(turned / FINE)))
    edges, angles = np.linspace(0.0, pitch, steps + 1)[:, None], pitch * np.arange(cutter.teeth)
    C = depth * cutter.mean_forces(edges[:-1] + angles, edges[1:] + angles).sum(axis=1)
    A = np.zeros((steps, 2 * m + 4, 2 * m + 4))  # of q, q̇, of r one period ago, and of its rise in a step
    A[:, :m, m : 2 * m], A[:, m : 2 * m, :m], A[:, m : 2 * m, m : 2 * m] = np.eye(m), J.T @ C @ J - K, -D
    A[:, m : 2 * m, 2 * m : -2] = -J.T @ C
    A[:, 2 * m : -2, -2:] = np.eye(2) * speed * steps / pitch
    start = np.eye(2 * m + 2 * (steps + 1))
    now, before = start[: 2 * m], deque(start[2 * m :].reshape(steps + 1, 2, -1), steps + 1)  # the newest r first
    for moved in scipy.linalg.expm(A * pitch / speed / steps)[:, : 2 * m]:
        rise = before[-3] - before[-2]
        first = (13 * (before[-2] + before[-3]) - before[-1] - before[-4]) / 24 - rise / 2
        before.appendleft(J @ now[:m])
        now = moved @ np.vstack([now, first, rise])
    return float(np.abs(np.linalg.eigvals(np.vstack([now, *before]))).max())


def limit_depth(tip: Tip, cutter: Cutter, speed: float, bounds: Sequence[float]) -> float:
    """The least depth (m) between `bounds` above which `growth` passes 1, to 0.1 %; infinite beyond them.

    Where vibrations grow at the lower bound already, it is sought below that; 0 below `THINNEST`.
    """
    low, high = map(float, bounds)
    while growth(tip, cutter, low, speed) > 1.0:
        low, high = low / 10, low
        if high < THINNEST:
            return 0.0
    while low < high and growth(tip, cutter, min(RISE * low, high), speed) <= 1.0:
        low *= RISE
    if low >= high:
        return np.inf
    high = RISE * low
    while high / low > 1.001:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if growth(tip, cutter, middle, speed) > 1.0 else (middle, high)
    return low
