"""The planar equations as docs/theory.md states them: dense matrices, written to be read, not to be fast.

Shares nothing with the compiled core but its input: `PlanarBody`, rows (`marker_measures.Measure`) and
functions of time.
Coordinates q = (R, θ, p) of one body after the other; symbols as in Shabana, Dynamics of Multibody Systems, ch. 5.
"""

from dataclasses import dataclass

import numpy as np
from bodies_by_invariants import PlanarPoint


def rotation(theta):
    return np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])


def rotation_derivative(theta):
    return np.array([[-np.sin(theta), -np.cos(theta)], [np.cos(theta), -np.sin(theta)]])


@dataclass
class Fields:
    """Positions in the body frame, x + iy = u · (1, x + iy, Φ_x + iΦ_y) with u = (−½pᵀαp, 1 − ½pᵀβp, p).

    H (2 + n, 2 + n): products of the fields; u and its Jacobian u_p (2 + n, n); curvature (2 + n, n, n) of u;
    m_out = m_ff − m_xy: of what moves otherwise than in the plane.
    """

    H: np.ndarray
    u: np.ndarray
    u_p: np.ndarray
    curvature: np.ndarray
    m_out: np.ndarray


def fields(body, p):
    n = body.n_modes
    K = np.array([body.K_s[0] + 1j * body.K_s[1], body.K_stretch + 1j * body.K_turn])
    s0 = complex(*body.first_moment)
    of_modes = np.array([body.S_bar[0] + 1j * body.S_bar[1], body.j + 1j * body.h])
    affine = np.array([[body.mass, s0], [s0.conjugate(), body.inertia]])
    H = np.block([[affine, of_modes], [of_modes.conj().T, body.m_xy + 1j * body.S_tilde]])
    curvature = np.zeros((2 + n, n, n), dtype=complex)
    curvature[:2] = -np.einsum("ij,jkl->ikl", np.linalg.pinv(affine, hermitian=True), K)
    u = np.concatenate([[0, 1], p]) + 0.5 * p @ curvature @ p
    u_p = np.vstack([np.zeros((2, n)), np.eye(n)]) + curvature @ p
    return Fields(H, u, u_p, curvature, np.eye(n) - body.m_xy)


def directions(f, p):
    """T (2 + n, 3 + n): what R (body axes), θ and p do to the coefficients of the fields."""
    first = np.zeros_like(f.u)
    first[0] = 1
    return np.column_stack([first, 1j * first, 1j * f.u, f.u_p])


def first_moment(body, p):
    """s = ∫ρ (x + Φp − ½ pᵀK p) and its derivative with respect to p."""
    return body.first_moment + body.S_bar @ p - 0.5 * p @ body.K_s @ p, body.S_bar - body.K_s @ p


def in_global_axes(theta, force):
    return np.concatenate([rotation(theta) @ force[:2], force[2:]])


def mass_matrix(body, q):
    """M = Re TᴴHT (3 + n, 3 + n) of one body."""
    p, f = q[3:], fields(body, q[3:])
    T = directions(f, p)
    M = (T.conj().T @ f.H @ T).real
    M[3:, 3:] += f.m_out
    A = np.eye(len(q))
    A[:2, :2] = rotation(q[2])
    return A @ M @ A.T


def quadratic_velocity_forces(body, q, v):
    """Q_v = −Re TᴴHc, c: the acceleration of the fields' coefficients where R̈ = 0, θ̈ = 0, p̈ = 0."""
    p, theta_dot, p_dot, f = q[3:], v[2], v[3:], fields(body, q[3:])
    c = -(theta_dot**2) * f.u + 2j * theta_dot * f.u_p @ p_dot + p_dot @ f.curvature @ p_dot
    return in_global_axes(q[2], -(directions(f, p).conj().T @ f.H @ c).real)


def gravity_forces(body, q, g):
    theta, p = q[2], q[3:]
    s, s_p = first_moment(body, p)
    Q_theta = rotation_derivative(theta) @ s @ g
    return np.concatenate([body.mass * g, [Q_theta], s_p.T @ rotation(theta).T @ g])


def elastic_forces(body, q, v):
    return np.concatenate([np.zeros(3), -body.stiffness * q[3:] - body.damping @ v[3:]])


def resistance(friction, rate):
    return friction.viscous * rate + friction.coulomb * np.tanh(rate / friction.speed)


@dataclass
class Marker:
    """Motion (x, y, angle) of one end of a row, its Jacobian L (3, N) and acceleration where q̈ = 0."""

    position: np.ndarray
    velocity: np.ndarray
    L: np.ndarray
    convective: np.ndarray


@dataclass
class RowState:
    """value, rate and second derivative = gradient · q̈ + bias of a row."""

    value: float
    rate: float
    gradient: np.ndarray
    bias: float


class Mechanism:
    """Bodies with constraints (row, target), loads (row, size) and modal loads (body name, vector, size).

    Joints as built: rotors (row, inertia), whose rate is the row's, friction (row, Friction) along rows. Forces of the
    motion (marker, function) as scenes have them.
    """

    def __init__(self, bodies, gravity, constraints=(), loads=(), modal_loads=(), rotors=(), frictions=(), forces=()):
        self.bodies = list(bodies)
        self.gravity = np.array(gravity)
        self.constraints, self.loads, self.modal_loads = list(constraints), list(loads), list(modal_loads)
        self.rotors, self.frictions = list(rotors), list(frictions)
        self.state_forces = list(forces)
        sizes = [3 + body.n_modes for body in self.bodies]
        ends = np.cumsum(sizes)
        self.size = int(ends[-1])
        self.columns = {
            body.name: slice(end - size, end) for body, size, end in zip(self.bodies, sizes, ends, strict=True)
        }

    def body(self, name):
        return next(body for body in self.bodies if body.name == name)

    def mass_matrix(self, q):
        M = np.zeros((self.size, self.size))
        for body in self.bodies:
            i = self.columns[body.name]
            M[i, i] = mass_matrix(body, q[i])
        for row, inertia in self.rotors:
            gradient = self.row(row, q, np.zeros_like(q)).gradient
            M += inertia * np.outer(gradient, gradient)
        return M

    def forces(self, t, q, v):
        """Q: quadratic velocity, elastic, damping, gravity and applied forces."""
        Q = np.zeros(self.size)
        for body in self.bodies:
            i = self.columns[body.name]
            Q[i] += quadratic_velocity_forces(body, q[i], v[i])
            Q[i] += elastic_forces(body, q[i], v[i]) + gravity_forces(body, q[i], self.gravity)
        for row, size in self.loads:
            Q += self.row(row, q, v).gradient * size(t)[0]
        for row, inertia in self.rotors:
            state = self.row(row, q, v)
            Q -= inertia * state.bias * state.gradient
        for row, friction in self.frictions:
            state = self.row(row, q, v)
            Q -= state.gradient * resistance(friction, state.rate)
        for end, function in self.state_forces:
            marker = self.marker(end, q, v)
            Q += marker.L.T @ np.array(function(t, list(marker.position), list(marker.velocity)))
        for name, vector, size in self.modal_loads:
            Q[self.columns[name]][3:] += vector * size(t)[0]
        return Q

    def marker(self, end, q, v):
        L = np.zeros((3, self.size))
        if end.body is None:
            return Marker(np.array([*end.position, 0.0]), np.zeros(3), L, np.zeros(3))
        body, i = self.body(end.body), self.columns[end.body]
        (R, theta, p), (theta_dot, p_dot) = (q[i][:2], q[i][2], q[i][3:]), (v[i][2], v[i][3:])
        n = body.n_modes
        frame = PlanarPoint(np.zeros(2), np.zeros((2, n)), np.zeros(n), np.zeros((3, n, n)))
        point = body.points[end.point] if end.point else frame
        x, Phi, phi, K = point.position, point.translation, point.rotation, point.K
        A, A_theta = rotation(theta), rotation_derivative(theta)
        u, Phi_p, phi_p = x + Phi @ p - 0.5 * p @ K[:2] @ p, Phi - K[:2] @ p, phi - K[2] @ p
        L[:2, i] = np.column_stack([np.eye(2), A_theta @ u, A @ Phi_p])
        L[2, i] = np.concatenate([[0, 0, 1], phi_p])
        convective = -(theta_dot**2) * A @ u + 2 * theta_dot * A_theta @ Phi_p @ p_dot - A @ (p_dot @ K[:2] @ p_dot)
        angle = theta + phi @ p - 0.5 * p @ K[2] @ p
        return Marker(np.array([*(R + A @ u), angle]), L @ v, L, np.array([*convective, -p_dot @ K[2] @ p_dot]))

    def row(self, row, q, v):
        a, b = self.marker(row.a, q, v), self.marker(row.b, q, v)
        if row.kind.name in ("x", "y", "angle"):
            k = ("x", "y", "angle").index(row.kind.name)
            value = b.position[k] - a.position[k] - row.offset
            return RowState(value, b.velocity[k] - a.velocity[k], b.L[k] - a.L[k], b.convective[k] - a.convective[k])
        if row.kind.name == "gear":
            n_b, n_a = row.gear_ratios
            value, rate, gradient, bias = (
                n_b * at_b - n_a * at_a
                for at_a, at_b in (
                    (a.position[2], b.position[2]),
                    (a.velocity[2], b.velocity[2]),
                    (a.L[2], b.L[2]),
                    (a.convective[2], b.convective[2]),
                )
            )
            return RowState(value - row.offset, rate, gradient, bias)
        alpha, alpha_dot = a.position[2], a.velocity[2]
        n, n_alpha = rotation(alpha) @ row.direction, rotation_derivative(alpha) @ row.direction
        d, d_dot = b.position[:2] - a.position[:2], b.velocity[:2] - a.velocity[:2]
        gradient = n @ (b.L[:2] - a.L[:2]) + (n_alpha @ d) * a.L[2]
        bias = n @ (b.convective[:2] - a.convective[:2]) + 2 * alpha_dot * n_alpha @ d_dot - alpha_dot**2 * n @ d
        return RowState(n @ d - row.offset, n @ d_dot + alpha_dot * n_alpha @ d, gradient, bias)

    def rows(self, q, v):
        return [self.row(row, q, v) for row, _ in self.constraints]

    def constraint_values(self, t, q, v):
        """C, Ċ and C_q."""
        states, targets = self.rows(q, v), [target(t) for _, target in self.constraints]
        C = [state.value - target[0] for state, target in zip(states, targets, strict=True)]
        C_dot = [state.rate - target[1] for state, target in zip(states, targets, strict=True)]
        return np.array(C), np.array(C_dot), np.array([state.gradient for state in states]).reshape(-1, self.size)

    def solve(self, t, q, v):
        """q̈ and λ of the augmented system M q̈ + C_qᵀ λ = Q, C_q q̈ = γ (Eq. 13)."""
        states = self.rows(q, v)
        C_q = np.array([state.gradient for state in states]).reshape(-1, self.size)
        gamma = [target(t)[2] - state.bias for state, (_, target) in zip(states, self.constraints, strict=True)]
        m = len(gamma)
        augmented = np.block([[self.mass_matrix(q), C_q.T], [C_q, np.zeros((m, m))]])
        solution = np.linalg.solve(augmented, np.concatenate([self.forces(t, q, v), gamma]))
        return solution[: self.size], solution[self.size :]

    def energies(self, q, v):
        """Kinetic, strain and gravitational energy, dissipated power."""
        kinetic = 0.5 * v @ self.mass_matrix(q) @ v
        strain = gravitational = dissipated = 0.0
        for body in self.bodies:
            (R, theta, p), p_dot = np.split(q[self.columns[body.name]], [2, 3]), v[self.columns[body.name]][3:]
            strain += 0.5 * p @ (body.stiffness * p)
            dissipated += p_dot @ body.damping @ p_dot
            s, _ = first_moment(body, p)
            gravitational -= (body.mass * R + rotation(theta[0]) @ s) @ self.gravity
        for row, friction in self.frictions:
            rate = self.row(row, q, v).rate
            dissipated += resistance(friction, rate) * rate
        return np.array([kinetic, strain, gravitational, dissipated])

    def momentum(self, q, v):
        """Linear momentum (2) and angular momentum about the origin, of all bodies together."""
        momentum = np.zeros(3)
        for body in self.bodies:
            i = self.columns[body.name]
            P = mass_matrix(body, q[i]) @ v[i]
            momentum[:2] += P[:2]
            momentum[2] += P[2] + q[i][0] * P[1] - q[i][1] * P[0]
        return momentum
