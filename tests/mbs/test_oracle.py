"""The oracle in 3D against what it does not know: sums over points, differences, closed forms, turned scenes."""

from dataclasses import replace

import numpy as np
import pytest
import random_mechanisms
from mechanisms import relative
from oracle_3d import Mechanism, body_forces, body_mass_matrix
from random_mechanisms import TYPES, G, Tree, random_solid, random_tree, stiffened, symmetric
from rotations import exponential, left_jacobian, left_jacobian_rate, logarithm, quaternion, random_rotation, rotation
from triad_measures import UNIT, About, Along, Driven, Ground, Joint, Section, Spinning

from ffrobot.mbs.model.body import from_modal_body, rigid_body
from ffrobot.mbs.model.stiffening import Stiffening

MIXED = list(TYPES)


@pytest.fixture
def rng():
    return np.random.default_rng(5)


# Rotations.


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.3, 2.0, 3.1])
def test_exponential_logarithm_and_quaternion(rng, size):
    axis = rng.standard_normal(3)
    phi = size * axis / np.linalg.norm(axis)
    C = exponential(phi)
    np.testing.assert_allclose(C @ C.T, np.eye(3), atol=1e-14)
    np.testing.assert_allclose(C @ phi, phi, atol=1e-14)
    assert np.trace(C) == pytest.approx(1 + 2 * np.cos(size), abs=1e-14)
    np.testing.assert_allclose(logarithm(C), phi, atol=1e-13)
    np.testing.assert_allclose(rotation(quaternion(C)), C, atol=1e-14)


def test_rates_of_rotation_vectors_by_differences(rng):
    phi, phi_dot, h = rng.standard_normal(3), rng.standard_normal(3), 1e-5

    def spin(s):
        return left_jacobian(phi + s * phi_dot) @ phi_dot

    turned = (exponential(phi + h * phi_dot) - exponential(phi - h * phi_dot)) / (2 * h) @ exponential(phi).T
    np.testing.assert_allclose([turned[2, 1], turned[0, 2], turned[1, 0]], spin(0), atol=1e-9)
    np.testing.assert_allclose((spin(h) - spin(-h)) / (2 * h), left_jacobian_rate(phi, phi_dot), atol=1e-9)


# One body: d'Alembert over the points of a cloud, accelerations by hand.


def test_equations_are_newtons_of_every_point(rng):
    """M v̇ − Q = Σ m (∂ṙ/∂v)ᵀ(r̈ − g) at any motion, without elastic forces."""
    cloud = random_mechanisms.random_cloud(rng, "b", n=5)
    body = from_modal_body("b", cloud.modal_body())
    A, p, omega, p_dot = random_rotation(rng), *(rng.standard_normal(k) for k in (5, 3, 5))
    a = rng.standard_normal(11)
    alpha, p_2dot = a[3:6], a[6:]
    residual = np.zeros(11)
    for m, x, Phi in zip(cloud.mass, cloud.x, cloud.Phi, strict=True):
        u, u_dot = x + Phi @ p, Phi @ p_dot
        own = np.cross(omega, np.cross(omega, u)) + 2 * np.cross(omega, u_dot) + np.cross(alpha, u) + Phi @ p_2dot
        force = m * (A.T @ (a[:3] - G) + own)
        residual += np.concatenate([A @ force, np.cross(u, force), Phi.T @ force])
    elastic = np.concatenate([np.zeros(6), body.stiffness * p + body.damping @ p_dot])
    found = body_mass_matrix(body, A, p) @ a - body_forces(body, A, p, omega, p_dot, G) - elastic
    assert relative(found, residual) < 1e-13


def test_stiffened_equations_are_newtons_of_every_point(rng):
    """Of points that move by −½ pᵀG p besides, with G affine in x: its projection is itself."""
    n = 4
    cloud = random_mechanisms.random_cloud(rng, "b", n=n)
    G_fields = symmetric(rng, 4, 3, n) / n
    fields = np.hstack([np.ones((len(cloud.x), 1)), cloud.x])
    G_points = np.einsum("if,flmn->ilmn", fields, G_fields)
    K = np.einsum("i,if,ilmn->flmn", cloud.mass, fields, G_points)
    body = replace(
        from_modal_body("b", cloud.modal_body()), stiffening=Stiffening(K[0], K[1:], {}, np.zeros_like(K[1:]))
    )
    A, p, omega, p_dot = random_rotation(rng), *(rng.standard_normal(k) for k in (n, 3, n))
    a = rng.standard_normal(6 + n)
    alpha, p_2dot = a[3:6], a[6:]
    residual, energy = np.zeros(6 + n), 0.0
    for m, x, Phi, K_x in zip(cloud.mass, cloud.x, cloud.Phi, G_points, strict=True):
        u, Phi_p = x + Phi @ p - 0.5 * p @ K_x @ p, Phi - K_x @ p
        u_dot = Phi_p @ p_dot
        own = np.cross(omega, np.cross(omega, u)) + 2 * np.cross(omega, u_dot) + np.cross(alpha, u)
        own = own + Phi_p @ p_2dot - p_dot @ K_x @ p_dot
        force = m * (A.T @ (a[:3] - G) + own)
        residual += np.concatenate([A @ force, np.cross(u, force), Phi_p.T @ force])
        energy += 0.5 * m * np.sum((A.T @ a[:3] + np.cross(omega, u) + u_dot) ** 2)
    elastic = np.concatenate([np.zeros(6), body.stiffness * p + body.damping @ p_dot])
    M = body_mass_matrix(body, A, p)
    assert relative(M @ a - body_forces(body, A, p, omega, p_dot, G) - elastic, residual) < 1e-13
    v = np.concatenate([a[:3], omega, p_dot])
    assert 0.5 * v @ M @ v == pytest.approx(energy, rel=1e-13)


@pytest.mark.parametrize("make", [random_solid, random_mechanisms.random_beam], ids=["solid", "beam"])
def test_stiffened_equations_with_nothing_of_second_order_are_the_plain_ones(rng, make):
    plain = make(rng, "b")
    n = plain.n_modes
    zero = replace(
        plain, stiffening=Stiffening(np.zeros((3, n, n)), np.zeros((3, 3, n, n)), {}, np.zeros((3, 3, n, n)))
    )
    A, p, omega, p_dot = random_rotation(rng), *(rng.standard_normal(k) for k in (n, 3, n))
    assert relative(body_mass_matrix(zero, A, p), body_mass_matrix(plain, A, p)) < 1e-13
    assert relative(body_forces(zero, A, p, omega, p_dot, G), body_forces(plain, A, p, omega, p_dot, G)) < 1e-13


@pytest.mark.parametrize("make", [random_solid, random_mechanisms.random_beam], ids=["solid", "beam"])
def test_mass_matrices_stay_positive_definite_however_far_bodies_bend(rng, make):
    body = stiffened(rng, make(rng, "b"))
    for size in (0.1, 1.0, 10.0):
        M = body_mass_matrix(body, np.eye(3), size * rng.standard_normal(body.n_modes))
        assert np.linalg.eigvalsh(M).min() > 0


# Rows.


def rows_of(tree):
    return [row for joint in (*tree.joints, *tree.loops) for row in (*joint.rows(), *joint.coordinates())]


def test_gradients_and_biases_of_all_rows_by_differences(rng):
    """C_v against differences of C, gradient · v̇ + bias against those of the rate; all joints at poses they hold."""
    tree = random_tree(rng, MIXED, loops=2)
    driven = Driven(moving_frame)
    rows = [*rows_of(tree), *(Along(driven, Section("b3", "tip"), e) for e in UNIT)]
    mechanism = Mechanism(tree.bodies, G, [(row, None) for row in rows])
    q, v, a, h = tree.q, rng.standard_normal(mechanism.size), rng.standard_normal(mechanism.size), 1e-5

    def along(s):
        return mechanism.integrate(q, s * v + s**2 / 2 * a), v + s * a

    C, rate, C_v, gamma = mechanism.constraint_values(0.3, q, v)
    for column, e in zip(C_v.T, np.eye(mechanism.size), strict=True):
        ahead, behind = (mechanism.constraint_values(0.3, mechanism.integrate(q, s * e), v)[0] for s in (h, -h))
        np.testing.assert_allclose((ahead - behind) / (2 * h), column, atol=2e-9)
    h = 1e-6
    ahead, behind = (mechanism.constraint_values(0.3 + s, *along(s))[1] for s in (h, -h))
    assert relative((ahead - behind) / (2 * h), C_v @ a - gamma) < 1e-8
    assert len(C) == len(rate) > 40


def moving_frame(t):
    psi = np.array([0.3 * np.sin(t), 0.2 * t**2, -0.4 * t])
    psi_dot, psi_2dot = np.array([0.3 * np.cos(t), 0.4 * t, -0.4]), np.array([-0.3 * np.sin(t), 0.4, 0.0])
    omega = left_jacobian(psi) @ psi_dot
    alpha = left_jacobian(psi) @ psi_2dot + left_jacobian_rate(psi, psi_dot)
    r, velocity = np.array([t**2, 0.5 * t, np.sin(t)]), np.array([2 * t, 0.5, np.cos(t)])
    acceleration = np.array([2.0, 0.0, -np.sin(t)])
    return r, exponential(psi), np.concatenate([velocity, omega]), np.concatenate([acceleration, alpha])


def test_driven_orientation_by_differences(rng):
    """Rows that hold a section to a frame driven in time: where they hold, their rate is that of their value."""
    body, h = random_solid(rng, "b"), 1e-5
    section, driven = Section("b", "tip", random_rotation(rng)), Driven(moving_frame)
    mechanism = Mechanism([body], G, [(About(driven, section, e), None) for e in UNIT])
    q, v = np.zeros(7 + body.n_modes), rng.standard_normal(6 + body.n_modes)
    q[3], q[7:] = 1.0, 0.1 * rng.standard_normal(body.n_modes)
    at = mechanism.marker(section, q, v)
    q[3:7] = quaternion(moving_frame(0.3)[1] @ at.F.T)
    C, rate, _, _ = mechanism.constraint_values(0.3, q, v)
    assert np.abs(C).max() < 1e-14
    ahead, behind = (mechanism.constraint_values(0.3 + s, mechanism.integrate(q, s * v), v)[0] for s in (h, -h))
    np.testing.assert_allclose((ahead - behind) / (2 * h), rate, atol=1e-8)
    a, h = rng.standard_normal(6 + body.n_modes), 1e-4
    _, _, C_v, gamma = mechanism.constraint_values(0.3, q, v)

    def rate_at(s):
        return mechanism.constraint_values(0.3 + s, mechanism.integrate(q, s * v + s**2 / 2 * a), v + s * a)[1]

    np.testing.assert_allclose((rate_at(h) - rate_at(-h)) / (2 * h), C_v @ a - gamma, atol=1e-6)


@pytest.mark.parametrize("type_", MIXED)
def test_random_trees_meet_their_joints(rng, type_):
    tree = random_tree(rng, ["revolute", type_, type_], loops=2)
    C, rate, _, _ = tree.mechanism().constraint_values(0.0, tree.q, tree.v)
    assert np.abs(C).max() < 1e-13
    assert np.abs(rate).max() < 1e-9
    for joint in tree.joints:
        rows = Mechanism(tree.bodies, G, [(row, None) for row in joint.coordinates()])
        found = rows.constraint_values(0.0, tree.q, tree.v)[0]
        np.testing.assert_allclose(found, tree.poses[joint.name].coordinates[: len(found)], atol=1e-13)


# Closed forms.


def rod(name, mass, length):
    inertia = mass * length**2 / 12 * np.diag([0.0, 1.0, 1.0])
    return rigid_body(name, mass, np.array([length / 2, 0, 0]), inertia + 1e-3 * mass * np.diag([1.0, 0, 0]),
                      {"root": np.zeros(3), "tip": np.array([length, 0, 0])})  # fmt: skip


def test_spinning_symmetric_top_precesses_steadily():
    """A fast top on a spherical joint, its axis level: no nutation where Ω_p = m g l / (C ω) and the right spin."""
    m, length, C, A, g = 0.8, 0.1, 2e-3, 5e-3, 9.81
    center = np.array([length, 0, 0])
    inertia = np.diag([C, A - m * length**2, A - m * length**2])
    top = rigid_body("top", m, center, inertia, {"root": np.zeros(3)})
    pivot = Joint("pivot", "spherical", Ground(), Section("top", "root"))
    mechanism = Mechanism([top], [0, 0, -g], [(row, None) for row in pivot.rows()])
    spin = 60.0
    precession = m * g * length / (C * spin)  # axis level: the term in Ω_p² vanishes
    q = np.array([0.0, 0, 0, 1, 0, 0, 0])
    a, lambda_ = mechanism.solve(0.0, q, np.array([0.0, 0, 0, spin, 0, precession]))
    np.testing.assert_allclose(a[3:], [0, spin * precession, 0], atol=1e-10)  # the vertical, seen from the turning body
    expected = [-m * length * precession**2, 0.0, m * g]
    reaction = sum(mechanism.reaction(k, 0.0, q, np.zeros(6), lambda_[k]) for k in range(3))
    np.testing.assert_allclose(reaction, [*expected, 0, 0, 0], atol=1e-10)


def test_pendulum_on_a_slanted_hinge():
    """α̈ = −(m g c sin ι / J) sin α for a hinge inclined by ι from the vertical."""
    pendulum, tilt, angle = rod("p", 1.3, 0.7), 0.6, 0.4
    axis = exponential(np.array([0, tilt, 0]))  # z leans towards x; x of the triad then points downhill
    hinge = Joint("hinge", "revolute", Ground(triad=axis), Section("p", "root"))
    tree = Tree([pendulum], [hinge], poses={})
    mechanism = tree.mechanism(gravity=[0, 0, -9.81])
    A = axis @ exponential(np.array([0, 0, angle]))
    q = np.concatenate([np.zeros(3), quaternion(A)])
    a, _ = mechanism.solve(0.0, q, np.zeros(6))
    J = pendulum.inertia[2, 2]
    assert a[5] == pytest.approx(-1.3 * 9.81 * 0.35 * np.sin(tilt) * np.sin(angle) / J, rel=1e-12)


def test_bead_on_a_screw():
    """M ẍ (1 + J/(m h²)) = −m g along a vertical screw, h in m/rad."""
    nut = rigid_body("nut", 0.5, np.zeros(3), np.diag([1.0, 1.0, 2e-3]), {"root": np.zeros(3)})
    h = 0.02
    mechanism = Tree([nut], [Joint("s", "screw", Ground(), Section("nut", "root"), h)]).mechanism(gravity=[0, 0, -9.81])
    a, _ = mechanism.solve(0.0, np.array([0.0, 0, 0, 1, 0, 0, 0]), np.zeros(6))
    assert a[2] == pytest.approx(-9.81 / (1 + 2e-3 / (0.5 * h**2)), rel=1e-12)
    assert a[5] == pytest.approx(a[2] / h, rel=1e-12)


def test_geared_rotor_keeps_momentum(rng):
    """Two free bodies, a rotor between them: J w along the axis belongs to the angular momentum, which stays."""
    hinge = Joint(
        "j", "revolute", Section("a", "tip", random_rotation(rng)), Section("b", "root", random_rotation(rng))
    )
    base = Joint("base", "free", Ground(), Section("a", "root"))
    tree = Tree([random_mechanisms.random_solid(rng, "a"), random_mechanisms.random_beam(rng, "b")], [base, hinge])
    tree.poses = {joint.name: random_mechanisms.random_pose(rng, joint) for joint in tree.joints}
    tree.q = random_mechanisms.placed(tree, [0.1 * rng.standard_normal(body.n_modes) for body in tree.bodies])
    rotor, J, h = Spinning(hinge.a, hinge.b, 30.0), 2e-2, 1e-5
    mechanism = tree.mechanism(gravity=np.zeros(3), rotors=[(rotor, J)])
    v = random_mechanisms.admissible(tree, rng.standard_normal(mechanism.size))
    a, _ = mechanism.solve(0.0, tree.q, v)

    def momentum(s):
        q, rates = mechanism.integrate(tree.q, s * v + s**2 / 2 * a), v + s * a
        spin = J * mechanism.row(rotor, q, rates).rate * mechanism.marker(hinge.a, q, rates).F[:, 2]
        return mechanism.momentum(q, rates) + np.concatenate([np.zeros(3), spin])

    change = (momentum(h) - momentum(-h)) / (2 * h)
    assert np.abs(change).max() < 1e-7 * np.abs(momentum(0.0)).max()
    assert np.abs(mechanism.momentum(tree.q, v) - momentum(0.0)).max() > 0.01 * np.abs(momentum(0.0)).max()


# Balances and invariance.


@pytest.mark.parametrize("seed", range(4))
def test_power_of_a_motion(seed):
    """d/dt (T + V) = −ṗᵀD ṗ for trees and loops of all joints."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, rng.permutation(MIXED)[:5], loops=seed % 3)
    mechanism, h = tree.mechanism(), 1e-6
    a, _ = mechanism.solve(0.0, tree.q, tree.v)

    def energy(s):
        return mechanism.energies(mechanism.integrate(tree.q, s * tree.v + s**2 / 2 * a), tree.v + s * a).sum()

    dissipated = 0.0
    for body in tree.bodies:
        p_dot = mechanism.coordinates.rates(tree.v, body.name)[2]
        dissipated += p_dot @ body.damping @ p_dot
    size = np.abs(mechanism.energies(tree.q, tree.v)).max()
    assert (energy(h) - energy(-h)) / (2 * h) == pytest.approx(-dissipated, abs=1e-7 * size)


def test_turned_scene_moves_as_the_scene(rng):
    """All of it turned by a random rotation: accelerations turn along, ω̄ and p do not notice."""
    tree, C = random_tree(rng, MIXED, loops=1), random_rotation(rng)
    mechanism = tree.mechanism()
    a, _ = mechanism.solve(0.0, tree.q, tree.v)

    def turn(at):
        return Ground(C @ at.position, C @ at.triad) if isinstance(at, Ground) else at

    turned = Tree(tree.bodies, [Joint(j.name, j.type, turn(j.a), turn(j.b), j.h) for j in (*tree.joints, *tree.loops)])
    q, v, expected = tree.q.copy(), tree.v.copy(), a.copy()
    for body in tree.bodies:
        R, e, _ = mechanism.coordinates.parts(q, body.name)
        R[:], e[:] = C @ R, quaternion(C @ rotation(e))
        for rates in (v, expected):
            rates[mechanism.coordinates.columns(body.name)][:3] = C @ mechanism.coordinates.rates(rates, body.name)[0]
    found, _ = turned.mechanism(gravity=C @ G).solve(0.0, q, v)
    assert relative(found, expected) < 1e-10
