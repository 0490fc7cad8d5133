"""Where loops of robots in 3D are cut, and searches for a posture that end without one."""

import warnings

import numpy as np
import pytest
from checkpoint_scenes import checkpoint_scene, tree_model
from random_mechanisms import Tree

from ffrobot.mbs.model.body import rigid_body
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.run.bodies import load_bodies


def model_of(name):
    scene = checkpoint_scene(name)
    return build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])


@pytest.mark.parametrize(
    ("of_joints", "cut"),
    [
        ({}, "last"),
        ({"second": {}}, "second"),
        ({"last": {"rotor_inertia": 1e-4}}, "third"),
        ({"third": {"motor": True}, "last": {"rotor_inertia": 1e-4}}, "second"),
        ({"first": {"rotor_inertia": 1e-4}, "second": {"position_limit": (-1.0, 1.0)}}, "second"),
    ],
)
def test_loops_are_cut_where_nothing_acts_then_where_there_is_neither_motor_nor_rotor(of_joints, cut):
    """There is friction in all joints that are not named."""
    pins = {
        "first": ("ground", "crank.root"), "second": ("crank.tip", "coupler.root"), "third": ("ground", "rocker.root"),
        "last": ("rocker.tip", "coupler.tip"),
    }  # fmt: skip
    keys = {"type": "revolute", "axis": (0.0, 0.0, 1.0)}
    joints = [
        {"name": name, "between": sides} | keys | of_joints.get(name, {"viscous_friction": 0.1})
        for name, sides in pins.items()
    ]
    points = dict.fromkeys(("root", "tip"), (0.0, 0.0, 0.0))
    bodies = [rigid_body(name, 1.0, np.zeros(3), np.eye(3), points) for name in ("crank", "coupler", "rocker")]
    model = tree_model(Tree(bodies, []), joints)
    assert [joint.name for joint in model.tree.loops] == [cut]


def test_a_search_that_leaves_all_bounds_ends_in_silence():
    """From angles of 3e10 rad series of rotations overflow; the search says whether it converged, NumPy nothing."""
    model = model_of("stanford")
    q = undeformed_posture(model).q
    q[model.tree.nodes[model.tree.carried["q2"]].q] = 3e10
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert model.constraints.posture(q, 0.0) is None
