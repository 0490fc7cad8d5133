"""What links say of their modes, or nothing does: damping ratios, and the sign, which eigensolvers leave open."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ..link_records.link import Link


def damping_ratio(link: Link, omega: Array) -> Array:
    """Return ζ (n,) as given, or of Rayleigh damping D = aM + bK: ζ = a/(2ω) + bω/2.

    A list is for the eigenmodes: its last number is that of the attachment modes, too.
    """
    if link.damping.rayleigh is not None:
        a, b = link.damping.rayleigh
        return a / (2 * omega) + b * omega / 2
    ratio = np.asarray(link.damping.ratio or 0.0, dtype=np.float64)
    if ratio.ndim:
        ratio = np.pad(ratio, (0, omega.size - ratio.size), mode="edge")
    return np.broadcast_to(ratio, omega.shape).copy()


def canonical_signs(fields: Array) -> Array:
    """Return factors 1 or −1 (n,) of each mode; `fields` (6, k, n) as in `station_fields`, root first.

    The dominant translation is then positive at the station nearest the root where it exceeds half its largest value;
    of a mode without translation, the dominant rotation.
    """
    signs = np.ones(fields.shape[2])
    for k in range(signs.size):
        rows = fields[:3, :, k]
        if not np.any(rows):
            rows = fields[3:, :, k]
        dominant = rows[np.argmax(np.abs(rows).max(axis=1))]
        signs[k] = np.sign(dominant[np.argmax(np.abs(dominant) > 0.5 * np.abs(dominant).max())])
    return signs
