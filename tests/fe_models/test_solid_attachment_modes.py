"""Residual attachment modes of solids: flexibility of beam theory, whatever the number of modes."""

import numpy as np
import pytest
from beam_links import flexibility, rectangle, solid_link

import ffrobot

ONE_CACHE = True  # each mesh once
E, I_Z, I_Y, AREA, L = 2.1e11, 0.03 * 0.02**3 / 12, 0.02 * 0.03**3 / 12, 0.03 * 0.02, 0.4


def bar(count=4, family="in-plane-bending", interface=()):
    modes = {"family": family, "attachment_modes": True} | ({"count": count} if count else {})
    keys = {"name": "bar", "modes": modes, "interface": list(interface)}
    link = solid_link(L, rectangle(0.02, 0.03), {"size": 0.02}, E=E, nu=0.3, rho=7850.0, **keys)
    return ffrobot.make_link(link).body


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
