"""Bodies of the plane as bodies in space, whose equations for motions in the plane z = 0 are those of the plane.

In the plane inertia counts by sums alone: I_o = tr J2 over x and y, j = Ī_xx + Ī_yy, m_xy = S̄_xx + S̄_yy, and
h = Ī_xy − Ī_yx, S̃ = S̄_xy − S̄_yx by differences. In space they are shared out evenly; nothing moves along z.
"""

from __future__ import annotations

from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from .planar_body import PlanarBody, PlanarPoint
from .spatial_body import SpatialBody, SpatialPoint


def planar_body_in_space(body: PlanarBody) -> SpatialBody:
    """The body with its modes, payloads and patches as they are in the plane, without geometric stiffening.

    J2 = I_o/2 along all axes: of a sphere, whose moment of inertia about each is I_o.
    """
    n, along_z = body.n_modes, np.zeros((1, body.n_modes))
    I_bar, S_bar_kl = np.zeros((3, 3, n)), np.zeros((3, 3, n, n))
    I_bar[0, 0] = I_bar[1, 1] = body.j / 2
    I_bar[0, 1], I_bar[1, 0] = body.h / 2, -body.h / 2
    S_bar_kl[0, 0] = S_bar_kl[1, 1] = body.m_xy / 2
    S_bar_kl[0, 1], S_bar_kl[1, 0] = body.S_tilde / 2, -body.S_tilde / 2
    return SpatialBody(
        name=body.name,
        mass=body.mass,
        first_moment=np.append(body.first_moment, 0.0),
        second_moment=body.inertia / 2 * np.eye(3),
        S_bar=np.vstack([body.S_bar, along_z]),
        I_bar=I_bar,
        S_bar_kl=S_bar_kl,
        J_spin=0.0,
        h_spin=np.zeros(n),
        S_spin=np.zeros((n, n)),
        stiffness=body.stiffness,
        damping=body.damping,
        points=MappingProxyType({label: _section(point) for label, point in body.points.items()}),
        modal_transform=body.modal_transform,
        length=body.length,
        attachment_modes=body.attachment_modes,
    )


def _section(point: PlanarPoint) -> SpatialPoint:
    still: Array = np.zeros((1, point.translation.shape[1]))
    return SpatialPoint(
        np.append(point.position, 0.0),
        np.vstack([point.translation, still]),
        np.vstack([still, still, point.rotation[None]]),
    )
