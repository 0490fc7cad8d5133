"""Rotations in the plane: A(θ) = [[cos θ, −sin θ], [sin θ, cos θ]], angles in rad."""

from __future__ import annotations

import numpy as np

from .arrays import Array


def rotation(theta: float) -> Array:
    """A(θ), (2, 2)."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


def in_3d(vectors: Array) -> Array:
    """(…, 3) of `vectors` (…, 2) of the plane z = 0; longer ones as they are."""
    return vectors if vectors.shape[-1] > 2 else np.concatenate([vectors, np.zeros_like(vectors[..., :1])], axis=-1)
