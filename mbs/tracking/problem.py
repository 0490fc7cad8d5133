"""Motors and patches together on a path, within limits: an optimal control problem on the internal dynamics.

With patches r(t, p, ṗ, p̈) = Φ_V V (`zero_dynamics`). p̈ is a polynomial on each interval through the four Gauss
points of `collocation`, V is linear between breaks: limits at breaks are limits everywhere. Each Newton step solves

    min  1/(t₁−t₀) ∫ ½ |τ − τ_qs|²/τ_ref² + ½ |V|²/V_ref² + ½ T_r² |V̇|²/V_ref² dt,
    V_min ≤ V ≤ V_max, |V̇| ≤ s_max, |C V̇ + Φ_Vᵀ ṗ| ≤ i_max, |τ| ≤ τ_max

or the least share of the limits of voltages, currents or torques, of the linearized equations; τ_qs carries the links
as they sag. Links rest at both ends. Output transition with free internal states: Perez and Devasia, Automatica 39
(2003).

A motor behind a compliant gear supplies τ + I τ̈_s/K, with what the gear transmits, τ_s: there V̈ is linear between
breaks, and T_r⁴|V̈|² takes the place of T_r²|V̇|².

Within a path tolerance the path of points is y_d + e, and r and τ contain e, ė, ë as well: ë is linear between breaks,
|e| ≤ e_max, |ë| ≤ e_max/T_e², e = ė = 0 at both ends. Without the limit of ë the error would jump to e_max at once.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ..inversion.collocation import GAUSS
from ..inversion.zero_dynamics import shape_along
from .steps import TOLERANCE, Iterate, Steps
from .transition import Tracked, Transition

MOST_ITERATIONS = 30
FEWEST_ITERATIONS = 6  # after which Newton's steps are taken to wander among these motions
WANDERING = (1e-2, 1e-3)  # of the effort, one after the other, where they do
SLOW = 0.5  # of the step before: what moves more is damped
DAMPING = 0.01  # of the square of changes, in the effort; four times as much with each such step
WHILE_SETTLING = 1e-4  # of the last change of a share by Newton's steps, relative, where intervals are to change
NO_SHARE = 1e-2  # of the limits: shares below it are compared with it
ROUGH_GAP = 1e-6  # of the objective, there


def track(
    asked: Transition, breaks: Array, near: Tracked | None = None, calm: float | None = None, within: float = TOLERANCE
) -> Tracked:
    """Solve on `breaks` (N + 1,), from a motion `near`, or from links as they sag and no voltages.

    Newton's method ends with a step `within` that share of the peaks.
    With `calm`, such a share of the effort joins a least share, which a few steps find within `WHILE_SETTLING`. That of
    voltages grows to one away from the ends: with equal weights, forces are left over between Gauss points (theory.md).
    """
    if asked.tolerance is not None and near is None:  # exact tracking is a good start
        exact = track(replace(asked, tolerance=None), breaks, None, calm, within)
        near = exact if exact.converged else None
    driven, h = asked.driven, np.diff(breaks)
    times = breaks[:-1, None] + h[:, None] * GAUSS.c
    N, s, n, m = *times.shape, *asked.Phi_V.shape
    flat = times.ravel()
    p_s = shape_along(driven, np.concatenate([breaks, flat]))
    p, v, u = p_s[: N + 1].copy(), np.zeros((N + 1, n)), np.zeros((N + 1, m * (asked.order + 1)))
    K, sag_at = np.zeros((N, s, n)), p_s[N + 1 :]
    tau_qs = driven.quasi_static(flat, sag_at).reshape(N, s, -1)
    size = max(float(np.abs(driven.scale * p_s).max()), 1e-300)
    if near is not None:
        p, v = near.curve(breaks), near.curve(breaks, 1)
        u = np.hstack([near.voltage(breaks, order) for order in (asked.order, *range(asked.order))])
        K = near.curve(flat, 2).reshape(K.shape)
    steps = Steps(asked, breaks, tau_qs, size)
    steps.tolerance = within if calm is None else max(within, WHILE_SETTLING)
    e = np.zeros((N + 1, 3 * asked.errors))
    if near is not None and near.error is not None:
        e = np.hstack([near.error(breaks, order) for order in (2, 0, 1)])
    start = Iterate(p, v, K, u, e, near.share if near is not None and steps.has_share else 1.0)
    is_like = near is not None and near.objective == asked.objective and (near.error is None) == (asked.errors == 0)
    if near is not None and is_like and np.array_equal(near.voltage.x, breaks):
        start = replace(start, moved=near.step, found=near.found)
    if calm is not None:
        middle = 0.5 * (breaks[1:] + breaks[:-1])
        away = asked.rate * np.minimum(middle - breaks[0], breaks[-1] - middle)
        steps.gap, steps.unique, steps.of_voltages = ROUGH_GAP, calm, np.minimum(1.0, calm * np.exp(away)) / calm
        return _newton(steps, start, FEWEST_ITERATIONS).tracked(steps)
    last = _newton(steps, start, FEWEST_ITERATIONS if steps.has_share else MOST_ITERATIONS)
    if steps.has_share and not last.converged:
        start = replace(start, iterations=last.iterations)
        for steps.unique in WANDERING:
            iterate = _newton(steps, start, MOST_ITERATIONS)
            if not iterate.converged:
                break
            start = last = iterate
    return last.tracked(steps)


def _newton(steps: Steps, start: Iterate, most: int) -> Iterate:
    """Newton's steps from `start`, no more than `most`, counted on from it."""
    scale, size = steps.asked.driven.scale, steps.size
    now, steps.sigma, previous = replace(start, converged=False), start.share, start.moved
    share = np.inf if start.found is None else start.share
    for iteration in range(start.iterations + 1, start.iterations + most + 1):
        old = now
        now = steps.take(old)
        change = max(float(np.abs(scale * (now.p - old.p)).max()), float(np.abs(now.v - old.v).max()))
        moved = change / max(float(np.abs(scale * now.p).max()), float(np.abs(now.v).max()), size)
        now = replace(now, iterations=iteration, moved=moved)
        if not (np.isfinite(moved) and now.found is not None and now.found.converged):
            break
        shrunk = moved**2  # about the size of the next step, which is not taken where it is small
        if steps.has_share:  # V(t) of linear programs is not unique
            moved = abs(now.share - share) / max(abs(now.share), NO_SHARE)
            share = now.share
        else:
            shrunk = shrunk / previous if previous < np.inf else np.inf
        if min(moved, shrunk) <= steps.tolerance or (moved <= 1e-7 and moved > 0.3 * previous):
            return replace(now, converged=True)
        if not steps.has_share and moved > SLOW * previous:
            steps.damping = max(DAMPING, 4 * steps.damping)
        previous = moved
    return now
