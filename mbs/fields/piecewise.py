"""Motions made of polynomials: what paths are put together from, with exact derivatives."""

from __future__ import annotations

from collections.abc import Sequence
from math import perm

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.structs import struct
from .._core import TimeFunction

SAME_TIME = 1e-12  # of a motion's duration: breaks nearer to each other are one


@struct
class Piecewise:
    """n components over time: polynomials between `breaks` (k + 1,), s; at rest outside, with their values there.

    coefficients: (k, order, n), highest power first, in powers of t − left break.
    """

    breaks: Array
    coefficients: Array

    @property
    def begin(self) -> float:
        """When the motion begins, s."""
        return float(self.breaks[0])

    @property
    def end(self) -> float:
        """When it is over, s."""
        return float(self.breaks[-1])

    def moved(self, factor: float = 1.0, delay: float = 0.0) -> Piecewise:
        """The same, `factor` times as long about t = 0 and then `delay` (s) later."""
        powers = factor ** -np.arange(self.coefficients.shape[1] - 1, -1, -1.0)
        return Piecewise(factor * self.breaks + delay, as_floats(self.coefficients * powers[None, :, None]))

    def along(self, change: Array) -> Piecewise:
        """Of one component: the motion times a vector `change` (n,)."""
        return Piecewise(self.breaks, as_floats(self.coefficients * change))

    @property
    def first(self) -> Array:
        """(n,) where it begins."""
        return as_floats(self.coefficients[0, -1])

    @property
    def last(self) -> Array:
        """(n,) where it is over."""
        return as_floats(shifted(self.coefficients[-1], self.end - self.breaks[-2])[-1])

    def sample(self, times: Array, derivative: int = 0) -> Array:
        """(T, n) a derivative at `times` (T,), s; where it jumps, that of the piece which follows."""
        t = np.clip(times, self.begin, self.end)
        piece = np.clip(np.searchsorted(self.breaks, t, side="right") - 1, 0, len(self.coefficients) - 1)
        powers = range(self.coefficients.shape[1] - 1, derivative - 1, -1)
        values = np.zeros((len(t), self.coefficients.shape[2]))
        for k, power in enumerate(powers):
            values = values * (t - self.breaks[piece])[:, None] + perm(power, derivative) * self.coefficients[piece, k]
        return values if derivative == 0 else as_floats(np.where((t == times)[:, None], values, 0.0))

    def functions(self) -> list[TimeFunction]:
        """One function of time for each component, held before and after the motion."""
        each = np.moveaxis(self.coefficients, 2, 0)
        made = (TimeFunction.polynomial(self.breaks, np.ascontiguousarray(one)) for one in each)
        return [function.held(self.begin, self.end) for function in made]


def shifted(coefficients: Array, s: Array | float) -> Array:
    """The same polynomials, (…, order, n) with the highest power first, in powers of x − s, s (…) (Horner's scheme)."""
    moved, s = coefficients.copy(), np.asarray(s)[..., None]
    for last in range(moved.shape[-2], 1, -1):
        for k in range(1, last):
            moved[..., k, :] += s * moved[..., k - 1, :]
    return moved


def superposed(motions: Sequence[Piecewise], weights: Sequence[float] | None = None) -> Piecewise:
    """Σ weight · motion (weights 1 where not given), each held before and after itself."""
    breaks = merged(np.concatenate([motion.breaks for motion in motions]))
    middles = 0.5 * (breaks[1:] + breaks[:-1])
    order = max(motion.coefficients.shape[1] for motion in motions)
    total = np.zeros((len(middles), order, motions[0].coefficients.shape[2]))
    for motion, weight in zip(motions, weights or [1.0] * len(motions), strict=True):
        total[middles < motion.begin, -1] += weight * motion.first
        total[middles > motion.end, -1] += weight * motion.last
        own = order - motion.coefficients.shape[1]
        k = np.flatnonzero((middles > motion.begin) & (middles < motion.end))
        piece = np.searchsorted(motion.breaks, middles[k]) - 1
        total[k, own:] += weight * shifted(motion.coefficients[piece], breaks[k] - motion.breaks[piece])
    return Piecewise(breaks, total)


def merged(instants: Array) -> Array:
    """The instants, s, in their order and each once: those that differ by rounding are one."""
    every = np.unique(instants)
    return as_floats(every[np.append(True, np.diff(every) > SAME_TIME * np.ptp(every))])
