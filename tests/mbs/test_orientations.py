"""Integrators on a state with an orientation: a heavy top on a ball joint, q a quaternion (4), v rates (3).

I omega_dot = (I omega) x omega + r x (A^T f)
"""

import numpy as np
import pytest
from equal_steps import controls, states_of_equal_steps

from ffrobot.mbs import _core

INERTIA, ARM, WEIGHT = np.array([0.02, 0.03, 0.015]), np.array([0.1, 0.05, 0.2]), np.array([0.0, 0.0, -9.81])
START, SPIN = np.array([0.5, 0.5, -0.5, 0.5]), np.array([2.0, -3.0, 9.0])


def top():
    """One body whose mass m, which its motion does not depend on, weighs m g = f at r."""
    mass, body = 0.01, _core.SpatialBody()
    body.name, body.joint = "top", _core.JointKind.spherical
    data = _core.SpatialData()
    data.mass, data.first_moment = mass, mass * ARM
    data.J2 = np.diag(0.5 * INERTIA.sum() - INERTIA)
    data.markers = [_core.SpatialMarker()]
    body.data = data
    return _core.SpatialModel([body], [_core.SpatialMarker()], [], [], WEIGHT / mass)


def steps_of_top(method, steps):
    """States after equal steps, and in their middle."""
    times = np.linspace(0.0, 1.0, 2 * steps + 1)
    states = states_of_equal_steps(top(), _core.TreeScene(), method, START, SPIN, times, every=2)
    return states[::2], states[1::2]


def distance(state, exact):
    """Of the orientations, whose sign is free, and of the angular velocities."""
    sign = np.sign(state[:4] @ exact[:4])
    return np.hypot(np.linalg.norm(state[:4] - sign * exact[:4]), np.linalg.norm(state[4:] - exact[4:]))


@pytest.fixture(scope="module")
def exact():
    return steps_of_top("dop853", 6400)[0]


@pytest.mark.parametrize(
    ("method", "order", "dense_order", "steps"),
    [
        ("dop853", 8, 8, (25, 50, 100)),
        ("dopri5", 5, 5, (100, 200, 400)),
        ("radau", 5, 4, (100, 200)),
        ("generalized_alpha", 2, 2, (200, 400, 800)),
    ],
)
def test_methods_keep_their_order(exact, method, order, dense_order, steps):
    ends, middles = [], []
    for count in steps:
        states, between = steps_of_top(method, count)
        every = 6400 // count
        ends.append(distance(states[-1], exact[-1]))
        middles.append(max(distance(s, e) for s, e in zip(between, exact[every // 2 :: every], strict=False)))
    for errors, expected in ((ends, order), (middles, dense_order)):
        observed = np.diff(np.log(errors)) / -np.log(2)
        assert np.abs(observed - expected).max() < 0.5, observed


@pytest.mark.parametrize(
    ("method", "tolerance"), [("dopri5", 1e-8), ("dop853", 1e-10), ("radau", 1e-8), ("generalized_alpha", 1e-4)]
)
def test_adaptive_steps_and_their_outputs(exact, method, tolerance):
    """The tolerance is relative: to a radian, and to the largest rate."""
    times = np.linspace(0.0, 1.0, 41)
    of_run = controls(method, tolerance)
    run = _core.tree_motion(top(), _core.TreeScene(), times.tolist(), START, SPIN, of_run, lambda _: True)
    assert run.status == _core.IntegrationStatus.completed
    states, peak = run.states, np.linalg.norm(exact[:, 4:], axis=1).max()
    assert np.abs(np.linalg.norm(states[:, :4], axis=1) - 1).max() < 1e-15
    relative = np.array([1, 1, 1, 1, peak, peak, peak])
    assert max(distance(s, e) for s, e in zip(states / relative, exact[::160] / relative, strict=True)) < tolerance
