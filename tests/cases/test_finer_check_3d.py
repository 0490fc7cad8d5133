"""`check = "finer"` in 3D: what inverse results leave on links with twice the modes."""

import pytest
from beam_links import beam_link, rectangle

import ffrobot as library

LENGTH, MODES = 0.7, 2


def link(modes):
    return beam_link(
        LENGTH, rectangle(0.006, 0.02), 20, nu=0.3, name="link",
        modes={"count": modes, "family": "in-plane-bending", "attachment_modes": False}, damping={"ratio": 0.005}
    )  # fmt: skip


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


@pytest.mark.parametrize("change", [{"motor": False}, {"stiffness": 1e4, "damping": 1.0, "rotor_inertia": 1e-4}])
def test_what_a_replay_cannot_do(change):
    keys = in_3d(planar(MODES, patches=False))
    keys["joint"] = [keys["joint"][0] | change]
    with pytest.raises(library.InputError, match="check: expected motors, and joints without stiffness"):
        library.solve(library.make_scene(**keys))
