"""Stable inversion: the bounded p(t) for which motors alone carry a path (Devasia, Chen and Paden 1996; Seifried 2014).

Where zeros lie in the right half plane, collocation solves a two-point problem (docs/theory.md, Torque-only tracking).
Otherwise it is an initial value problem, solved window by window.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, Booleans, ComplexArray, PPoly
from ...common.errors import SolveError
from ...common.libraries import scipy
from ...common.structs import struct
from .. import _core
from .collocation import GAUSS, OF_SECOND_ORDER, Boundary, Problem, between, collocate
from .servo import Servo, Stopped
from .zero_dynamics import Linearisation, equilibrium, first_order, linear_dynamics

FIRST_INTERVALS = 24  # of each of: before, on and after the path
WINDOW = 32  # intervals integrated forward at once
SHORTEST = 1e-7  # of all the time, an interval of them
MOST_INTERVALS = 3000  # solved at once
MOST_REFINEMENTS = 14
MOST_PLACES = 200  # along a motion at which derivatives are taken again
MOST_PARTS = 6  # an interval is cut into at once
TINY = 1e-300
PROBES = np.sort(np.concatenate([(GAUSS.c[1:] + GAUSS.c[:-1]) / 2, [0.01, 0.5, 0.99]]))  # where r is looked at


@struct
class Inversion:
    """`curve` p(t) (n,), m·√kg, from before the path to after it, and how it was found.

    `unmet` is the largest residual modal force between collocation points, relative to the largest elastic one;
    `worst` (s) is when it occurs, or where iterations converge least; `off_rest` is the distance from rest at the
    start, relative to its peak.
    """

    servo: Servo
    linearisation: Linearisation
    curve: PPoly
    status: str
    iterations: int
    unmet: float
    worst: float
    off_rest: float


def invert(
    servo: Servo, linear: Linearisation, pre: float, post: float, tolerance: float, progress: Callable[[float], bool]
) -> Inversion:
    """Solve r(t, p, ṗ, p̈) = 0 on [−pre, end + post] (s) until r between breaks is below `tolerance`.

    `tolerance` is a share of the largest elastic force. `progress`, called with the time reached (s), says whether to
    go on. Raises `SolveError` where there is no equilibrium at the start or the end, or where zeros change sides.
    """
    end = float(linear.times[-1])
    start, finish = _boundaries(servo, linear, -pre, end + post)
    size, force = (max(TINY, float(np.abs(servo.scale**k * linear.shape).max())) for k in (1, 2))
    schemes = [OF_SECOND_ORDER] if not linear.is_light.any() else [GAUSS]
    if linear.singular_after:  # either may lose the p̈ that has no factor for a moment
        schemes = [GAUSS, OF_SECOND_ORDER]
    is_marched, breaks = not len(finish.rows), np.unique([-pre, 0.0, end, end + post])
    if not is_marched:
        breaks = np.unique([np.linspace(a, b, FIRST_INTERVALS + 1) for a, b in pairwise(breaks)])
    breaks = with_corners(breaks, (*servo.functions, *servo.model.scene.load_functions))
    for scheme in schemes:
        problem = Problem(servo.residuals, linear.dynamics, servo.scale, size, start, end=finish, scheme=scheme)
        solver = _Solver(servo, problem, tolerance * force, progress)
        try:
            (solver.march if is_marched else solver.solve)(breaks)
        except Stopped:
            if solver.curve is None:
                raise
            solver.status = "interrupted"
        if solver.status in ("completed", "interrupted"):
            break
    assert solver.curve is not None
    off = np.hstack([solver.curve(solver.curve.x), solver.curve(solver.curve.x, 1)]) - start.state
    away = np.linalg.norm(off * np.append(servo.scale, np.ones_like(servo.scale)), axis=1)
    return Inversion(
        servo=servo,
        linearisation=linear,
        curve=solver.curve,
        status=solver.status,
        iterations=solver.iterations,
        unmet=solver.unmet / force,
        worst=solver.worst,
        off_rest=float(away[0] / max(float(away.max()), TINY)),
    )


class _Solver:
    """Collocation on intervals that are cut until r is below `most` everywhere; keeps what was found last."""

    curve: PPoly | None = None

    def __init__(self, servo: Servo, problem: Problem, most: float, progress: Callable[[float], bool]) -> None:
        self.servo, self.problem, self.most, self.progress = servo, problem, most, progress
        self.status, self.iterations, self.unmet, self.worst = "", 0, 0.0, 0.0

    def solve(self, breaks: Array) -> None:
        """Solve on all `breaks` (N + 1,), s, at once, from rest as at the start."""
        guess = _constant(self.problem.start.state[: len(self.problem.scale)], breaks)
        is_near = True  # derivatives to the guess
        for refinement in range(MOST_REFINEMENTS):
            collocated = collocate(self.problem, breaks, guess)
            self.iterations += collocated.iterations
            unmet, self.worst = np.full(len(breaks) - 1, np.inf), collocated.worst
            self.status = "mesh too coarse" if collocated.converged else "inversion not converged"
            if collocated.converged:
                self.curve, unmet = collocated.curve, self._unmet(collocated.curve)
                self.worst = float(breaks[unmet.argmax()])
            if unmet.max() <= self.most:
                self.status, self.unmet = "completed", float(unmet.max())
                return
            if not self.progress(float(breaks[0] + (breaks[-1] - breaks[0]) * refinement / MOST_REFINEMENTS)):
                self.status = "interrupted"
                break
            if collocated.converged:
                breaks, guess, is_near = cut(breaks, unmet / self.most), collocated.curve, False
            elif not is_near:
                times = breaks[:: -(-len(breaks) // MOST_PLACES)]
                derivatives = linear_dynamics(self.servo, times, *(guess(times, k) for k in range(3)))
                self.problem, is_near = replace(self.problem, derivatives=derivatives), True
            else:
                breaks = halved(breaks)
            if len(breaks) > MOST_INTERVALS + 1:
                break
        self.unmet, self.curve = float(unmet.max()), self.curve or collocated.curve

    def march(self, corners: Array) -> None:
        """One window after the other between `corners` (k,), s, each from where the last ended, while r allows.

        With derivatives near the state there: iterations with others get out of phase with fast vibrations.
        """
        along = self.problem.derivatives
        y, n, t, end = self.problem.start.state, len(self.problem.scale), float(corners[0]), float(corners[-1])
        width = (end - t) / FIRST_INTERVALS
        while t < end:
            last = min(float(corners[corners > t][0]), t + WINDOW * width)
            window = np.linspace(t, last, int(np.ceil((last - t) / width - 1e-6)) + 1)
            derivatives = _about(self.servo, along, t, y)
            self.problem = replace(self.problem, derivatives=derivatives, start=Boundary(np.eye(2 * n), y))
            collocated = collocate(self.problem, window, _constant(y[:n], window))
            self.iterations += collocated.iterations
            unmet = float(self._unmet(collocated.curve).max()) if collocated.converged else np.inf
            wider = float(np.clip(0.9 * (self.most / max(unmet, TINY)) ** 0.25, 0.2, 4.0))
            width = float(window[1] - window[0]) * wider
            if unmet <= self.most:
                self.unmet, t = max(self.unmet, unmet), last
                if self.curve is None:
                    self.curve = collocated.curve
                else:
                    self.curve.extend(collocated.curve.c, collocated.curve.x[1:])
                y = np.concatenate([self.curve(last), self.curve(last, 1)])
                self.status = "completed" if t >= end else "interrupted"
                if not self.progress(t):
                    break
            elif width < SHORTEST * (end - float(corners[0])):
                self.status = "mesh too coarse" if collocated.converged else "inversion not converged"
                self.curve, self.worst = self.curve or collocated.curve, collocated.worst
                break

    def _unmet(self, curve: PPoly) -> Array:
        """Largest |r| between the collocation points of each interval (N,)."""
        times = between(curve.x, PROBES)
        r = np.abs(self.problem.residual(times, *(curve(times, k) for k in range(3)))).max(axis=1)
        return np.nan_to_num(r, nan=np.inf).reshape(-1, len(PROBES)).max(axis=1)


def _about(servo: Servo, along: Callable[[Array], Array], t: float, y: Array) -> Callable[[Array], Array]:
    """Those `along` the path, with what the state y (2n,) at time t changes of them."""
    now, (p, v) = np.array([t]), y.reshape(2, 1, -1)
    here = linear_dynamics(servo, now, p, v, 0 * p)
    changes = np.array([here.M, here.D, here.K]) - along(now)
    return lambda times: along(times) + changes


def _boundaries(servo: Servo, linear: Linearisation, first: float, last: float) -> tuple[Boundary, Boundary]:
    """What holds at the times `first` and `last`, 2n conditions in all.

    A zero that passes through infinity takes a condition away, or brings one: p̈ of a fast motion loses its factor
    there, and a motion without it is smooth (what is left of it shows in `unmet`). The fastest motion then has one
    condition more or less: intervals far longer than it lets it neither grow nor decay.
    """
    enforced = [~linear.is_future[0], linear.is_future[-1].copy()]
    excess = int(sum(of.sum() for of in enforced)) - linear.zeros.shape[1]
    if excess and not linear.singular_after:
        raise SolveError(
            f"stable inversion needs as many zeros in the right half plane at t = 0 s as at t ="
            f" {linear.times[-1]:g} s, found {np.count_nonzero(~enforced[0])} and {np.count_nonzero(enforced[1])}."
            " Change the number of modes in the link files, end the path in a posture more like the first, or use"
            ' output = "redefined"'
        )
    zeros = linear.zeros[[0, -1]]
    speeds = np.where([of if excess > 0 else ~of for of in enforced], np.abs(zeros), 0.0).max(axis=1)
    counts = [int(of.sum()) for of in enforced]
    counts[int(speeds.argmax())] -= excess
    start, end = map(partial(_boundary, servo), (first, last), zeros, enforced, counts)
    return start, end


def _boundary(servo: Servo, t: float, s: ComplexArray, is_enforced: Booleans, count: int) -> Boundary:
    """No part of y − y_rest in the subspace of the zeros s (2n,) that are enforced, of the equilibrium at time t.

    An orthonormal basis of the left invariant subspace, from the ordered Schur form of 𝒜ᵀ with eigenvalues near s;
    `count` of them, without some of the fastest that are enforced, or with some of the fastest others.
    """
    p, rest = equilibrium(servo, t), np.zeros((1, len(servo.scale)))
    A = first_order(linear_dynamics(servo, np.array([t]), p[None], rest, rest), servo.scale)[0]
    others = [is_enforced]  # sets of zeros, each within the next one, up to one with at least `count`
    is_more = bool(is_enforced.sum() < count)
    while not min(x.sum() for x in others) <= count <= max(x.sum() for x in others):
        fastest = s[np.where(others[-1] != is_more, np.abs(s), -1.0).argmax()]
        pair = np.abs(s.real + 1j * np.abs(s.imag) - fastest.real - 1j * abs(fastest.imag)) <= 1e-9 * abs(fastest)
        others.append(np.where(pair, is_more, others[-1]))
    basis = np.zeros((2 * len(p), 0))
    for enforced in sorted(others, key=lambda x: int(x.sum())):
        _, U, size = scipy.linalg.schur(
            A.T, sort=lambda re, im, of=enforced: bool(of[np.abs(s - complex(re, abs(im))).argmin()])
        )
        more = U[:, :size] - basis @ (basis.T @ U[:, :size])
        basis = np.hstack([basis, np.linalg.svd(more, full_matrices=False)[0][:, : enforced.sum() - basis.shape[1]]])
    rows = basis[:, :count].T * np.concatenate([servo.scale, np.ones_like(servo.scale)])
    return Boundary(rows, np.concatenate([p, rest[0]]))


def with_corners(breaks: Array, functions: Iterable[_core.TimeFunction]) -> Array:
    """`breaks` (N + 1,), s, and the times inside at which conditions such as t < 0.1 change in `functions`."""
    corners = np.unique([t for function in functions for t in function.switches()])
    near = np.abs(breaks[:, None] - corners).min(axis=0) <= SHORTEST * (breaks[-1] - breaks[0])
    within = (corners > breaks[0]) & (corners < breaks[-1])
    return np.union1d(breaks, corners[within & ~near])


def cut(breaks: Array, excess: Array) -> Array:
    """Return `breaks` (N + 1,), s, with intervals divided by their `excess` (N,), error over tolerance ∝ h⁴."""
    parts = np.where(excess > 1, np.clip(np.ceil(1.1 * np.minimum(excess, 1e9) ** 0.25), 2, MOST_PARTS), 1).astype(int)
    pieces = [np.linspace(a, b, k, endpoint=False) for a, b, k in zip(breaks[:-1], breaks[1:], parts, strict=True)]
    return np.concatenate([*pieces, breaks[-1:]])


def halved(breaks: Array, which: Booleans | slice = slice(None)) -> Array:
    """`breaks` (N + 1,), s, with the intervals `which` halved, by default all."""
    return np.sort(np.concatenate([breaks, ((breaks[1:] + breaks[:-1]) / 2)[which]]))


def _constant(p: Array, breaks: Array) -> PPoly:
    return scipy.interpolate.PPoly(p[None, None], breaks[[0, -1]])
