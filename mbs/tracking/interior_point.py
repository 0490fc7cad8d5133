"""Convex quadratic programs along a time axis, by a primal-dual interior point method.

Predictor and corrector are Mehrotra's (Nocedal and Wright, *Numerical Optimization*, ch. 16.6), with further
correctors for longer steps (Gondzio, Comput. Optim. Appl. 6, 1996). Newton's equations in the order (R_0, x_0, λ_0,
x_1, λ_1 …) are banded, and factorized with pivoting: growing and decaying solutions side by side need it.
"""

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import as_strided

from ...common.arrays import Array
from ...common.libraries import scipy
from ...common.structs import struct

MOST_ITERATIONS = 60
FEASIBLE = 1e-10  # of equations and inequalities, relative to their data
GAP = 1e-9  # of the objective: closer, weights of dependent limits spoil the factors
STATIONARY = 1e-8  # of the Lagrangian's gradient, relative to its terms
EXACT = 1e-12  # of what Newton's equations contain: that may be left
HALFWAY = 1e-5  # of the objective: the gap where a similar program begins
BACK = 0.995  # of the way to the nearest bound
CORRECTORS, LONGER = 2, 0.3  # at most, and by how much each is to lengthen the step
SPREAD = 10.0  # of slack × z about their target, which no corrector changes


@struct
class Program:
    """Quadratic program over time, any units, in unknowns x_0 … x_N (s,) and z_k = (x_k, the first r of x_{k+1}).

    min Σ_k ½ z_kᵀ H_k z_k + g_kᵀ z_k with F_k x_k + G_k x_{k+1} = c_k and C_k z_k ≤ d_k: H (N, s + r, s + r),
    g (N, s + r), F, G (N, e, s), c (N, e), C (N, i, s + r), d (N, i). `start`, `end`: R, e of R x = e at x_0 and x_N.
    """

    H: Array
    g: Array
    F: Array
    G: Array
    c: Array
    start: tuple[Array, Array]
    end: tuple[Array, Array]
    C: Array
    d: Array

    def z(self, x: Array) -> Array:
        """All z_k (N, s + r) of x (N + 1, s), any unit."""
        return np.hstack([x[:-1], x[1:, : self.g.shape[1] - x.shape[1]]])


class Minimum(NamedTuple):
    """Solution x (N + 1, s) of a `Program`, in its units, multipliers (N, i) ≥ 0 of C z ≤ d; whether it converged.

    `halfway`: slack, multipliers and all unknowns, x less that of the minimum, at an iteration inside the bounds.
    """

    x: Array
    multipliers: Array
    converged: bool
    halfway: tuple[Array, Array, Array]


class _Equations:
    """Newton's equations [H + CᵀWC, Aᵀ; A, 0] as LAPACK stores bands, with room for pivots.

    Unknowns (size,): R_0's multipliers, then x_k and λ_k by turns, R_N's multipliers.
    """

    def __init__(self, program: Program) -> None:
        self.program, (N, e, s) = program, program.F.shape
        first, last = len(program.start[0]), len(program.end[0])
        self.s, self.r, self.period = s, program.g.shape[1] - s, s + e
        self.size = first + N * self.period + s + last
        self.x = first + self.period * np.arange(N + 1)[:, None] + np.arange(s)
        self.equations = first + s + self.period * np.arange(N)[:, None] + np.arange(e)
        self.of_start, self.of_end = np.arange(first), self.size - last + np.arange(last)
        self.band = max(s + e + self.r, first + s, s + last) - 1
        used = np.flatnonzero(program.C.any(axis=(0, 1)))
        self.C = program.C[:, :, : used.max(initial=-1) + 1]
        self.ab = np.zeros((self.size, 3 * self.band + 1)).T  # columns contiguous, as LAPACK takes them
        self.factors = np.empty_like(self.ab)
        self._add_costs(self.ab, program.H)
        x, equations = self.x[:, 0], self.equations[0, 0]
        for row, column, of in (
            (equations, x[0], program.F),
            (equations, x[1], program.G),
            (0, x[0], program.start[0][None]),
            (self.size - last, x[-1], program.end[0][None]),
        ):
            self._add(self.ab, row, column, of)
            self._add(self.ab, column, row, of.transpose(0, 2, 1))

    def factorize(self, W: Array) -> bool:
        """Factors in the place of those before; False where it is singular."""
        b = self.band
        self.factors[b:] = self.ab[b:]  # but for the room
        self._add_costs(self.factors, (self.C * W[:, :, None]).transpose(0, 2, 1) @ self.C)
        self.factors, self.pivots, info = scipy.linalg.lapack.dgbtrf(self.factors, b, b, overwrite_ab=True)
        return bool(info == 0)

    def solve(self, right: Array) -> Array:
        """The unknowns."""
        return scipy.linalg.lapack.dgbtrs(self.factors, self.band, self.band, right, self.pivots)[0]

    def _add_costs(self, ab: Array, blocks: Array) -> None:
        parts = (self.x[0, 0], slice(None, self.s)), (self.x[1, 0], slice(self.s, None))
        for (row, of_rows), (column, of_columns) in product(parts, parts):
            self._add(ab, row, column, blocks[:, of_rows, of_columns])

    def _add(self, ab: Array, row: int, column: int, blocks: Array) -> None:
        """Blocks (k, i, j), the first at (row, column), the others by one period each further down the diagonal."""
        length = len(ab)
        first = ab.T.ravel()[column * length + 2 * self.band + row - column :]
        strides = self.period * length, 1, length - 1
        as_strided(first, blocks.shape, [first.itemsize * stride for stride in strides])[...] += blocks

    def add(self, to: Array, of_z: Array) -> None:
        """What belongs to each z_k (N, s + r), to unknowns."""
        to[self.x[:-1]] += of_z[:, : self.s]
        to[self.x[1:, : self.r]] += of_z[:, self.s :]

    def left(self, unknown: Array, z: Array) -> Array:
        """Minus the gradient of the Lagrangian by all unknowns, with multipliers z (N, i)."""
        left, program = -self.linear(unknown, z), self.program
        self.add(left, -program.g)
        left[self.equations] += program.c
        left[self.of_start] += program.start[1]
        left[self.of_end] += program.end[1]
        return left

    def linear(self, unknown: Array, z: Array) -> Array:
        """The part of this gradient that is linear in `unknown` and in z."""
        program, left = self.program, np.zeros(self.size)
        x, multiplier = unknown[self.x], unknown[self.equations]
        self.add(left, _times(program.H, program.z(x)) + _transposed_times(program.C, z))
        left[self.x[:-1]] += _transposed_times(program.F, multiplier)
        left[self.x[1:]] += _transposed_times(program.G, multiplier)
        for (rows, _), at, k in ((program.start, self.of_start, 0), (program.end, self.of_end, -1)):
            left[self.x[k]] += rows.T @ unknown[at]
            left[at] = rows @ x[k]
        left[self.equations] = _times(program.F, x[:-1]) + _times(program.G, x[1:])
        return left


def minimize(program: Program, gap: float = GAP, near: Minimum | None = None) -> Minimum:
    """Minimize to a relative duality gap of `gap`, starting from the solution `near` of a similar program."""
    way = _CentralPath(program, gap, near)
    halfway = way.slack, way.z, way.unknown
    for _ in range(MOST_ITERATIONS):
        if way.is_at_end() or not way.advance():
            break
        if way.gap * way.count > HALFWAY * way.size():
            halfway = way.slack, way.z, way.unknown
    multipliers = np.where(way.slack < way.z, way.z, 0.0)  # of bounds that are reached
    x, change = way.unknown[way.equations.x], halfway[2].copy()
    change[way.equations.x] -= x
    return Minimum(x, multipliers, way.is_at_end(), (*halfway[:2], change))


class _CentralPath:
    """Unknowns, slack and multipliers z (N, i) of the inequalities on their way to the minimum."""

    def __init__(self, program: Program, relative_gap: float, near: Minimum | None) -> None:
        self.program, self.equations, self.relative_gap = program, _Equations(program), relative_gap
        self.reach = np.abs(program.d).max(initial=1.0)
        self.force = 1 + float(np.abs(program.g).sum())
        self.count = max(1, program.d.size)
        if near is not None:
            self.slack, self.z, self.unknown = near.halfway
        else:  # at the minimum of ½ zᵀ H z + gᵀ z + ½ |slack|², with slack made positive
            self.equations.factorize(np.ones_like(program.d))
            self.unknown = self.equations.solve(self.equations.left(np.zeros(self.equations.size), -program.d))
            slack = self._slack()
            least = 1e-1 * float(np.abs(slack).max(initial=self.reach))
            self.slack = slack + max(0.0, least - float(slack.min(initial=np.inf)))
            self.z = self.force * float(self.slack.sum()) / (self.count**2 * self.slack)  # on the central path
        self._look()

    def _slack(self) -> Array:
        return self.program.d - _times(self.program.C, self.program.z(self.unknown[self.equations.x]))

    def _look(self) -> None:
        """Take what equations and inequalities leave here, and the mean of slack × z."""
        self.right = self.equations.left(self.unknown, self.z)
        self.of_slack = self._slack() - self.slack
        self.gap = float((self.slack * self.z).sum()) / self.count

    def is_at_end(self) -> bool:
        program, places, right = self.program, self.equations, self.right
        off = np.abs(right[places.equations]).max(initial=0.0) / (1 + np.abs(program.c).max(initial=0.0))
        if max(off, np.abs(self.of_slack).max(initial=0.0) / self.reach) > FEASIBLE:
            return False
        if self.gap * self.count > self.relative_gap * self.size():
            return False
        multipliers = np.abs(self.unknown[places.equations])
        terms = _transposed_times(np.abs(program.F), multipliers).max(initial=self.force)
        return bool(np.abs(right[places.x]).max() <= STATIONARY * terms)

    def size(self) -> float:
        """What gaps are small against."""
        program, z = self.program, self.program.z(self.unknown[self.equations.x])
        return 1 + abs(float((z * (0.5 * _times(program.H, z) + program.g)).sum()))

    def advance(self) -> bool:
        """One step of predictor and corrector; False where there is none."""
        slack, z = self.slack, self.z
        if not self.equations.factorize(z / slack) or not np.isfinite(self.gap):
            return False
        _, d_slack, dz = self._toward(slack * z, is_refined=False)
        ways = min(1.0, _way(slack, d_slack)), min(1.0, _way(z, dz))
        after = float(((slack + ways[0] * d_slack) * (z + ways[1] * dz)).sum()) / self.count
        target = self.gap * (after / self.gap) ** 3 if self.gap else 0.0
        target = max(target, 0.5 * self.relative_gap * self.size() / self.count)  # less spoils the factors' weights
        products, step = slack * z + d_slack * dz - target, -1.0
        for _ in range(1 + CORRECTORS):
            toward = self._toward(products)
            way = min(1.0, BACK * min(_way(slack, toward[1]), _way(z, toward[2])))
            if way <= step:
                break
            step, (dx, d_slack, dz) = way, toward
            longer = min(1.0, step + LONGER)
            reached = (slack + longer * d_slack) * (z + longer * dz)
            most = SPREAD * target
            products += np.minimum(reached - reached.clip(target / SPREAD, most), most)
        self.unknown, self.slack, self.z = self.unknown + step * dx, slack + step * d_slack, z + step * dz
        self._look()
        return True

    def _toward(self, products: Array, *, is_refined: bool = True) -> tuple[Array, Array, Array]:
        """Steps of unknowns, slack and z by which slack × z loses `products`.

        With a step of refinement where it is needed: close to the end weights span many powers of ten.
        """
        program, equations = self.program, self.equations
        pull = (products + self.z * self.of_slack) / self.slack
        to = self.right.copy()
        equations.add(to, _transposed_times(program.C, pull))
        dx = equations.solve(to)
        if is_refined:
            weighted = self.z / self.slack * _times(program.C, program.z(dx[equations.x]))
            left = to - equations.linear(dx, weighted)
            if np.abs(left).max() > EXACT * np.abs(to).max():
                dx += equations.solve(left)
        d_slack = self.of_slack - _times(program.C, program.z(dx[equations.x]))
        return dx, d_slack, -(products + self.z * d_slack) / self.slack


def _times(A: Array, x: Array) -> Array:
    """A_k x_k (N, i) of A (N, i, a) and x (N, a)."""
    return (A @ x[:, :, None])[:, :, 0]


def _transposed_times(A: Array, y: Array) -> Array:
    """A_kᵀ y_k (N, a) of A (N, i, a) and y (N, i)."""
    return (y[:, None] @ A)[:, 0]


def _way(values: Array, step: Array) -> float:
    """The longest share of a step that leaves positive values positive, at most 1 / BACK."""
    shrinking = step < 0
    return float(np.min(-values[shrinking] / step[shrinking], initial=1 / BACK))
