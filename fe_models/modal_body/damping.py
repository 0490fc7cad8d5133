"""Damping ratios of modes."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ..link_records import Link


def damping_ratio(link: Link, omega: Array) -> Array:
    """(n,) ζ as given, or of Rayleigh damping D = aM + bK: ζ = a/(2ω) + bω/2.

    A list is for the eigenmodes: its last number is that of the attachment modes, too.
    """
    if link.damping.rayleigh is not None:
        a, b = link.damping.rayleigh
        return a / (2 * omega) + b * omega / 2
    ratio = np.asarray(link.damping.ratio or 0.0, dtype=np.float64)
    if ratio.ndim:
        ratio = np.pad(ratio, (0, omega.size - ratio.size), mode="edge")
    return np.broadcast_to(ratio, omega.shape).copy()
