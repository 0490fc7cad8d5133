"""The equations of a body in 3D: dense matrices, written to be read, not to be fast.

Shares nothing with the compiled core but `Body`: place R and axes A of its frame, modal coordinates p and
v = (Ṙ, ω̄, ṗ) with ω̄ in body axes. Symbols: Shabana, Dynamics of Multibody Systems, ch. 5.

With geometric stiffening u = x + Φp − ½ pᵀG p, G taken by its projection on affine fields. All motion of the body along
an axis is made of the shapes 1, x, y, z and Φ_c of axis c, whose products H are constant: M = TᵀHT.
"""

import numpy as np
from rotations import skew


def products_of_shapes(body):
    """H (3, 3, 4 + n, 4 + n) at [c, d]: ∫ρ of products of 1, x, y, z, Φ_c with 1, x, y, z, Φ_d."""
    N = np.block([[np.array([[body.mass]]), body.first_moment[None]], [body.first_moment[:, None], body.second_moment]])
    F = np.concatenate([body.S_bar[None], body.I_bar])  # (4, 3, n)
    S = body.S_bar_kl if body.stiffening is None else body.S_bar_kl + body.stiffening.S_turned
    return np.array([[np.block([[N, F[:, d]], [F[:, c].T, S[c, d]]]) for d in range(3)] for c in range(3)])


def affine_part(body):
    """(4, 3, n, n): the affine field nearest to G under the mass, which has the integrals ∫ρG dV, ∫ρx_k G dV."""
    if body.stiffening is None:
        return np.zeros((4, 3, body.n_modes, body.n_modes))
    N = products_of_shapes(body)[0, 0, :4, :4]
    K = np.concatenate([body.stiffening.K_s[None], body.stiffening.K_x])
    return np.einsum("ef,fcmn->ecmn", np.linalg.pinv(N, rcond=1e-12, hermitian=True), K)


def position_by_shapes(body, p):
    """U (3, 4 + n) at [c]: how much of 1, x, y, z, Φ_c there is in the position along c."""
    second = -0.5 * np.einsum("m,ecmn,n->ce", p, affine_part(body), p)
    straight = np.hstack([np.zeros((3, 1)), np.eye(3)])
    return np.hstack([straight + second, np.tile(p, (3, 1))])


def rates_by_shapes(body, p):
    """(3, 4 + n, n): the derivatives of these by p."""
    n = body.n_modes
    first = -np.einsum("ecmn,n->cem", affine_part(body), p)
    return np.concatenate([first, np.broadcast_to(np.eye(n), (3, n, n))], axis=1)


def turned_shapes(omega, U):
    """(3, 3, …) at [b, c]: ω × u along axis b by shapes of axis c."""
    return np.einsum("bc,c...->bc...", skew(omega), U)


def velocity_map(body, A, p):
    """T (3, 3, 4 + n, 6 + n) at [b, c]: velocity along axis b of the body by shapes of axis c, from (Ṙ, ω̄, ṗ)."""
    n = body.n_modes
    U, T = position_by_shapes(body, p), np.zeros((3, 3, 4 + n, 6 + n))
    for k, e in enumerate(np.eye(3)):
        T[..., 3 + k] = turned_shapes(e, U)
    for b, rates in enumerate(rates_by_shapes(body, p)):
        T[b, b, 0, :3] = A[:, b]
        T[b, b, :, 6:] = rates
    return T


def spinning(body, S):
    """Matrix (6 + n, 6 + n) of the energy ½∫ρI_p (ω̄_x + φ̇)² dx that a line of mass has besides.

    And of what its modes move otherwise, across the plane on which it is projected: they have a mass of 1 in all, of
    which S (n, n) is in the shapes.
    """
    M = np.zeros((6 + body.n_modes, 6 + body.n_modes))
    M[3, 3], M[3, 6:], M[6:, 3] = body.J_spin, body.h_spin, body.h_spin
    M[6:, 6:] = np.eye(body.n_modes) - S
    assert np.linalg.eigvalsh(M[6:, 6:] - body.S_spin).min(initial=0.0) > -1e-9
    return M


def body_mass_matrix(body, A, p):
    T, H = velocity_map(body, A, p), products_of_shapes(body)
    return np.einsum("bcim,cdij,bdjk->mk", T, H, T) + spinning(body, np.einsum("ccmn->mn", H[:, :, 4:, 4:]))


def forces_on_body(body, A, p, v, g):
    """−TᵀH c, c what of the acceleration less gravity is by velocities: ω × (ω × u) + 2 ω × u̇ − ṗᵀG ṗ; and elastic."""
    omega, p_dot = v[3:6], v[6:]
    T, H = velocity_map(body, A, p), products_of_shapes(body)
    U, U_dot = position_by_shapes(body, p), rates_by_shapes(body, p) @ p_dot
    c = np.einsum("ab,bc...->ac...", skew(omega), turned_shapes(omega, U)) + 2 * turned_shapes(omega, U_dot)
    for b in range(3):
        c[b, b, :4] -= np.einsum("m,emn,n->e", p_dot, affine_part(body)[:, b], p_dot)
        c[b, b, 0] -= A[:, b] @ g
    Q = -np.einsum("bcim,cdij,bdj->m", T, H, c)
    spin = body.J_spin * omega[0] + body.h_spin @ p_dot
    Q[3:6] -= np.cross(omega, [spin, 0.0, 0.0])
    Q[6:] -= body.stiffness * p + body.damping @ p_dot
    return Q


def energies_of_body(body, R, A, p, v, g):
    """Kinetic, strain and gravitational energy."""
    s = body.first_moment + body.S_bar @ p
    if body.stiffening is not None:
        s = s - 0.5 * p @ body.stiffening.K_s @ p
    kinetic = 0.5 * v @ body_mass_matrix(body, A, p) @ v
    return np.array([kinetic, 0.5 * p @ (body.stiffness * p), -(body.mass * R + A @ s) @ g])
