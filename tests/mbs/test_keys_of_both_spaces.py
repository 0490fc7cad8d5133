"""Keys that planar and 3D scenes share: the robot of a planar scene moves as the same robot of a 3D scene."""

import copy
from itertools import pairwise

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot

LINK = beam_link(
    0.6, rectangle(0.006, 0.03), 12, damping={"ratio": 0.01},
    modes={"count": 2, "family": "in-plane-bending", "attachment_modes": False}
)  # fmt: skip
PATCHES = {"body": "a", "length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12}


def rod():
    points = {"root": [0.0, 0.0], "tip": [0.5, 0.0]}
    return {"mass": 2.0, "inertia": 0.1, "center": [0.25, 0.0], "points": points}


def arm(count, **changed):
    """Rods in a row that hang on joints O, B, C."""
    names = "abc"[:count]
    sides = [("ground", "a.root"), *((f"{one}.tip", f"{two}.root") for one, two in pairwise(names))]
    joints = [{"name": j, "type": "revolute", "between": list(of)} for j, of in zip("OBC", sides, strict=False)]
    return {
        "name": "arm", "space": "planar", "gravity": [0.0, -9.81],
        "body": [{"name": name, "rigid": rod()} for name in names], "joint": joints,
        "initial": {"joints": {joint["name"]: 0.4 for joint in joints}},
        "trajectory": [{"name": "path", "point": f"{names[-1]}.tip", "x": "0.65+0.05*cos(t)", "y": "0.45+0.1*sin(t)"}],
        "analysis": [{"name": "run", "kind": "pcid", "end": 0.5, "output_step": 0.05, "tolerance": 1e-9}],
    } | changed  # fmt: skip


def in_3d(planar):
    """The same robot, its axes written out, its masses as those of a body in 3D."""
    keys = copy.deepcopy(planar) | {"space": "spatial", "gravity": [*planar["gravity"], 0.0]}
    for rigid in (body["rigid"] for body in keys["body"] if "rigid" in body):
        rigid |= {"inertia": [0.6 * rigid["inertia"], 0.6 * rigid["inertia"], rigid["inertia"]]}
        rigid |= {"center": [*rigid["center"], 0.0], "points": {n: [*at, 0.0] for n, at in rigid["points"].items()}}
    for joint in keys["joint"]:
        joint |= {"axis": [0.0, 0.0, 1.0]}
    for payload in keys.get("payload", []):
        J = payload["inertia"]
        payload |= {"center": [*payload["center"], 0.0], "inertia": [0.6 * J, 0.6 * J, J]}
    return keys


SCALARS = ("/coordinate", "/rate", "/moment", "/gear_moment", "/motor_angle", "/voltage", "/force")


def solved_both(keys):
    """Results of the planar scene and of the 3D one, after what has no components was compared."""
    planar, spatial = (ffrobot.solve(ffrobot.make_scene(**one)) for one in (keys, in_3d(keys)))
    names = [name for name in planar.keys() if name.endswith(SCALARS)]  # noqa: SIM118 (no mapping)
    assert len(names) > 1
    for name in names:
        found, expected = np.asarray(planar[name]), np.asarray(spatial[name])
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max(initial=1e-12))
    return planar, spatial


def test_payload_beside_its_point():
    """At rest its weight turns the last joint about that point, at any angle."""
    still = [{"name": f"turn{joint}", "joint": joint, "value": "0.4"} for joint in "OB"]
    keys = arm(2, trajectory=still, payload=[{"point": "b.tip", "mass": 1.5, "center": [0.1, 0.2], "inertia": 0.05}])
    planar, _ = solved_both(keys)
    ways = np.cos(0.8) * 0.6 - np.sin(0.8) * 0.2
    weight = 9.81 * (2.0 * 0.25 * np.cos(0.8) + 1.5 * ways)
    np.testing.assert_allclose(planar["run/trajectories/turnB/force"][:, 0], weight, rtol=1e-9)


@pytest.mark.filterwarnings("ignore::ffrobot.FfrobotWarning")
def test_joint_that_leaves_its_range():
    keys = arm(2)
    keys["joint"][1]["position_limit"] = [-0.2, "60*deg"]
    warned = [dict(results.attributes("run"))["warnings"] for results in solved_both(keys)]
    assert list(warned[0]) == list(warned[1])
    assert any('joint "B": leaves its position_limit [-0.2, 1.0472] rad' in text for text in warned[0])


def test_motor_that_follows_a_path_before_a_gear_that_gives():
    keys = arm(1, trajectory=[{"name": "turn", "motor": "O", "value": "0.3*t**2"}])
    keys["joint"][0] |= {"stiffness": 200.0, "rotor_inertia": 0.01, "gear_ratio": 5.0, "damping": 1.0}
    planar, _ = solved_both(keys)
    np.testing.assert_allclose(planar["run/joints/O/motor_angle"], 0.3 * planar["run/time"] ** 2, atol=1e-9)


def test_joints_beyond_those_that_a_path_needs():
    keys = arm(3, redundancy="least-motion")
    keys["trajectory"][0] |= {"x": "0.85+0.05*cos(t)", "y": "0.65+0.1*sin(t)"}
    solved_both(keys)


def test_several_layouts_on_a_link():
    layouts = [{"name": "inner", "centers": [0.08, 0.2]}, {"name": "outer", "centers": [0.35, 0.5], "layers": 2}]
    keys = arm(1, body=[{"name": "a", "link": LINK}], pzt=[PATCHES | layout for layout in layouts])
    keys["trajectory"] = [{"name": "turn", "joint": "O", "value": "0.3*sin(2*t)"}]
    planar, _ = solved_both(keys)
    assert planar["run/pzt/outer/voltage"].shape == (11, 2)
