"""Inertia shape integrals of a beam, from its fields at the stations.

The stations are the Gauss–Lobatto points of cubic elements, so values at stations *are* the degrees of freedom of
the fields and every integral is a product with a mass matrix, without error.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from ...common.arrays import Array
from ..link_records.link import BeamLink
from ..modal_body.parts import Invariants
from .line import R_X, R_Y, R_Z, U_X, U_Y, U_Z, Functions, gram
from .sections import Property, cellwise


def shape_integrals(link: BeamLink, stations: Functions, fields: Array) -> Invariants:
    """Inertia shape integrals (docs/theory.md) over axis and cross section; `fields` (6, k, n) U_X … R_Z at k stations.

    With displacement (u, v, w) and rotation (φ, θ_y, θ_z) of the section, a point (x, y, z) moves by Φ0 + y Φy + z Φz,
    Φ0 = (u, v, w), Φy = (−θ_z, 0, φ), Φz = (θ_y, −φ, 0); principal axes leave ∫y = ∫z = ∫yz = 0.

    Euler–Bernoulli links are a line of mass on the axis, ∫y² = ∫z² = 0 in all that bends or turns as a whole. Their
    torsion modes keep their own ρI_p, booked in S̄_33: no planar invariant then holds any rotary inertia, and m_ff =
    S̄_11 + S̄_22 + S̄_33 stays true. What such a link has of inertia about its own axis, in space, is the spin inertia
    ½∫ρI_p (ω_1 + φ̇)² dx: J_s = ∫ρI_p, h_s = ∫ρI_p φ, S_s = ∫ρI_p φᵀφ, apart from the integrals over the axis.
    """
    rho = link.material.density
    line_mass = link.model.theory == "euler-bernoulli"
    zero = np.zeros_like(fields[U_X])
    Phi = [
        fields[[U_X, U_Y, U_Z]],
        np.stack([-fields[R_Z], zero, fields[R_X]]),
        np.stack([fields[R_Y], -fields[R_X], zero]),
    ]
    # Position likewise: x e1 + y e2 + z e3, per unit of (1, y, z).
    one = np.ones_like(stations.x)
    position = np.zeros((3, 3, stations.x.size))
    position[0, 0], position[1, 1], position[2, 2] = stations.x, one, one
    moments: list[Property] = [lambda s: s.area, lambda s: s.I_yy, lambda s: s.I_zz]
    weights = [weighted(link, stations, moment, rho) for moment in (moments[:1] if line_mass else moments)]

    n = fields.shape[2]
    S_bar = np.einsum("i,lin->ln", weights[0] @ one, Phi[0])
    second_moment, I_bar, S_bar_kl = np.zeros((3, 3)), np.zeros((3, 3, n)), np.zeros((3, 3, n, n))
    for W, x, shape in zip(weights, position, Phi, strict=False):
        W_x, W_shape = np.stack([W @ row for row in x]), np.stack([W @ component for component in shape])
        second_moment += np.einsum("ki,li->kl", x, W_x)
        I_bar += np.einsum("ki,lin->kln", W_x, shape)
        S_bar_kl += np.einsum("kim,lin->klmn", shape, W_shape)
    J_spin, h_spin, S_spin = 0.0, np.zeros(n), np.zeros((n, n))
    if line_mass:
        spin, twist = weighted(link, stations, lambda s: s.I_p, rho), fields[R_X]
        J_spin, h_spin, S_spin = float(one @ (spin @ one)), (spin @ one) @ twist, twist.T @ spin @ twist
        S_bar_kl[2, 2] += S_spin
    first = float(stations.x @ (weights[0] @ one))
    symmetric = 0.5 * (S_bar_kl + S_bar_kl.transpose(1, 0, 3, 2))
    return Invariants(
        mass=float(one @ (weights[0] @ one)),
        first_moment=np.array([first, 0.0, 0.0]),
        second_moment=second_moment,
        S_bar=S_bar,
        I_bar=I_bar,
        S_bar_kl=symmetric,
        J_spin=J_spin,
        h_spin=h_spin,
        S_spin=0.5 * (S_spin + S_spin.T),
    )


def weighted(link: BeamLink, stations: Functions, moment: Property, rho: float) -> sp.csr_matrix:
    """Return the matrix (k, k) of ∫ρ·moment·a b dx for two fields a, b at the stations."""
    return gram(stations.root(cellwise(link, stations.nodes, lambda s: rho * moment(s))))
