"""`check = "finer"`: what inverse results leave on links with twice the modes."""

import json

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from links import quintic
from one_link import one_link

import ffrobot as library
from ffrobot.run.solve import solve_scene

CHECKED = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "check": "finer"}


def link(name, length, condition):
    return beam_link(
        length, rectangle(0.006, 0.02), 20, nu=None, condition=condition, name=name,
        modes={"count": 2, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": 0.005}
    )  # fmt: skip


def arm(**changes):
    """Two links that fold, with as many patches as modes, and `changes` of the first one."""
    links = {"link1": link("link1", 0.7, "simply-supported"), "link2": link("link2", 0.5, "cantilever")}
    bodies = [{"name": name, "link": of} for name, of in links.items()]
    layout = {"count": 2, "length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12}
    layout["structural"] = False  # their stiffness on few modes is another error, which falls more slowly
    return library.make_scene(
        name="arm", gravity=[0.0, 0.0], body=[changes or bodies[0], bodies[1]],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
               {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]}],
        payload=[{"point": "link2.tip", "mass": 0.2}], pzt=[{"body": name, **layout} for name in links],
        initial={"state": "static", "angles": {"link1": 0.4, "link2": 1.3}},
        trajectory=[{"name": "tip", "point": "link2.tip", "x": quintic(0.778, 0.762), "y": quintic(0.754, 0.897)}],
        analysis=[CHECKED | {"end": 1.0, "output_step": 0.005, "tolerance": 1e-5}],
    )  # fmt: skip


def test_the_growth_of_deviations_is_that_of_an_upright_rod():
    """By 3 g / 2 L: torques that stand still hold it, but do not bring it back."""
    scene = one_link("rod", link("rod", 0.2, "cantilever"), CHECKED, joint={}, target="pi/2", gravity=[0.0, -9.81])
    check = solve_scene(scene).analyses["inverse"].check
    assert check.growth == pytest.approx(np.sqrt(1.5 * 9.81 / 0.2), rel=0.02)  # the rod bends, too
    assert f"in an open loop in which deviations grow by {check.growth:.2g} 1/s" in check.in_words


def test_it_is_told_and_kept(tmp_path, ffrobot):
    path = tmp_path / "scene.toml"
    path.write_text(arm().text, encoding="utf-8")
    done = ffrobot.ok("solve", path, "--verbose")
    assert "inverse, forward simulation on 4 modes: link2.tip is off by" in " ".join(done.stdout.split())
    with library.Results(path.with_suffix(".results.h5")) as results:
        about = results.attributes("inverse")
    assert json.loads(about["check_modes"]) == {"link1": 4, "link2": 4}
    assert about["check_error"] > 1e-7


def test_modal_body_files_cannot_be_refined(tmp_path):
    library.make_link(link("link1", 0.7, "simply-supported"), tmp_path / "link.h5")
    with pytest.raises(library.InputError, match=r'check: expected "link" in body "link1" for "finer"'):
        solve_scene(arm(name="link1", modal=str(tmp_path / "link.h5")))


def test_the_check_of_a_rigid_robot_is_its_replay():
    rod = {"mass": 1.0, "inertia": 0.1, "center": [0.3, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
    turned, body = CHECKED | {"end": 0.5, "output_step": 0.05}, [{"name": "rod", "rigid": rod}]
    scene = one_link("rod", {}, turned, joint={}, target="t**3", body=body, gravity=[0.0, -9.81])
    check = solve_scene(scene).analyses["inverse"].check
    assert (check.point, check.status) == ("rod.tip", "completed")
    assert check.error < 1e-6
