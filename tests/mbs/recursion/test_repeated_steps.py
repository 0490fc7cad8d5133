"""Runs that take the steps of another one again: as smooth in parameters as the equations are."""

import numpy as np
import pytest
from equal_steps import controls
from points_3d import J, Mechanism
from random_bodies import ground, random_body, three_links

from ffrobot.mbs import _core

TIMES = list(np.linspace(0.0, 2.0, 9))


def slide():
    """A rigid body on a rail: (model, its coordinate in q and v, its mass as the equations have it)."""
    body = random_body(np.random.default_rng(4), 0, J.prismatic)
    model = Mechanism([body], ground(np.random.default_rng(5)), np.zeros(3)).model()
    q, _, v, _ = model.first[0]
    force = np.zeros(model.n_v)
    force[v] = 1.0
    a, _ = model.evaluate(np.zeros(model.n_q), np.zeros(model.n_v), np.zeros(0), force, None)
    return model, q, v, 1.0 / a[v]


def run(model, scene, start, control, times=TIMES):
    return _core.tree_motion(model, scene, times, start, np.zeros(model.n_v), control, lambda t: True)


@pytest.mark.parametrize("method", ["dop853", "dopri5"])
def test_a_spring_by_its_stiffness(method):
    """x = x₀ cos ωt, ∂x/∂k = −x₀ t sin(ωt)/(2 ω m), by one central difference with k changed by 1e-5 of it."""
    model, joint_q, joint_v, m = slide()
    k, h = 900.0 * m, 1e-5 * 900.0 * m
    start = np.zeros(model.n_q)
    start[joint_q] = 0.1

    def positions(stiffness, repeated):
        scene = _core.TreeScene()
        scene.add_joint_force(joint_q, joint_v, stiffness, 0.0, 0.0, 0.0, 1.0)
        found = run(model, scene, start, controls(method, 1e-8, keep_steps=True, repeated=repeated))
        assert found.status == _core.IntegrationStatus.completed
        return found.states[:, joint_q], found

    _, base = positions(k, ())
    times = np.array(TIMES)
    exact = -0.1 * times * np.sin(30.0 * times) / (2 * 30.0 * m)

    def error(repeated):
        difference = (positions(k + h, repeated)[0] - positions(k - h, repeated)[0]) / (2 * h)
        return np.abs(difference - exact).max() / np.abs(exact).max()

    assert error(base.step_ends) < 1e-6


def test_the_same_run_again():
    """Links that bend: the same outputs to rounding, without the work of step control."""
    rng = np.random.default_rng(11)
    bodies = three_links(rng)
    model = Mechanism(bodies, ground(rng, 2), np.array([0, 0, -9.81])).model()
    start = np.zeros(model.n_q)
    start[model.first[1][0]] = 1.0
    times = list(np.linspace(0.0, 0.05, 4))
    base = run(model, _core.TreeScene(), start, controls(tolerance=1e-6, keep_steps=True), times)
    repeating = controls(tolerance=1e-6, keep_steps=True, repeated=base.step_ends)
    again = run(model, _core.TreeScene(), start, repeating, times)
    assert again.steps == base.steps == len(base.step_ends)
    assert again.rejected == 0
    assert again.evaluations < base.evaluations
    np.testing.assert_array_equal(again.step_ends, base.step_ends)
    np.testing.assert_allclose(again.states, base.states, rtol=0, atol=1e-11 * np.abs(base.states).max())
