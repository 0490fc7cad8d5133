"""The records of a planar mechanism as those of space: places, angles, what is refused.

Motions are in tests/exchange/test_forward_fmu.py.
"""

import numpy as np
import pytest

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.mbs.scene.in_space.mechanism import mechanism_in_space
from ffrobot.run.spatial_bodies import load_spatial_bodies
from ffrobot.scene.spatial import SpatialScene


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


def mechanism(**changes):
    return mechanism_in_space(ffrobot.make_scene(**ARM | changes))


def test_bodies_and_loads_stay_in_the_plane():
    found = mechanism()
    rigid = found.body[0].rigid
    assert found.gravity == (1.0, -9.81, 0.0)
    assert (rigid.center, rigid.points["b"]) == ((0.1, 0.2, 0.0), (0.4, 0.1, 0.0))
    assert rigid.inertia[2] == 0.1
    assert found.payload[0].inertia[2] == 0.01
    assert {key: of(2.0)[0] for key, of in found.load[0].components.items()} == {"x": 2.0, "mz": 4.0}
    assert found.load[1].moments[0](2.0)[0] == 6.0
    assert sorted(found.trajectory[0].components) == ["x", "y"]


def test_joints_turn_about_z_and_start_by_relative_angles():
    """The tree of the plane comes first, which a prismatic joint is the last to be part of."""
    found = mechanism()
    joints = {joint.name: joint for joint in found.joint}
    assert list(joints) == ["root", "elbow", "hold", "way"]
    assert [found.joint[number].name for number in found.topology.loop_joints] == ["way"]
    assert joints["elbow"].axis == (0.0, 0.0, 1.0)
    assert (joints["way"].axis, joints["way"].at) == ((1.0, 2.0, 0.0), (0.5, 0.0, 0.0))
    assert joints["way"].rpy == pytest.approx((0.0, 0.0, 0.3))  # as lower stands on the ground
    assert joints["hold"].rpy == pytest.approx((0.0, 0.0, -0.9))
    assert found.initial.joints == pytest.approx({"way": 0.0, "root": 0.3, "elbow": -0.4})
    assert found.initial.joint_rates == pytest.approx({"way": 0.0, "root": 2.0, "elbow": -3.0})


def test_inertia_of_a_body_is_that_of_the_plane():
    J = load_spatial_bodies(SpatialScene.model_construct(**dict(mechanism(payload=[]))), str)[0].spatial.inertia
    assert J[2, 2] == pytest.approx(0.1 + 2.0 * (0.1**2 + 0.2**2))
    assert np.abs(J[:2, 2]).max() < 1e-15  # nothing turns it out of the plane


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"trajectory": [{"name": "turn", "angle": "tool.a", "value": "t"}]}, 'trajectory "turn": angle: expected'),
        ({"joint": ARM["joint"][2:], "trajectory": []}, 'joints that lead to the ground in 3D, found "lower"'),
        (
            {"joint": ARM["joint"][:2], "trajectory": [], "load": []},
            'angle and rate 0 in 3D, not so of "upper"(.|\n)*not so of "tool"',
        ),
    ],
)
def test_what_space_cannot_say_is_refused(changes, message):
    with pytest.raises(InputError, match=message):
        mechanism(**changes)


LINK = {
    "material": {"youngs_modulus": 70e9, "poissons_ratio": 0.3, "density": 2700.0},
    "modes": {"count": 1}, "mesh": {"elements": 4},
    "geometry": {"kind": "beam", "length": 0.4, "section": {"shape": "rectangle", "height": 0.02, "width": 0.02}},
    "reference": {"condition": "cantilever"}, "damping": {"ratio": 0.01},
}  # fmt: skip
ROOT = {"name": "root", "type": "revolute", "between": ["ground", "lower.root"]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"joint": [ROOT | {"viscous_friction": 0.1}]}, 'joint "root": viscous_friction: expected motors = "section"'),
        ({"load": [{"joint": "root", "moment": "t"}]}, 'load no. 1: joint: expected motors = "section"'),
        ({"trajectory": [{"name": "p", "joint": "root", "value": "t"}]}, 'trajectory "p": joint: expected motors'),
    ],
)
def test_coordinates_of_frames_are_refused_where_links_bend(changes, message):
    keys = {"name": "rod", "space": "planar", "gravity": [0.0, -9.81], "motors": "frame", "joint": [ROOT]}
    keys |= {"body": [{"name": "lower", "link": LINK}], "analysis": ARM["analysis"]}
    assert mechanism_in_space(ffrobot.make_scene(**keys)).motors == "frame"
    with pytest.raises(InputError, match=message):
        mechanism_in_space(ffrobot.make_scene(**keys | changes))
