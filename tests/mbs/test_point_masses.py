"""The equations in invariants against the material points that the invariants are sums over."""

import numpy as np
import oracle
import pytest
from material_points import random_cloud
from mechanisms import make_model, random_state, relative
from oracle_runs import energies, evaluated, freely

STEP = 1e-30  # complex step: exact to rounding
GRAVITY = np.array([1.3, -9.81])


@pytest.fixture(params=range(5))
def case(request):
    rng = np.random.default_rng(request.param)
    cloud = random_cloud(rng, "body", n=2 + request.param)
    q, v = random_state(rng, 3 + len(cloud.stiffness))
    return cloud, cloud.planar_body(), q, v


def generalized_momentum(cloud, q, v):
    """∂T/∂v: T is quadratic in v, so that central differences are exact."""
    return np.array([(cloud.kinetic_energy(q, v + e) - cloud.kinetic_energy(q, v - e)) / 2 for e in np.eye(len(v))])


def gradient(function, q):
    return np.array([np.imag(function(q + 1j * STEP * e)) / STEP for e in np.eye(len(q))])


def test_clouds_are_as_general_as_a_solid(case):
    _, body, _, _ = case
    n = body.n_modes
    assert np.abs(body.S_tilde).max() > 0.01
    assert np.abs(body.j).max() > 0.01
    assert np.abs(body.m_xy - np.eye(n)).max() > 0.01
    assert np.abs(body.damping - np.diag(np.diag(body.damping))).max() > 1e-3


def test_mass_matrix_from_invariants_is_that_of_the_points(case):
    cloud, body, q, _ = case
    columns = [generalized_momentum(cloud, q, e) for e in np.eye(len(q))]
    assert relative(oracle.mass_matrix(body, q), np.array(columns)) < 1e-13


def test_quadratic_velocity_forces_satisfy_lagranges_equations(case):
    """Q_v = ∂T/∂q − (d/dt ∂T/∂v at constant v), straight from T of the points."""
    cloud, body, q, v = case
    momentum_rate = np.imag(generalized_momentum(cloud, q + 1j * STEP * v, v)) / STEP
    Q_v = gradient(lambda x: cloud.kinetic_energy(x, v), q) - momentum_rate
    assert relative(oracle.quadratic_velocity_forces(body, q, v), Q_v) < 1e-13


def test_gravity_forces_are_the_gradient_of_the_points_height(case):
    cloud, body, q, _ = case
    Q = gradient(lambda x: cloud.mass @ cloud.positions(x)[:, :2] @ GRAVITY, q)
    assert relative(oracle.gravity_forces(body, q, GRAVITY), Q) < 1e-13


def test_free_body_of_the_core_moves_as_its_points(case):
    """C++ against the points, with nothing in between."""
    cloud, body, q, v = case
    robot = make_model([body], gravity=tuple(GRAVITY))
    M = np.array([generalized_momentum(cloud, q, e) for e in np.eye(len(q))])
    Q = gradient(lambda x: cloud.kinetic_energy(x, v) + cloud.mass @ cloud.positions(x)[:, :2] @ GRAVITY, q)
    Q -= np.imag(generalized_momentum(cloud, q + 1j * STEP * v, v)) / STEP
    Q[3:] -= cloud.stiffness * q[3:] + cloud.damping @ v[3:]
    found = evaluated(robot, 0.0, *freely(robot, q, v))
    assert relative(found.q[0], q) < 1e-14
    assert relative(found.a[0], np.linalg.solve(M, Q)) < 1e-12


def test_kinetic_energy_of_the_core_is_that_of_the_points(case):
    cloud, body, q, v = case
    robot = make_model([body])
    found = energies(evaluated(robot, 0.0, *freely(robot, q, v)))
    assert relative(found["kinetic"], cloud.kinetic_energy(q, v)) < 1e-13
