"""Masses attached to sections of bodies: payloads, and line masses along a beam. SI units.

A payload rotates with its section by exp(φ~), φ = Φ_r p. A body of its own, welded to the section, is exact whatever
inertia it has. Payloads of rigid bodies, and point masses on sections, are exact as parts of their body.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array, Indices
from ...common.rotations import skew
from ...fe_models.modal_body.lumped_masses import attached_integrals, with_added
from ..joints.joints import WeldJoint
from ..scene.bodies import Payload, tensor
from ..scene.mechanism import MechanismKeys
from .body import Body, BodyPoint, rigid_body, transformed


def turns_as_a_body(scene: MechanismKeys, payload: Payload) -> bool:
    """Whether rotation of its section matters to the payload: not to a point mass there (planar: any mass there)."""
    is_beside = payload.mass and np.any(payload.center)
    return bool(is_beside or (np.any(payload.inertia) and not scene.is_planar))


def welded_payloads(scene: MechanismKeys) -> Iterator[tuple[Body, WeldJoint]]:
    """Yield payloads that are rigid bodies of their own, with welds to their links; no scene can have their names."""
    rigid = {body.name for body in scene.body if body.rigid is not None}
    for k, payload in enumerate(scene.payload, 1):
        if turns_as_a_body(scene, payload) and payload.point.partition(".")[0] not in rigid:
            name = f"payload, number {k}"
            body = rigid_body(name, payload.mass, np.array(payload.center), tensor(payload.inertia), {})
            yield body, WeldJoint.model_construct(name=name, type="weld", between=(payload.point, name))


UNCOUPLED = 1e-12  # of the geometric mean of two modes' own terms: what couples them less is round-off


def with_payload(body: Body, point: str, mass: float, center: Array, inertia: Array) -> Body:
    """Add a mass (kg) rigidly attached to a section of the body; `center` (3,), m, in the body's axes.

    `inertia` (3, 3) is in kg·m² about that center.
    """
    at = body.points[point]
    x, phi = at.position + center, at.rotation
    Phi = at.translation - skew(center) @ phi
    # ∫ρ ξ ξᵀ dV
    E = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    added = attached_integrals(mass, x, E, Phi, phi)
    # J about the center counts as it is, however far the section turns: see `Stiffening.S_turned`
    added["S_bar_kl"] = mass * np.einsum("km,ln->klmn", Phi, Phi)
    loaded = with_added(body, added)
    if body.stiffening is not None:
        stiffening = body.stiffening.with_payload(point, at.position, phi, mass, center, E)
        loaded = replace(loaded, stiffening=stiffening)
    return _uncoupled(loaded, np.eye(body.n_modes) + mass * Phi.T @ Phi + phi.T @ inertia @ phi)


def with_line_masses(body: Body, points: Sequence[BodyPoint], masses: Array, spins: Array, stiffness: Array) -> Body:
    """Add masses (k,), kg, at sections `points` near the body's axis, and stiffness (n, n), rad²/s², of strips on it.

    They have moments of inertia `spins` (k,), kg·m², about the axis alone.
    """
    m_ff, loaded = np.eye(body.n_modes), body
    for at, mass, spin in zip(points, masses, spins, strict=True):
        Phi, twist = at.translation, at.rotation[0]
        loaded = with_added(loaded, attached_integrals(mass, at.position, np.zeros((3, 3)), Phi, at.rotation))
        about = {"J_spin": spin, "h_spin": spin * twist, "S_spin": spin * np.outer(twist, twist)}
        loaded = with_added(loaded, about)
        m_ff += mass * Phi.T @ Phi + about["S_spin"]
    return _uncoupled(loaded, m_ff, stiffness)


def _uncoupled(body: Body, m_ff: Array, added: Array | float = 0.0) -> Body:
    """The body in modal coordinates that make m_ff (n, n) the identity, and K_ff, with what is `added`, diagonal."""
    if not body.n_modes:
        return body
    T, stiffness = uncoupling(m_ff, np.diag(body.stiffness) + added)
    return transformed(body, T, stiffness)


def uncoupling(M: Array, K: Array) -> tuple[Array, Array]:
    """T (n, n), no unit, with TᵀMT = 1, TᵀKT = diag(stiffness), and this stiffness (n,), rad²/s², of n modes.

    Modes that M (n, n), no unit, and K (n, n), rad²/s², do not couple are not mixed, even at equal frequencies, so
    that they keep their families. Coupled ones are in ascending order in the places that they had.
    """
    T, stiffness = np.zeros_like(M), np.zeros(len(M))
    for block in coupled_blocks(M, K):
        square = np.ix_(block, block)
        L_inverse = np.linalg.inv(np.linalg.cholesky(M[square]))
        stiffness[block], vectors = np.linalg.eigh(L_inverse @ K[square] @ L_inverse.T)
        T[square] = L_inverse.T @ vectors
    return T, stiffness


def coupled_blocks(*matrices: Array) -> list[Indices]:
    """Sets of indices (any,) of modes that any of the `matrices` (n, n), of any unit, couples."""
    coupled = np.eye(len(matrices[0]), dtype=bool)
    for matrix in matrices:
        scale = np.sqrt(np.diag(matrix))
        coupled |= np.abs(matrix) > UNCOUPLED * np.outer(scale, scale)
    coupled |= coupled.T
    while np.any((further := coupled @ coupled) != coupled):
        coupled = further
    return [np.array(block) for block in dict.fromkeys(tuple(np.flatnonzero(row)) for row in coupled)]
