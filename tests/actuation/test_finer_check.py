"""`check = "finer"`: what inverse results leave on links with twice the modes."""

import json

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot as library
from ffrobot.run.solve import solve_scene

LENGTHS, START, END = (0.7, 0.5), (0.4, 1.3), (0.7, 1.1)


def place(angles):
    return np.array([np.cos(angles), np.sin(angles)]) @ LENGTHS


def link(name, length, condition, modes, damping=0.005):
    return beam_link(
        length, rectangle(0.006, 0.02), 20, nu=None, condition=condition, name=name,
        modes={"count": modes, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": damping}
    )  # fmt: skip


def arm(modes, kind="pcid", gravity=0.0, bodies=None, patches=True, **keys):
    names = ("link1", "link2")
    path = {
        axis: f"{a!r}+{b - a!r}*(10*t**3-15*t**4+6*t**5)"
        for axis, a, b in zip("xy", place(START).tolist(), place(END).tolist(), strict=True)
    }
    conditions = ("simply-supported", "cantilever")
    layout = {"count": modes, "length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12}
    layout["structural"] = False  # their stiffness on few modes is another error, which falls more slowly
    apply = "joints+pzt" if patches else "joints"
    return library.make_scene(
        name="arm",
        space="planar",
        gravity=[0.0, -gravity],
        body=bodies
        or [
            {"name": n, "link": link(n, length, condition, modes)}
            for n, length, condition in zip(names, LENGTHS, conditions, strict=True)
        ],
        joint=[
            {"name": "O", "type": "revolute", "between": ["ground", "link1.root"]},
            {"name": "A", "type": "revolute", "between": ["link1.tip", "link2.root"]},
        ],
        payload=[{"point": "link2.tip", "mass": 0.2}],
        initial={"state": "static", "angles": dict(zip(names, START, strict=True))},
        trajectory=[{"name": "tip", "point": "link2.tip", **path}],
        pzt=[{"body": name, **layout} for name in names] if patches else [],
        analysis=[
            {"name": "inverse", "kind": kind, "end": 1.0, "output_step": 0.005, "tolerance": 1e-5, "check": "finer"}
            | keys,
            {"name": "same", "kind": "forward", "actuation": "inverse", "apply": apply},
        ],
    )


def test_the_growth_of_deviations_is_that_of_an_upright_rod():
    """By 3 g / 2 L: torques that stand still hold it, but do not bring it back."""
    scene = library.make_scene(
        name="upright", gravity=[0.0, -9.81], body=[{"name": "rod", "link": link("rod", 0.2, "cantilever", 2)}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]}],
        trajectory=[{"name": "stand", "joint": "O", "value": "pi/2"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "check": "finer"}],
    )  # fmt: skip
    check = solve_scene(scene).analyses["inverse"].check
    assert check.growth == pytest.approx(np.sqrt(1.5 * 9.81 / 0.2), rel=0.02)  # the rod bends, too
    assert f"in an open loop in which deviations grow by {check.growth:.2g} 1/s" in check.in_words


def test_it_is_told_and_kept(tmp_path, ffrobot):
    path = tmp_path / "scene.toml"
    path.write_text(arm(2).text, encoding="utf-8")
    done = ffrobot.ok("solve", path, "--verbose")
    assert "inverse, forward simulation on 4 modes: link2.tip is off by" in " ".join(done.stdout.split())
    with library.Results(path.with_suffix(".results.h5")) as results:
        about = results.attributes("inverse")
    assert json.loads(about["check_modes"]) == {"link1": 4, "link2": 4}
    assert about["check_error"] > 1e-7


def test_modal_body_files_cannot_be_refined(tmp_path):
    library.make_link(link("link1", 0.7, "simply-supported", 2), tmp_path / "link.h5")
    bodies = [
        {"name": "link1", "modal": str(tmp_path / "link.h5")},
        {"name": "link2", "link": link("link2", 0.5, "cantilever", 2)},
    ]
    with pytest.raises(library.InputError, match=r'check: expected "link" in body "link1" for "finer"'):
        solve_scene(arm(2, bodies=bodies))


def test_the_check_of_a_rigid_robot_is_its_replay():
    rod = {"mass": 1.0, "inertia": 0.1, "center": [0.3, 0.0], "points": {"root": [0.0, 0.0], "tip": [0.6, 0.0]}}
    scene = library.make_scene(
        name="rod", gravity=[0.0, -9.81], body=[{"name": "rod", "rigid": rod}],
        joint=[{"name": "O", "type": "revolute", "between": ["ground", "rod.root"]}],
        trajectory=[{"name": "turn", "joint": "O", "value": "t**3"}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": 0.5, "output_step": 0.05, "check": "finer"}],
    )  # fmt: skip
    check = solve_scene(scene).analyses["inverse"].check
    assert (check.point, check.status) == ("rod.tip", "completed")
    assert check.error < 1e-6
