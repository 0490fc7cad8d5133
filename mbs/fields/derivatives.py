"""Whether rate and acceleration of a function of time are the derivatives of its value, as users give them."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, Booleans, as_floats
from ...common.errors import InputError
from .._core import TimeFunction

INSTANTS = 13  # at which is looked
STEPS = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7)  # of differences, relative to the time that the function is needed for
AGREED = 1e-5  # two differences that differ by less know the derivative; relative to its largest value
WRONG = 1e-3  # what a derivative may be off by, likewise
ROUNDING = 1e-9  # of the largest value over the time: differences of less are rounding
GOLDEN = 0.6180339887498949  # its multiples fall on no grid, so on no instant at which accelerations jump


def check_derivatives(function: TimeFunction, end: float, describe: str) -> None:
    """Raise `InputError`, starting with `describe`, where rate or acceleration contradict differences before `end` (s).

    Differences of the value, and of the rate, are made with several steps h. One knows the derivative where that with
    h/2 agrees. Beside a jump of the acceleration, where values are rounded, or vibrate faster than a step, none does or
    only those with a shorter step; the function is wrong where all that know contradict it.
    """
    times = end * (0.02 + 0.96 * ((GOLDEN * np.arange(1, INSTANTS + 1)) % 1.0))
    given = function.sample(times)
    with np.errstate(all="ignore"):  # poles: nothing is known there
        once, twice = (np.stack([_differences(function, times, h * part * end) for h in STEPS]) for part in (1.0, 0.5))
    for order, quantity in ((1, "rate"), (2, "acceleration")):
        found = twice[:, order - 1]
        known, wrong = _judged(once[:, order - 1], found, given[order], ROUNDING * np.abs(given[order - 1]).max() / end)
        if wrong.any():
            k = int(np.flatnonzero(wrong)[0])
            said = found[np.flatnonzero(known[:, k])[0], k]
            raise InputError(
                f"{describe}: expected the derivatives of the value, (value, rate, acceleration), found the {quantity}"
                f" {given[order, k]:.6g} at t = {times[k]:.6g} s, where differences of the"
                f" {('value', 'rate')[order - 1]} are {said:.6g}"
            )


def _differences(function: TimeFunction, times: Array, h: float) -> Array:
    """(2, T) derivatives of value and rate at `times` (T,) by central differences of fourth order with the step h."""
    before2, before, after, after2 = (function.sample(times + k * h)[:2] for k in (-2, -1, 1, 2))
    return as_floats((before2 - 8 * before + 8 * after - after2) / (12 * h))


def _judged(once: Array, twice: Array, given: Array, rounding: float) -> tuple[Booleans, Booleans]:
    """Which differences (steps, T), with h and h/2, know the derivative, and where (T,) all of these contradict it."""
    with np.errstate(all="ignore"):
        size = max(np.abs(given).max(), np.abs(twice).min(axis=0).max()) + rounding
        known = np.abs(once - twice) <= AGREED * size
        wrong = known.any(axis=0) & np.all(~known | (np.abs(twice - given) > WRONG * size), axis=0)
    return known, wrong
