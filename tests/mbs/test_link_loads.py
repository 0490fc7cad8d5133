"""Loads on links: what joints, motors and loads are found to do at the points of a body is what moves it."""

import numpy as np
import pytest
import zoo
from links import arm, arm_links
from mechanisms import forward, pcid
from oracle import elastic_forces, gravity_forces, mass_matrix, quadratic_velocity_forces
from oracle_runs import run

from ffrobot.common.rotations import rotation
from ffrobot.mbs.quantities.link_loads import loads_on_links

MECHANISMS = (
    *("chain of 3", "backwards", "mixed", "four-bar", "slider-crank", "tree"),
    *("mixed, as built", "slider-crank, as built"),
)
LOADS = (
    {"point": "link2.mid", "x": "3*cos(4*t)", "y": "2", "moment": "0.3*t"},
    {"joint": "A", "moment": "4*sin(5*t)"},
)


def link_loads(outcome, bodies):
    return loads_on_links(outcome.motion, bodies)


def at_point(loads, point):
    """Force and moment (T, 3) in body axes; zero where nothing acts."""
    return np.stack([loads.get(name, 0.0 * loads["t_x"]) for name in _names(point)], axis=1)


def _names(point):
    return f"force/{point}/x", f"force/{point}/y", f"moment/{point}/z"


def missing(outcome, name):
    """(T, 3 + n) what M a − Q of a body needs beside its loads at points, and the largest of what it needs."""
    body, loads = outcome.assembly.model.body(name), link_loads(outcome, [name])[name].sizes
    motion = (x[:, outcome.coordinates(name)] for x in (outcome.q, outcome.v, outcome.a))
    gravity = np.array(outcome.robot.scene.gravity[:2])
    needed, given = np.zeros((2, len(outcome.time), 3 + body.n_modes))
    for k, (q, v, a) in enumerate(zip(*motion, strict=True)):
        forces = quadratic_velocity_forces(body, q, v) + elastic_forces(body, q, v) + gravity_forces(body, q, gravity)
        needed[k] = mass_matrix(body, q) @ a - forces
        for point, at in body.points.items():
            *force, moment = at_point(loads, point)[k]
            x = at.position + at.translation @ q[3:]
            given[k, :2] += rotation(q[2]) @ force
            given[k, 2] += x[0] * force[1] - x[1] * force[0] + moment
            given[k, 3:] += at.translation.T @ force + at.rotation * moment
    return needed - given, np.abs(needed).max()


@pytest.mark.parametrize("name", MECHANISMS)
def test_loads_at_points_move_the_bodies(name):
    """Every joint type, closed loops, rotors, friction, given loads; frames and modes alike."""
    model = zoo.build(name, trajectory=[], load=zoo.LOADS)
    outcome = run(model, forward(end=0.05, output_step=0.01))
    for body in model.bodies:
        left, largest = missing(outcome, body.name)
        assert np.abs(left).max() < 1e-9 * largest


def test_inverse_dynamics_counts_what_motors_and_patches_do():
    """Not the force on the trajectory that stands for them: what is left to the modes is F_p."""
    outcome = run(arm(arm_links(damping_ratio=0.02), load=LOADS[:1]), pcid(output_step=0.05))
    for body in outcome.assembly.model.bodies:
        left, largest = missing(outcome, body.name)
        np.testing.assert_allclose(left[:, :3], 0.0, atol=1e-9 * largest)
        F_p = outcome.F_p[:, outcome.modal_columns(body.name)]
        np.testing.assert_allclose(left[:, 3:], F_p, atol=1e-9 * largest)
        np.testing.assert_allclose(link_loads(outcome, [body.name])[body.name].modal_force, F_p, atol=1e-9 * largest)
    np.testing.assert_allclose(at_point(link_loads(outcome, ["link2"])["link2"].sizes, "tip"), 0.0, atol=1e-9)
    assert np.abs(outcome.lambda_).max() > 1.0
