"""Intervals of tracking: graded at first, halved until the least voltage settles, cut until no force is left over."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, as_floats
from ..inversion.stable_inversion import PROBES, cut, halved
from .problem import NO_SHARE, track
from .transition import Tracked, Transition

GRADING = 2.5  # of breaks to both ends: tanh
MOST_INTERVALS = 1500
SETTLED = 0.02  # change of the least share of voltages by finer intervals, relative
CALM = (1e-3, 1e-2, 0.1)  # of the effort in these steps, each where they wander with those before
LOST = 0.5  # of the largest elastic force: where more is left over between Gauss points, no motion is near
OUT_OF_REACH = 5.0  # times the limits: more than so much voltage is not found to the end
TURNING = 0.3  # of the largest voltage, or of the limit of ë: by so much one changes in intervals that are then halved
QUICKLY = 5e-3  # of the share by Newton's steps, on intervals that are to change


def graded(start: float, end: float, intervals: int) -> Array:
    """Breaks (intervals + 1,), closer together at both ends."""
    u = np.tanh(GRADING * np.linspace(-1.0, 1.0, intervals + 1)) / np.tanh(GRADING)
    return as_floats(start + 0.5 * (end - start) * (1.0 + u))


def start_breaks(start: float, path_end: float, end: float, intervals: int) -> Array:
    """Graded breaks (intervals + 1,), s, those next to 0 and `path_end` moved there."""
    breaks = graded(start, end, intervals)
    for t in (0.0, path_end):
        breaks[np.abs(breaks - t).argmin()] = t
    return breaks


def refined(asked: Transition, breaks: Array, tolerance: float, goes_on: Callable[[], bool], near: Tracked) -> Tracked:
    """Return the solution on intervals halved until residual forces are below `tolerance` of the largest elastic one.

    Nor are torques then further beyond the limits asked for than by half this share of them, where they are looked at.
    """
    tracked, within = near, tolerance**0.5  # Newton's next step is about the square of the last one
    while True:
        tracked = track(asked, breaks, tracked, within=within)
        unmet, excess = _left_over(asked, tracked, tolerance)
        finer = cut(breaks, excess)
        is_fine = not len(breaks) < len(finer) <= MOST_INTERVALS or not goes_on()
        if not tracked.converged or (is_fine and within == tolerance):
            return replace(tracked, unmet=unmet)
        breaks, within = (breaks, tolerance) if is_fine else (finer, within)


def _left_over(asked: Transition, tracked: Tracked, tolerance: float) -> tuple[float, Array]:
    """`Tracked.unmet`, and by interval (N,) that, or torques beyond their limits, as multiples of the tolerance."""
    breaks = tracked.voltage.x
    times = (breaks[:-1, None] + np.diff(breaks)[:, None] * PROBES).ravel()
    motion = [tracked.curve(times, k) for k in range(3)]
    r, tau = asked.driven_at(times, tracked.error).forces(times, *motion)
    r = r - tracked.voltage(times) @ asked.Phi_V.T
    unmet = np.abs(r).max(axis=1) / float(np.abs(asked.driven.scale**2 * motion[0]).max())
    beyond = 2 * (np.abs(tau[:, : len(asked.limits.torque)]) / asked.limits.torque - 1.0).max(axis=1, initial=0.0)
    return float(unmet.max()), np.maximum(unmet, beyond).reshape(len(breaks) - 1, -1).max(axis=1) / tolerance


def settled(asked: Transition, breaks: Array, goes_on: Callable[[], bool], to: float = SETTLED) -> Tracked:
    """The least voltage, on intervals that are halved where V or ë turns until that changes it by at most `to`.

    Both are linear on each interval: finer ones allow more of them, so that the least share falls. Where steps wander,
    more of the effort joins it, on intervals that are all halved. All that converge count, and the least one is taken;
    where much is `LOST` between Gauss points it is no motion and did not converge. Surely far beyond the limits it is
    not refined.
    """
    best, is_settled = _descend(asked, breaks, CALM[0], goes_on, to)
    for calm in CALM[1:]:
        if is_settled or (best.converged and asked.is_limited and best.surely > OUT_OF_REACH):
            break
        calmer, is_settled = _descend(asked, halved(breaks), calm, goes_on, to)
        best = min(best, calmer, key=lambda one: one.share if one.converged else np.inf)
    best = best if best.converged else track(asked, breaks)
    unmet = _left_over(asked, best, 1.0)[0] if best.converged else np.inf
    return replace(best, unmet=unmet, converged=unmet <= LOST)


def _descend(
    asked: Transition, breaks: Array, calm: float, goes_on: Callable[[], bool], to: float
) -> tuple[Tracked, bool]:
    """The least voltage with a share `calm` of the effort on finer and finer intervals, and whether it settled."""
    tracked, change = track(asked, breaks, None, calm), np.inf
    while tracked.converged and change > to and len(breaks) <= MOST_INTERVALS and goes_on():
        if asked.is_limited and tracked.surely > OUT_OF_REACH:
            break
        breaks = halved(breaks, _changes(asked, tracked) > TURNING * tracked.share)
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
    return tracked, tracked.converged and change <= to


def _changes(asked: Transition, tracked: Tracked) -> Array:
    """Largest changes (N,) of V in each interval as shares of limits, and of ë likewise, times the least share."""
    breaks = tracked.voltage.x
    values = [tracked.voltage(breaks) / asked.units]
    if asked.tolerance is not None and tracked.error is not None:
        values.append(tracked.share * tracked.error(breaks, 2) / asked.tolerance.acceleration)
    return as_floats(np.abs(np.diff(np.hstack(values), axis=0)).max(axis=1))
