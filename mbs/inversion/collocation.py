"""Collocation of second-order equations r(t, p, ṗ, p̈) = 0 between two boundary conditions.

On each interval p̈ is a polynomial through its values K at the Gauss points; p and ṗ are its integrals, continuous at
the breaks. At the points themselves p is what Gauss's method has for (p, ṗ) as a system of first order, A²K: then
solutions decay, grow or vibrate as they do, whatever the size of an interval (Ascher, Mattheij and Russell 1995,
ch. 10). With the second integral of the polynomial there (Ascher, Christiansen and Russell 1981) fast vibrations leave
their side of the imaginary axis (van der Houwen, Sommeijer and Nguyen huu Cong 1991), but equations may lose their
p̈ for a moment, as where a zero passes through infinity.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, PPoly
from ...common.libraries import scipy
from ...common.structs import struct

STAGES = 4
MOST_ITERATIONS = 25
TOLERANCE = 1e-12  # of the last Newton step, relative to the peak of its quantity
ROUND_OFF = 1e-8  # below which a step that no longer shrinks is round-off


class Boundary(NamedTuple):
    """k boundary conditions rows · (y − state) = 0 of y = (p, ṗ): `rows` (k, 2n), `state` (2n,), SI units."""

    rows: Array
    state: Array


class Scheme(NamedTuple):
    """s collocation points `c` (s,) on [0, 1], and weights of values there in integrals of p̈, no unit."""

    c: Array
    to_powers: Array  # (s, s) values → coefficients of 1, ξ, ξ² …
    stage_once: Array  # (s, s), in single integrals; `stage_twice` in double ones
    stage_twice: Array
    end_once: Array  # (s,)
    end_twice: Array


def gauss(stages: int = STAGES, *, of_second_order: bool = False) -> Scheme:
    """Collocation at the zeros of the Legendre polynomial of degree `stages` (Hairer, Nørsett and Wanner, II.7).

    `of_second_order`: p at the points is the second integral of the polynomial for p̈; else Gauss's method for (p, ṗ).
    """
    c = (np.polynomial.legendre.leggauss(stages)[0] + 1) / 2
    m = np.arange(stages)
    to_powers = np.linalg.inv(c[:, None] ** m)
    once, twice = 1 / (m + 1), 1 / ((m + 1) * (m + 2))
    stage_once = c[:, None] ** (m + 1) * once @ to_powers
    stage_twice = c[:, None] ** (m + 2) * twice @ to_powers if of_second_order else stage_once @ stage_once
    return Scheme(c, to_powers, stage_once, stage_twice, once @ to_powers, twice @ to_powers)


GAUSS, OF_SECOND_ORDER = gauss(), gauss(of_second_order=True)


def between(breaks: Array, xi: Array) -> Array:
    """Times (N · S,), s, at shares ξ (S,) of each of the intervals between `breaks` (N + 1,), s."""
    return (breaks[:-1, None] + np.diff(breaks)[:, None] * xi).ravel()


@struct
class Problem:
    """Equations r(t, p, ṗ, p̈) = 0 with boundary conditions, for N `times` (N,), s, at once: p, ṗ, p̈ (N, n), SI units.

    residual(times, p, ṗ, p̈) is r (N, n), SI. derivatives(times) are ∂r/∂p̈, ∂r/∂ṗ, ∂r/∂p (3, N, n, n), SI: they only
    set the pace of Newton's method. `scale` (n,) is about |ṗ|/|p|, 1/s, `size` a typical |scale · p|. All conditions at
    the start make it an initial value problem; then intervals have to resolve vibrations, or errors of these grow.
    """

    residual: Callable[[Array, Array, Array, Array], Array]
    derivatives: Callable[[Array], Array]
    scale: Array
    size: float
    start: Boundary
    end: Boundary
    scheme: Scheme = GAUSS


@struct
class Found:
    """A solution p(t) (n,) of `collocate`, SI units; whether Newton's method converged, and its iterations.

    `worst` is the time, s, at which the last Newton step was largest, or the residual was NaN.
    """

    curve: PPoly
    converged: bool
    iterations: int
    worst: float


def collocate(problem: Problem, breaks: Array, guess: PPoly) -> Found:
    """Solve `problem` by Newton's method on `breaks` (N+1,), s, from a `guess` of p(t) (n,), SI units."""
    h, times = np.diff(breaks), between(breaks, problem.scheme.c)
    N, s, n = len(h), len(problem.scheme.c), len(problem.scale)
    linear = _LinearSystem(problem, breaks, [x.reshape(N, s, n, n) for x in problem.derivatives(times)])
    p, v, K = guess(breaks), guess(breaks, 1), guess(times, 2).reshape(N, s, n)
    previous, converged, iteration, worst = np.inf, False, 0, float(breaks[0])
    while not converged and iteration < MOST_ITERATIONS:
        iteration += 1
        stages = stage_states(problem.scheme, h, p, v, K)
        r = problem.residual(times, *(x.reshape(-1, n) for x in (*stages, K)))
        if not (is_finite := np.isfinite(r).all(axis=1)).all():
            worst = float(times[is_finite.argmin()])
            break
        p_step, v_step, K_step = linear.solve(r.reshape(N, s, n), p, v, K)
        p, v, K = p + p_step, v + v_step, K + K_step
        peak = max(np.abs(problem.scale * p).max(), np.abs(v).max(), problem.size)
        steps = np.maximum(np.abs(problem.scale * p_step), np.abs(v_step)).max(axis=1) / peak
        size, worst = float(steps.max()), float(breaks[steps.argmax()])
        converged = size <= TOLERANCE or (size <= ROUND_OFF and size > 0.3 * previous)
        if not np.isfinite(size):
            break
        previous = size
    return Found(piecewise(problem.scheme, breaks, p, v, K), bool(converged), iteration, worst)


def stage_states(scheme: Scheme, h: Array, p: Array, v: Array, K: Array) -> tuple[Array, Array]:
    """States p and ṗ (N, s, n), SI units, at s Gauss points of each of N intervals of lengths `h` (N,), s.

    From p and ṗ = `v` (N + 1, n) at the breaks, and p̈ = K (N, s, n) at the Gauss points.
    """
    step = h[:, None, None]
    once, twice = (np.einsum("ij,Njn->Nin", a, K) for a in (scheme.stage_once, scheme.stage_twice))
    p_stages = p[:-1, None] + scheme.c[:, None] * step * v[:-1, None] + step**2 * twice
    return p_stages, v[:-1, None] + step * once


def piecewise(scheme: Scheme, breaks: Array, p: Array, v: Array, K: Array) -> PPoly:
    """p(t) (n,), any unit, from p, ṗ = `v` (N + 1, n) at `breaks` (N + 1,), s, and p̈ = K (N, s, n) at Gauss points."""
    h = np.diff(breaks)[:, None]
    powers = np.einsum("mi,Nin->mNn", scheme.to_powers, K)
    integrated = [x / ((m + 1) * (m + 2) * h**m) for m, x in enumerate(powers)]
    return scipy.interpolate.PPoly(np.array([*integrated[::-1], v[:-1], p[:-1]]), breaks)


class Elimination:
    """Newton's equations E K + G (p, ṗ) = b for p̈ = K at the s Gauss points of N intervals, solved for K.

    (p, ṗ) (2n,) are values where an interval starts. `E_inverse` (N, s n, s n), `G` (N, s n, 2n), and `response`
    (N, s, n, 2n), −E⁻¹ G, of K to (p, ṗ), are in SI units.
    """

    def __init__(self, scheme: Scheme, h: Array, derivatives: Sequence[Array]) -> None:
        M, D, K = derivatives
        self.scheme, self.h = scheme, h
        N, s, n = M.shape[:3]
        h = h[:, None, None, None, None]
        once, twice = (h**k * a[:, None, :, None] for k, a in ((1, scheme.stage_once), (2, scheme.stage_twice)))
        E = once * D[:, :, :, None] + twice * K[:, :, :, None]  # (N, s, n, s, n)
        for i in range(s):
            E[:, i, :, i] += M[:, i]
        self.G = np.concatenate([K, D + scheme.c[:, None, None] * h[..., 0] * K], axis=3).reshape(N, s * n, 2 * n)
        self.E_inverse = np.linalg.inv(E.reshape(N, s * n, s * n))
        self.response = -(self.E_inverse @ self.G).reshape(N, s, n, 2 * n)

    def at_end(self, p: Array, v: Array, K: Array) -> tuple[Array, Array]:
        """States p, ṗ (N, n, …) at ends of intervals for p, ṗ = `v` at their starts and p̈ = K (N, s, n, …); SI."""
        h = self.h.reshape(-1, *(1 for _ in K.shape[2:]))
        once, twice = (np.einsum("i,Ni...->N...", b, K) for b in (self.scheme.end_once, self.scheme.end_twice))
        return p + h * v + h**2 * twice, v + h * once


class _LinearSystem:
    """Newton's equations: stages eliminated interval by interval, then a banded system for the values at breaks."""

    def __init__(self, problem: Problem, breaks: Array, derivatives: list[Array]) -> None:
        self.problem, n = problem, len(problem.scale)
        self.stages = Elimination(problem.scheme, np.diff(breaks), derivatives)
        self.S = np.concatenate([problem.scale, np.ones(n)])
        p, v = np.split(np.eye(2 * n), 2)
        Y = np.concatenate(self.stages.at_end(p, v, self.stages.response), axis=1)
        blocks = np.concatenate([Y, -np.broadcast_to(np.eye(2 * n), Y.shape)], axis=2)
        blocks = self.S[:, None] * blocks / np.tile(self.S, 2)
        first = len(problem.start.rows)
        self.lower, self.upper = first + 2 * n - 1, 4 * n - 1 - first
        # Conditions at the start, continuity at the end of each interval, conditions at the end, as LAPACK has bands
        (N, size), diagonal = blocks.shape[:2], self.lower + self.upper
        band = np.zeros((self.lower + diagonal + 1, (N + 1) * size))
        for k, rows, row in ((0, problem.start.rows / self.S, 0), (N, problem.end.rows / self.S, first)):
            i, j = np.indices(rows.shape)
            band[diagonal + row + i - j, size * k + j] = rows
        i, j = np.indices(blocks.shape[1:])
        columns = size * np.arange(N)[:, None, None] + j
        band[np.broadcast_to(diagonal + first + i - j, columns.shape), columns] = blocks
        self.lu, self.pivots, _ = scipy.linalg.lapack.dgbtrf(band, self.lower, self.upper)

    def solve(self, r: Array, p: Array, v: Array, K: Array) -> tuple[Array, Array, Array]:
        """Steps of p, ṗ at the breaks and of K at the stages."""
        (N, s, n), stages = r.shape, self.stages
        K_step = -(stages.E_inverse @ r.reshape(N, s * n, 1)).reshape(N, s, n)
        ends = stages.at_end(p[:-1], v[:-1], K + K_step)
        gap = self.S * np.concatenate([p[1:] - ends[0], v[1:] - ends[1]], axis=1)
        start, end = (
            -b.rows @ (np.concatenate([p[k], v[k]]) - b.state)
            for k, b in ((0, self.problem.start), (-1, self.problem.end))
        )
        x, _ = scipy.linalg.lapack.dgbtrs(
            self.lu, self.lower, self.upper, np.concatenate([start, gap.ravel(), end]), self.pivots
        )
        y = x.reshape(N + 1, 2 * n) / self.S
        K_step -= (stages.E_inverse @ (stages.G @ y[:-1, :, None])).reshape(N, s, n)
        return y[:, :n], y[:, n:], K_step
