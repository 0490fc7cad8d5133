"""How near to an optimum a design is, and what limits and bounds cost there: multipliers of Karush, Kuhn and Tucker.

With F_i whose largest is to be least, excesses g ≤ 0 and bounds of u: Σ ν_i ∇F_i + Σ λ_i ∇g_i + Σ μ_j ∇b_j = 0 with
ν, λ, μ ≥ 0 and Σ ν = 1; ν is 0 where F_i is not the largest, λ and μ where a limit is not reached. Of the gradients
there are, the multipliers that come nearest to it are taken (Lawson & Hanson's least squares without negative values,
the sum as a heavy row: Solving Least Squares Problems, 1974, chapter 22). One unit more room in g_i lowers F by λ_i.

The same of the limits that a design exceeds, as F, tells whether the largest excess can become less: where it cannot,
those with ν > 0 are the ones that no design near keeps together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from ..common.arrays import Array, as_floats
from .evaluations import Evaluated, Evaluations
from .problem import KEPT
from .slopes import Slopes

ACTIVE = 1e-4  # of a limit, or of a number's range: what is nearer counts as reached
TIED = 1e-5  # of the largest one: peaks that are equal
CLOSED = 1e-2  # of the gradient that an optimum may have: room that limits may have there, in the objective
HEAVY = 1e3  # row of the sum of multipliers, beside the largest gradient
SHARE = 1e-3  # of the multipliers' sum: a limit that matters


@dataclass(frozen=True)
class Optimality:
    """At one design, in the scaled problem.

    Attributes:
        limits: (m) multipliers λ of limits; NaN of those that are not reached.
        bounds: (n) multipliers μ of bounds, of lower ones negative; NaN where a number is between its bounds.
        residual: the largest entry of the gradient of the Lagrangian: the part of the objective that the range of one
            number would change if all were linear.
        gradient_error: the largest estimate of an error in the gradient of F, in the same measure.
        gap: how much lower the objective would be, if all were linear, with no room left in limits that are reached.
        violation: the largest excess, of its limit.
        kinks: of peaks, in words.
    """

    limits: Array
    bounds: Array
    residual: float
    gap: float
    gradient_error: float
    violation: float
    kinks: tuple[str, ...]

    def reached(self, aim: float) -> bool:
        """Whether this is an optimum, with no larger gradient than `aim`."""
        return self.residual <= aim and self.gap <= CLOSED * aim and self.violation <= KEPT


@dataclass(frozen=True)
class Conflict:
    """Numbers of `limits` that no design near keeps together, of variables at `bounds` beside, and the `violation`."""

    limits: tuple[int, ...]
    bounds: tuple[int, ...]
    violation: float


def optimality(evaluations: Evaluations, design: Evaluated, slopes: Slopes) -> Optimality:
    """Of a completed design, by the gradients there."""
    split, count = evaluations.split, len(evaluations.problem.limits)
    values = split.scaled(evaluations.row_values(design))
    excess = values[split.limit_rows]
    largest = values[split.objective_rows].max()
    tops = [row for row in split.objective_rows if values[row] >= largest - TIED]
    found = _multipliers(evaluations, design, slopes, tops, [row for row in split.limit_rows if values[row] > -ACTIVE])
    limits = np.full(count, np.nan)
    for owner, value, multiplier in zip(split.owners, excess, found.limits, strict=True):
        if value > -ACTIVE:
            limits[owner] = np.nan_to_num(limits[owner]) + multiplier
    gap = float(found.tops[split.objective_rows] @ (largest - values[split.objective_rows]))
    gap += float(found.limits @ np.maximum(-excess, 0.0))
    error = _largest((slopes.error * np.abs(found.factors))[np.ix_(np.array(tops), found.free)])
    violation = evaluations.problem.violation(design.readings)
    return Optimality(limits, found.bounds, found.residual, gap, error, violation, slopes.kinks)


def conflict(evaluations: Evaluations, design: Evaluated, slopes: Slopes, aim: float) -> Conflict | None:
    """What keeps the largest excess from becoming less; None where the limits are kept, or it can."""
    violation = evaluations.problem.violation(design.readings)
    if violation <= KEPT:
        return None
    split = evaluations.split
    values = split.scaled(evaluations.row_values(design))
    largest = values[split.limit_rows].max()
    found = _multipliers(
        evaluations, design, slopes, [r for r in split.limit_rows if values[r] >= largest - ACTIVE], []
    )
    if found.residual > aim:
        return None
    owners = [owner for owner, share in zip(split.owners, found.tops[split.limit_rows], strict=True) if share > SHARE]
    bounds = np.flatnonzero(np.abs(np.nan_to_num(found.bounds)) > aim)
    return Conflict(tuple(dict.fromkeys(owners)), tuple(map(int, bounds)), violation)


@dataclass(frozen=True)
class _Multipliers:
    """ν (r), λ (limits) and μ (n, NaN between bounds), with the `residual`; `free` coordinates, `factors` (r, 1)."""

    tops: Array
    limits: Array
    bounds: Array
    residual: float
    free: NDArray[np.intp]
    factors: Array


def _multipliers(
    evaluations: Evaluations, design: Evaluated, slopes: Slopes, tops: Sequence[int], limits: Sequence[int]
) -> _Multipliers:
    """With rows `tops` as F, rows `limits` as g."""
    split, variables = evaluations.split, evaluations.space.variables
    factors = split.factors(evaluations.row_values(design))[:, None]
    scaled = slopes.gradient * factors
    is_number = np.array([not variable.is_catalogue for variable in variables])
    free = np.flatnonzero(~np.isnan(scaled).any(axis=0) & is_number)
    place = np.array(design.place)
    low, high = (np.intersect1d(free, np.flatnonzero(near)) for near in (place < ACTIVE, place > 1.0 - ACTIVE))
    unit = np.eye(place.size)
    rows = np.vstack([scaled[list(tops)], scaled[list(limits)], -unit[low], unit[high]])[:, free]
    heavy = HEAVY * max(1.0, _largest(rows))
    sum_row = np.where(np.arange(len(rows)) < len(tops), heavy, 0.0)
    found = nnls(np.vstack([rows.T, sum_row]), np.append(np.zeros(free.size), heavy))[0]
    found = found / found[: len(tops)].sum()
    ends = np.cumsum([len(tops), len(limits), low.size])
    of_tops, of_limits, of_low, of_high = np.split(found, ends)
    bounds = np.full(place.size, np.nan)
    bounds[low], bounds[high] = -of_low, of_high
    all_tops, all_limits = np.zeros(len(scaled)), np.zeros(len(scaled))
    all_tops[list(tops)], all_limits[list(limits)] = of_tops, of_limits
    return _Multipliers(all_tops, all_limits[split.limit_rows], bounds, _largest(found @ rows), free, factors)


def _largest(values: Array) -> float:
    return float(np.abs(as_floats(values)).max(initial=0.0))
