"""The equations in space: absolute coordinates, dense matrices, written to be read, not to be fast.

Shares nothing with the compiled core but `SpatialBody`. Of one body after the other q = (R, e, p) with the quaternion e
(scalar first) and v = (Ṙ, ω̄, ṗ) with ω̄ in body axes. Symbols: Shabana, Dynamics of Multibody Systems, ch. 5; turning
sections and joints: docs/theory.md.
"""

from dataclasses import dataclass, field

import numpy as np
from rotations import exponential, left_jacobian, left_jacobian_rate, rotation, skew, turned
from spatial_rows import Coordinates, RowState


@dataclass
class Stiffening:
    """Second-order shapes u = x + Φp − ½pᵀGp by their integrals (section 4 of the formulation in space).

    K_s (3, n, n) = ∫ρ G dV, K_omega (3, 3, n, n) symmetric in its first two, K_r (3, n, n); `points`: (6, n, n) of
    forces and moments at a section, by its name.
    """

    K_s: np.ndarray
    K_omega: np.ndarray
    K_r: np.ndarray
    points: dict


def no_stiffening(body):
    n = body.n_modes
    zero = np.zeros((3, n, n))
    return Stiffening(zero, np.zeros((3, 3, n, n)), zero, {label: np.zeros((6, n, n)) for label in body.points})


@dataclass
class Inertia:
    """s (3,), s_p (3, n), J (3, 3), J_p (3, 3, n) and h (3, n) of a bent body, in body axes."""

    s: np.ndarray
    s_p: np.ndarray
    J: np.ndarray
    J_p: np.ndarray
    h: np.ndarray


def coupling(body):
    """H (3, n, n), H_a = ε_abc S̄_bc, skew."""
    S = body.S_bar_kl
    return np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])


def inertia(body, p, stiffening):
    S = body.S_bar_kl
    G = np.einsum("ij,kkmn->ijmn", np.eye(3), S) - 0.5 * (S + S.transpose(1, 0, 2, 3)) - stiffening.K_omega
    return Inertia(
        s=body.first_moment + body.S_bar @ p - 0.5 * p @ stiffening.K_s @ p,
        s_p=body.S_bar - stiffening.K_s @ p,
        J=body.inertia + body.inertia_slope @ p + p @ G @ p,
        J_p=body.inertia_slope + 2 * G @ p,
        h=body.spin + p @ (coupling(body) - stiffening.K_r),
    )


def body_mass_matrix(body, A, p, stiffening):
    """M (6 + n, 6 + n): m_RR = mI, m_Rθ = −A s~, m_Rf = A S̄, m_θθ = J, m_θf = h, m_ff = I."""
    at, n = inertia(body, p, stiffening), body.n_modes
    coupled = -A @ skew(at.s)
    return np.block(
        [
            [body.mass * np.eye(3), coupled, A @ at.s_p],
            [coupled.T, at.J, at.h],
            [(A @ at.s_p).T, at.h.T, np.eye(n)],
        ]
    )


def body_forces(body, A, p, omega, p_dot, g, stiffening):
    """Q (6 + n,): quadratic velocity forces, elastic forces, damping and gravity."""
    at = inertia(body, p, stiffening)
    K_s, K_r = stiffening.K_s, stiffening.K_r
    s_dot, J_dot = at.s_p @ p_dot, at.J_p @ p_dot
    Q_R = -A @ (np.cross(omega, np.cross(omega, at.s)) + 2 * np.cross(omega, s_dot) - p_dot @ K_s @ p_dot)
    Q_theta = -J_dot @ omega - np.cross(omega, at.J @ omega + at.h @ p_dot) + p_dot @ K_r @ p_dot
    Q_f = 0.5 * np.einsum("i,j,ijn->n", omega, omega, at.J_p)
    Q_f += 2 * np.einsum("a,amn,n->m", omega, coupling(body), p_dot)
    Q_f -= body.stiffness * p + body.damping @ p_dot
    pull = A.T @ g
    return np.concatenate([Q_R + body.mass * g, Q_theta + np.cross(at.s, pull), Q_f + at.s_p.T @ pull])


@dataclass
class MarkerState:
    """Of a triad: place r, axes F (columns), velocity (ṙ, Ω) (6,), its Jacobian L (6, N) and bias: (r̈, Ω̇) for v̇ = 0."""

    r: np.ndarray
    F: np.ndarray
    velocity: np.ndarray
    L: np.ndarray
    bias: np.ndarray


def resistance(friction, rate):
    return friction.viscous * rate + friction.coulomb * np.tanh(rate / friction.speed)


@dataclass
class Mechanism:
    """Bodies under constraints.

    constraints: (row, target), target(t) = (d, ḋ, d̈) or None where the row is kept at zero; loads: (row, size(t));
    modal_loads: (body name, vector (n,), size(t)); rotors: (row, inertia); frictions: (row, Friction). `stiffening` by
    body name where it is in the equations.
    """

    bodies: list
    gravity: np.ndarray
    constraints: list = field(default_factory=list)
    loads: list = field(default_factory=list)
    modal_loads: list = field(default_factory=list)
    rotors: list = field(default_factory=list)
    frictions: list = field(default_factory=list)
    stiffening: dict = field(default_factory=dict)

    def __post_init__(self):
        self.gravity = np.array(self.gravity, dtype=float)
        self.coordinates = Coordinates([(body.name, body.n_modes) for body in self.bodies])
        self.size = self.coordinates.n_v
        self.stiffening = {body.name: self.stiffening.get(body.name) or no_stiffening(body) for body in self.bodies}

    def body(self, name):
        return next(body for body in self.bodies if body.name == name)

    def integrate(self, q, dv):
        """Q moved by the small velocity-like step dv (N,)."""
        moved = q.copy()
        for name in self.coordinates.names:
            R, e, p = self.coordinates.parts(moved, name)
            dR, turn, dp = self.coordinates.rates(dv, name)
            e[:] = turned(e, turn)
            R += dR
            p += dp
        return moved

    def mass_matrix(self, q):
        M = np.zeros((self.size, self.size))
        for body in self.bodies:
            i = self.coordinates.columns(body.name)
            _, e, p = self.coordinates.parts(q, body.name)
            M[i, i] = body_mass_matrix(body, rotation(e), p, self.stiffening[body.name])
        for row, J in self.rotors:
            gradient = self.row(row, q, np.zeros(self.size)).gradient
            M += J * np.outer(gradient, gradient)
        return M

    def forces(self, t, q, v):
        """Q (N,): quadratic velocity, elastic, damping, gravity and applied forces."""
        Q = np.zeros(self.size)
        for body in self.bodies:
            _, e, p = self.coordinates.parts(q, body.name)
            _, omega, p_dot = self.coordinates.rates(v, body.name)
            own = body_forces(body, rotation(e), p, omega, p_dot, self.gravity, self.stiffening[body.name])
            Q[self.coordinates.columns(body.name)] += own
        for row, size in self.loads:
            Q += self.row(row, q, v, t).gradient * size(t)
        for row, J in self.rotors:
            state = self.row(row, q, v, t)
            Q -= J * (state.bias * state.gradient + state.rate * state.axis_turns)
        for row, friction in self.frictions:
            state = self.row(row, q, v, t)
            Q -= state.gradient * resistance(friction, state.rate)
        for name, vector, size in self.modal_loads:
            Q[self.coordinates.columns(name)][6:] += vector * size(t)
        return Q

    def marker(self, at, q, v, t=0.0):
        """A section's triad (`spatial_rows.Section`), of a body or the ground, or one driven in time."""
        L = np.zeros((6, self.size))
        if at.body is None:
            r, F, velocity, acceleration = at.motion(t)
            return MarkerState(r, F, velocity, L, acceleration)
        body, i = self.body(at.body), self.coordinates.columns(at.body)
        (R, e, p), (_, omega, p_dot) = self.coordinates.parts(q, at.body), self.coordinates.rates(v, at.body)
        A, n = rotation(e), body.n_modes
        if at.point:
            section, K = body.points[at.point], self.stiffening[at.body].points[at.point]
            x, Phi, Phi_r = section.position, section.translation, section.rotation
        else:
            x, Phi, Phi_r, K = np.zeros(3), np.zeros((3, n)), np.zeros((3, n)), np.zeros((6, n, n))
        u, u_p = x + Phi @ p - 0.5 * p @ K[:3] @ p, Phi - K[:3] @ p
        phi, phi_p = Phi_r @ p - 0.5 * p @ K[3:] @ p, Phi_r - K[3:] @ p
        phi_dot, J_l = phi_p @ p_dot, left_jacobian(phi)
        L[:3, i] = np.hstack([np.eye(3), -A @ skew(u), A @ u_p])
        L[3:, i] = np.hstack([np.zeros((3, 3)), A, A @ J_l @ phi_p])
        spin = np.cross(omega, J_l @ phi_dot) + left_jacobian_rate(phi, phi_dot) - J_l @ (p_dot @ K[3:] @ p_dot)
        carried = np.cross(omega, np.cross(omega, u)) + 2 * np.cross(omega, u_p @ p_dot) - p_dot @ K[:3] @ p_dot
        F = A @ exponential(phi) @ at.triad
        return MarkerState(R + A @ u, F, L @ v, L, np.concatenate([A @ carried, A @ spin]))

    def row(self, row, q, v, t=0.0, known=None):
        """Value, rate, gradient (N,) and bias of a row: its second derivative is gradient · v̇ + bias.

        `known`: markers found before at this state, by their identity.
        """
        known = {} if known is None else known
        for at in (row.a, row.b):
            if id(at) not in known:
                known[id(at)] = self.marker(at, q, v, t)
        a, b = known[id(row.a)], known[id(row.b)]
        found = row.between(a, b)
        ends = ((found.on_a, a), (found.on_b, b))
        return RowState(
            value=found.value,
            rate=sum(on @ end.velocity for on, end in ends),
            gradient=sum(on @ end.L for on, end in ends),
            bias=sum(on @ end.bias for on, end in ends) + found.extra,
            on_b=found.on_b,
            axis_turns=found.axis_turns @ a.L[3:],
        )

    def constraint_values(self, t, q, v):
        """C, Ċ, C_v (m, N) and γ, with C_v v̇ = γ."""
        known = {}
        states = [self.row(row, q, v, t, known) for row, _ in self.constraints]
        targets = [(0.0, 0.0, 0.0) if target is None else target(t) for _, target in self.constraints]
        C = np.array([state.value - target[0] for state, target in zip(states, targets, strict=True)])
        C_dot = np.array([state.rate - target[1] for state, target in zip(states, targets, strict=True)])
        gamma = np.array([target[2] - state.bias for state, target in zip(states, targets, strict=True)])
        return C, C_dot, np.array([state.gradient for state in states]).reshape(-1, self.size), gamma

    def solve(self, t, q, v):
        """V̇ and λ of M v̇ + C_vᵀλ = Q, C_v v̇ = γ; of least size where constraints repeat each other."""
        _, _, C_v, gamma = self.constraint_values(t, q, v)
        m = len(gamma)
        augmented = np.block([[self.mass_matrix(q), C_v.T], [C_v, np.zeros((m, m))]])
        right = np.concatenate([self.forces(t, q, v), gamma])
        if m and np.linalg.matrix_rank(C_v) < m:
            solution = np.linalg.lstsq(augmented, right, rcond=1e-13)[0]
        else:
            solution = np.linalg.solve(augmented, right)
        return solution[: self.size], solution[self.size :]

    def reaction(self, number, t, q, v, multiplier):
        """Force and moment (6,) that constraint `number` puts on its second side there, global axes."""
        return -multiplier * self.row(self.constraints[number][0], q, v, t).on_b

    def required(self, t, q, forces, mechanical, motors):
        """What motors and modal forces replace generalised `forces` (N,) = −C_sᵀλ_s: τ (k,), F_p by body.

        mechanical: rows whose reactions may change; motors: gradients (k, N) of the motors' rates.
        """
        C_m = np.array([self.row(row, q, np.zeros(self.size), t).gradient for row in mechanical])
        of_modes = np.zeros((0, self.size))
        for body in self.bodies:
            of_modes = np.vstack([of_modes, np.eye(self.size)[self.coordinates.columns(body.name)][6:]])
        rows = np.vstack([C_m.reshape(-1, self.size), motors, of_modes])
        solution = np.linalg.lstsq(rows.T, forces, rcond=None)[0]
        first = len(mechanical) + len(motors)
        sizes = np.cumsum([0] + [body.n_modes for body in self.bodies]) + first
        F_p = {body.name: solution[sizes[k] : sizes[k + 1]] for k, body in enumerate(self.bodies)}
        return solution[len(mechanical) : first], F_p

    def energies(self, q, v):
        """Kinetic, strain and gravitational energy."""
        strain = gravitational = 0.0
        for body in self.bodies:
            R, e, p = self.coordinates.parts(q, body.name)
            s = inertia(body, p, self.stiffening[body.name]).s
            strain += 0.5 * p @ (body.stiffness * p)
            gravitational -= (body.mass * R + rotation(e) @ s) @ self.gravity
        return np.array([0.5 * v @ self.mass_matrix(q) @ v, strain, gravitational])

    def momentum(self, q, v):
        """Linear momentum (3) and angular momentum about the origin (3), of all bodies together."""
        total = np.zeros(6)
        for body in self.bodies:
            R, e, p = self.coordinates.parts(q, body.name)
            P = (
                body_mass_matrix(body, rotation(e), p, self.stiffening[body.name])
                @ v[self.coordinates.columns(body.name)]
            )
            total[:3] += P[:3]
            total[3:] += np.cross(R, P[:3]) + rotation(e) @ P[3:6]
        return total
