"""Rotations in the plane: A(θ) = [[cos θ, −sin θ], [sin θ, cos θ]], angles in rad."""

from __future__ import annotations

import numpy as np

from .arrays import Array


def rotation(theta: float) -> Array:
    """A(θ), (2, 2)."""
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, -s], [s, c]])


def rotated(theta: Array | float, vectors: Array) -> Array:
    """A(θ) times `vectors` (…, 2): from body axes to global axes, the other way with −θ. θ (…) is broadcast."""
    c, s = np.cos(theta), np.sin(theta)
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def perpendicular(vectors: Array) -> Array:
    """`vectors` (…, 2) turned by +π/2; of A x it is the derivative A_θ x."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def in_3d(vectors: Array) -> Array:
    """(…, 3) of `vectors` (…, 2) of the plane z = 0; longer ones as they are."""
    return vectors if vectors.shape[-1] > 2 else np.concatenate([vectors, np.zeros_like(vectors[..., :1])], axis=-1)
