"""Shapes with which links at rest against their frames need no modal forces."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, as_list
from .prescribed import PrescribedMotion

MOST_ITERATIONS = 100
SETTLED = 1e-14  # of a shape's size: what the next step would change
TINY = 1e-300


def quasi_static_shape(motion: PrescribedMotion, stiffness: Array, times: Array, posture: Array) -> Array:
    """Shapes p (T, n) of all bodies at `times` (T,) with which nothing is left on modes, by p ← p − F_p/K.

    With `stiffness` K (n,), from a posture (n_q,) near the first. NaN where that does not converge: links too soft for
    their loads.
    """
    shape = np.zeros((len(times), len(stiffness)))
    going, near, rate = np.arange(len(times)), posture[None], np.ones(len(times))  # by which a step shrinks
    previous = np.zeros(len(times))
    for _ in range(MOST_ITERATIONS):
        p = shape[going]
        near, left = motion.left_on_modes(as_list(times[going]), p, 0 * p, 0 * p, near)
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
