"""Patches of scenes in 3D: what they can do, what no patch reaches, and input that does not fit."""

import re

import numpy as np
import pytest
from patched_arms import SEVEN, link, pzt
from tables_3d import ORIGIN, X, Y, Z, joint, revolute, rigid, scene

import ffrobot

LAYOUTS = [pzt("one", "in-plane"), pzt("other", "out-of-plane")]
RUN = {"name": "inverse", "kind": "pcid", "end": 0.2, "output_step": 0.02, "tolerance": 1e-8}


def one_link(layouts=LAYOUTS, **tables):
    """A link on a universal joint, whose tip follows a path."""
    yaw = joint("yaw", "universal", "ground", "link.root", axis=Z, second_axis=Y)
    path = {"name": "tip", "point": "link.tip", "y": "0.02*sin(6*t)**3", "z": "0.03*sin(5*t)**3"}
    keys = {"payload": [{"point": "link.tip", "mass": 0.1}], "trajectory": [path], "pzt": layouts}
    return scene([link(SEVEN)], [yaw], RUN, **{"gravity": [0.3, 0.5, -9.81]} | keys | tables)


def solved(tables, path=None):
    return ffrobot.solve(ffrobot.make_scene(**tables), path)


def test_feasibility_of_a_scene_in_3d(tmp_path, ffrobot):
    with solved(one_link(), tmp_path / "results.h5") as results:
        lines, verdict = ffrobot.ok("feasibility", results.path).stdout.splitlines(), results.verdict["inverse"]
        factors, modes = (
            [float(x) for name in ("one", "other") for x in results[f"inverse/feasibility/pzt/{name}/{key}"]]
            for key in ("factor", "mode_factor")
        )
    assert any(line.startswith("yaw 1") for line in lines)  # motors of a universal joint, one for each axis
    patches = [line for line in lines if line.startswith("patch ")]
    assert [line.endswith("no") for line in patches] == [factor > 1 for factor in factors]
    assert sum(line.startswith("mode ") for line in lines) == len(modes)
    assert sum(line.startswith("sufficient alone: a limit of") for line in lines) == 2
    assert set(verdict.patches) == {"one", "other"}
    assert verdict.feasible == all(need.factor <= 1.0 for need in verdict.patches.values())


def test_what_no_patch_reaches_is_told_mode_by_mode():
    """The moment of a wrist about the link's axis twists it: the modal force τ φ_x of torsion is left, whole."""
    hand = rigid("hand", 0.2, [1e-4] * 3, [0.0, 0.05, 0.0], tool=[0.0, 0.1, 0.0])
    joints = [revolute("yaw", "ground", "link.root", Z), revolute("roll", "link.tip", "hand.root", X)]
    path = {"name": "tool", "point": "hand.tool", "y": "0.1 - 0.02*sin(8*t)**3", "z": "0.05*sin(10*t)**3"}
    bodies = [link(SEVEN | {"indices": [*SEVEN["indices"], 8]}), hand]
    tables = scene(bodies, joints, RUN | {"tolerance": 1e-6}, gravity=ORIGIN, trajectory=[path], pzt=LAYOUTS)
    with solved(tables) as results:
        force, left = results["inverse/bodies/link/modal_force"], results["inverse/pzt/one/residual_force"]
        torsion = list(results.attributes("inverse/pzt/one/residual_force")["columns"]).index("torsion")
        moment = results["inverse/joints/roll/moment"]
        expected = moment * results.modal_body("link").interfaces["tip"].rotation[0, torsion]
        np.testing.assert_allclose(force[:, torsion], expected, atol=1e-2 * np.abs(expected).max())  # small rotations
        np.testing.assert_allclose(left[:, torsion], force[:, torsion], rtol=1e-9)
        np.testing.assert_array_equal(left, results["inverse/pzt/other/residual_force"])
        assert results.verdict["inverse"].feasible is False
        (told,) = (text for text in results.warnings["inverse"] if "no actuator provides" in text)
        assert "modal forces required on link (torsion), off by" in told


def other(**keys):
    return [LAYOUTS[0], LAYOUTS[1] | keys]


VOLTS = {"pzt": "other", "voltage": ["30"] * 4}
MISTAKES = {
    'pzt "one": name: expected a separate name for each layout on a body': {"layouts": other(name="one")},
    'expected one of the bodies "link", found "lnk"': {"layouts": other(body="lnk")},
    "plain piezoceramic strains alike in all directions": {"layouts": other(bends="twist")},
    'expected bends = "in-plane" and no fibers with coupling = "surface"': {"layouts": other(coupling="surface")},
    'expected 4 expressions, one for each patch of "other", found 1': {"load": [VOLTS | {"voltage": ["30"]}]},
    'expected the keys "voltage" with "pzt", found "moment"': {"load": [{"pzt": "other", "moment": "1"}]},
}


@pytest.mark.parametrize("message", MISTAKES)
def test_mistakes(message):
    with pytest.raises(ffrobot.InputError, match=re.escape(message)):
        solved(one_link(**MISTAKES[message]))
