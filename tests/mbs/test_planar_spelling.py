"""Planar scenes read by the records of 3D: components, axes, angles; what is unknown there: test_scene_file.py."""

import pytest

from ffrobot.scene.load import make_scene


def body(name, **points):
    return {"name": name, "rigid": {"mass": 2.0, "inertia": 0.1, "center": [0.1, 0.2], "points": points}}


ARM = {
    "name": "arm", "space": "planar", "gravity": [1.0, -9.81],
    "body": [body("lower", a=[0.0, 0.0], b=[0.4, 0.1]), body("upper", a=[0.0, 0.0], b=[0.3, 0.0]),
             body("tool", a=[0.0, 0.0])],
    "joint": [
        {"name": "way", "type": "prismatic", "between": ["ground", "lower.b"], "axis": [1.0, 2.0], "at": [0.5, 0.0]},
        {"name": "root", "type": "revolute", "between": ["ground", "lower.a"], "at": [0.1, 0.2]},
        {"name": "elbow", "type": "revolute", "between": ["upper.a", "lower.b"], "gear_ratio": 9.0},
        {"name": "hold", "type": "weld", "between": ["upper.b", "tool.a"]},
    ],
    "payload": [{"point": "upper.b", "mass": 0.5, "inertia": 0.01}],
    "load": [{"point": "tool.a", "x": "t", "moment": "2*t"}, {"joint": "elbow", "moment": "3*t"}],
    "trajectory": [{"name": "path", "point": "upper.b", "via": [[0.1, 0.2], [0.3, 0.4]], "duration": 1.0}],
    "initial": {"angles": {"lower": 0.3, "upper": 0.7, "tool": -0.2}, "rates": {"lower": 2.0, "upper": 5.0}},
    "analysis": [{"name": "rest", "kind": "static"}],
}  # fmt: skip


def read(**changes):
    return make_scene(**ARM | changes)


def test_bodies_and_loads_get_components_of_3d():
    found = read()
    rigid = found.body[0].rigid
    assert (found.space, found.gravity) == ("planar", (1.0, -9.81, 0.0))
    assert (rigid.center, rigid.points["b"]) == ((0.1, 0.2, 0.0), (0.4, 0.1, 0.0))
    assert (rigid.inertia[2], found.payload[0].inertia[2]) == (0.1, 0.01)
    assert {key: of(2.0)[0] for key, of in found.load[0].components.items()} == {"x": 2.0, "mz": 4.0}
    assert found.load[1].moments[0](2.0)[0] == 6.0
    assert sorted(found.trajectory[0].components) == ["x", "y"]


def test_joints_turn_about_z_and_start_by_relative_angles():
    found = read()
    joints = {joint.name: joint for joint in found.joint}
    assert joints["elbow"].axis == (0.0, 0.0, 1.0)
    assert (joints["way"].axis, joints["way"].at) == ((1.0, 2.0, 0.0), (0.5, 0.0, 0.0))
    assert joints["way"].rpy == pytest.approx((0.0, 0.0, 0.3))  # as lower stands on the ground
    assert joints["hold"].rpy == pytest.approx((0.0, 0.0, -0.9))
    assert found.initial.joints == pytest.approx({"root": 0.3, "elbow": -0.4})
    assert found.initial.joint_rates == pytest.approx({"root": 2.0, "elbow": -3.0})


def test_bodies_without_angles_follow_guesses_of_joints():
    found = read(initial={"angles": {"upper": 0.7}, "joints": {"root": 0.3, "way": 0.1}})
    joints = {joint.name: joint for joint in found.joint}
    assert found.initial.joints == pytest.approx({"root": 0.3, "way": 0.1, "elbow": 0.3 - 0.7})
    assert joints["hold"].rpy == pytest.approx((0.0, 0.0, 0.0))  # the tool follows what it is welded to
