"""Input shapers: a motion as a few delayed parts of itself, whose vibrations cancel each other."""

from __future__ import annotations

from math import exp, pi, sqrt
from typing import Literal, NamedTuple

from .piecewise import Piecewise, superposed

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
