"""Masses: what point masses do to a body, and mass matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ...common.plane import perpendicular, rotation
from .. import _core
from .geometric_stiffening import GeometricStiffening
from .planar_body import PlanarBody, PlanarPoint, diagonalised
from .system import MechanismSystem


def with_payload(body: PlanarBody, point: str, mass: float, inertia: float) -> PlanarBody:
    """The body with a point mass (kg) and moment of inertia (kg·m²) on one of its points, modes made anew."""
    at = body.points[point]
    stiffening = body.stiffening and body.stiffening.with_payload(point, at.position, at.rotation, mass, inertia)
    return with_masses(replace(body, stiffening=stiffening), [at], np.array([mass]), np.array([inertia]))


def with_masses(
    body: PlanarBody, points: Sequence[PlanarPoint], masses: Array, inertias: Array, stiffness: Array | None = None
) -> PlanarBody:
    """The body with point masses (kg) and moments of inertia (kg·m²) at points of it, and more stiffness (n, n).

    Masses are summed into every invariant as more material points (integrals become sums); the modal mass
    I + Σ m ΦᵀΦ + I_p φᵀφ is brought back to the identity by a small eigenproblem. Geometric stiffening is left to the
    caller: what it has to be depends on how the body takes the loads of their inertia.
    """
    x, y = np.array([at.position for at in points]).T
    Phi_x, Phi_y = np.array([at.translation for at in points]).transpose(1, 0, 2)
    phi = np.array([at.rotation for at in points])
    xy = (Phi_x.T * masses) @ Phi_y
    loaded = replace(
        body,
        mass=body.mass + float(masses.sum()),
        inertia=body.inertia + float(masses @ (x * x + y * y) + inertias.sum()),
        first_moment=body.first_moment + np.array([masses @ x, masses @ y]),
        S_bar=body.S_bar + np.array([masses @ Phi_x, masses @ Phi_y]),
        h=body.h + (masses * x) @ Phi_y - (masses * y) @ Phi_x + inertias @ phi,
        j=body.j + (masses * x) @ Phi_x + (masses * y) @ Phi_y,
        S_tilde=body.S_tilde + xy - xy.T,
        m_xy=body.m_xy + (Phi_x.T * masses) @ Phi_x + (Phi_y.T * masses) @ Phi_y,
    )
    m_ff = np.eye(body.n_modes) + loaded.m_xy - body.m_xy + (phi.T * inertias) @ phi
    K_ff = np.diag(body.stiffness)
    return diagonalised(loaded, K_ff if stiffness is None else K_ff + stiffness, m_ff)


def mass_matrix(body: PlanarBody, q: Array) -> Array:
    """M (3 + n, 3 + n) of one body at its coordinates q = (R, θ, p), R in global axes: kg, kg·m, kg·m², √kg, √kg·m, 1.

    docs/theory.md, Equations of motion of a planar body (Shabana, Dynamics of Multibody Systems, ch. 5).
    """
    p, to_global = q[3:], np.eye(len(q))
    to_global[:2, :2] = rotation(q[2])
    if body.stiffening is not None and len(p):
        return np.asarray(to_global @ _stiffened_mass_matrix(body, body.stiffening, p) @ to_global.T)
    M = np.eye(len(q))
    M[:2, :2] = body.mass * np.eye(2)
    M[:2, 2] = M[2, :2] = perpendicular(body.first_moment + body.S_bar @ p)
    M[:2, 3:] = body.S_bar
    M[3:, :2] = M[:2, 3:].T
    M[2, 2] = body.inertia + 2 * body.j @ p + p @ body.m_xy @ p
    M[2, 3:] = M[3:, 2] = body.h + p @ body.S_tilde
    return np.asarray(to_global @ M @ to_global.T)


def _stiffened_mass_matrix(body: PlanarBody, stiffening: GeometricStiffening, p: Array) -> Array:
    """M (3 + n, 3 + n) in body axes: XᵀN⁻¹X of the affine part, and that of the rest.

    Symbols: mbs/core/body/affine_inertia.h.
    """
    m, (s_x, s_y), J = body.mass, body.first_moment, body.inertia
    N = np.array([[m, 0, s_x, -s_y], [0, m, s_y, s_x], [s_x, s_y, J, 0], [-s_y, s_x, 0, J]])
    i = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 0, -1], [0, 0, 1, 0]])
    F = np.vstack([body.S_bar, body.j, body.h])
    K = np.array([*stiffening.K_s, stiffening.K_omega + stiffening.rotary, stiffening.K_h])
    g = N[:, 2] + F @ p - 0.5 * p @ K @ p
    X = np.column_stack([N[:, :2], i @ g, F - K @ p])
    N_F = np.linalg.solve(N, F)
    rest = np.zeros((3 + len(p), 3 + len(p)))
    rest[2, 2] = p @ (body.m_xy + stiffening.rotary - F.T @ N_F) @ p
    rest[2, 3:] = rest[3:, 2] = p @ (body.S_tilde - (i @ F).T @ N_F)
    rest[3:, 3:] = np.eye(len(p)) - F.T @ N_F
    return np.asarray(X.T @ np.linalg.solve(N, X) + rest)


def system_mass_matrix(system: MechanismSystem, q: Array) -> Array:
    """M (coordinates, coordinates) of all bodies and of the rotors in joints, at q (coordinates,)."""
    blocks = zip(system.model.bodies, system.first, strict=True)
    M = block_diagonal([mass_matrix(body, q[first : first + 3 + body.n_modes]) for body, first in blocks])
    sensing = _core.Sensing(system.system, [(measure, 1) for measure, _ in system.rotors], [])
    at = np.tile(q, (len(q), 1))
    gradient = sensing.read(at, np.eye(len(q)), np.zeros_like(at))  # rates of unit velocities
    return M + gradient * [inertia for _, inertia in system.rotors] @ gradient.T


def block_diagonal(blocks: Sequence[Array]) -> Array:
    """Square blocks (n_i, n_i) along the diagonal of a matrix that is 0 elsewhere."""
    size = sum(len(block) for block in blocks)
    matrix, first = np.zeros((size, size)), 0
    for block in blocks:
        matrix[first : first + len(block), first : first + len(block)] = block
        first += len(block)
    return matrix
