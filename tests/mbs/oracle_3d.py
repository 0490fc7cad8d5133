"""The equations in 3D: absolute coordinates, dense matrices, written to be read, not to be fast.

Shares nothing with the compiled core but `Body`. Of one body after the other q = (R, e, p) with the quaternion e
(scalar first) and v = (Ṙ, ω̄, ṗ) with ω̄ in body axes. Symbols: Shabana, Dynamics of Multibody Systems, ch. 5.
"""

from types import SimpleNamespace

import numpy as np
from rotations import rotation, skew


def coupling(body):
    """H (3, n, n), H_a = ε_abc S̄_bc, skew."""
    S = body.S_bar_kl
    return np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])


def inertia(body, p):
    """s (3,), s_p (3, n), J (3, 3), J_p (3, 3, n) and h (3, n) of a bent body, in body axes."""
    S = body.S_bar_kl
    G = np.einsum("ij,kkmn->ijmn", np.eye(3), S) - 0.5 * (S + S.transpose(1, 0, 2, 3))
    return SimpleNamespace(
        s=body.first_moment + body.S_bar @ p,
        s_p=body.S_bar,
        J=body.inertia + body.inertia_slope @ p + p @ G @ p,
        J_p=body.inertia_slope + 2 * G @ p,
        h=body.spin + p @ coupling(body),
    )


def body_mass_matrix(body, A, p):
    """M (6 + n, 6 + n): m_RR = mI, m_Rθ = −A s~, m_Rf = A S̄, m_θθ = J, m_θf = h, m_ff = I."""
    if body.stiffening is not None:
        return stiffened_mass_matrix(body, A, p)
    at, n = inertia(body, p), body.n_modes
    coupled = -A @ skew(at.s)
    return np.block(
        [[body.mass * np.eye(3), coupled, A @ at.s_p], [coupled.T, at.J, at.h], [(A @ at.s_p).T, at.h.T, np.eye(n)]]
    )


def body_forces(body, A, p, omega, p_dot, g):
    """Q (6 + n,): quadratic velocity forces, elastic forces, damping and gravity."""
    if body.stiffening is not None:
        return stiffened_forces(body, A, p, omega, p_dot, g)
    at = inertia(body, p)
    s_dot, J_dot = at.s_p @ p_dot, at.J_p @ p_dot
    Q_R = -A @ (np.cross(omega, np.cross(omega, at.s)) + 2 * np.cross(omega, s_dot))
    Q_theta = -J_dot @ omega - np.cross(omega, at.J @ omega + at.h @ p_dot)
    Q_f = 0.5 * np.einsum("i,j,ijn->n", omega, omega, at.J_p)
    Q_f += 2 * np.einsum("a,amn,n->m", omega, coupling(body), p_dot)
    Q_f -= body.stiffness * p + body.damping @ p_dot
    pull = A.T @ g
    return np.concatenate([Q_R + body.mass * g, Q_theta + np.cross(at.s, pull), Q_f + at.s_p.T @ pull])


# With geometric stiffening: u = x + Φp − ½ pᵀG p, G taken by its projection on affine fields. All motion of the body
# along an axis is made of the shapes 1, x, y, z and Φ_c of axis c, whose products H are constant: M = TᵀHT.


def products_of_shapes(body):
    """H (3, 3, 4 + n, 4 + n) at [c, d]: ∫ρ of products of 1, x, y, z, Φ_c with 1, x, y, z, Φ_d."""
    N = np.block([[np.array([[body.mass]]), body.first_moment[None]], [body.first_moment[:, None], body.second_moment]])
    F = np.concatenate([body.S_bar[None], body.I_bar])  # (4, 3, n)
    S = body.S_bar_kl + body.stiffening.S_turned
    return np.array([[np.block([[N, F[:, d]], [F[:, c].T, S[c, d]]]) for d in range(3)] for c in range(3)])


def affine_part(body):
    """(4, 3, n, n): the affine field nearest to G under the mass, which has the integrals ∫ρG dV, ∫ρx_k G dV."""
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


def stiffened_mass_matrix(body, A, p):
    T, H = velocity_map(body, A, p), products_of_shapes(body)
    return np.einsum("bcim,cdij,bdjk->mk", T, H, T) + spinning(body, np.einsum("ccmn->mn", H[:, :, 4:, 4:]))


def stiffened_forces(body, A, p, omega, p_dot, g):
    """−TᵀH c, c what of the acceleration less gravity is by velocities: ω × (ω × u) + 2 ω × u̇ − ṗᵀG ṗ."""
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


class Mechanism:
    """Bodies, each by itself: where R, e, p of each are in q, and Ṙ, ω̄, ṗ in v."""

    def __init__(self, bodies, gravity):
        self.bodies, self.gravity = bodies, np.array(gravity, dtype=float)
        self._modes = {body.name: body.n_modes for body in bodies}
        self._first_q = dict(zip(self._modes, np.cumsum([0] + [7 + n for n in self._modes.values()]), strict=False))
        self._first_v = dict(zip(self._modes, np.cumsum([0] + [6 + n for n in self._modes.values()]), strict=False))
        self.n_q, self.n_v = (sum(k + n for n in self._modes.values()) for k in (7, 6))

    def columns(self, name):
        """Slice of a body in v."""
        return slice(self._first_v[name], self._first_v[name] + 6 + self._modes[name])

    def parts(self, q, name):
        """R, e, p: views of q."""
        i, n = self._first_q[name], self._modes[name]
        return q[i : i + 3], q[i + 3 : i + 7], q[i + 7 : i + 7 + n]

    def rates(self, v, name):
        """Ṙ, ω̄, ṗ: views of v."""
        own = v[self.columns(name)]
        return own[:3], own[3:6], own[6:]

    def mass_matrix(self, q):
        M = np.zeros((self.n_v, self.n_v))
        for body in self.bodies:
            i = self.columns(body.name)
            _, e, p = self.parts(q, body.name)
            M[i, i] = body_mass_matrix(body, rotation(e), p)
        return M

    def forces(self, q, v):
        """Q (N,): quadratic velocity, elastic, damping and gravity forces."""
        Q = np.zeros(self.n_v)
        for body in self.bodies:
            _, e, p = self.parts(q, body.name)
            _, omega, p_dot = self.rates(v, body.name)
            own = body_forces(body, rotation(e), p, omega, p_dot, self.gravity)
            Q[self.columns(body.name)] = own
        return Q

    def energies(self, q, v):
        """Kinetic, strain and gravitational energy."""
        strain = gravitational = 0.0
        for body in self.bodies:
            R, e, p = self.parts(q, body.name)
            s = inertia(body, p).s
            if body.stiffening is not None:
                s = s - 0.5 * p @ body.stiffening.K_s @ p
            strain += 0.5 * p @ (body.stiffness * p)
            gravitational -= (body.mass * R + rotation(e) @ s) @ self.gravity
        return np.array([0.5 * v @ self.mass_matrix(q) @ v, strain, gravitational])
