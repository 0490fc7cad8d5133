"""`check = "finer"` in 3D: what inverse results leave on links with twice the modes."""

import pytest
from planar_features import link, one_link

import ffrobot as library

CHECKED = {"kind": "pcid", "check": "finer"}


def solved(modes, **of_joint):
    """Of one link in 3D that turns about its root, with as many patches as modes unless its joint is changed."""
    body = {"link": link(modes={"count": modes, "family": "in-plane-bending", "attachment_modes": False})}
    _, tables = one_link(CHECKED, body, count=0 if of_joint else modes)
    tables["joint"] = [tables["joint"][0] | of_joint]
    return library.solve(library.make_scene(**tables))


def test_error_is_that_of_the_modes_left_out():
    """It falls with every mode."""
    errors = []
    for modes in (1, 3):
        with solved(modes) as results:
            errors.append(results.attributes("inverse")["check_error"])
    assert errors[0] > 4 * errors[1]


@pytest.mark.parametrize("change", [{"motor": False}, {"stiffness": 1e4, "damping": 1.0, "rotor_inertia": 1e-4}])
def test_what_a_replay_cannot_do(change):
    with pytest.raises(library.InputError, match="check: expected motors, and joints without stiffness"):
        solved(2, **change)
