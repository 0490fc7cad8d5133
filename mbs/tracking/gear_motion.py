"""Twists of compliant gears and torques of motors behind them, of a motion that carries the path: exact by intervals.

As in docs/theory.md, Motors and patches together: p(t) is a quintic spline through the breaks of the optimum, and
voltages make up for residual modal forces (flat outputs: Fliess et al., Int. J. Control 61, 1995).
"""

from collections.abc import Iterator
from dataclasses import replace
from math import ceil, comb, factorial
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, PPoly
from ...common.libraries import scipy
from ..inversion.collocation import between, gauss
from ..inversion.stable_inversion import halved
from ..model.model import Model
from ..run.record import GearCurve
from .geared import GearedServo, motor_names
from .problem import MOST_INTERVALS, track
from .transition import Limits, Tracked, Transition

TEN = gauss(10)
REACHES = 1e-6  # of the largest singular value of Φ_V: smaller ones are none
ROUNDING = 1e-13  # of the largest value, coefficients of Legendre's polynomials
NEAR_OPTIMUM = 1e-5  # last Newton step where gears give: voltages make an exact motion of any that is smooth
MOST_SHRINKINGS = 8  # of limits, for voltages and torques of motions behind gears
SHRUNK = 1.002, 1.1  # factor, and power of what exceeds them, by which they do
LASTS = 20.0  # D/K after which a gear has come to rest
GONE = 1e-12  # of the largest twist: decaying parts below it are none
MANY = np.arange(40) / 40  # of an interval, where a polynomial is looked at for its largest value
# Coefficients of Legendre's polynomials of 2ξ − 1 by values at the points, and powers of ξ, lowest first, by these
TO_SERIES = np.linalg.inv(np.polynomial.legendre.legvander(2 * TEN.c - 1, 9))
POWERS = np.array([[(-1.0) ** (k + i) * comb(k, i) * comb(k + i, i) for k in range(10)] for i in range(10)])
# of e^{−x} on [0, 1], lowest power first
EXPONENTIAL: Array = np.polynomial.Polynomial.fit(
    np.linspace(0, 1, 101), np.exp(-np.linspace(0, 1, 101)), 10, domain=[0, 1], window=[0, 1]
).coef


def within_limits(
    asked: Transition, limits: Limits, meshes: tuple[Array, Array], near: Tracked, *, tolerance: float, step: float
) -> Tracked:
    """The motion `asked` for with compliant gears, within `limits`, or else the motion that exceeds these least.

    `meshes` (breaks, s): the second is coarser, for cases without solution on the first; `near`: a first guess;
    `tolerance`: relative residual force on modes; `step` (s) of outputs.
    """
    near, wanted = _without_jumps(asked, meshes, near, tolerance), replace(asked, limits=limits)
    found, power, now = list[tuple[float, Tracked]](), SHRUNK[1], asked
    for _ in range(MOST_SHRINKINGS):
        if near.converged:
            now, last, tracked = asked, near, behind_gears(asked, near, step)
            shares = largest_shares(wanted, tracked)
            voltages = shares.voltage if asked.is_limited and asked.objective != "least-voltage" else 0.0
            torques = shares.torques if asked.objective != "least-torque" else 0.0 * shares.torques
            if asked.objective == "least-voltage":
                tracked = replace(tracked, share=max(tracked.share, shares.voltage))
            found.append((max(voltages, float(torques.max())), tracked))
            if found[-1][0] <= 1.0:
                break
        elif found:  # so small limits allow no motion
            power /= 2
        else:
            return near
        by = [np.where(share > 1.0, SHRUNK[0] * share**power, 1.0) for share in (voltages, torques)]
        patches = replace(now.limits.patches, range=now.limits.patches.range / by[0])
        asked = replace(now, limits=Limits(patches, now.limits.torque / by[1]))
        near = track(asked, last.voltage.x, last, within=NEAR_OPTIMUM)
    return min(found, key=lambda one: one[0])[1]


def _without_jumps(asked: Transition, meshes: tuple[Array, Array], near: Tracked, tolerance: float) -> Tracked:
    """The optimum on intervals that are halved, all of them, while that leaves less on modes of a motion without jumps.

    Splines swing where intervals are unlike, and where a zero passes through infinity finer ones do not help, or have
    no solution.
    """
    best = track(asked, meshes[0], near, within=NEAR_OPTIMUM)
    if not best.converged:
        best = track(asked, meshes[1], within=NEAR_OPTIMUM)
    left = smooth(asked, best).unmet if best.converged else 0.0
    while left > tolerance and 2 * len(best.voltage.x) <= MOST_INTERVALS and asked.driven.goes_on():
        finer = track(asked, halved(best.voltage.x), best, within=NEAR_OPTIMUM)
        left, last = smooth(asked, finer).unmet if finer.converged else np.inf, left
        if left > 0.5 * last:
            break
        best = finer
    return best


def behind_gears(asked: Transition, tracked: Tracked, step: float) -> Tracked:
    """The motion `tracked`, a solution of the problem `asked`, with its compliant gears.

    It is extended by multiples of `step` (s) until damped gears are at rest.
    """
    driven, gears = asked.driven, asked.gears
    assert isinstance(driven, GearedServo)
    assert gears is not None
    motion, (n, m) = smooth(asked, tracked), asked.Phi_V.shape
    lasts = step * ceil(LASTS * float((gears.damping / gears.stiffness).max()) / step)
    curve, voltage = _held(motion.curve, asked.rest[1], lasts), _held(motion.voltage, np.zeros(m), lasts)
    breaks, end = curve.x, motion.curve.x[-1]

    def curves(breaks: Array, torques: Array) -> dict[str, GearCurve]:
        """Twists of gears, and torques of their motors: what a rigid gear takes, and I δ̈."""
        of_all, motors = _through(breaks, torques), torques.shape[1] - len(gears.joints)
        by_joint = dict[str, GearCurve]()
        for k, joint in enumerate(gears.joints):
            transmitted, rigid = (
                scipy.interpolate.PPoly(of_all.c[:, :, i].copy(), breaks) for i in (motors + k, gears.columns[k])
            )
            twist = _twist(transmitted, gears.stiffness[k], gears.damping[k])
            torque, second = _on(rigid, twist.x), twist.derivative(2).c
            torque.c[-len(second) :] += gears.inertia[k] * second
            by_joint[joint] = GearCurve(twist, torque)
        return by_joint

    def along(breaks: Array) -> tuple[Array, list[Array]]:
        times = between(breaks, TEN.c)
        return times, [curve(times, k) for k in range(3)]

    times, states = along(breaks)
    alone = curves(breaks, driven.forces(times, *states)[1])
    pieces = np.concatenate([of.twist.x for of in alone.values()])
    breaks = np.union1d(breaks, pieces[(pieces < breaks[1]) | (pieces > end)])  # where δ̈ changes within D/K
    times, states = along(breaks)
    ahead = np.column_stack([of.twist(times, 2) for of in alone.values()]) * gears.inertia
    pushed = np.einsum("Tk,Tkf->Tf", ahead, driven.reactions(times, *states))
    torques = driven.forces(times, *states)[1] + np.hstack([pushed[:, n:], pushed[:, n + gears.columns]])
    more = pushed[:, :n] @ np.linalg.pinv(asked.Phi_V, rcond=REACHES).T
    voltage = _through(breaks, voltage(times) + more)
    return replace(motion, curve=curve, voltage=voltage, gears=curves(breaks, torques))


def smooth(asked: Transition, tracked: Tracked) -> Tracked:
    """The motion with p as a quintic spline at rest at both ends, and voltages for least residual forces on modes.

    Its third derivative is zero at the ends: else δ̈ would jump, and a motor might need an impulse.
    """
    breaks = tracked.voltage.x
    still = [(order, np.zeros(len(asked.Phi_V))) for order in (1, 2, 3)]
    knots = np.concatenate([breaks[:1].repeat(5), breaks, breaks[-1:].repeat(5)])
    through = np.delete(breaks, [1, -2])
    spline = scipy.interpolate.make_interp_spline(through, tracked.curve(through), t=knots, k=5, bc_type=(still, still))
    curve = _on(spline, breaks)
    times = between(breaks, TEN.c)
    p, wanted = curve(times), tracked.voltage(times)
    left = asked.driven.residuals(times, p, curve(times, 1), curve(times, 2)) - wanted @ asked.Phi_V.T
    more = left @ np.linalg.pinv(asked.Phi_V, rcond=REACHES).T  # least voltages, as far as patches reach modes
    unmet = float(np.abs(left - more @ asked.Phi_V.T).max() / np.abs(asked.driven.scale**2 * p).max())
    return replace(tracked, curve=curve, voltage=_through(breaks, wanted + more), unmet=unmet)


class Shares(NamedTuple):
    """Largest shares of limits in a motion."""

    voltage: float  # of `Weights.voltage` where patches have no limits
    torques: Array  # (motors,), no unit, 0 of motors without a limit
    peak_times: Array  # (motors,) s, of the largest torques


def largest_shares(asked: Transition, tracked: Tracked) -> Shares:
    """Largest shares of limits that voltages and torques of motors reach at many points of each interval.

    Torques of motors behind gears accelerate their rotors, too.
    """
    gears, count = asked.gears, len(asked.limits.torque)
    assert gears is not None
    breaks = np.unique(np.concatenate([of.twist.x for of in tracked.gears.values()]))
    times = np.append(between(breaks, MANY), breaks[-1])
    (least, most), V, torques = asked.ranges["voltage"], tracked.voltage(times), np.zeros((len(times), count))
    if len(gears.joints) < count:
        torques[:] = asked.driven.forces(times, *(tracked.curve(times, k) for k in range(3)))[1][:, :count]
    for column, joint in zip(gears.columns, gears.joints, strict=True):
        torque = tracked.gears[joint].torque
        assert torque is not None
        torques[:, column] = torque(times)
    of_voltages, torques = float(np.maximum(V / most, V / least).max()), np.abs(torques)
    return Shares(of_voltages, torques.max(axis=0) / asked.limits.torque, times[torques.argmax(axis=0)])


def torques_beyond(model: Model, shares: Shares) -> Iterator[str]:
    """Yield warnings on motors whose torques exceed their limits between the points at which these are constraints."""
    names = motor_names(model)
    for k in np.flatnonzero(shares.torques > 1.0):
        yield (
            f"the motor of {names[k]} reaches {100 * shares.torques[k]:.4g} % of its moment_limit at"
            f" t = {shares.peak_times[k]:.4g} s,"
            " between the points of intervals where its torque is limited: a slower path, or a larger moment_limit"
        )


def _through(breaks: Array, values: Array) -> PPoly:
    """Polynomials through values (N · 10, k) at points `TEN`, without what is rounding: their derivatives are used."""
    h = np.diff(breaks)
    series = np.einsum("ij,Njk->Nik", TO_SERIES, values.reshape(len(h), len(TEN.c), -1))
    series = np.where(np.abs(series) > ROUNDING * np.abs(values).max(axis=0, initial=1e-300), series, 0.0)
    powers = np.einsum("ij,Njk->iNk", POWERS, series) / h[:, None] ** np.arange(len(TEN.c))[:, None, None]
    return scipy.interpolate.PPoly(powers[::-1], breaks)


def _on(curve: PPoly, breaks: Array) -> PPoly:
    """The same with pieces between other breaks, which contain its own."""
    degree = curve.k if isinstance(curve, scipy.interpolate.BSpline) else len(curve.c) - 1
    return scipy.interpolate.PPoly(
        np.array([curve(breaks[:-1], order) / factorial(order) for order in range(degree, -1, -1)]), breaks
    )


def _held(curve: PPoly, values: Array, lasts: float) -> PPoly:
    """The same, and then `values` (k,) for so long (s)."""
    if not lasts:
        return curve
    still = np.zeros_like(curve.c[:, :1])
    still[-1, 0] = values
    return scipy.interpolate.PPoly(np.concatenate([curve.c, still], axis=1), np.append(curve.x, curve.x[-1] + lasts))


def _twist(transmitted: PPoly, stiffness: float, damping: float) -> PPoly:
    """δ with K δ + D δ̇ = τ_s from rest on: Σ (−D/K)^j τ_s^{(j)}/K, and what decays as e^{−K t/D} from each break."""
    breaks, lag = transmitted.x, damping / stiffness
    series, derivative = transmitted.c / stiffness, transmitted
    if not lag:
        return scipy.interpolate.PPoly(series, breaks)
    for order in range(1, len(series)):
        derivative = derivative.derivative()
        series[order:] += (-lag) ** order * derivative.c / stiffness
    steady, h = scipy.interpolate.PPoly(series, breaks), np.diff(breaks)
    first, last = series[-1], np.polyval(series, h)
    none = GONE * float(np.abs(first).max())
    starts, sizes = list[Array](), list[Array]()
    decaying = float(transmitted.c[-1, 0] / stiffness - first[0])
    for k, step in enumerate(h):
        parts = 1 if abs(decaying) <= none else min(ceil(step / lag), ceil(np.log(abs(decaying) / none)) + 1)
        at = lag * np.arange(parts)
        at = at[at < step * (1 - 1e-9)]
        starts.append(breaks[k] + at)
        gone = np.exp(-at / lag) * decaying
        sizes.append(np.where(np.abs(gone) > none, gone, 0.0))
        decaying = float(decaying * np.exp(-step / lag) + last[k] - (first[k + 1] if k + 1 < len(h) else last[k]))
    fine = _on(steady, np.append(np.concatenate(starts), breaks[-1]))
    powers = (EXPONENTIAL / lag ** np.arange(len(EXPONENTIAL)))[::-1, None] * np.concatenate(sizes)
    powers[-len(fine.c) :] += fine.c  # of a lower degree, `TEN` points
    return scipy.interpolate.PPoly(powers, fine.x)
