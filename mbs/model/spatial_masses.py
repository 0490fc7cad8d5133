"""Masses rigidly attached to sections of bodies in space: payloads."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from ...common.rotations import skew
from ...fe_models.modal_body.lumped_masses import attached_integrals
from .spatial_body import SpatialBody, SpatialPoint


def with_payload(body: SpatialBody, point: str, mass: float, center: Array, inertia: Array) -> SpatialBody:
    """The body with a mass (kg) whose center is at `center` (3,) m from a section and goes with it, axes of the body.

    `inertia` J (3, 3) in kg·m² about that center: ∫ρ ξ ξᵀ dV = E = ½ tr(J) I − J.
    """
    at = body.points[point]
    x, phi = at.position + center, at.rotation
    Phi = at.translation - skew(center) @ phi
    E = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    added = attached_integrals(mass, x, E, Phi, phi)
    loaded = replace(body, **{key: getattr(body, key) + more for key, more in added.items()})
    return _uncoupled(loaded, np.eye(body.n_modes) + mass * Phi.T @ Phi + phi.T @ inertia @ phi)


def _uncoupled(body: SpatialBody, m_ff: Array) -> SpatialBody:
    """The body in modal coordinates that make m_ff (n, n) the identity and K_ff diagonal again."""
    if not body.n_modes:
        return body
    L_inverse = np.linalg.inv(np.linalg.cholesky(m_ff))
    stiffness, vectors = np.linalg.eigh(L_inverse @ np.diag(body.stiffness) @ L_inverse.T)
    T = L_inverse.T @ vectors
    return replace(
        body,
        stiffness=stiffness,
        damping=T.T @ body.damping @ T,
        S_bar=body.S_bar @ T,
        I_bar=body.I_bar @ T,
        S_bar_kl=T.T @ body.S_bar_kl @ T,
        h_spin=body.h_spin @ T,
        S_spin=T.T @ body.S_spin @ T,
        points=MappingProxyType(
            {
                label: SpatialPoint(section.position, section.translation @ T, section.rotation @ T)
                for label, section in body.points.items()
            }
        ),
        modal_transform=body.modal_transform @ T,
    )
