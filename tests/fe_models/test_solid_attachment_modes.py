"""Residual attachment modes of solids: flexibility that does not depend on the number of modes, and identities."""

import numpy as np
import pytest
from beam_links import flexibility, rectangle, solid_link

import ffrobot

ONE_CACHE = True  # each mesh once
E, I_Z, I_Y, AREA, L = 2.1e11, 0.03 * 0.02**3 / 12, 0.02 * 0.03**3 / 12, 0.03 * 0.02, 0.4


def bar(condition="cantilever", count=4, family="in-plane-bending", interface=(), size=0.02):
    modes = {"family": family, "attachment_modes": True} | ({"count": count} if count else {})
    keys = {"name": "bar", "modes": modes, "interface": list(interface)}
    link = solid_link(L, rectangle(0.02, 0.03), {"size": size}, E=E, nu=0.3, rho=7850.0, condition=condition, **keys)
    return ffrobot.make_link(link).body


@pytest.mark.parametrize(
    ("condition", "family"),
    [("cantilever", ["in-plane-bending", "axial"]), ("cantilever", "all"), ("simply-supported", "in-plane-bending"),
     ("simply-supported", "all")],
)  # fmt: skip
def test_flexibility_does_not_depend_on_the_number_of_modes(condition, family):
    few, more = (bar(condition, count, family, size=0.04) for count in (2, 8))
    expected = flexibility(more, "tip")
    rows = [1, 5] if family != "all" else list(range(6))
    if condition == "simply-supported":  # the forces across are the supports'
        rows = [5] if family != "all" else [0, 3, 4, 5]
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))[np.ix_(rows, rows)]
    assert np.abs((flexibility(few, "tip") - expected)[np.ix_(rows, rows)] / size).max() < 2e-6
    for body in (few, more):
        assert np.abs(body.modal_mass - np.eye(body.mode_count)).max() < 1e-12
        assert np.abs(np.einsum("kkij->ij", body.S_bar_kl) - np.eye(body.mode_count)).max() < 1e-10


def test_beam_theory():
    body = bar(family="all", count=None)
    found = np.diag(flexibility(body, "tip"))
    assert found[0] == pytest.approx(L / (E * AREA), rel=5e-3)
    assert found[1] == pytest.approx(L**3 / (3 * E * I_Z), rel=6e-3)
    assert found[2] == pytest.approx(L**3 / (3 * E * I_Y), rel=6e-3)
    assert found[4] == pytest.approx(L / (E * I_Y), rel=5e-3)
    assert found[5] == pytest.approx(L / (E * I_Z), rel=5e-3)
    families = np.array(body.family)
    eigenmodes, added = families[body.residual == 0].tolist(), families[body.residual == 1].tolist()
    for family, number in (("in-plane-bending", 6), ("out-of-plane-bending", 6), ("axial", 1), ("torsion", 1)):
        assert eigenmodes.count(family) == number
    assert sorted(added) == ["axial", *["in-plane-bending"] * 2, *["out-of-plane-bending"] * 2, *["torsion"] * 2]


def test_rigid_interface_and_a_section_inside():
    places = [{"name": "tip", "coupling": "rigid"}, {"name": "middle", "position": 0.2}]
    few, many = (bar(count=count, interface=places) for count in (3, 9))
    for name in ("tip", "middle"):
        assert flexibility(few, name)[1, 1] == pytest.approx(flexibility(many, name)[1, 1], rel=2e-6)
    assert flexibility(few, "middle", "tip")[1, 5] == pytest.approx(0.2**2 / (2 * E * I_Z), rel=1e-2)


def test_interfaces_that_do_not_move_add_no_modes():
    """Both at the clamped end: loads there bend nothing."""
    at_root = {"position": [0.0, 0.0, 0.0], "normal": [-1.0, 0.0, 0.0]}
    assert len(bar(interface=[{"name": name, **at_root} for name in ("root", "tip")]).stiffness) == 4
