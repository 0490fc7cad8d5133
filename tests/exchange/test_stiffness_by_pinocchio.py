"""Natural frequencies and compliance at the tool frame of a UR5 on springs, motors locked, against Pinocchio."""

import tomllib

import numpy as np
import pytest
from rigid_robots import ROBOTS

import ffrobot

MOTORS = [0.4, -1.1, 1.3, -0.7, 0.9, 0.2]
STIFFNESS = [2.1e4, 1.9e4, 1.2e4, 5e3, 4e3, 3e3]  # N·m/rad
CLOSE = 1e-8


@pytest.fixture(scope="module")
def scene(tmp_path_factory, ffrobot):
    """The imported robot on compliant gears whose motors stand still; rotors without inertia, nearly."""
    folder = tmp_path_factory.mktemp("ur5")
    ffrobot.ok("import", ROBOTS / "ur5.urdf", "-o", folder / "out")
    keys = tomllib.loads((folder / "out" / "scene.toml").read_text())
    for joint, stiffness in zip(keys["joint"], STIFFNESS, strict=True):
        joint |= {"gear_ratio": 1.0, "rotor_inertia": 1e-12, "stiffness": stiffness}
    names = [joint["name"] for joint in keys["joint"]]
    keys["trajectory"] = [{"name": n, "motor": n, "value": repr(q)} for n, q in zip(names, MOTORS, strict=True)]
    keys["initial"] = {"joints": dict(zip(names, MOTORS, strict=True))}
    keys["analysis"] = [{"name": "rest", "kind": "static"}]
    return keys


def test_a_robot_on_springs(scene, pinocchio_stiffness):
    """In the equilibrium under gravity: K is that of springs and of weights, C = J K⁻¹ Jᵀ in the axes of the tool."""
    names = [joint["name"] for joint in scene["joint"]]
    request = {"names": names, "motors": MOTORS, "stiffness": STIFFNESS, "frame": "tool0"}
    answer = pinocchio_stiffness(ROBOTS / "ur5.urdf", **request)
    assert {tool["name"] for tool in scene["tool"]} == {"ee_link", "tool0"}
    with ffrobot.solve(ffrobot.make_scene(**scene)) as results:
        q = [results[f"rest/joints/{name}/coordinate"][0] for name in names]
        frequency = results["rest/joints_compliant/frequency"][0]
        C = results["rest/joints_compliant/compliance/wrist_3_link.tool0"][0]
    np.testing.assert_allclose(q, answer["q"], rtol=CLOSE)
    np.testing.assert_allclose(frequency, answer["frequency"], rtol=CLOSE)
    np.testing.assert_allclose(C, answer["compliance"], rtol=CLOSE, atol=CLOSE * np.abs(C).max())
