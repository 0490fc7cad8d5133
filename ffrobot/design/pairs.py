"""Derivatives by runs that take the steps of the base again: a central pair for each key, and two that all share.

Differences of such runs have no noise but rounding, which many thousand steps, and modes of links that are computed
anew, make 1e-13 to 1e-11 of a goal. Truncation grows with the number of periods that vibrations pass through. So pairs
are `WIDE`, or `NARROW` where that is too much, as two pairs tell that change all keys at once, with random signs. The
sum of what all pairs have found is then checked by that of the two that has their width.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ..common.arrays import Array, as_floats
from .derivatives import AIM, Base, Known, Sample, followed, sample, values_of
from .designs import Designs

SHARED = 4  # keys, at least: fewer are as cheap with `THREE` runs each, which check themselves
THREE = (-0.01, 0.01, 0.02)  # of the largest step
WIDE, NARROW = 2e-3, 1e-4  # likewise
OTHERS = ((4e-4, 2e-3), (1e-2,))  # likewise, of pairs that follow where these are not good enough


def take_pairs(designs: Designs, base: Base, known: Known, wanted: Sequence[int]) -> None:
    """Of the keys `wanted`, by number; those that are 0 may only grow, maybe, and have three runs."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(wanted))
    signed = {k: float(sign) for k, sign in zip(wanted, signs, strict=True) if base.point[k] != 0.0}
    signed = signed if len(signed) >= SHARED else {}
    sums = _sums_of_differences(designs, base, signed) if signed else {}
    part = NARROW if signed and _is_too_wide(base, signed, sums) else WIDE
    offsets = {k: (-part, part) if k in signed else THREE for k in wanted}
    known.samples += samples_at(designs, base, [(k, x * base.steps[k]) for k in wanted for x in offsets[k]])
    failed = {k for k in signed if not all(one.goals for one in known.of_key(k))}
    second = [(k, 2.0 * one.offset) for k in failed for one in known.of_key(k) if one.goals]
    known.samples += samples_at(designs, base, second)
    if signed and not failed:
        known.pairs = {k: part * base.steps[k] for k in signed}
        found = sum(sign * known.central(k) for k, sign in signed.items())
        known.left = as_floats(np.abs(found - sums[part]))


def samples_at(designs: Designs, base: Base, places: Sequence[tuple[int, float]]) -> list[Sample]:
    """Runs with one key changed, by number of the key and offset."""
    found = designs.run([base.moved(k, offset) for k, offset in places], base.again)
    return [sample(base, k, offset, design) for (k, offset), design in zip(places, found, strict=True)]


def _sums_of_differences(designs: Designs, base: Base, signed: Mapping[int, float]) -> dict[float, Array]:
    """By width (g,) Σ ±(F(h_k) − F(−h_k))/2, of one pair with all keys changed at once, signs as in `signed`.

    In units of the steps h_k it is half as long as each of them: the third order is a quarter of theirs, the noise of
    the sum twice as large. NaN where a run fails.
    """
    shorter, widths = 0.5 / np.sqrt(len(signed)), (WIDE, NARROW)
    along = np.array([signed.get(k, 0.0) * step for k, step in enumerate(base.steps)])
    ends = [
        tuple(map(float, np.array(base.point) + side * shorter * part * along))
        for part in widths
        for side in (1.0, -1.0)
    ]
    values = [values_of(followed(base, design)) for design in designs.run(ends, base.again)]
    pairs = zip(widths, values[::2], values[1::2], strict=True)
    return {part: as_floats(0.5 * (above - below) / shorter) for part, above, below in pairs}


def _is_too_wide(base: Base, signed: Mapping[int, float], sums: Mapping[float, Array]) -> bool:
    """Whether the sums of wide and narrow differences disagree by more than `AIM`."""
    k = next(iter(signed))
    sizes = np.abs([reading.value for reading in base.readings])
    relative = base.steps[k] / abs(base.point[k]) * np.where(sizes > 0.0, sizes, 1.0)
    wide, narrow = (sums[part] / (part * relative) for part in (WIDE, NARROW))  # percent per percent
    return bool(np.any(np.abs(wide - narrow) > AIM * np.maximum(1.0, np.abs(narrow))))
