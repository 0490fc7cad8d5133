"""Loads on links: what joints, motors and loads are found to do at the points of a body is what moves it."""

import numpy as np
import pytest
import tree_oracle
import zoo
from body_equations import accelerated, body_forces
from links import arm, arm_links
from mechanisms import forward, pcid
from oracle_runs import run

from ffrobot.mbs.quantities.link_loads import loads_on_links

MECHANISMS = ("mixed backwards", "four-bar", "tree", "mixed, as built", "slider-crank, as built")
LOAD = {"point": "link2.mid", "x": "3*cos(4*t)", "y": "2", "moment": "0.3*t"}


def at_point(loads, point):
    """Force and moment (T, 3) in body axes; zero where nothing acts."""
    return [np.stack([loads.get(f"{kind}/{point}/{axis}", 0.0 * loads["t_x"]) for axis in "xyz"], axis=1)
            for kind in ("force", "moment")]  # fmt: skip


def missing(outcome):
    """By body (T, 6 + n) what it needs beside its loads at points, moments about its frame; the largest."""
    motion, found = outcome.motion, {}
    of_all = body_forces(accelerated(motion), outcome.robot.scene.gravity)
    for node, frame, needed in zip(
        motion.model.tree.nodes, tree_oracle.frames(motion.model.tree, motion.q), of_all, strict=True
    ):
        if node.body.name not in [body.name for body in outcome.robot.bodies]:
            continue  # output of a rotor
        loads, p = loads_on_links(outcome.motion, [node.body.name])[node.body.name].sizes, motion.q[:, node.p_q]
        whole, given = needed, 0.0
        for point, at in node.body.points.items():
            force, moment = at_point(loads, point)
            of_frame = moment + np.cross(at.position + p @ at.translation.T, force)
            of_modes = force @ at.translation + moment @ at.rotation
            given += np.hstack([np.einsum("tij,tj->ti", frame.F, x) for x in (force, of_frame)] + [of_modes])
        found[node.body.name] = whole - given, np.abs(whole).max()
    return found


@pytest.mark.parametrize("name", MECHANISMS)
def test_loads_at_points_move_the_bodies(name):
    """Every joint type, closed loops, rotors, friction, given loads; frames and modes alike, in the plane."""
    outcome = run(zoo.build(name, trajectory=[], load=zoo.LOADS), forward(end=0.05, output_step=0.01))
    for left, largest in missing(outcome).values():
        assert np.abs(left[:, [0, 1, *range(5, left.shape[1])]]).max() < 1e-9 * largest


def test_inverse_dynamics_counts_what_motors_and_patches_do():
    """Not the force on the trajectory that stands for them: what is left to the modes is F_p."""
    outcome = run(arm(arm_links(damping_ratio=0.02), load=[LOAD]), pcid(output_step=0.05))
    for name, (left, largest) in missing(outcome).items():
        np.testing.assert_allclose(left[:, [0, 1, 5]], 0.0, atol=1e-9 * largest)
        F_p = outcome.F_p[:, outcome.modal_columns(name)]
        np.testing.assert_allclose(left[:, 6:], F_p, atol=1e-9 * largest)
        np.testing.assert_allclose(loads_on_links(outcome.motion, [name])[name].modal_force, F_p, atol=1e-9 * largest)
    np.testing.assert_allclose(
        np.hstack(at_point(loads_on_links(outcome.motion, ["link2"])["link2"].sizes, "tip")), 0.0, atol=1e-9
    )
    assert np.abs(outcome.lambda_).max() > 1.0
