"""The sign of a mode, which an eigensolver leaves open. NumPy only."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array


def canonical_signs(fields: Array) -> Array:
    """(n,) 1 or −1, to multiply each mode by.

    The dominant translation is then positive at the station nearest the root where it exceeds half its largest value;
    of a mode without translation, the dominant rotation.

    Args:
        fields: (6, k, n) displacement and rotation along x, y, z of n modes at k stations, root first.
    """
    signs = np.ones(fields.shape[2])
    for k in range(signs.size):
        rows = fields[:3, :, k]
        if not np.any(rows):
            rows = fields[3:, :, k]
        dominant = rows[np.argmax(np.abs(rows).max(axis=1))]
        signs[k] = np.sign(dominant[np.argmax(np.abs(dominant) > 0.5 * np.abs(dominant).max())])
    return signs
