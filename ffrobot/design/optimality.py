"""How near to an optimum a design is, and what limits and bounds cost there: multipliers of Karush, Kuhn and Tucker.

With F to be least, excesses g ≤ 0 and bounds of u: ∇F + Σ λ_i ∇g_i + Σ μ_j ∇b_j = 0 with λ, μ ≥ 0, which are 0 where
a limit is not reached. Of the gradients there are, the multipliers that come nearest to it are taken (Lawson & Hanson's
least squares without negative values). One unit more room in g_i lowers F by λ_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from ..common.arrays import Array, as_floats
from .evaluations import Evaluated, Evaluations
from .problem import KEPT
from .slopes import Slopes

ACTIVE = 1e-4  # of a limit, or of a number's range: what is nearer counts as reached


@dataclass(frozen=True)
class Optimality:
    """At one design, in the scaled problem.

    Attributes:
        limits: (m) multipliers λ of limits; NaN of those that are not reached.
        bounds: (n) multipliers μ of bounds, of lower ones negative; NaN where a number is between its bounds.
        residual: the largest entry of the gradient of the Lagrangian: the part of the objective that the range of one
            number would change if all were linear.
        gradient_error: the largest estimate of an error in the gradient of F, in the same measure.
        violation: the largest excess, of its limit.
        kinks: of peaks, in words.
    """

    limits: Array
    bounds: Array
    residual: float
    gradient_error: float
    violation: float
    kinks: tuple[str, ...]

    def reached(self, aim: float) -> bool:
        """Whether this is an optimum, with no larger gradient than `aim`."""
        return self.residual <= aim and self.violation <= KEPT


def optimality(evaluations: Evaluations, design: Evaluated, slopes: Slopes) -> Optimality:
    """Of a completed design, by the gradients there."""
    problem, variables = evaluations.problem, evaluations.space.variables
    factors = problem.factors(design.values)[:, None]
    scaled = slopes.gradient * factors
    free = np.array([not variable.is_catalogue for variable in variables]) & ~np.isnan(scaled).any(axis=0)
    excess = problem.excess(design.values)
    place = np.array(design.place)
    reached = np.flatnonzero(excess > -ACTIVE)
    low, high = (np.flatnonzero(free & near) for near in (place < ACTIVE, place > 1.0 - ACTIVE))
    unit = np.eye(place.size)
    rows = np.vstack([scaled[1 + reached], -unit[low], unit[high]])[:, free]
    multipliers = nnls(rows.T, -scaled[0, free])[0] if rows.size else np.zeros(len(rows))
    lagrangian = scaled[0, free] + multipliers @ rows
    limits, bounds = np.full(excess.size, np.nan), np.full(place.size, np.nan)
    limits[reached] = multipliers[: reached.size]
    bounds[low] = -multipliers[reached.size : reached.size + low.size]
    bounds[high] = multipliers[reached.size + low.size :]
    error = (slopes.error * np.abs(factors))[0, free]
    return Optimality(
        limits, bounds, _largest(lagrangian), _largest(error), problem.violation(design.readings), slopes.kinks
    )


def _largest(values: Array) -> float:
    return float(np.abs(as_floats(values)).max(initial=0.0))
