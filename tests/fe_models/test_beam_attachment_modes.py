"""Residual attachment modes: closed forms of the flexibility at interfaces, identities, and what files say of them."""

import numpy as np
import pytest
from beam_links import flexibility

from ffrobot.fe_models.link import make_link

E, I_Z, L = 2.068427e11, 0.025 * 0.015**3 / 12, 1.0
ATTACHED = {"attachment_modes = false\n": ""}  # as links are unless they say otherwise
INTERFACES = "".join(f'[[interface]]\nname = "i{k}"\nposition = {0.45 + 0.005 * k}\n' for k in range(5))


@pytest.fixture
def modal_body(link_file):
    def make(replace=None, **options):
        return make_link(link_file(replace={**ATTACHED, **(replace or {})}, **options)).body

    return make


def check_identities(body):
    """Of the file, which `ModalBody` has checked to 1e-8, to rounding; signs as of eigenmodes."""
    n = body.mode_count
    assert np.abs(body.modal_mass - np.eye(n)).max() < 1e-12
    total = np.einsum("kkij->ij", body.S_bar_kl)
    assert np.abs(total - np.eye(n)).max() < 1e-10
    assert np.array_equal(body.stiffness, np.diag(np.diag(body.stiffness)))
    static = body.residual == 1
    assert np.all(np.diff(body.frequency[static]) >= 0)
    assert all(matrix.shape == (n, n) for matrix in body.geometric_stiffness.values())


@pytest.mark.parametrize("count", [1, 4, 10])
def test_cantilever_tip_is_exact_with_any_number_of_modes(modal_body, count):
    body = modal_body(condition="cantilever", count=count)
    found = flexibility(body, "tip")
    assert found[1, 1] == pytest.approx(L**3 / (3 * E * I_Z), rel=1e-9)
    assert found[5, 5] == pytest.approx(L / (E * I_Z), rel=1e-9)
    assert found[1, 5] == pytest.approx(L**2 / (2 * E * I_Z), rel=1e-9)
    assert (body.eigenmode_count, body.mode_count) == (count, count + 2)
    check_identities(body)


@pytest.mark.parametrize("count", [1, 4, 10])
def test_end_moments_of_a_simply_supported_beam_are_exact(modal_body, count):
    body = modal_body(count=count)
    for name, other in (("root", "tip"), ("tip", "root")):
        assert flexibility(body, name)[5, 5] == pytest.approx(L / (3 * E * I_Z), rel=1e-9)
        assert flexibility(body, name, other)[5, 5] == pytest.approx(-L / (6 * E * I_Z), rel=1e-9)
    assert body.mode_count == count + 2  # the forces at the supports do no work
    check_identities(body)


def test_eigenmodes_stay_as_they_are(link_file, modal_body):
    plain, body = make_link(link_file(name="plain")).body, modal_body()
    n = plain.mode_count
    assert np.array_equal(body.frequency[:n], plain.frequency)
    assert np.array_equal(body.stations.translation[..., :n], plain.stations.translation)
    assert np.array_equal(body.S_bar[:, :n], plain.S_bar)
    assert body.family == ("in-plane-bending",) * (n + 2)
    assert body.residual.tolist() == [0] * n + [1] * 2


def test_near_interfaces(modal_body):
    """Seven interfaces, five of them at 5 mm: as many shapes as say something, and the flexibility of each is there."""
    body = modal_body(more=INTERFACES)
    for k in range(5):
        a = 0.45 + 0.005 * k
        found = flexibility(body, f"i{k}")
        assert found[1, 1] == pytest.approx(a**2 * (L - a) ** 2 / (3 * E * I_Z * L), rel=1e-5)
        # Nodes are at every interface: the moment may jump there.
        assert found[5, 5] == pytest.approx((a**3 + (L - a) ** 3) / (3 * E * I_Z * L**2), rel=1e-5)
    assert 4 <= body.mode_count - body.eigenmode_count <= 12
    check_identities(body)


def test_all_families(modal_body):
    """All six loads at the tip of a cantilever, each by its own closed form."""
    body = modal_body(family="all", condition="cantilever", count=8)
    found = np.diag(flexibility(body, "tip"))
    I_y, area, G = 0.015 * 0.025**3 / 12, 0.015 * 0.025, E / 2.6
    assert found[0] == pytest.approx(L / (E * area), rel=1e-9)
    assert found[2] == pytest.approx(L**3 / (3 * E * I_y), rel=1e-9)
    assert found[4] == pytest.approx(L / (E * I_y), rel=1e-9)
    J = 0.025 * 0.015**3 * (1 / 3 - 0.21 * 0.6 * (1 - 0.6**4 / 12))  # Roark, within 0.5 %
    assert found[3] == pytest.approx(L / (G * J), rel=5e-3)
    added = np.array(body.family)[body.residual == 1].tolist()
    assert sorted(added) == ["axial", *["in-plane-bending"] * 2, *["out-of-plane-bending"] * 2, *["torsion"] * 2]
    check_identities(body)


def test_timoshenko_with_masses(modal_body):
    more = '[model]\ntheory = "timoshenko"\n[[interface]]\nname = "tip"\nmass = 2.0\ninertia = [0.0, 0.0, 0.01]\n'
    body = modal_body(condition="cantilever", count=3, more=more)
    shear = L / (5 / 6 * E / 2.6 * 0.015 * 0.025)
    assert flexibility(body, "tip")[1, 1] == pytest.approx(L**3 / (3 * E * I_Z) + shear, rel=2e-3)
    check_identities(body)


@pytest.mark.parametrize("count", [4, 10])
def test_stress_of_end_loads(modal_body, count):
    """M y / I of a moment and of a force at the tip, next to it too, where eigenmodes have nothing."""
    more = "[stress.points]\nnear = [0.2, 0.0075, 0.0]\nend = [0.995, 0.0075, 0.0]\n"
    body = modal_body(condition="cantilever", count=count, more=more)
    for point, x in (("near", 0.2), ("end", 0.995)):
        for row, moment in (("rotation", 10.0), ("translation", 10.0 * (L - x))):
            load = getattr(body.interfaces["tip"], row)[2 if row == "rotation" else 1]
            stress = body.stress[point].stress @ (10.0 * load / np.diag(body.stiffness))
            assert stress[0] == pytest.approx(-moment * 0.0075 / I_Z, rel=1e-9)


def test_damping(modal_body):
    given = modal_body(more="[damping]\nratio = [0.01, 0.02, 0.03]\n", count=3)
    assert given.damping_ratio.tolist() == [0.01, 0.02, 0.03, 0.03, 0.03]
    rayleigh = modal_body(more="[damping]\nrayleigh = [1.0, 1e-5]\n", count=3)
    omega = 2 * np.pi * rayleigh.frequency
    assert rayleigh.damping_ratio == pytest.approx(0.5 / omega + 0.5e-5 * omega)
