"""The equations in 3D: absolute coordinates, dense matrices, written to be read, not to be fast.

Shares nothing with the compiled core but `Body`. Of one body after the other q = (R, e, p) with the quaternion e
(scalar first) and v = (Ṙ, ω̄, ṗ) with ω̄ in body axes. Symbols: Shabana, Dynamics of Multibody Systems, ch. 5; turning
sections and joints: docs/theory.md.
"""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
from rotations import exponential, left_jacobian, left_jacobian_rate, rotation, skew
from triad_measures import Coordinates, RowState


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


@dataclass
class MarkerState:
    """Of a triad: place r, axes F (columns), velocity (ṙ, Ω) (6,), its Jacobian L (6, N) and bias: (r̈, Ω̇) for v̇ = 0."""

    r: np.ndarray
    F: np.ndarray
    velocity: np.ndarray
    L: np.ndarray
    bias: np.ndarray


@dataclass
class Mechanism:
    """Bodies, and rotors (row, inertia)."""

    bodies: list
    gravity: np.ndarray
    rotors: list = field(default_factory=list)

    def __post_init__(self):
        self.gravity = np.array(self.gravity, dtype=float)
        self.coordinates = Coordinates([(body.name, body.n_modes) for body in self.bodies])
        self.size = self.coordinates.n_v

    def body(self, name):
        return next(body for body in self.bodies if body.name == name)

    def mass_matrix(self, q):
        M = np.zeros((self.size, self.size))
        for body in self.bodies:
            i = self.coordinates.columns(body.name)
            _, e, p = self.coordinates.parts(q, body.name)
            M[i, i] = body_mass_matrix(body, rotation(e), p)
        for row, J in self.rotors:
            gradient = self.row(row, q, np.zeros(self.size)).gradient
            M += J * np.outer(gradient, gradient)
        return M

    def forces(self, q, v):
        """Q (N,): quadratic velocity, elastic, damping and gravity forces."""
        Q = np.zeros(self.size)
        for body in self.bodies:
            _, e, p = self.coordinates.parts(q, body.name)
            _, omega, p_dot = self.coordinates.rates(v, body.name)
            own = body_forces(body, rotation(e), p, omega, p_dot, self.gravity)
            Q[self.coordinates.columns(body.name)] += own
        for row, J in self.rotors:
            state = self.row(row, q, v)
            Q -= J * (state.bias * state.gradient + state.rate * state.axis_turns)
        return Q

    def marker(self, at, q, v):
        """A section's triad (`triad_measures.Section`), of a body or the ground."""
        L = np.zeros((6, self.size))
        if at.body is None:
            return MarkerState(np.asarray(at.position, dtype=float), at.triad, np.zeros(6), L, np.zeros(6))
        body, i = self.body(at.body), self.coordinates.columns(at.body)
        (R, e, p), (_, omega, p_dot) = self.coordinates.parts(q, at.body), self.coordinates.rates(v, at.body)
        A, n = rotation(e), body.n_modes
        if at.point:
            section = body.points[at.point]
            K = np.zeros((6, n, n)) if body.stiffening is None else body.stiffening.at(at.point)
            x, Phi, Phi_r = section.position, section.translation, section.rotation
        else:
            x, Phi, Phi_r, K = np.zeros(3), np.zeros((3, n)), np.zeros((3, n)), np.zeros((6, n, n))
        if at.still:
            Phi_r, K = 0 * Phi_r, K * np.repeat([1, 0], 3)[:, None, None]
        u, u_p = x + Phi @ p - 0.5 * p @ K[:3] @ p, Phi - K[:3] @ p
        phi, phi_p = Phi_r @ p - 0.5 * p @ K[3:] @ p, Phi_r - K[3:] @ p
        phi_dot, J_l = phi_p @ p_dot, left_jacobian(phi)
        L[:3, i] = np.hstack([np.eye(3), -A @ skew(u), A @ u_p])
        L[3:, i] = np.hstack([np.zeros((3, 3)), A, A @ J_l @ phi_p])
        spin = np.cross(omega, J_l @ phi_dot) + left_jacobian_rate(phi, phi_dot) - J_l @ (p_dot @ K[3:] @ p_dot)
        carried = np.cross(omega, np.cross(omega, u)) + 2 * np.cross(omega, u_p @ p_dot) - p_dot @ K[:3] @ p_dot
        F = A @ exponential(phi) @ at.triad
        return MarkerState(R + A @ u, F, L @ v, L, np.concatenate([A @ carried, A @ spin]))

    def row(self, row, q, v, known=None):
        """Value, rate, gradient (N,) and bias of a row: its second derivative is gradient · v̇ + bias.

        `known`: markers found before at this state, by their identity.
        """
        known = {} if known is None else known
        for at in (row.a, row.b):
            if id(at) not in known:
                known[id(at)] = self.marker(at, q, v)
        a, b = known[id(row.a)], known[id(row.b)]
        found = row.between(a, b)
        ends = ((found.on_a, a), (found.on_b, b))
        return RowState(
            value=found.value,
            rate=sum(on @ end.velocity for on, end in ends),
            gradient=sum(on @ end.L for on, end in ends),
            bias=sum(on @ end.bias for on, end in ends) + found.extra,
            axis_turns=found.axis_turns @ a.L[3:],
        )

    def energies(self, q, v):
        """Kinetic, strain and gravitational energy."""
        strain = gravitational = 0.0
        for body in self.bodies:
            R, e, p = self.coordinates.parts(q, body.name)
            s = inertia(body, p).s
            if body.stiffening is not None:
                s = s - 0.5 * p @ body.stiffening.K_s @ p
            strain += 0.5 * p @ (body.stiffness * p)
            gravitational -= (body.mass * R + rotation(e) @ s) @ self.gravity
        return np.array([0.5 * v @ self.mass_matrix(q) @ v, strain, gravitational])
