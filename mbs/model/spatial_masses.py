"""Masses rigidly attached to sections of bodies in space: payloads."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array
from ...common.rotations import skew
from ...fe_models.modal_body.tensors import LEVI_CIVITA
from .spatial_body import SpatialBody, SpatialPoint


def with_payload(body: SpatialBody, point: str, mass: float, center: Array, inertia: Array) -> SpatialBody:
    """The body with a mass (kg) whose center is at `center` (3,) m from a section and goes with it, axes of the body.

    `inertia` (3, 3) in kg·m² about that center. Points of it, ξ from the center, move by Φ_c + φ × ξ; with
    ∫ρ ξ ξᵀ dV = E = ½ tr(J) I − J the integrals are those of lumped masses (fe_models.modal_body.lumped_masses).
    """
    at = body.points[point]
    x, phi = at.position + center, at.rotation
    Phi = at.translation - skew(center) @ phi
    E = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    turn = np.einsum("kab,an->kbn", LEVI_CIVITA, phi)  # (φ × ξ)_k = turn[k, b] ξ_b
    loaded = replace(
        body,
        mass=body.mass + mass,
        first_moment=body.first_moment + mass * x,
        second_moment=body.second_moment + mass * np.outer(x, x) + E,
        S_bar=body.S_bar + mass * Phi,
        I_bar=body.I_bar + mass * np.einsum("k,ln->kln", x, Phi) + np.einsum("kb,lbn->kln", E, turn),
        S_bar_kl=body.S_bar_kl
        + mass * np.einsum("km,ln->klmn", Phi, Phi)
        + np.einsum("kbm,bd,ldn->klmn", turn, E, turn),
    )
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
