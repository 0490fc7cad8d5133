"""Motions made of polynomials: laws from rest to rest, paths through waypoints with holds, input shapers.

Laws s(t) from 0 to 1 are polynomials, or a step that is averaged over times T₁ ≥ T₂ ≥ … (docs/theory.md, Paths).
"""

from collections.abc import Sequence
from dataclasses import replace
from math import exp, factorial, inf, perm, pi, sqrt
from typing import Literal, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .._core import TimeFunction

SAME_TIME = 1e-12  # of a motion's duration: breaks nearer to each other are one


@struct
class Piecewise:
    """n components (m, rad) over time: polynomials between `breaks` (k + 1,), s; outside they rest where they are.

    coefficients: (k, order, n), SI, highest power first, in powers of t − left break.
    """

    breaks: Array
    coefficients: Array

    @property
    def begin(self) -> float:
        """Start time of the motion, s."""
        return float(self.breaks[0])

    @property
    def end(self) -> float:
        """End time of the motion, s."""
        return float(self.breaks[-1])

    def moved(self, factor: float = 1.0, delay: float = 0.0) -> "Piecewise":
        """Return the motion stretched by `factor` about t = 0, then delayed by `delay` (s)."""
        powers = factor ** -np.arange(self.coefficients.shape[1] - 1, -1, -1.0)
        return Piecewise(factor * self.breaks + delay, self.coefficients * powers[None, :, None])

    def along(self, change: Array) -> "Piecewise":
        """The motion of one component times a vector `change` (n,), any unit."""
        return Piecewise(self.breaks, self.coefficients * change)

    @property
    def first(self) -> Array:
        """Initial value (n,), m or rad."""
        return self.coefficients[0, -1]

    @property
    def last(self) -> Array:
        """Final value (n,), m or rad."""
        return shifted(self.coefficients[-1], self.end - self.breaks[-2])[-1]

    def sample(self, times: Array, derivative: int = 0) -> Array:
        """Derivative no. k (T, n), m or rad per sᵏ, at `times` (T,), s; at jumps that of the following piece."""
        t = np.clip(times, self.begin, self.end)
        piece = np.clip(np.searchsorted(self.breaks, t, side="right") - 1, 0, len(self.coefficients) - 1)
        powers = range(self.coefficients.shape[1] - 1, derivative - 1, -1)
        values = np.zeros((len(t), self.coefficients.shape[2]))
        for k, power in enumerate(powers):
            values = values * (t - self.breaks[piece])[:, None] + perm(power, derivative) * self.coefficients[piece, k]
        return values if derivative == 0 else np.where((t == times)[:, None], values, 0.0)

    def polynomials(self) -> list[TimeFunction]:
        """One function of time for each component, without values before and after the motion."""
        each = np.ascontiguousarray(np.moveaxis(self.coefficients, 2, 0))
        return [TimeFunction.polynomial(self.breaks, one) for one in each]

    def functions(self) -> list[TimeFunction]:
        """One function of time for each component, constant before and after the motion."""
        return [function.held(self.begin, self.end) for function in self.polynomials()]


def shifted(coefficients: Array, s: Array | float) -> Array:
    """Polynomials in x (…, order, n), highest power first, in powers of x − s, s (…), by Horner; any units."""
    moved, s = coefficients.copy(), np.asarray(s)[..., None]
    for last in range(moved.shape[-2], 1, -1):
        for k in range(1, last):
            moved[..., k, :] += s * moved[..., k - 1, :]
    return moved


def superposed(motions: Sequence[Piecewise], weights: Sequence[float] | None = None) -> Piecewise:
    """Σ weight · motion (weights 1 where not given); each motion rests before its begin and after its end."""
    breaks = merged(np.concatenate([motion.breaks for motion in motions]))
    middles = 0.5 * (breaks[1:] + breaks[:-1])
    order = max(motion.coefficients.shape[1] for motion in motions)
    total = np.zeros((len(middles), order, motions[0].coefficients.shape[2]))
    changes = np.zeros((len(breaks), total.shape[2]))  # of what motions at rest add up to
    for motion, weight in zip(motions, weights or [1.0] * len(motions), strict=True):
        begin, end = np.searchsorted(middles, (motion.begin, motion.end))
        changes[0] += weight * motion.first
        changes[begin] -= weight * motion.first
        changes[end] += weight * motion.last
        own, during = order - motion.coefficients.shape[1], slice(begin, end)
        piece = np.searchsorted(motion.breaks, middles[during]) - 1
        total[during, own:] += weight * shifted(motion.coefficients[piece], breaks[during] - motion.breaks[piece])
    total[:, -1] += np.cumsum(changes[:-1], axis=0)
    return Piecewise(breaks, total)


def merged(instants: Array) -> Array:
    """`instants` (any,), s, ascending; those that differ by round-off are one."""
    every = np.unique(instants)
    return every[np.append(True, np.diff(every) > SAME_TIME * np.ptp(every))]


Profile = Literal["rest-to-rest", "s-curve", "trapezoid"]

SMOOTHNESS: dict[Profile, int] = {"rest-to-rest": 4, "s-curve": 2, "trapezoid": 1}
"""Number of continuous derivatives where the scene gives none."""
SHORTEST = 1e-9  # of a motion's duration: what is shorter would be lost by round-off
HALF = 0.5  # of each time of averaging to the one before, where no limit says otherwise


class PathLimits(NamedTuple):
    """Limits of speed, acceleration and jerk along a path segment, m/s or rad/s and so on; infinite if none."""

    speed: float = inf
    acceleration: float = inf
    jerk: float = inf


def law_in(duration: float, profile: Profile, smoothness: int) -> Piecewise:
    """The law of motion s(t) from 0 to 1 in `duration` (s); `smoothness`: number of continuous derivatives."""
    if profile == "rest-to-rest":
        return polynomial_law(smoothness).moved(duration)
    times = HALF ** np.arange(smoothness + 1)
    return averaged_step(duration * times / times.sum())


def law_within(distance: float, limits: PathLimits, profile: Profile, smoothness: int) -> Piecewise:
    """The fastest law s(t) from 0 to 1 with which a motion over `distance` (m or rad) satisfies `limits`.

    `smoothness`: number of continuous derivatives. Raises `ValueError` where parts of it are too short beside others.
    """
    if profile == "rest-to-rest":
        peaks = [distance * law_peak(smoothness, order) for order in (1, 2, 3)]
        times = [(peak / limit) ** (1 / k) for k, (peak, limit) in enumerate(zip(peaks, limits, strict=True), 1)]
        return law_in(max(times), profile, smoothness)
    averaged = [T for T in averaging_times(distance, limits) if T > 0.0]
    while len(averaged) < smoothness + 1:
        averaged.append(HALF * averaged[-1])
    check_durations(averaged, sum(averaged))
    return averaged_step(np.array(averaged))


def check_durations(durations: Sequence[float], total: float) -> None:
    """Raise `ValueError` if a part of a motion (s) is negligibly short against its `total`, s."""
    if not SHORTEST * total < min(durations) <= max(durations) < inf:
        raise ValueError(
            f"expected limits and times that fit each other in size, found a motion of {total:.3g} s with parts of"
            f" {min(durations):.3g} s"
        )


def averaging_times(distance: float, limits: PathLimits) -> tuple[float, float, float]:
    """Averaging times T₁ ≥ T₂ + T₃, T₂ ≥ T₃ (s) of the fastest motion over `distance` (m, rad) within `limits`.

    T₃ = 0 without a limit of jerk.
    """
    h, (v, a, j) = distance, limits
    T_3 = min(a / j, sqrt(v / j), (h / (2 * j)) ** (1 / 3)) if j < inf else 0.0
    if T_3:
        a = j * T_3  # what is reached
    T_2 = max(T_3, min(v / a, (sqrt(T_3**2 + 4 * h / a) - T_3) / 2))
    return max(T_2 + T_3, h / (a * T_2)), T_2, T_3


def averaged_step(times: Array) -> Piecewise:
    """The step from 0 to 1 at t = 0, averaged over each of the `times` (m + 1,), s: m continuous derivatives.

    The highest derivative is constant between the sums of some of the times; the others follow by integration.
    """
    n = len(times)
    instants, signs = np.zeros(1), np.ones(1)
    for T in times:
        instants, signs = np.concatenate([instants, instants + T]), np.concatenate([signs, -signs])
    breaks = merged(instants)
    jumps = [signs[np.abs(instants - t) <= 2 * SAME_TIME * times.sum()].sum() for t in breaks]
    highest = np.cumsum(jumps) / np.prod(times)
    coefficients = np.zeros((len(breaks) - 1, n + 1, 1))
    state = np.zeros(n)
    for k, step in enumerate(np.diff(breaks)):
        derivatives = np.append(state, highest[k])  # s, ṡ, …
        coefficients[k, :, 0] = [derivatives[m] / factorial(m) for m in range(n, -1, -1)]
        state = shifted(coefficients[k], step)[::-1, 0][:n] * [factorial(m) for m in range(n)]
    return Piecewise(breaks, coefficients)


def polynomial_law(smoothness: int) -> Piecewise:
    """s(t) ∝ ∫ t^m (1 − t)^m dt on [0, 1], m = `smoothness`: as many derivatives vanish at both ends.

    It has two pieces against the round-off of large coefficients at its end.
    """
    whole = _polynomial(smoothness)[:, None]
    return Piecewise(np.array([0.0, 0.5, 1.0]), np.array([whole, shifted(whole, 0.5)]))


def law_peak(smoothness: int, order: int) -> float:
    """The largest size of the derivative of this `order` of `polynomial_law` on [0, 1]."""
    derivative = np.polyder(_polynomial(smoothness), order)
    turns = np.roots(np.polyder(derivative))
    inside = turns.real[(np.abs(turns.imag) < 1e-9) & (turns.real > 0.0) & (turns.real < 1.0)]
    return float(np.abs(np.polyval(derivative, np.concatenate([[0.0, 1.0], inside]))).max())


def _polynomial(m: int) -> Array:
    """(2m + 2,) coefficients, highest power first."""
    bell = (-1.0) ** m * np.poly([0.0] * m + [1.0] * m)
    return np.polyint(bell) * (factorial(2 * m + 1) / factorial(m) ** 2)


SAMPLES = 64  # of each polynomial, to find where a rounded path is fastest


@struct
class Legs:
    """A path of k legs through `places` (k + 1, n), m or rad; it rests at the first until `start` (s)."""

    places: Array
    start: float
    # profile, smoothness: law of motion of each leg, and its number of continuous derivatives
    profile: Profile
    smoothness: int
    limits: PathLimits  # of the speed along the path and its derivatives
    durations: tuple[float, ...] | None  # (k,) s of each leg; None: the shortest within the limits
    holds: tuple[float, ...]  # (k − 1,) s, rests at the places between
    # overlap of legs without hold, as a share of the shorter one: the path passes within the triangle of three places
    blend: float = 0.0
    stretch: float = 1.0  # factor of the times of all legs, not of holds


def path_of(legs: Legs) -> Piecewise:
    """The motion along `legs`; where these overlap, all are slowed down equally to stay within the limits."""
    motion = _joined(legs)
    if not legs.blend or legs.durations is not None:
        return motion
    excess = max(
        (_peak(motion, order) / (limit / legs.stretch**order)) ** (1 / order)
        for order, limit in enumerate(legs.limits, 1)
    )
    return _joined(replace(legs, stretch=legs.stretch * excess)) if excess > 1.0 else motion


def _joined(legs: Legs) -> Piecewise:
    """p₀ + Σ (p_{i+1} − p_i) s_i(t − t_i)."""
    changes = np.diff(legs.places, axis=0)
    kind = legs.profile, legs.smoothness
    if legs.durations is not None:
        laws = [law_in(duration, *kind) for duration in legs.durations]
    else:
        laws = [law_within(float(way), legs.limits, *kind) for way in np.linalg.norm(changes, axis=1)]
    laws = [law.moved(legs.stretch) for law in laws]
    begin, moving = legs.start, []
    for k, (law, change) in enumerate(zip(laws, changes, strict=True)):
        if k and legs.holds[k - 1]:
            begin += legs.holds[k - 1]
        elif k:
            begin -= legs.blend * min(laws[k - 1].end, law.end)
        moving.append(law.moved(delay=begin).along(change))
        begin += law.end
    check_durations([law.end for law in laws], begin)
    rest = Piecewise(moving[0].breaks[:2], legs.places[None, :1])
    return superposed([rest, *moving])


def _peak(motion: Piecewise, order: int) -> float:
    times = np.concatenate([np.linspace(a, b, SAMPLES) for a, b in zip(motion.breaks, motion.breaks[1:], strict=False)])
    return float(np.linalg.norm(motion.sample(times, order), axis=1).max())


Kind = Literal["zv", "zvd", "ei"]

RESIDUAL = 0.05  # of the vibration, that an EI shaper leaves at its frequency to leave no more about it


class Impulse(NamedTuple):
    """The share of a motion that begins `delay` (s) later; all shares together are 1."""

    share: float
    delay: float


def impulses(kind: Kind, frequency: float, damping_ratio: float) -> list[Impulse]:
    """The impulses of a shaper for vibrations of one undamped `frequency`, Hz.

    "zv" leaves no vibration of that frequency (Singer and Seering 1990, J. Dyn. Syst. Meas. Control 112); "zvd" none,
    with zero derivative by frequency; "ei" at most 5 % over a wider range (Singhose, Seering and Singer 1994, J. Mech.
    Des. 116). Shares fall with K = exp(−ζπ/√(1 − ζ²)), by which half a period damps a vibration.
    """
    damped = sqrt(1.0 - damping_ratio**2)
    half, K, V = 0.5 / (frequency * damped), exp(-damping_ratio * pi / damped), RESIDUAL
    parts = {"zv": (1.0, 1.0), "zvd": (1.0, 2.0, 1.0), "ei": (1.0 + V, 2.0 - 2.0 * V, 1.0 + V)}[kind]
    shares = [part * K**k for k, part in enumerate(parts)]
    return [Impulse(share / sum(shares), k * half) for k, share in enumerate(shares)]


def shaped(motion: Piecewise, sequence: list[Impulse]) -> Piecewise:
    """The motion shaped by one `sequence` of impulses; it is longer by the last delay."""
    return superposed([motion.moved(delay=impulse.delay) for impulse in sequence], [i.share for i in sequence])
