"""Paths through given places at rest in each, or past some of them: legs, holds between, input shapers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import exp, pi, sqrt
from typing import Literal, NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .motion_laws import Limits, Profile, check_durations, law_in, law_within
from .piecewise import Piecewise, superposed

SAMPLES = 64  # of each polynomial, to find where a rounded path is fastest


@struct
class Legs:
    """A path through `places` (k + 1, n), m or rad, from the first, where it is until `start` (s)."""

    places: Array
    start: float
    # profile, smoothness: law of motion of each leg, and its number of continuous derivatives
    profile: Profile
    smoothness: int
    limits: Limits  # of the speed along the path and its derivatives
    durations: tuple[float, ...] | None  # (k,) s of each leg; None: as long as the limits ask for
    holds: tuple[float, ...]  # (k − 1,) s at the places between
    # share of the shorter of two legs for which they overlap where there is no hold: the path then passes the place
    # between them within the triangle of the three, without a stop
    blend: float = 0.0
    stretch: float = 1.0  # factor of the times of all legs, not of holds


def path_of(legs: Legs) -> Piecewise:
    """The motion; where legs overlap, all of them are slowed down as far as the limits ask for."""
    motion = _joined(legs)
    if not legs.blend or legs.durations is not None:
        return motion
    excess = max(
        (_peak(motion, order) / (limit / legs.stretch**order)) ** (1 / order)
        for order, limit in enumerate(legs.limits.by_order, 1)
    )
    return _joined(replace(legs, stretch=legs.stretch * excess)) if excess > 1.0 else motion


def _joined(legs: Legs) -> Piecewise:
    """p₀ + Σ (p_{i+1} − p_i) s_i(t − t_i)."""
    changes = np.diff(legs.places, axis=0)
    laws = [law.moved(legs.stretch) for law in _laws(legs, changes)]
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


def _laws(legs: Legs, changes: Array) -> Sequence[Piecewise]:
    if legs.durations is not None:
        return [law_in(duration, legs.profile, legs.smoothness) for duration in legs.durations]
    ways = np.linalg.norm(changes, axis=1)
    return [law_within(float(way), legs.limits, legs.profile, legs.smoothness) for way in ways]


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
    """Of a shaper for vibrations of one `frequency` (Hz, undamped).

    "zv" leaves none at that frequency (Singer and Seering 1990, J. Dyn. Syst. Meas. Control 112); "zvd" none there, and
    little about it (the derivative with respect to frequency is zero, too); "ei" 5 % there, and at most 5 % over a
    wider range (Singhose, Seering and Singer 1994, J. Mech. Des. 116). Shares fall with K = exp(−ζπ/√(1 − ζ²)), which
    half a period leaves of a vibration.
    """
    damped = sqrt(1.0 - damping_ratio**2)
    half, K, V = 0.5 / (frequency * damped), exp(-damping_ratio * pi / damped), RESIDUAL
    parts = {"zv": (1.0, 1.0), "zvd": (1.0, 2.0, 1.0), "ei": (1.0 + V, 2.0 - 2.0 * V, 1.0 + V)}[kind]
    shares = [part * K**k for k, part in enumerate(parts)]
    return [Impulse(share / sum(shares), k * half) for k, share in enumerate(shares)]


def shaped(motion: Piecewise, sequence: list[Impulse]) -> Piecewise:
    """The motion, shaped by one sequence of impulses: as much longer as its last delay."""
    return superposed([motion.moved(delay=impulse.delay) for impulse in sequence], [i.share for i in sequence])
