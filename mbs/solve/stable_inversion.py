"""Stable inversion: the bounded p(t) for which motors alone carry a path (Devasia, Chen and Paden 1996; Seifried 2014).

Where zeros lie in the right half plane, integrating forward diverges. Decaying motions are told by the past, growing
ones by the future: at rest long before the path the part in the stable subspace vanishes, at rest long after it the
part in the unstable one. Collocation solves this two-point problem at once. Without such zeros it is an initial value
problem, solved window by window. Intervals are cut where r(t) ≠ 0 between the collocation points.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np

from ...common.arrays import Array, ComplexArray, as_floats
from ...common.errors import SolveError
from .. import _core
from .collocation import GAUSS, Boundary, Found, Problem, collocate
from .internal_dynamics import LinearDynamics, Output, equilibrium, first_order, is_unstable, linear_dynamics, zeros

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

SAMPLES = 33  # of the linear dynamics along the path
FIRST_INTERVALS = 24  # of each of: before, on and after the path
SHAPE_ITERATIONS = 8  # of that shape, each a hundred times closer for links that are not very soft
RESOLVED = 5.0  # largest interval times the fastest zero where it is integrated forward
WINDOW = 32  # intervals integrated forward at once
MOST_INTERVALS = 3000  # solved at once
MOST_REFINEMENTS = 14
MOST_PARTS = 6  # an interval is cut into at once
TINY = 1e-300
PROBES = np.sort(np.concatenate([(GAUSS.c[1:] + GAUSS.c[:-1]) / 2, [0.01, 0.5, 0.99]]))  # where r is looked at

States = Callable[[Array], tuple[Array, Array, Array]]
"""(p, ṗ, p̈), each (N, n), at any times (N,)."""


@dataclass(frozen=True)
class Linearisation:
    """The internal dynamics along the path, with the shape (N, n) that the links sag to there, at its times."""

    dynamics: LinearDynamics
    shape: Array
    zeros: ComplexArray  # (N, 2n) 1/s

    @property
    def times(self) -> Array:
        """From 0 to the end of the path (N,)."""
        return self.dynamics.times


S = TypeVar("S", bound=Output)


@dataclass(frozen=True)
class Inversion(Generic[S]):
    """p(t) from −pre to end + post, and how it was found.

    `unmet` is the largest modal force that nobody supplies between collocation points, relative to the largest elastic
    one; `off_rest` how far from rest the start is: ‖(ω(p − p_0), ṗ)‖ relative to its peak.
    """

    servo: S
    linearisation: Linearisation
    curve: PPoly
    status: str
    iterations: int
    unmet: float
    off_rest: float

    @property
    def shape(self) -> list[list[_core.TimeFunction]]:
        """p_k(t) of each body, for the core."""
        columns = iter(self.curve.c.transpose(2, 1, 0))
        return [
            [_core.TimeFunction.polynomial(self.curve.x, np.ascontiguousarray(next(columns))) for _ in range(count)]
            for count in self.servo.mode_counts
        ]


def linearise(servo: Output, end: float) -> Linearisation:
    """About links that follow their loads on the path as springs would: r(t, p, 0, 0) = 0.

    Raises `SolveError` where they are too soft for that.
    """
    times = as_floats(np.linspace(0.0, end, SAMPLES))
    rest: Array = np.zeros((SAMPLES, len(servo.scale)))
    p = rest
    K = linear_dynamics(servo, times, rest, rest, rest).K
    for _ in range(SHAPE_ITERATIONS):
        p = p - np.linalg.solve(K, servo.residuals(times, p, rest, rest)[:, :, None])[:, :, 0]
    dynamics = linear_dynamics(servo, times, p, rest, rest)
    lost = ~np.isfinite(dynamics.M.sum(axis=(1, 2)) + dynamics.D.sum(axis=(1, 2)) + dynamics.K.sum(axis=(1, 2)))
    if lost.any():
        raise SolveError(
            f"{servo.scene_path}: motors alone cannot carry the path at t = {times[lost.argmax()]:g} s: the"
            " links are too soft for their loads there; slow the path down"
        )
    return Linearisation(dynamics, p, zeros(dynamics, servo.scale))


def invert(
    servo: S, linear: Linearisation, pre: float, post: float, tolerance: float, progress: Callable[[float], bool]
) -> Inversion[S]:
    """Solve r(t, p, ṗ, p̈) = 0 on [−pre, end + post] until nothing above `tolerance` is left between the breaks.

    Raises `SolveError` where there is no equilibrium to start from or to end in, or where zeros change sides.
    """
    end = float(linear.times[-1])
    start, finish = _boundary(servo, -pre, unstable=False), _boundary(servo, end + post, unstable=True)
    if len(start.rows) + len(finish.rows) != 2 * len(servo.scale):
        raise SolveError(
            f"{servo.scene_path}: stable inversion needs as many zeros in the right half plane before the"
            f" path as after it, found {2 * len(servo.scale) - len(start.rows)} and {len(finish.rows)}"
        )
    problem = Problem(
        servo.residuals, linear.dynamics, servo.scale,
        max(TINY, float(np.abs(servo.scale * linear.shape).max())), start, finish,
    )  # fmt: skip
    force = max(TINY, float(np.abs(servo.scale**2 * linear.shape).max()))
    solver = _Solver(problem, tolerance * force, progress)
    if len(finish.rows):
        solver.solve(_breaks(pre, end, post), _constant(start.state[: len(servo.scale)]))
    else:

        def about(times: Array, p: Array, v: Array) -> LinearDynamics:
            one = np.ones((len(times), 1))
            return linear_dynamics(servo, times, one * p, one * v, 0 * one * p)

        solver.march(_breaks(pre, end, post, RESOLVED / float(np.abs(linear.zeros).max())), about)
    return Inversion(
        servo, linear, solver.curve, solver.status, solver.iterations, solver.unmet / force,
        _off_rest(servo, solver.curve, start.state),
    )  # fmt: skip


class _Solver:
    """Collocation on intervals that are cut until r is below `most` everywhere; keeps what was found last."""

    curve: PPoly

    def __init__(self, problem: Problem, most: float, progress: Callable[[float], bool]) -> None:
        self.problem, self.most, self.progress = problem, most, progress
        self.status, self.iterations, self.unmet = "", 0, 0.0

    def solve(self, breaks: Array, guess: States) -> Found:
        """On all breaks at once."""
        for refinement in range(MOST_REFINEMENTS):
            found = collocate(self.problem, breaks, guess)
            self.curve, self.iterations = found.curve, self.iterations + found.iterations
            unmet = self._unmet(found.curve) if found.converged else np.full(len(breaks) - 1, np.inf)
            self.status = "mesh too coarse" if found.converged else "inversion not converged"
            if unmet.max() <= self.most:
                self.status, self.unmet = "completed", max(self.unmet, float(unmet.max()))
                return found
            finer = _refined(breaks, as_floats(unmet / self.most)) if found.converged else _halved(breaks)
            if len(finer) > MOST_INTERVALS + 1:
                break
            if not self.progress(float(breaks[0] + (breaks[-1] - breaks[0]) * refinement / MOST_REFINEMENTS)):
                self.status = "interrupted"
                break
            breaks, guess = finer, _states(found.curve) if found.converged else guess
        self.unmet = max(self.unmet, float(unmet.max()))
        return found

    def march(self, breaks: Array, about: Callable[[Array, Array, Array], LinearDynamics]) -> None:
        """One window after the other, each from where the last one ended; about(times, p, ṗ) linearises there.

        Iterations with derivatives from elsewhere get out of phase with fast vibrations within a window.
        """
        start, n = self.problem.start.state, len(self.problem.scale)
        pieces: list[PPoly] = []
        for first in range(0, len(breaks) - 1, WINDOW):
            window = breaks[first : first + WINDOW + 1]
            derivatives = about(window[[0, len(window) // 2, -1]], start[:n], start[n:])
            self.problem = replace(self.problem, derivatives=derivatives, start=Boundary(np.eye(2 * n), start))
            self.solve(window, _constant(start[:n]))
            pieces.append(self.curve)
            if self.status != "completed" or not self.progress(float(self.curve.x[-1])):
                self.status = "interrupted" if self.status == "completed" else self.status
                break
            p, v, _ = _states(self.curve)(self.curve.x[-1:])
            start = np.concatenate([p[0], v[0]])
        self.curve = pieces[0]
        for piece in pieces[1:]:
            self.curve.extend(piece.c, piece.x[1:])

    def _unmet(self, curve: PPoly) -> Array:
        """Largest |r| between the collocation points of each interval (N,)."""
        times = (curve.x[:-1, None] + np.diff(curve.x)[:, None] * PROBES).ravel()
        r = np.abs(self.problem.residual(times, *_states(curve)(times))).max(axis=1)
        largest: Array = np.nan_to_num(r, nan=np.inf).reshape(-1, len(PROBES)).max(axis=1)
        return largest


def _boundary(servo: Output, t: float, unstable: bool) -> Boundary:
    """No part of y − y_rest in the unstable subspace of the equilibrium at time t, or none in the rest.

    An orthonormal basis of the left invariant subspace, from the ordered Schur form of 𝒜ᵀ. Undamped motions count as
    decaying ones: at rest before the path, ringing on after it.
    """
    from scipy.linalg import schur

    p, rest = equilibrium(servo, t), np.zeros((1, len(servo.scale)))
    A = first_order(linear_dynamics(servo, np.array([t]), p[None], rest, rest), 0, servo.scale)
    _, U, count = schur(A.T, sort=lambda re, im: bool(is_unstable(np.asarray(complex(re, im)))) == unstable)
    rows = U[:, :count].T * np.concatenate([servo.scale, np.ones_like(servo.scale)])
    return Boundary(rows, np.concatenate([p, rest[0]]))


def _breaks(pre: float, end: float, post: float, widest: float = np.inf) -> Array:
    """Even breaks before, on and after the path, whose ends are breaks; (N+1,)."""
    parts = [(-pre, 0.0), (0.0, end), (end, end + post)]
    pieces = [np.linspace(a, b, max(FIRST_INTERVALS, int((b - a) / widest)) + 1) for a, b in parts if b > a]
    breaks: Array = np.unique(np.concatenate(pieces))
    return breaks


def _refined(breaks: Array, excess: Array) -> Array:
    """Breaks that cut interval k into as many parts as its `excess` over the tolerance asks for: r falls as h⁴."""
    parts = np.where(excess > 1, np.clip(np.ceil(1.1 * np.minimum(excess, 1e9) ** 0.25), 2, MOST_PARTS), 1).astype(int)
    pieces = [np.linspace(a, b, k, endpoint=False) for a, b, k in zip(breaks[:-1], breaks[1:], parts, strict=True)]
    return np.concatenate([*pieces, breaks[-1:]])


def _halved(breaks: Array) -> Array:
    return np.sort(np.concatenate([breaks, (breaks[1:] + breaks[:-1]) / 2]))


def _constant(p: Array) -> States:
    def states(times: Array) -> tuple[Array, Array, Array]:
        rest = np.zeros((len(times), len(p)))
        return rest + p, rest, rest

    return states


def _states(curve: PPoly) -> States:
    rate, acceleration = curve.derivative(1), curve.derivative(2)
    return lambda times: (curve(times), rate(times), acceleration(times))


def _off_rest(servo: Output, curve: PPoly, rest: Array) -> float:
    p, v, _ = _states(curve)(curve.x)
    size = np.hypot(np.linalg.norm(servo.scale * (p - rest[: p.shape[1]]), axis=1), np.linalg.norm(v, axis=1))
    return float(size[0] / max(float(size.max()), TINY))
