"""Stresses and attached masses of a solid link, from its file on, against the same link as a beam."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle, solid_link

import ffrobot

KEYS = {
    "name": "arm",
    "modes": {"count": 3, "family": "in-plane-bending", "attachment_modes": False},
    "interface": [
        {"name": "tip", "mass": 0.7, "inertia": [2e-3, 1e-3, 3e-3]},
        {"name": "hub", "position": 0.4, "mass": 0.3},
    ],
}
STEEL = {"E": 2.0e11, "nu": 0.3, "rho": 7800.0, "condition": "simply-supported"}
POINTS = {"top": [0.3, 0.015, 0.0], "edge": [0.62, -0.015, 0.01], "axis": [0.2, 0.0, 0.0]}


@pytest.fixture(scope="module")
def pair():
    section, stress = rectangle(0.03, 0.02), {"points": POINTS}
    beam = beam_link(1.0, section, 40, **STEEL, **KEYS, model={"theory": "timoshenko"}, stress=stress)
    solid = solid_link(1.0, section, {"size": 0.025}, **STEEL, **KEYS, stress=stress | {"surface": True})
    return [ffrobot.make_link(link).body for link in (beam, solid)]


def test_masses_are_those_of_the_beam(pair):
    beam, solid = pair
    assert solid.mass == pytest.approx(7800.0 * 0.03 * 0.02 + 1.0, rel=1e-10)
    np.testing.assert_allclose(solid.frequency, beam.frequency, rtol=2e-3)
    np.testing.assert_allclose(solid.second_moment, beam.second_moment, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(solid.S_bar[1], beam.S_bar[1], rtol=2e-3, atol=2e-3)
    # The tension of a solid works on the axial strain of bending too, which beams leave out: N ∫(w'² + θ'² I/A), that
    # is (kπ)² h²/12L² more, 0.7 % in mode 3.
    for load in ("omega_zz", "t_x", "force/tip/x"):
        scale = np.abs(beam.geometric_stiffness[load]).max()
        np.testing.assert_allclose(
            solid.geometric_stiffness[load], beam.geometric_stiffness[load], atol=1e-2 * scale, err_msg=load
        )


def test_spin_about_the_axis_stiffens_as_in_the_beam(pair):
    """What sections that tilt lose of their height: by their rotation in beams, by stresses across it in solids."""
    found, expected = (body.geometric_stiffness["omega_xx"] for body in (pair[1], pair[0]))
    np.testing.assert_allclose(found, expected, atol=5e-4 * np.abs(expected).max())


@pytest.mark.parametrize("name", ["top", "edge"])
def test_bending_stress_is_that_of_the_beam(pair, name):
    beam, solid = (body.stress[name].stress for body in pair)
    scale = np.abs(beam[0]).max()
    np.testing.assert_allclose(solid[0], beam[0], atol=1e-2 * scale)
    np.testing.assert_allclose(solid[1:], 0.0, atol=2e-2 * scale)


def test_shear_stress_on_the_axis_is_that_of_the_beam(pair):
    """Beams give the mean along the chord; in its middle Timoshenko & Goodier, §124, with a = h/2, b = w/2 have

    1 − ν/(1 + ν) b²/a² [1/3 + 4/π² Σ (−1)ⁿ/(n² cosh nπa/b)] of it: 0.9666 for this section.
    """
    beam, solid = (body.stress["axis"].stress for body in pair)
    ratio, n = 0.03 / 0.02, np.arange(1, 20)
    series = 1 / 3 + 4 / np.pi**2 * np.sum((-1.0) ** n / (n**2 * np.cosh(n * np.pi * ratio)))
    np.testing.assert_allclose(solid[5] / beam[5], 1 - 0.3 / 1.3 / ratio**2 * series, rtol=5e-3)


def test_surface_holds_what_the_points_on_it_have(pair):
    solid = pair[1]
    assert solid.surface_stress.shape == (len(solid.mesh.points), 6, 3)
    edge = solid.stress["edge"]
    near = np.argsort(np.linalg.norm(solid.mesh.points - edge.position, axis=1))[:4]
    # Bending: σ_xx is proportional to y, and changes along x over these 5 mm by up to 7 %, in mode 3.
    expected = solid.mesh.points[near, 1, None] / edge.position[1] * edge.stress[0]
    np.testing.assert_allclose(solid.surface_stress[near, 0], expected, atol=0.08 * np.abs(edge.stress).max())
