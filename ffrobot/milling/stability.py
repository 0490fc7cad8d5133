"""Largest depths of cut without chatter: by averaged cutting forces, and by semi-discretization.

The forces on the tool are F = a C(φ) (r(t) − r(t − τ)) with the depth of cut a, the tooth period τ and r = (x, y): x is
along the feed, y normal to it, and teeth turn from y to x. Averaged over φ, with the receptance G(iω) of r, vibration
at ω persists where 1 = a (1 − exp(−iωτ)) ν with an eigenvalue ν of C̄ G: a = 1/(2 Re ν) (Y. Altintas and E. Budak,
CIRP Annals 44, 1995). Of turning, C̄ = −K_s, that is −1/(2 K_s Re G).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, ComplexArray, as_floats
from ..common.libraries import scipy
from ..common.structs import struct

SPREAD = np.concatenate([-np.geomspace(40.0, 0.03, 200), np.geomspace(0.03, 40.0, 200)])  # half-bandwidths off a mode

LEAST = 1e-9  # damping ratio: without any, no depth is stable
FINE = 0.2  # rad, of the fastest mode in a step of semi-discretization
STEPS = (40, 200)  # of a tooth period, at least and at most


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
        vibrates = poles[poles.imag > 0.0]
        bandwidth = np.maximum(np.abs(vibrates.real), LEAST * np.abs(vibrates))
        omega = (np.abs(vibrates)[:, None] + bandwidth[:, None] * SPREAD).ravel()
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
            off = (turned - phase + np.pi) % (2 * np.pi) - np.pi
            crossed = (depth[:-1] * depth[1:] > 0.0) & (off[:, :-1] * off[:, 1:] <= 0.0)
            crossed &= np.abs(off[:, 1:] - off[:, :-1]) < np.pi
            share = off[:, :-1] / np.where(crossed, off[:, :-1] - off[:, 1:], 1.0)
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
    enter and leave the cut. `depth` in m, `speed` of the spindle in rad/s.
    """
    (K, D, J), m = tip, len(tip.K)
    pitch = 2 * np.pi / cutter.teeth
    fastest = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))
    steps = int(np.clip(fastest * pitch / speed / FINE, *STEPS))
    step, edges = pitch / speed / steps, np.linspace(0.0, pitch, steps + 1)
    size, angles = 2 * m + 2 * steps, pitch * np.arange(cutter.teeth)
    whole = np.eye(size)
    for first, last in pairwise(edges):
        C = depth * cutter.mean_forces(first + angles, last + angles).sum(axis=0)
        A = np.zeros((2 * m + 2, 2 * m + 2))
        A[:m, m : 2 * m], A[m : 2 * m, :m], A[m : 2 * m, m : 2 * m] = np.eye(m), J.T @ C @ J - K, -D
        A[m : 2 * m, 2 * m :] = -J.T @ C
        moved = scipy.linalg.expm(A * step)[: 2 * m]
        one = np.zeros((size, size))
        one[: 2 * m, : 2 * m] = moved[:, : 2 * m]
        one[: 2 * m, -2:] += moved[:, 2 * m :] / 2  # r one tooth period ago, the mean over the step
        one[: 2 * m, -4:-2] += moved[:, 2 * m :] / 2
        one[2 * m : 2 * m + 2, :m] = J
        one[2 * m + 2 :, 2 * m : -2] = np.eye(2 * steps - 2)
        whole = one @ whole
    return float(np.abs(np.linalg.eigvals(whole)).max())


def limit_depth(tip: Tip, cutter: Cutter, speed: float, bounds: Sequence[float]) -> float:
    """The depth (m) between `bounds` at which `growth` passes 1, by bisection to 0.1 %; infinite beyond them."""
    low, high = map(float, bounds)
    if growth(tip, cutter, high, speed) <= 1.0:
        return np.inf
    while high / low > 1.001:
        middle = float(np.sqrt(low * high))
        low, high = (low, middle) if growth(tip, cutter, middle, speed) > 1.0 else (middle, high)
    return low
