"""Sections of a body in 3D bent by p. SI units, axes of the body."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .body import Body


class Section(NamedTuple):
    """Of a bent body: u = x + Φp − … (…, 3), φ = Φ_r p − … (…, 3), and their derivatives by p, (…, 3, n) or (3, n)."""

    u: Array
    phi: Array
    u_p: Array
    phi_p: Array


def bent_section(body: Body, point: str, p: Array) -> Section:
    """A point of a body, bent by p (…, n)."""
    at = body.points[point]
    u, phi = at.position + p @ at.translation.T, p @ at.rotation.T
    if body.stiffening is None:
        return Section(u, phi, at.translation, at.rotation)
    K_p = np.einsum("kmn,...n->...km", body.stiffening.at(point), p)
    second = 0.5 * np.einsum("...km,...m->...k", K_p, p)
    return Section(
        u - second[..., :3], phi - second[..., 3:], at.translation - K_p[..., :3, :], at.rotation - K_p[..., 3:, :]
    )
