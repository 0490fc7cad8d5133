"""Inertia with geometric stiffening: against material points that move with the affine part of their second-order
displacements, and positive whatever the deflection."""

from dataclasses import dataclass, replace

import numpy as np
import oracle
import pytest
import zoo
from bodies_by_invariants import GeometricStiffening, with_payload
from links import ritz_link
from material_points import PointCloud, random_cloud
from mechanisms import assemble, make_model, oracle_of, random_state, relative
from oracle import mass_matrix
from oracle_runs import energies, evaluated, freely

STEP = 1e-30  # complex step: exact to rounding
GRAVITY = np.array([1.3, -9.81])


@dataclass
class BentCloud:
    """Points that move by Φp − ½ pᵀG p in the plane, G (points, 2, n, n); `affine`: the part of G in affine fields."""

    cloud: PointCloud
    G: np.ndarray

    @property
    def affine(self):
        x, y = self.cloud.x[:, :2].T
        one, zero = np.ones_like(x), np.zeros_like(x)
        fields = np.array([[one, zero], [zero, one], [x, y], [-y, x]]).transpose(2, 1, 0).reshape(-1, 4)
        root = np.sqrt(np.repeat(self.cloud.mass, 2))[:, None]
        flat = self.G.reshape(len(root), -1)
        return (fields @ np.linalg.lstsq(root * fields, root * flat, rcond=None)[0]).reshape(self.G.shape)

    def body(self):
        m, (x, y), n = self.cloud.mass, self.cloud.x[:, :2].T, self.G.shape[-1]
        K_s = np.einsum("i,ikmn->kmn", m, self.G)
        K_omega = np.einsum("i,ikmn->mn", m, self.G * np.array([x, y]).T[:, :, None, None])
        K_h = np.einsum("i,imn->mn", m * x, self.G[:, 1]) - np.einsum("i,imn->mn", m * y, self.G[:, 0])
        points = {name: np.zeros((3, n, n)) for name in ("root", "tip", "side", "mid")}
        stiffening = GeometricStiffening(K_omega, K_s, K_h, points, np.zeros((n, n)))
        return replace(self.cloud.planar_body(), stiffening=stiffening)

    def field(self, p):
        u = self.cloud.x + self.cloud.Phi @ p
        return u[:, :2] - 0.5 * p @ self.affine @ p, u[:, 2]

    def kinetic_energy(self, q, v):
        """½ Σ m |ṙ|²; for complex q as well."""
        (theta_dot, p_dot), (u, _) = (v[2], v[3:]), self.field(q[3:])
        rate = self.cloud.Phi @ p_dot
        u_dot = rate[:, :2] - q[3:] @ self.affine @ p_dot
        c, s = np.cos(q[2]), np.sin(q[2])
        x_dot, y_dot = u_dot[:, 0] - theta_dot * u[:, 1], u_dot[:, 1] + theta_dot * u[:, 0]
        velocity = (v[0] + c * x_dot - s * y_dot, v[1] + s * x_dot + c * y_dot, rate[:, 2])
        return 0.5 * sum(self.cloud.mass @ component**2 for component in velocity)

    def work_of_gravity(self, q):
        u, _ = self.field(q[3:])
        c, s = np.cos(q[2]), np.sin(q[2])
        heights = np.column_stack([q[0] + c * u[:, 0] - s * u[:, 1], q[1] + s * u[:, 0] + c * u[:, 1]]) @ GRAVITY
        return self.cloud.mass @ heights


@pytest.fixture(params=range(5))
def case(request):
    rng = np.random.default_rng(request.param)
    cloud = random_cloud(rng, "body", n=2 + request.param)
    n = len(cloud.stiffness)
    G = 0.1 * rng.standard_normal((len(cloud.mass), 2, n, n))
    return BentCloud(cloud, G + G.swapaxes(-1, -2)), *random_state(rng, 3 + n)


def momentum(bent, q, v):
    """∂T/∂v: T is quadratic in v, so that central differences are exact."""
    return np.array([(bent.kinetic_energy(q, v + e) - bent.kinetic_energy(q, v - e)) / 2 for e in np.eye(len(v))])


def gradient(function, q):
    return np.array([np.imag(function(q + 1j * STEP * e)) / STEP for e in np.eye(len(q))])


def test_mass_matrix_is_that_of_the_points(case):
    bent, q, _ = case
    M = np.array([momentum(bent, q, e) for e in np.eye(len(q))])
    assert relative(mass_matrix(bent.body(), q), M) < 1e-13


def test_quadratic_velocity_forces_satisfy_lagranges_equations(case):
    """Q_v = ∂T/∂q − (d/dt ∂T/∂v at constant v), straight from T of the points."""
    bent, q, v = case
    momentum_rate = np.imag(momentum(bent, q + 1j * STEP * v, v)) / STEP
    Q_v = gradient(lambda x: bent.kinetic_energy(x, v), q) - momentum_rate
    assert relative(oracle.quadratic_velocity_forces(bent.body(), q, v), Q_v) < 1e-13


def test_free_body_of_the_core_moves_as_its_points(case):
    """C++ against the points, with nothing in between."""
    bent, q, v = case
    robot = make_model([bent.body()], gravity=tuple(GRAVITY))
    M = np.array([momentum(bent, q, e) for e in np.eye(len(q))])
    Q = gradient(lambda x: bent.kinetic_energy(x, v) + bent.work_of_gravity(x), q)
    Q -= np.imag(momentum(bent, q + 1j * STEP * v, v)) / STEP
    Q[3:] -= bent.cloud.stiffness * q[3:] + bent.cloud.damping @ v[3:]
    found = evaluated(robot, 0.0, *freely(robot, q, v))
    assert relative(found.a[0], np.linalg.solve(M, Q)) < 1e-12
    assert relative(energies(found)["kinetic"], bent.kinetic_energy(q, v)) < 1e-13


@pytest.mark.parametrize("name", ["stiffened", "stiffened, driven"])
def test_mass_matrix_is_positive_definite_however_far_the_bodies_are_bent(name):
    assembly = assemble(zoo.build(name))
    mechanism, rng = oracle_of(assembly), np.random.default_rng(3)
    for size in 10.0 ** rng.uniform(-2, 1, 200):
        q, _ = random_state(rng, assembly.size)
        for first, body in zip(assembly.first, assembly.model.bodies, strict=True):
            p = rng.standard_normal(body.n_modes)
            q[first + 3 : first + 3 + body.n_modes] = size * p / np.linalg.norm(p)
        eigenvalues = np.linalg.eigvalsh(mechanism.mass_matrix(q))
        assert eigenvalues[0] > 1e-12 * eigenvalues[-1]


def test_a_long_payload_is_a_pair_of_masses():
    """A moment of inertia at the tip is that of two masses that turn with its section, at their sides."""
    link = ritz_link("link", "cantilever", modes=4, stiffening=True)
    point, radius = link.points["tip"], 0.1
    turning = with_payload(link, "tip", mass=0.5, inertia=0.5 * radius**2)
    rng = np.random.default_rng(2)
    p = 0.05 * rng.standard_normal(4)
    q = np.array([0.3, -0.2, 0.7, *np.linalg.solve(turning.modal_transform, p)])
    # what the link alone has, and ½ I_p (θ̇ + φṗ)²; the rotation's second order vanishes at the tip of a cantilever
    alone = with_payload(link, "tip", mass=0.5, inertia=0.0)
    T, T_alone = np.eye(7), np.eye(7)
    T[3:, 3:], T_alone[3:, 3:] = turning.modal_transform, alone.modal_transform
    back = np.linalg.inv(T)
    M = back.T @ mass_matrix(turning, q) @ back
    back = np.linalg.inv(T_alone)
    M_alone = back.T @ mass_matrix(alone, np.array([*q[:3], *np.linalg.solve(alone.modal_transform, p)])) @ back
    row = np.array([0, 0, 1, *point.rotation])
    added = 0.5 * radius**2 * np.outer(row, row)
    shorter = np.abs(p @ point.rotation) ** 2
    assert np.abs(M - M_alone - added).max() < 2 * shorter * np.abs(added).max()
    assert np.abs(M - M_alone).max() > 0.5 * np.abs(added).max()
