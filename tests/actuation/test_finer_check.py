"""`check = "finer"`: what inverse results leave on links with twice the modes."""

import json

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from one_link import one_link

import ffrobot as library
from ffrobot.run.solve import solve_scene

CHECKED = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "check": "finer"}


def link(length):
    return beam_link(
        length, rectangle(0.006, 0.02), 20, nu=None, name="rod",
        modes={"count": 2, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": 0.005}
    )  # fmt: skip


def turned(**keys):
    """A link with as many patches as modes, whose joint follows a path."""
    layout = {"count": 2, "length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12}
    keys = {"joint": {}, "target": "0.4 + 100*t**3", "pzt": [layout | {"body": "rod", "structural": False}]} | keys
    return one_link("rod", link(0.7), CHECKED, **keys)


def test_the_growth_of_deviations_is_that_of_an_upright_rod():
    """By 3 g / 2 L: torques that stand still hold it, but do not bring it back."""
    scene = one_link("rod", link(0.2), CHECKED, joint={}, target="pi/2", gravity=[0.0, -9.81])
    check = solve_scene(scene).analyses["inverse"].check
    assert check.growth == pytest.approx(np.sqrt(1.5 * 9.81 / 0.2), rel=0.02)  # the rod bends, too
    assert f"in an open loop in which deviations grow by {check.growth:.2g} 1/s" in check.in_words


def test_it_is_told_and_kept(tmp_path, ffrobot):
    path = tmp_path / "scene.toml"
    path.write_text(turned().text, encoding="utf-8")
    done = ffrobot.ok("solve", path, "--verbose")
    assert "inverse, forward simulation on 4 modes: rod.tip is off by" in " ".join(done.stdout.split())
    with library.Results(path.with_suffix(".results.h5")) as results:
        about = results.attributes("inverse")
    assert json.loads(about["check_modes"]) == {"rod": 4}
    assert about["check_error"] > 1e-7


def test_modal_body_files_cannot_be_refined(tmp_path):
    library.make_link(link(0.7), tmp_path / "link.h5")
    with pytest.raises(library.InputError, match=r'check: expected "link" in body "rod" for "finer"'):
        solve_scene(turned(body=[{"name": "rod", "modal": str(tmp_path / "link.h5")}]))


def test_the_check_of_a_rigid_robot_is_its_replay():
    rod = {"mass": 1.0, "inertia": 0.1, "center": [0.3, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
    run, body = CHECKED | {"end": 0.5, "output_step": 0.05}, [{"name": "rod", "rigid": rod}]
    scene = one_link("rod", {}, run, joint={}, target="t**3", body=body, gravity=[0.0, -9.81])
    check = solve_scene(scene).analyses["inverse"].check
    assert (check.point, check.status) == ("rod.tip", "completed")
    assert check.error < 1e-6


@pytest.mark.parametrize("change", [{"motor": False}, {"stiffness": 1e4, "damping": 1.0, "rotor_inertia": 1e-4}])
def test_what_a_replay_cannot_do(change):
    with pytest.raises(library.InputError, match="check: expected motors, and joints without stiffness"):
        library.solve(turned(joint=change, pzt=[]))
