"""A path that motors carry from rest to rest: what has to rest, for how long they act, and why none was found."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...common.arrays import as_floats
from ...common.errors import InputError
from ..scene.analysis import Analysis, TimedAnalysis
from ..solve.internal_dynamics import Output, is_unstable
from ..solve.stable_inversion import Inversion, S
from ..solve.zero_dynamics import GROWTH, Linearisation
from .outcome import ADVICE, Details

DECAY = 23.0  # times the slowest time constant of zeros: what is left is 1e-10
INFINITE = (
    "where a zero of the modes passes through infinity: take another number of modes in the link files, or output ="
    ' "redefined"'
)
REST = 1e-9  # speed of a path at rest, relative to its mean speed


@dataclass(frozen=True, kw_only=True)
class AroundPath(Details):
    """How long motors act before and after the path, s, and how the path was inverted for motors alone."""

    pre_actuation: float
    post_actuation: float
    inversion: Inversion[Any] | None = field(default=None, repr=False)


def where(scene_path: Path, analysis: Analysis) -> str:
    """Scene and analysis, as messages begin."""
    return f'{scene_path}: analysis "{analysis.name}"'


def is_minimum_phase(linear: Linearisation) -> bool:
    """Whether no zero lies in the right half plane at rest, and none long enough along the path to matter."""
    at_rest = linear.zeros[[0, -1]]
    grows = linear.zeros.real.max() * linear.times[-1] > GROWTH
    return not (is_unstable(at_rest).any() or grows)


def describe_zeros(linear: Linearisation) -> str:
    """The slowest zeros in the right half plane, in 1/s."""
    row = max(linear.zeros, key=lambda s: float(s.real.max()))
    found = row[is_unstable(row)]
    shown = ", ".join(f"{s.real:.4g}{f' ± {s.imag:.4g}i' if s.imag > 0 else ''}" for s in found if s.imag >= 0)
    return shown if len(shown) < 120 else ", ".join(shown.split(", ")[:4]) + f" … ({len(found)} in all)"


def check_rest(servo: Output, analysis: TimedAnalysis, ends: Sequence[float]) -> None:
    """Raise `InputError` for a path that moves at one of the `ends` (s), where the robot has to be at rest."""
    for target in servo.targets():
        values = target.function.sample(as_floats(np.linspace(0.0, analysis.end, 101)))[0]
        mean = float(np.ptp(values)) / analysis.end
        for t in ends:
            rate = target.function(t)[1]
            if abs(rate) > REST * max(mean, 1.0):
                raise InputError(
                    f'{servo.where}: trajectory "{target.owner}": {target.component}: expected'
                    f' a path at rest at t = {t:g} s, before or after which "{analysis.name}" holds it, found the rate'
                    f" {rate:.4g}: start and end with zero speed, as 10*s**3 - 15*s**4 + 6*s**5 does"
                )


def decay_times(linear: Linearisation, end: float, *, needs_future: bool) -> tuple[float, float]:
    """Times (s) in which the zero dynamics dies out before and after the path, which ends at `end`."""
    first, last, light = linear.zeros[0].real, linear.zeros[-1].real, linear.is_light[0]
    is_ahead = linear.is_future[0] & (first > 0)
    grow, growing_vibrations, decay = first[is_ahead & ~light], first[is_ahead & light], -last[last < 0]
    pre = max(DECAY / grow.min(initial=np.inf), min(DECAY / growing_vibrations.min(initial=np.inf), end))
    return pre, min(DECAY / decay.min(initial=np.inf), end) if needs_future else 0.0


def durations(
    linear: Linearisation, given: tuple[float | None, float | None], step: float, *, needs_future: bool
) -> tuple[float, float]:
    """Pre- and post-actuation (s): as given, or until the zero dynamics has died out; whole output steps."""
    automatic = decay_times(linear, float(linear.times[-1]), needs_future=needs_future)
    chosen = (found if value is None else value for value, found in zip(given, automatic, strict=True))
    before, after = (math.ceil(time / step - 1e-9) * step for time in chosen)
    return before, after


def cause_of(inversion: Inversion[S]) -> str:
    """Why no motion was found and when it was worst; where zeros change sides, no bounded one need exist."""
    linear = inversion.linearisation
    if inversion.status not in ("inversion not converged", "mesh too coarse"):
        return ""
    count = (linear.is_future if linear.is_light.any() else is_unstable(linear.zeros)).sum(axis=1)
    changed = np.flatnonzero(count != count[0])
    if inversion.status == "inversion not converged" and linear.singular_after:
        k = linear.singular_after[0]
        return f"singular coupling between t = {linear.times[k]:.4g} and {linear.times[k + 1]:.4g} s, {INFINITE}"
    if inversion.status == "mesh too coarse" or not len(changed):
        return f"{ADVICE[inversion.status]} (worst at t = {inversion.worst:.4g} s)"
    k = int(changed[0])
    return (
        f"zeros change sides along the path: {count[0]} of them are in the right half plane at t = 0, {count[k]} at t"
        f" = {linear.times[k]:.4g} s, so a bounded motion may not exist. Leave out axial and high modes (modes.family"
        ' = "in-plane-bending" and fewer of them in the link files), or use output = "redefined"'
    )
