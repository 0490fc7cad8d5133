"""Damping ratios of modes."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ..link_records import Link


def damping_ratio(link: Link, omega: Array) -> Array:
    """(n,) ζ as given, or of Rayleigh damping D = aM + bK: ζ = a/(2ω) + bω/2."""
    if link.damping.rayleigh is not None:
        a, b = link.damping.rayleigh
        return a / (2 * omega) + b * omega / 2
    return np.broadcast_to(np.asarray(link.damping.ratio or 0.0, dtype=np.float64), omega.shape).copy()
