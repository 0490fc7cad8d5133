"""Joints of all types with motors under control in 3D, named from either side: signs, order of coordinates."""

import numpy as np
import pytest
import scenes_in_3d
import tables_3d
from beam_links import beam_link, rectangle
from tables_3d import X, Y, Z

import ffrobot

SAMPLE = 0.002
POINTS = {"root": [0.0, 0.0, 0.0], "tip": [0.3, 0.1, -0.2]}
BODY = {"mass": 1.2, "center": [0.1, 0.05, -0.1], "inertia": [0.03, 0.04, 0.05], "points": POINTS}
ASLANT = [0.48, -0.6, 0.64]
JOINTS = {
    "revolute": ({"axis": ASLANT}, {"joint": "J", "value": "0.3*sin(3*t)"}),
    "prismatic": ({"axis": ASLANT}, {"joint": "J", "value": "0.1*sin(3*t)"}),
    "screw": ({"axis": ASLANT, "lead": 0.2}, {"joint": "J", "value": "0.3*sin(3*t)"}),
    "cylindrical": (
        {"axis": [0.0, 0.0, 1.0]}, {"point": "b.tip", "y": "0.1 + 0.1*sin(3*t)", "z": "-0.2 + 0.1*sin(2*t)"},
    ),
    "universal": (
        {"axis": [1.0, 0.0, 0.0], "second_axis": [0.0, 1.0, 0.0]},
        {"point": "b.tip", "x": "0.3 - 0.05*(1 - cos(3*t))", "y": "0.1 + 0.1*sin(2*t)"},
    ),
}  # fmt: skip


def scene(kind, turned):
    keys, path = JOINTS[kind]
    sides = ["b.root", "ground"] if turned else ["ground", "b.root"]
    joint = {"name": "J", "type": kind, "between": sides, "motor": True, "rpy": [0.0, 0.0, 0.0]} | keys
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": SAMPLE, "tolerance": 1e-10}
    path = {"name": "path"} | path
    if turned and "value" in path:
        path["value"] = f"-({path['value']})"
    loop = {
        "name": "loop", "kind": "closed-loop", "actuation": "inverse", "sample_time": SAMPLE, "tip": "b.tip",
        "controller": [{"kind": "joint-pid", "proportional": {"J": 60.0}, "derivative": {"J": 2.0}}],
        "tolerance": 1e-9,
    }  # fmt: skip
    pd = loop | {"name": "pd", "feed_forward": "none"}
    torque = pd | {"name": "torque", "controller": [{"kind": "computed-torque", "bandwidth": 30}]}
    return {
        "name": "joints", "space": "spatial", "gravity": [1.0, 2.0, -9.0], "body": [{"name": "b", "rigid": BODY}],
        "joint": [joint], "trajectory": [path], "analysis": [inverse, loop, pd, torque],
    }  # fmt: skip


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("kind", JOINTS)
def test_sensors_and_motors_have_the_signs_of_the_joint(tmp_path, kind, turned):
    """Readings are the coordinates in results, commands P e + D ė; fed forward or by computed torque it follows."""
    with ffrobot.solve(scenes_in_3d.write(scene(kind, turned), tmp_path / "scene.toml")) as found:
        outputs = list(found.attributes("pd/control")["outputs"])
        labels = ["J"] if len(outputs) == 2 else ["J 1", "J 2"]
        at = [[outputs.index(f"joint/{name}{ending}") for name in labels] for ending in ("", "/rate")]
        readings, e = found["pd/control/readings"], found["pd/control/reference"] - found["pd/control/readings"]
        for columns, dataset in zip(at, ("coordinate", "rate"), strict=True):
            expected = found[f"pd/joints/J/{dataset}"][:-1].reshape(len(readings), -1)
            np.testing.assert_allclose(readings[:, columns], expected, atol=1e-9)
        np.testing.assert_allclose(found["pd/control/commands"], 60.0 * e[:, at[0]] + 2.0 * e[:, at[1]], atol=1e-9)
        assert np.abs(found["pd/control/commands"]).max() > 0.1
        moved = np.linalg.norm(np.ptp(found["inverse/points/b.tip/position"], axis=0))
        assert moved > 0.02
        assert found["loop/tip_error"].max() < 1e-5 * moved
        assert found["torque/tip_error"].max() < 2e-3 * moved


def test_motors_of_planar_joints_hold_a_link_that_vibrates():
    """Frequencies with its motors locked are those of two slides and a turn, between bodies next to massless."""
    body = {"name": "b", "link": beam_link(0.5, rectangle(0.01, 0.015), 6, modes={"count": 4})}
    friction, between = {"viscous_friction": 0.3}, ["ground", "u.root", "w.root", "b.root"]
    plane = [tables_3d.joint("plane", "planar", "ground", "b.root", axis=Z, motor=True, **friction)]
    slides = [
        tables_3d.joint(name, "revolute" if name == "turn" else "prismatic", *between[k : k + 2], axis=axis, **friction)
        for k, (name, axis) in enumerate({"x": X, "y": Y, "turn": Z}.items())
    ]
    massless = [tables_3d.rigid(name, 1e-9, [1e-12] * 3) for name in "uw"]
    found = []
    for bodies, joints in (([body], plane), ([*massless, body], slides)):
        tables = tables_3d.scene(bodies, joints, {"name": "linear", "kind": "linear"}, gravity=[1.0, 2.0, -9.0])
        with ffrobot.solve(ffrobot.make_scene(**tables)) as run:
            found.append(run["linear/joints_locked/frequency"])
    assert found[0].size >= 4
    np.testing.assert_allclose(*found, rtol=1e-6)
