"""Paths through given places at rest in each, or past some of them: legs one after the other, with holds between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Array
from .motion_laws import Limits, Profile, check_durations, law_in, law_within
from .piecewise import Piecewise, superposed

SAMPLES = 64  # of each polynomial, to find where a rounded path is fastest


@dataclass(frozen=True)
class Legs:
    """A path through `places` (k + 1, n), m or rad, from the first, where it is until `start` (s).

    Attributes:
        profile, smoothness: law of motion of each leg, and its number of continuous derivatives.
        limits: of the speed along the path and its derivatives.
        durations: (k,) s of each leg; None: as long as the limits ask for.
        holds: (k − 1,) s at the places between.
        blend: share of the shorter of two legs for which they overlap where there is no hold: the path then passes the
            place between them within the triangle of the three, without a stop.
        stretch: factor of the times of all legs, not of holds.
    """

    places: Array
    start: float
    profile: Profile
    smoothness: int
    limits: Limits
    durations: tuple[float, ...] | None
    holds: tuple[float, ...]
    blend: float = 0.0
    stretch: float = 1.0


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
    """Largest norm of a derivative."""
    times = np.concatenate([np.linspace(a, b, SAMPLES) for a, b in zip(motion.breaks, motion.breaks[1:], strict=False)])
    return float(np.linalg.norm(motion.sample(times, order), axis=1).max())
