"""Motors and patches together on a path, within limits: an optimal control problem on the internal dynamics.

docs/theory.md, Motors and patches together, has the problem, with compliant gears and a path tolerance. Each Newton
step solves its linearized equations for the least effort (43), or the least share of limits of voltages, currents
(|C V̇ + Φ_Vᵀ ṗ| ≤ i_max) or torques.
"""

from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ..inversion.collocation import GAUSS, between
from ..inversion.stable_inversion import PROBES, cut, halved
from ..inversion.zero_dynamics import shape_along
from .steps import TOLERANCE, Iterate, Steps
from .transition import Tracked, Transition, displaced_at

MOST_ITERATIONS = 30
FEWEST_ITERATIONS = 6  # after which Newton's steps are taken to wander among these motions
WANDERING = (1e-2, 1e-3)  # of the effort, one after the other, where they do
SLOW = 0.5  # of the step before: what moves more is damped
DAMPING = 0.01  # of the square of changes, in the effort; four times as much with each such step
WHILE_SETTLING = 1e-4  # of the last change of a share by Newton's steps, relative, where intervals are to change
NO_SHARE = 1e-2  # of the limits: shares below it are compared with it
ROUGH_GAP = 1e-6  # of the objective, there
GRADING = 2.5  # of breaks to both ends: tanh
MOST_INTERVALS = 1500
SETTLED = 0.02  # change of the least share of voltages by finer intervals, relative
CALM = (1e-3, 1e-2, 0.1)  # of the effort in these steps, each where they wander with those before
LOST = 0.5  # of the largest elastic force: where more is left over between Gauss points, no motion is near
OUT_OF_REACH = 5.0  # times the limits: more than so much voltage is not found to the end
TURNING = 0.3  # of the largest voltage, or of the limit of ë: by so much one changes in intervals that are then halved
QUICKLY = 5e-3  # of the share by Newton's steps, on intervals that are to change


def track(
    asked: Transition, breaks: Array, near: Tracked | None = None, calm: float | None = None, within: float = TOLERANCE
) -> Tracked:
    """Solve on `breaks` (N + 1,), s, from a motion `near`, or from quasi-static links and no voltages.

    Newton's method ends with a step smaller than the share `within` of the peaks.
    With `calm`, this share of the effort joins the objective, for voltages more of it away from the ends (theory.md).
    """
    if asked.tolerance is not None and near is None:  # exact tracking is a good start
        exact = track(replace(asked, tolerance=None), breaks, None, calm, within)
        near = exact if exact.converged else None
    driven, times = asked.driven, between(breaks, GAUSS.c)
    p_s, points, (n, m) = shape_along(driven, np.concatenate([breaks, times])), len(breaks), asked.Phi_V.shape
    K, e = np.zeros((points - 1, len(GAUSS.c), n)), np.zeros((points, 3 * asked.errors))
    tau_qs = driven.quasi_static(times, p_s[points:]).reshape(*K.shape[:2], -1)
    steps = Steps(asked, breaks, tau_qs, max(float(np.abs(driven.scale * p_s).max()), 1e-12))
    steps.tolerance = within if calm is None else max(within, WHILE_SETTLING)
    if near is None:
        start = Iterate(p_s[:points], np.zeros((points, n)), K, np.zeros((points, m * (asked.order + 1))), e, 1.0)
    else:
        V = np.hstack([near.voltage(breaks, order) for order in (asked.order, *range(asked.order))])
        K, share = near.curve(times, 2).reshape(K.shape), near.share if steps.has_share else 1.0
        if near.error is not None:
            e = np.hstack([near.error(breaks, order) for order in (2, 0, 1)])
        start = Iterate(near.curve(breaks), near.curve(breaks, 1), K, V, e, share)
        is_like = near.objective == asked.objective and (near.error is None) == (asked.errors == 0)
        if is_like and np.array_equal(near.voltage.x, breaks):
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


def graded(start: float, end: float, intervals: int) -> Array:
    """Breaks (intervals + 1,), s, closer together at both ends."""
    u = np.tanh(GRADING * np.linspace(-1.0, 1.0, intervals + 1)) / np.tanh(GRADING)
    return start + 0.5 * (end - start) * (1.0 + u)


def start_breaks(start: float, path_end: float, end: float, intervals: int) -> Array:
    """Breaks (intervals + 1,), s, closer together at both ends; those next to 0 and `path_end` are moved there."""
    breaks = graded(start, end, intervals)
    for t in (0.0, path_end):
        breaks[np.abs(breaks - t).argmin()] = t
    return breaks


def refined(asked: Transition, breaks: Array, tolerance: float, near: Tracked) -> Tracked:
    """The solution on `breaks` (N + 1,), s, divided until residual forces are below `tolerance`.

    `tolerance` is a share of the largest elastic force; torques between Gauss points exceed their limits by half of it
    at most. `near`: a motion to start from.
    """
    tracked, within = near, tolerance**0.5  # Newton's next step is about the square of the last one
    while True:
        tracked = track(asked, breaks, tracked, within=within)
        unmet, excess = _left_over(asked, tracked, tolerance)
        finer = cut(breaks, excess)
        is_fine = not len(breaks) < len(finer) <= MOST_INTERVALS or not asked.driven.goes_on()
        if not tracked.converged or (is_fine and within == tolerance):
            return replace(tracked, unmet=unmet)
        breaks, within = (breaks, tolerance) if is_fine else (finer, within)


def _left_over(asked: Transition, tracked: Tracked, tolerance: float) -> tuple[float, Array]:
    """`Tracked.unmet`, and by interval (N,) that, or torques beyond their limits, as multiples of the tolerance."""
    breaks = tracked.voltage.x
    times = between(breaks, PROBES)
    motion, driven = [tracked.curve(times, k) for k in range(3)], asked.driven
    if tracked.error is not None:
        driven = displaced_at(driven, times, np.array([tracked.error(times, order) for order in range(3)]))
    r, tau = driven.forces(times, *motion)
    largest = float(np.abs(asked.driven.scale**2 * motion[0]).max())
    unmet = np.abs(r - tracked.voltage(times) @ asked.Phi_V.T).max(axis=1) / largest
    beyond = 2 * (np.abs(tau[:, : len(asked.limits.torque)]) / asked.limits.torque - 1.0).max(axis=1, initial=0.0)
    return float(unmet.max()), np.maximum(unmet, beyond).reshape(len(breaks) - 1, -1).max(axis=1) / tolerance


def settled(asked: Transition, breaks: Array, to: float = SETTLED) -> Tracked:
    """The least voltage, on intervals that are halved where V or ë turns until it changes by at most the share `to`.

    The first intervals are between `breaks` (N + 1,), s. Where steps wander, more of the effort joins the objective, on
    intervals that are all halved. The least of all solutions that converge is taken; one with much force `LOST` between
    Gauss points did not converge. Far beyond the limits nothing is refined.
    """
    best, is_settled = _descend(asked, breaks, CALM[0], to)
    for calm in CALM[1:]:
        if is_settled or (best.converged and asked.is_limited and best.surely > OUT_OF_REACH):
            break
        calmer, is_settled = _descend(asked, halved(breaks), calm, to)
        best = min(best, calmer, key=lambda one: one.share if one.converged else np.inf)
    return best if best.converged else _judged(asked, track(asked, breaks))


def _judged(asked: Transition, tracked: Tracked) -> Tracked:
    unmet = _left_over(asked, tracked, 1.0)[0] if tracked.converged else np.inf
    return replace(tracked, unmet=unmet, converged=unmet <= LOST)


def _descend(asked: Transition, breaks: Array, calm: float, to: float) -> tuple[Tracked, bool]:
    """The least voltage with a share `calm` of the effort on finer and finer intervals, and whether it settled."""
    tracked, change = track(asked, breaks, None, calm), np.inf
    while tracked.converged and change > to and len(breaks) <= MOST_INTERVALS and asked.driven.goes_on():
        if asked.is_limited and tracked.surely > OUT_OF_REACH:
            break
        values = [tracked.voltage(breaks) / asked.units]  # changes of V as shares of limits; of ë times the least share
        if asked.tolerance is not None and tracked.error is not None:
            values.append(tracked.share * tracked.error(breaks, 2) / asked.tolerance.acceleration)
        changes = np.abs(np.diff(np.hstack(values), axis=0)).max(axis=1)
        breaks = halved(breaks, changes > TURNING * tracked.share)
        finer = track(asked, breaks, tracked, calm, QUICKLY)
        if not finer.converged:  # from other voltages steps wander less
            finer = track(asked, breaks, None, calm)
        if not finer.converged:
            break
        least = max(finer.share, NO_SHARE)
        change = abs(finer.share - tracked.share) / least
        tracked = replace(finer, doubt=2 * change + finer.added / least)
    if change <= to:
        tracked = replace(track(asked, breaks, tracked, calm), doubt=tracked.doubt)
    tracked = _judged(asked, tracked)
    return tracked, tracked.converged and change <= to
