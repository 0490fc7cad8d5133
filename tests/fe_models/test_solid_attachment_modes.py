"""Residual attachment modes of solids: flexibility that does not depend on the number of modes, and identities."""

import numpy as np
import pytest

from ffrobot.fe_models.link import make_link

LINK = """
name = "bar"
[material]
youngs_modulus = 2.1e11
poissons_ratio = 0.3
density = 7850.0
[geometry]
kind = "solid"
length = 0.4
section = {{ shape = "rectangle", height = 0.02, width = 0.03 }}
[mesh]
size = 0.02
[reference]
condition = "{condition}"
[modes]
{count}
family = {family}
attachment_modes = true
{more}
"""
E, I_Z, I_Y, AREA, L = 2.1e11, 0.03 * 0.02**3 / 12, 0.02 * 0.03**3 / 12, 0.03 * 0.02, 0.4


@pytest.fixture
def bar(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))

    def make(condition="cantilever", count=4, family='"in-plane-bending"', more=""):
        path = tmp_path / "bar.toml"
        counted = f"count = {count}" if count else ""
        path.write_text(LINK.format(condition=condition, count=counted, family=family, more=more))
        return make_link(path).body

    return make


def flexibility(body, name, other=None):
    places = body.interfaces[name], body.interfaces[other or name]
    rows = [np.concatenate([at.translation, at.rotation]) for at in places]
    return rows[0] / np.diag(body.stiffness) @ rows[1].T


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("family", ['"in-plane-bending"', '["in-plane-bending", "axial"]', '"all"'])
def test_flexibility_does_not_depend_on_the_number_of_modes(bar, condition, family):
    few, more = bar(condition, 2, family), bar(condition, 8, family)
    expected = flexibility(more, "tip")
    rows = [1, 5] if "all" not in family else list(range(6))
    if condition == "simply-supported":  # the forces across are the supports'
        rows = [5] if "all" not in family else [0, 3, 4, 5]
    size = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))[np.ix_(rows, rows)]
    assert np.abs((flexibility(few, "tip") - expected)[np.ix_(rows, rows)] / size).max() < 2e-6
    for body in (few, more):
        assert np.abs(body.modal_mass - np.eye(body.mode_count)).max() < 1e-12
        assert np.abs(np.einsum("kkij->ij", body.S_bar_kl) - np.eye(body.mode_count)).max() < 1e-10


def test_beam_theory(bar):
    body = bar(family='"all"', count=None)
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


def test_rigid_interface_and_a_section_inside(bar):
    more = '[[interface]]\nname = "tip"\ncoupling = "rigid"\n[[interface]]\nname = "middle"\nposition = 0.2\n'
    few, many = bar(count=3, more=more), bar(count=9, more=more)
    for name in ("tip", "middle"):
        assert flexibility(few, name)[1, 1] == pytest.approx(flexibility(many, name)[1, 1], rel=2e-6)
    assert flexibility(few, "middle", "tip")[1, 5] == pytest.approx(0.2**2 / (2 * E * I_Z), rel=1e-2)


def test_interfaces_that_do_not_move_add_no_modes(bar):
    """Both at the clamped end: loads there bend nothing."""
    at_root = "position = [0.0, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]"
    more = "".join(f'[[interface]]\nname = "{name}"\n{at_root}\n' for name in ("root", "tip"))
    assert len(bar(more=more).stiffness) == 4
