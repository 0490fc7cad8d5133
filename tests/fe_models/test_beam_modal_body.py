"""Modal bodies of beams: inertia, signs, stations and their identities."""

import numpy as np
import pytest

from ffrobot.fe_models.link import make_link

STEPPED = """
[[geometry.segment]]
until = 0.4
section = { shape = "rectangle", height = 0.03, width = 0.025 }
[[geometry.segment]]
until = 1.0
section = { shape = "rectangle", height = 15e-3, width = 25e-3 }
"""
STEPPED_LINK = {"replace": {'section = { shape = "rectangle", height = 0.015, width = 0.025 }': ""}, "more": STEPPED}
TIMOSHENKO = '[model]\ntheory = "timoshenko"\n'


@pytest.fixture
def modal_body(link_file):
    return lambda **options: make_link(link_file(**options)).body


def sampled(body, points=2001):
    """Φ on the axis at many points through the public interpolation, and Simpson weights of the integral over x."""
    x = np.linspace(0, body.length, points)
    weights = np.ones(points)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    values = [body.interpolate(float(point)) for point in x]
    return (
        x,
        weights * body.length / (points - 1) / 3,
        np.array([v.translation for v in values]),
        np.array([v.rotation for v in values]),
    )


def test_the_papers_link(modal_body):
    """Table 2: mass 2.94375 kg, moment of inertia about the root 0.98125 kg·m² = mL²/3."""
    body = modal_body()
    assert body.mass == pytest.approx(2.94375, rel=1e-14)
    np.testing.assert_allclose(body.first_moment, [2.94375 / 2, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(body.second_moment, np.diag([0.98125, 0, 0]), rtol=1e-14)
    np.testing.assert_allclose(2 * np.pi * body.frequency[:3], [219.37434, 877.50293, 1974.43545], rtol=3e-8)
    np.testing.assert_allclose(body.modal_mass, np.eye(10), atol=1e-13)
    np.testing.assert_allclose(np.einsum("kkmn->mn", body.S_bar_kl), np.eye(10), atol=1e-13)
    assert body.family == ("in-plane-bending",) * 10
    assert np.all(body.stations.height == 0.015)


CASES = {
    "all": {"family": "all", "count": 30},
    "all, cantilever": {"family": "all", "count": 30, "condition": "cantilever"},
    "stepped": {"family": "all", "count": 12, **STEPPED_LINK},
}


@pytest.mark.parametrize("options", CASES.values(), ids=CASES)
def test_line_mass_invariants_against_direct_integration(modal_body, options):
    body = modal_body(**options)
    x, weights, Phi, rotation = sampled(body)
    width = 0.025
    height = np.where(x < 0.4, 0.03, 0.015) if "more" in options else np.full_like(x, 0.015)
    density = 7850.0 * width * height
    if "more" in options:  # x = 0.4 belongs to both sides
        density[np.argmin(np.abs(x - 0.4))] = 7850.0 * width * (0.03 + 0.015) / 2
        height[np.argmin(np.abs(x - 0.4))] = np.nan
    rhoA = weights * density
    assert body.mass == pytest.approx(rhoA.sum(), rel=1e-12)
    assert body.second_moment[0, 0] == pytest.approx(rhoA @ x**2, rel=1e-9)
    scale = np.sqrt(body.mass)
    np.testing.assert_allclose(body.S_bar, np.einsum("i,ikn->kn", rhoA, Phi), atol=1e-7 * scale)
    np.testing.assert_allclose(body.I_bar[0], np.einsum("i,i,ikn->kn", rhoA, x, Phi), atol=1e-7 * scale)
    assert not np.any(body.I_bar[1:])
    S_bar_kl = np.einsum("i,ikm,iln->klmn", rhoA, Phi, Phi)
    planar = body.S_bar_kl[:2, :2]
    np.testing.assert_allclose(planar, S_bar_kl[:2, :2], atol=1e-6)
    if "more" not in options:
        rhoI_p = weights * 7850.0 * (width * 0.015**3 + 0.015 * width**3) / 12
        S_bar_kl[2, 2] += np.einsum("i,im,in->mn", rhoI_p, rotation[:, 0], rotation[:, 0])
        np.testing.assert_allclose(body.S_bar_kl, S_bar_kl, atol=1e-6)
        twist = rotation[:, 0]
        assert body.J_spin == pytest.approx(rhoI_p.sum(), rel=1e-9)
        np.testing.assert_allclose(body.h_spin, rhoI_p @ twist, atol=1e-7 * np.sqrt(body.J_spin))
        np.testing.assert_allclose(body.S_spin, np.einsum("i,im,in->mn", rhoI_p, twist, twist), atol=1e-6)


def test_spin_inertia_of_steps_by_sections(modal_body):
    """A link without torsion modes has the spin inertia of its sections all the same: rigid in twist, not massless."""
    body = modal_body(family="in-plane-bending", count=3, **STEPPED_LINK)
    I_p = [(0.025 * height**3 + height * 0.025**3) / 12 for height in (0.03, 0.015)]
    assert body.J_spin == pytest.approx(7850.0 * (0.4 * I_p[0] + 0.6 * I_p[1]), rel=1e-12)
    assert not np.any(body.h_spin)
    assert not np.any(body.S_spin)


@pytest.mark.parametrize("condition", ["simply-supported", "cantilever"])
def test_timoshenko_invariants_against_integration_over_the_volume(modal_body, condition):
    """Sum over a Gauss grid of the section: points (x, y, z) move by u + θ × (0, y, z)."""
    body = modal_body(family="all", count=25, condition=condition, more=TIMOSHENKO)
    x, weights, u, theta = sampled(body)
    gauss = np.array([-1, 1]) / np.sqrt(3)
    J2, I_bar, S_bar_kl = np.zeros((3, 3)), np.zeros((3, 3, 25)), np.zeros((3, 3, 25, 25))
    for y in gauss * 0.015 / 2:
        for z in gauss * 0.025 / 2:
            rho = weights * 7850.0 * 0.015 * 0.025 / 4
            points = np.stack([x, np.full_like(x, y), np.full_like(x, z)], axis=1)
            arm = np.broadcast_to(np.array([0, y, z])[None, :, None], theta.shape)
            Phi = u + np.cross(theta, arm, axis=1)
            J2 += np.einsum("i,ik,il->kl", rho, points, points)
            I_bar += np.einsum("i,ik,iln->kln", rho, points, Phi)
            S_bar_kl += np.einsum("i,ikm,iln->klmn", rho, Phi, Phi)
    np.testing.assert_allclose(body.second_moment, J2, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(body.I_bar, I_bar, atol=1e-7)
    np.testing.assert_allclose(body.S_bar_kl, S_bar_kl, atol=1e-6)
    np.testing.assert_allclose(np.einsum("kkmn->mn", body.S_bar_kl), np.eye(25), atol=1e-12)


@pytest.mark.parametrize("theory", ["", TIMOSHENKO])
@pytest.mark.parametrize("condition", ["simply-supported", "cantilever"])
def test_reference_conditions_hold_exactly(modal_body, condition, theory):
    body = modal_body(family="all", count=25, condition=condition, more=theory)
    root, tip = body.interfaces["root"], body.interfaces["tip"]
    assert not np.any(root.translation)
    assert not np.any(root.rotation[0])
    if condition == "cantilever":
        assert not np.any(root.rotation)
    else:
        assert not np.any(tip.translation[1:])


def test_all_families_merged_lowest_first(modal_body):
    every = modal_body(family="all", count=30)
    assert set(every.family) == {"in-plane-bending", "out-of-plane-bending", "axial", "torsion"}
    assert np.all(np.diff(every.frequency) >= 0)
    alone = modal_body(family="torsion", count=2)
    np.testing.assert_allclose(every.frequency[[f == "torsion" for f in every.family]][:2], alone.frequency, rtol=1e-13)
    picked = modal_body(family="all", replace={"count = 10": "indices = [2, 5, 30]"})
    np.testing.assert_allclose(picked.frequency, every.frequency[[1, 4, 29]], rtol=1e-13)


def test_equal_frequencies_are_told_apart_by_family(modal_body):
    body = modal_body(family="all", count=6, section='{ shape = "circle", diameter = 0.02 }')
    assert body.family == ("in-plane-bending", "out-of-plane-bending") * 3


def test_signs_are_canonical(modal_body):
    body = modal_body(family="all", count=30, condition="cantilever")
    for k, family in enumerate(body.family):
        rows = body.stations.rotation if family == "torsion" else body.stations.translation
        axis = {"in-plane-bending": 1, "out-of-plane-bending": 2}.get(family, 0)
        values = rows[:, axis, k]
        assert values[np.argmax(np.abs(values) > np.abs(values).max() / 2)] > 0


def test_extents_and_rigidities_of_the_sections(modal_body):
    """Heights by segment; E b³h/12 across the plane; J = b h³ (1/3 − 0.21 h/b (1 − h⁴/12b⁴)) (Roark)."""
    stepped = modal_body(count=3, **STEPPED_LINK).stations
    np.testing.assert_array_equal(stepped.height, np.where(stepped.position[:, 0] < 0.4, 0.03, 0.015))
    stations, E = modal_body(count=3).stations, 2.068427e11
    np.testing.assert_array_equal(stations.width, 0.025)
    np.testing.assert_allclose(stations.out_of_plane_rigidity, E * 0.015 * 0.025**3 / 12, rtol=1e-14)
    J = 0.025 * 0.015**3 * (1 / 3 - 0.21 * 0.6 * (1 - 0.6**4 / 12))
    np.testing.assert_allclose(stations.torsional_rigidity, E / 2.6 * J, rtol=4e-3)


@pytest.mark.parametrize(
    ("change", "factor"),
    [
        (("2.068427e11", "1e-30"), (1e-30 / 2.068427e11) ** 0.5),
        (("height = 0.015", "height = 1e-30"), 1e-30 / 0.015),
        (("height = 0.015", "height = 1e-20"), 1e-20 / 0.015),
    ],
)
def test_no_value_is_too_small(modal_body, change, factor):
    """Frequencies of bending go with the height, and with the root of E."""
    expected = modal_body().frequency * factor
    np.testing.assert_allclose(modal_body(replace=dict([change])).frequency, expected, rtol=1e-8)
