"""Shapes with which links at rest against their frames need no modal forces, in the plane and in space."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array

MOST_ITERATIONS = 100
SETTLED = 1e-14  # of a shape's size: what the next step would change
TINY = 1e-300

LeftOnModes = Callable[[Array, Array, Array | None], tuple[Array, Array]]
"""Postures q (T, n_q), and forces (T, n) on modes that nothing supplies, at times (T,) with p (T, n) and ṗ = p̈ = 0.

From postures near (T, n_q); without any they are found one after the other. NaN where there is none.
"""


def quasi_static_shape(left_on_modes: LeftOnModes, stiffness: Array, times: Array) -> Array:
    """Shapes p (T, n) of all bodies at `times` (T,) with which nothing is left, by p ← p − F_p/K; `stiffness` K (n,).

    NaN where that does not converge: links too soft for their loads.
    """
    shape = np.zeros((len(times), len(stiffness)))
    going, near, rate = np.arange(len(times)), None, np.ones(len(times))  # by which a step shrinks, as seen last
    previous = np.zeros(len(times))
    for _ in range(MOST_ITERATIONS):
        near, left = left_on_modes(times[going], shape[going], near)
        step = left / stiffness
        shape[going] -= step
        size = np.linalg.norm(step, axis=1) / (np.linalg.norm(shape[going], axis=1) + TINY)
        is_seen = (previous > 0) & (size > 10 * SETTLED)  # steps below that are rounding
        rate[is_seen] = size[is_seen] / previous[is_seen]
        on = ~(size * np.minimum(rate, 1.0) <= SETTLED) & np.isfinite(size)
        shape[going[~np.isfinite(size)]] = np.nan
        going, near, rate, previous = going[on], near[on], rate[on], size[on]
        if not len(going):
            break
    shape[going] = np.nan
    return shape
