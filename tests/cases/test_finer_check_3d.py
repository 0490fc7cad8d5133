"""`check = "finer"` in 3D: what inverse results leave on links with twice the modes."""

import json

import pytest

import ffrobot as library

LENGTH, MODES = 0.7, 2


def link(modes):
    return {
        "name": "link",
        "material": {"youngs_modulus": 70e9, "poissons_ratio": 0.3, "density": 2700.0},
        "geometry": {
            "kind": "beam", "length": LENGTH, "section": {"shape": "rectangle", "height": 0.006, "width": 0.02},
        },
        "mesh": {"elements": 20},
        "reference": {"condition": "cantilever"},
        "modes": {"count": modes, "family": "in-plane-bending", "attachment_modes": False},
        "damping": {"ratio": 0.005},
    }  # fmt: skip


LAYOUT = {"length": 0.05, "width": 0.02, "thickness": 5e-4, "modulus": 63e9, "d31": 110e-12, "structural": False}
LAW = "0.4 + 0.5*(10*t**3-15*t**4+6*t**5)"


def planar(modes, kind="pcid", patches=True, **keys):
    """One link that turns about its root, in the plane."""
    return {
        "name": "turn",
        "space": "planar",
        "gravity": [0.0, -9.81],
        "body": [{"name": "link", "link": link(modes)}],
        "joint": [{"name": "O", "type": "revolute", "between": ["ground", "link.root"]}],
        "payload": [{"point": "link.tip", "mass": 0.2}],
        "initial": {"state": "static", "angles": {"link": 0.4}},
        "trajectory": [{"name": "turn", "joint": "O", "value": LAW}],
        "pzt": [{"body": "link", "count": modes, **LAYOUT}] if patches else [],
        "analysis": [
            {"name": "inverse", "kind": kind, "end": 1.0, "output_step": 0.01, "tolerance": 1e-6, "check": "finer"}
            | keys
        ],
    }


def in_3d(tables):
    """The same with y up, and the motion about z."""
    keys = tables | {"space": "spatial", "gravity": [*tables["gravity"], 0.0]}
    keys["initial"] = {"state": "static", "joints": {"O": 0.4}}
    keys["joint"] = [joint | {"axis": [0.0, 0.0, 1.0]} for joint in tables["joint"]]
    return keys


def checked(keys):
    with library.solve(library.make_scene(**keys)) as results:
        about = results.attributes("inverse")
        return {name: about[f"check_{name}"] for name in ("modes", "point", "error", "status")}


def test_error_is_that_of_the_modes_left_out():
    """It falls with every mode."""
    errors = [checked(in_3d(planar(modes)))["error"] for modes in (1, 3)]
    assert errors[0] > 4 * errors[1]


def test_it_is_told_and_kept(tmp_path, ffrobot):
    path = tmp_path / "scene.toml"
    path.write_text(library.make_scene(**in_3d(planar(MODES))).text, encoding="utf-8")
    done = ffrobot("solve", path, "--verbose")
    assert done.returncode == 0, done.stderr
    assert "inverse, forward simulation on 4 modes: link.tip is off by" in " ".join(done.stdout.split())
    with library.Results(path.with_suffix(".results.h5")) as results:
        assert json.loads(results.attributes("inverse")["check_modes"]) == {"link": 4}


def test_modal_body_files_cannot_be_refined(tmp_path):
    library.make_link(link(MODES), tmp_path / "link.h5")
    keys = in_3d(planar(MODES)) | {"body": [{"name": "link", "modal": str(tmp_path / "link.h5")}]}
    with pytest.raises(library.InputError, match=r'check: expected "link" in body "link" for "finer"'):
        library.solve(library.make_scene(**keys))


@pytest.mark.parametrize("change", [{"motor": False}, {"stiffness": 1e4, "damping": 1.0, "rotor_inertia": 1e-4}])
def test_what_a_replay_cannot_do(change):
    keys = in_3d(planar(MODES, patches=False))
    keys["joint"] = [keys["joint"][0] | change]
    with pytest.raises(library.InputError, match="check: expected motors, and joints without stiffness"):
        library.solve(library.make_scene(**keys))
