"""Scene files in 3D: what their records take, and the message of each mistake."""

import copy

import numpy as np
import pytest
import tables_3d
from checkpoint_mechanisms import FOLDER
from tables_3d import X, Y, joint, revolute, rigid

from ffrobot.common.errors import InputError
from ffrobot.common.rotations import exponential, quaternions
from ffrobot.mbs.fields.orientations import OrientationLaw
from ffrobot.scene.load import validated_scene

HAND_INERTIA = [[0.01, 0.0, 0.0], [0.0, 0.02, 0.001], [0.0, 0.001, 0.02]]
ARM = tables_3d.scene(
    [
        rigid("base", 4.0, (0.02, 0.02, 0.01), [0.0, 0.0, 0.1], top=[0.0, 0.0, 0.2]),
        rigid("hand", 1.0, HAND_INERTIA, [0.1, 0.0, 0.0], tip=[0.2, 0.0, 0.0]),
    ],
    [
        revolute("waist", "ground", "base.root", position_limit=[-3.0, "180*deg"]),
        joint("wrist", "universal", "base.top", "hand.root", axis=Y, second_axis=X, moment_limit=[10.0, 5.0]),
    ],
    {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.1},
    initial={"joints": {"waist": 0.3, "wrist": [0.1, "10*deg"]}},
    trajectory=[{"name": "tool", "point": "hand.tip", "x": "0.1*cos(t)", "y": "0.1*sin(t)"}],
    load=[{"joint": "waist", "moment": "0.1*t"}],
    payload=[{"point": "hand.tip", "mass": 0.5, "center": [0.02, 0.0, 0.0]}],
)


def scene(change=lambda tables: None):
    data = copy.deepcopy(ARM)
    change(data)
    return validated_scene(data, FOLDER / "scene.toml", "")


def test_keys_and_their_meaning():
    found = scene()
    waist, wrist = found.joint
    assert waist.position_limits == ((-3.0, pytest.approx(np.pi)),)
    assert [limits.moment for limits in wrist.motor_limits] == [10.0, 5.0]
    assert [limits.moment for limits in waist.motor_limits] == [np.inf]
    assert found.topology.is_open_chain
    assert [joint.name for joint in found.motor_joints] == ["waist", "wrist"]
    first, second = wrist.triads()
    np.testing.assert_allclose(first[:, 0], [0, 1, 0], atol=1e-15)
    np.testing.assert_allclose(second[:, 1], [1, 0, 0], atol=1e-15)


def put(table, number=0, **keys):
    def change(data):
        entry = data[table][number] if isinstance(data.get(table), list) else data.setdefault(table, {})
        entry.update(keys)
        for key in [key for key, value in entry.items() if value is None]:
            del entry[key]

    return change


def add(table, **keys):
    return lambda data: data.setdefault(table, []).append(keys)


RIGID = ARM["body"][0]["rigid"]
MISTAKES = {
    "inertia of no body": (
        put("body", rigid=RIGID | {"inertia": [1.0, 0.1, 0.1]}),
        "rigid.inertia: expected no principal moment of inertia larger than the sum of the others, found 0.1, 0.1, 1",
    ),
    "inertia below zero": (
        put("body", rigid=RIGID | {"inertia": [-0.1, 1.0, 1.0]}),
        "expected principal moments of inertia not below 0, found -0.1",
    ),
    "axis of a weld": (
        put("joint", type="weld", position_limit=None),
        'joint "waist": expected the key "axis" only in revolute or .* joints, found it in a weld joint',
    ),
    "axes that are not square": (
        put("joint", 1, second_axis=[1.0, 1.0, 0.0]),
        "expected axis and second_axis at right angles .* found 45 degrees",
    ),
    "lead of none": (
        put("joint", type="screw", lead=0.0),
        "expected a lead that is not 0, found 0: without it the joint is a revolute one",
    ),
    "limits upside down": (
        put("joint", position_limit=[1.0, -1.0]),
        r"expected position_limit = \\[least, largest\\], found \\[1, -1\\]",
    ),
    "motor of a spherical joint": (
        lambda data: (
            put("joint", type="spherical", axis=None, position_limit=None, motor=True)(data),
            data.update(load=[]),
        ),
        'joint "waist": motor: expected false of a spherical joint, which has no coordinates for motors, found true',
    ),
    "direction that vanishes": (
        put("trajectory", tool_axis=[1.0, 0.0, 0.0], direction=["0", "0", "t-0.5"]),
        "direction: expected a direction at all times, found none at t = 0.5 s",
    ),
    "what is applied by patches that are not there": (
        add("analysis", name="again", kind="forward", actuation="inverse", apply="joints+pzt"),
        r'analysis "again": apply: expected at least one \\[\\[pzt\\]\\] for "joints\+pzt", found none',
    ),
    "shape without a value": (
        lambda data: (
            put("body", 1, rigid=None, link="links/upper.toml")(data),
            put("analysis", kind="fcid", shape="given", modal={"hand": ["1/(t - 0.1)"]})(data),
        ),
        r'analysis "inverse": modal.hand\[0\]: expected a finite value during the whole run, found none at t = 0.1',
    ),
    "function in a file": (
        lambda data: data.update(load=[{"point": "hand.tip", "force": "f"}]),
        "load no. 1: force: expected a function of t, position and velocity, in scenes made in Python"
        " \\(expressions in t are the keys x, y and their like\\), found 'f'",
    ),
    "axis of an angle without direction": (
        put("trajectory", point=None, x=None, y=None, angle="hand.tip", axis=[0.0, 0.0, 0.0], value="t"),
        'trajectory "tool": axis: expected a direction, found .0, 0, 0.',
    ),
    "rotor of a joint that slides and turns": (
        put("joint", type="cylindrical", rotor_inertia=1e-3),
        'expected the key "rotor_inertia" only in',
    ),
    "compliant gear without a rotor": (
        put("joint", stiffness=100.0),
        "expected a rotor_inertia above 0 with stiffness, found none",
    ),
    "nothing to follow": (lambda data: data.pop("trajectory"), r"expected at least one \\[\\[trajectory\\]\\]"),
}


@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_told(name):
    change, message = MISTAKES[name]
    with pytest.raises(InputError, match=message.replace(r"\\[", r"\[").replace(r"\\]", r"\]")) as caught:
        scene(change)
    assert str(FOLDER / "scene.toml") in str(caught.value)


@pytest.mark.parametrize("turn", [0.4, 2.5])
def test_waypoints_with_quaternions(tmp_path, turn):
    """Orientations of a table are met at its times, whichever sign quaternions have; the motion is smooth between."""
    rng = np.random.default_rng(1)
    times = np.linspace(0, 1, 9)
    axis = rng.standard_normal(3)
    vectors = np.outer(np.sin(np.pi * times / 2) * turn, axis / np.linalg.norm(axis))
    A = exponential(vectors) @ exponential(np.array([2.0, 1.0, -1.0]))
    e = quaternions(A) * rng.choice([-1, 1], (9, 1))
    table = np.column_stack([times, np.sin(times), np.cos(times), times, e])
    np.savetxt(tmp_path / "pose.csv", table, delimiter=",", header="t,x,y,z,qw,qx,qy,qz", comments="")
    data = copy.deepcopy(ARM)
    data["trajectory"] = [{"name": "tool", "point": "hand.tip", "waypoints": "pose.csv"}]
    found = validated_scene(data, tmp_path / "scene.toml", "").trajectory[0]
    assert set(found.components) == {"x", "y", "z"}
    np.testing.assert_allclose(found.orientation.sample(times), A, atol=1e-12)
    check_rates(found.orientation, np.linspace(0.05, 0.95, 7))


def test_waypoints_that_are_no_rotation(tmp_path):
    (tmp_path / "pose.csv").write_text("t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0,0,1,1,0,0\n")
    data = copy.deepcopy(ARM)
    data["trajectory"] = [{"name": "tool", "point": "hand.tip", "waypoints": "pose.csv"}]
    with pytest.raises(InputError, match=r"waypoints: row 2: expected qw, qx, qy, qz of length 1, found 1\.41421"):
        validated_scene(data, tmp_path / "scene.toml", "")


@pytest.mark.parametrize(
    "keys",
    [
        {"rotation_vector": ["0.3*sin(t)", "t", "t**2"], "reference_rotation_vector": [1.0, 2.0, -0.5]},
        {"rotation_vector": ["0", "t-0.7", "0"]},
        {"rotation_vector": ["5+t", "2*t", "-3"]},
        {"rpy": ["t", "2*sin(t)", "1-t**2"]},
        {"tool_axis": [0.0, 1.0, 1.0], "direction": ["cos(t)", "2*sin(t)", "0.3+t"]},
    ],
)
def test_rates_of_orientations_by_differences(keys):
    check_rates(scene(put("trajectory", **keys)).trajectory[0].orientation, np.linspace(0.1, 0.9, 5))


def check_rates(law: OrientationLaw, times):
    h = 1e-5
    omega, alpha = law.in_core.sample(times)[1:]
    if law.kind == "direction":
        z = [law.sample(times + s)[:, :, 2] for s in (-h, 0, h)]
        np.testing.assert_allclose((z[2] - z[0]) / (2 * h), np.cross(omega, z[1]), atol=1e-8)
        np.testing.assert_allclose(np.sum(omega * z[1], axis=1), 0, atol=1e-14)
        twice = (z[2] - 2 * z[1] + z[0]) / h**2
        np.testing.assert_allclose(np.cross(alpha, z[1]) + np.cross(omega, np.cross(omega, z[1])), twice, atol=1e-4)
        return
    spin = (law.sample(times + h) - law.sample(times - h)) / (2 * h) @ law.sample(times).transpose(0, 2, 1)
    np.testing.assert_allclose(np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1), omega, atol=1e-7)
    ahead, behind = law.in_core.sample(times + h)[1], law.in_core.sample(times - h)[1]
    np.testing.assert_allclose((ahead - behind) / (2 * h), alpha, atol=1e-7)
