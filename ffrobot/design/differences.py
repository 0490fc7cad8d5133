"""Derivatives by differences that are extrapolated, with an estimate of their error.

Of values at offsets x_i from the place where the derivative is wanted: that of the polynomial through them, exact for
polynomials of degree n − 1 (Fornberg, Mathematics of Computation 51, 1988). With pairs ±h, ±h/2, ±h/4 it is
Richardson's extrapolation of central differences, of order h⁶.
"""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, as_floats

LEVELS = 3  # sizes of steps that one extrapolation takes at most
NOISE = 3.0  # times what one divided difference says of it: with luck it says little
ROUNDING = float(np.finfo(np.float64).eps)


class Derivative(NamedTuple):
    """A derivative, the estimate of its error, and the largest step it was made with; NaN where there is none."""

    value: float
    error: float
    step: float


def weights(offsets: Array) -> Array:
    """Of values (n,): w with f'(0) ≈ Σ w_i f(x_i): Σ w_i x_iᵏ = 1 for k = 1 and 0 for all other k < n."""
    size = np.abs(offsets).max()
    powers = np.vander(offsets / size, increasing=True).T
    first = np.zeros(len(offsets))
    first[1] = 1.0
    return as_floats(np.linalg.solve(powers, first) / size)


def derivative(offsets: Array, values: Array) -> Derivative:
    """At 0, from `values` (n,) at `offsets` (n,); those that are NaN are left out.

    Steps are taken two and three sizes at a time; those whose estimate of the error is least make the derivative
    (Ridders, Advances in Engineering Software 4, 1982). One side is enough, at a lower order.
    """
    known = np.isfinite(values)
    offsets, values = offsets[known], values[known]
    sizes = np.unique(np.abs(offsets[offsets != 0.0]))[::-1]
    best = Derivative(np.nan, np.nan, np.nan)
    for first, last in combinations(range(sizes.size + 1), 2):
        found = _of_window(offsets, values, sizes[first:last]) if last - first <= LEVELS else None
        if found is not None and not found.error >= best.error:
            best = found
    return best


def _of_window(offsets: Array, values: Array, sizes: Array) -> Derivative | None:
    """With steps of these `sizes`, the largest first, and no step.

    The estimate of the error has two parts. Truncation: how far the derivative without the largest steps is off, which
    is of lower order. Noise of the values: by their divided difference of the highest order, which hardly knows of
    anything else.
    """
    if sizes.size < 2:
        return None
    taken = np.isin(np.abs(offsets), [0.0, *sizes])
    x, f = offsets[taken], values[taken]
    inner = np.abs(x) < sizes[0]
    f = f - f[np.argmin(np.abs(x))]  # rounding of differences, not of values
    w, u = weights(x), _highest(x)
    whole, truncation = float(w @ f), abs(float(w @ f - weights(x[inner]) @ f[inner]))
    noise = NOISE * abs(float(u @ f)) / float(np.abs(u).sum()) + ROUNDING * float(np.abs(values[taken]).max())
    return Derivative(whole, truncation + noise * float(np.abs(w).sum()), float(sizes[0]))


def _highest(offsets: Array) -> Array:
    """Weights (n,) of the divided difference of order n − 1: 0 of all polynomials of lower degree."""
    x = offsets / np.abs(offsets).max()
    apart = x[:, None] - x[None, :] + np.eye(x.size)
    return as_floats(1.0 / np.prod(apart, axis=1))
