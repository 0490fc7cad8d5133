"""Modal stresses of beams, and their sections: closed forms, resultants, tables of torsion and shear, bad input."""

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.fe_models.beam.section_stress import section_stress
from ffrobot.fe_models.link import make_link
from ffrobot.fe_models.link_file import read_link
from ffrobot.fe_models.link_records.section import rectangle, tube
from ffrobot.mesh.records import CircleSection, RectangleSection, TubeSection

E, NU, RHO, H, B = 2.068427e11, 0.3, 7850.0, 0.015, 0.025
RHO_A = RHO * H * B
CIRCLE = '{ shape = "circle", diameter = 0.02 }'


@pytest.fixture
def body(link_file):
    def compute(points, more="", **keys):
        entries = ", ".join(f"{name} = {list(map(float, point))}" for name, point in points.items())
        return make_link(link_file(more=f"[stress]\npoints = {{ {entries} }}\n{more}", **keys), force=True).body

    return compute


def test_cantilever_at_its_root(body):
    """v'' = 2 β²/√(ρAL) there (Blevins, Formulas for natural frequency, table 8-1); the upper fibre is pressed."""
    beta = np.array([1.8751040687, 4.6940911330, 7.8547574382])
    expected = -E * H / 2 * 2 * beta**2 / np.sqrt(RHO_A)
    errors = []
    for elements in (10, 20):
        point = body({"top": (0, H / 2, 0)}, condition="cantilever", count=3, elements=elements).stress["top"]
        errors.append(np.abs(np.abs(point.stress[0] / expected) - 1))
        assert point.stress[0, 0] < 0  # the first mode bends upwards: signs are canonical
        np.testing.assert_array_equal(point.stress[1:], 0.0)
        np.testing.assert_allclose(point.strain[:3], np.outer([1, -NU, -NU], point.stress[0] / E), rtol=1e-14)
    assert np.all(np.log2(errors[0] / errors[1]) > 3.7)
    assert errors[1].max() < 5e-5


def test_axial_and_torsional_modes(body):
    """Of a clamped bar of the length 1: sin(kx), k = π/2, 3π/2, scaled to ∫ ρA u² = 1, or ∫ ρI_p φ² = 1."""
    k = np.pi * np.array([0.5, 1.5])
    axial = body({"a": (0.2, 0, 0)}, family="axial", condition="cantilever", count=2).stress["a"].stress
    np.testing.assert_allclose(axial[0], E * np.sqrt(2 / RHO_A) * k * np.cos(0.2 * k), rtol=1e-6)
    np.testing.assert_array_equal(axial[1:], 0.0)
    points = {"side": (0.2, 0, 0.01), "top": (0.2, 0.01, 0)}
    torsion = body(points, section=CIRCLE, family="torsion", condition="cantilever", count=2).stress
    G, I_p = E / 2 / (1 + NU), np.pi * 0.01**4 / 2
    tau = G * 0.01 * np.sqrt(2 / (RHO * I_p)) * k * np.cos(0.2 * k)
    np.testing.assert_allclose(torsion["top"].stress[4], tau, rtol=1e-6)
    np.testing.assert_allclose(torsion["side"].stress[5], -tau, rtol=1e-6)


def test_simply_supported_beam_away_from_nodes(body):
    k = np.pi * np.arange(1, 5)
    top, side = (body({"a": (0.33, y, 0.01)}, count=4, elements=40).stress["a"] for y in (H / 2, 0.0))
    amplitude = np.sqrt(2 / RHO_A)
    np.testing.assert_allclose(top.stress[0], E * H / 2 * amplitude * k**2 * np.sin(0.33 * k), rtol=2e-4)
    V = -E * B * H**3 / 12 * -amplitude * k**3 * np.cos(0.33 * k)  # −EI v'''
    np.testing.assert_allclose(side.stress[5], 1.5 * V / (B * H), rtol=2e-4)
    np.testing.assert_allclose(side.strain[5], side.stress[5] * 2 * (1 + NU) / E, rtol=1e-14)


def test_hub_on_a_simply_supported_root_takes_the_moment(body):
    more = '[[interface]]\nname = "root"\ninertia = [0.0, 0.0, 0.01]\n'
    hub = body({"top": (0, H / 2, 0)}, count=3, more=more, elements=40)
    M = -((2 * np.pi * hub.frequency) ** 2) * 0.01 * hub.interfaces["root"].rotation[2]
    np.testing.assert_allclose(hub.stress["top"].stress[0], -M * H / 2 / (B * H**3 / 12), rtol=1e-4)


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
def test_timoshenko_agrees_with_the_curvature_of_its_modes(body, condition):
    """σ = −E y θ' with θ' from the rotations in the file, where θ' of quadratic elements is best: at a Gauss point."""
    x = 0.31875 + 0.00625 / np.sqrt(3)
    more = '[model]\ntheory = "timoshenko"\n'
    found = body({"a": (x, H / 2, 0)}, condition=condition, count=3, elements=80, more=more)
    ends = [found.interpolate(x + step).rotation[2] for step in (-1e-3, 1e-3)]
    np.testing.assert_allclose(found.stress["a"].stress[0], -E * H / 2 * (ends[1] - ends[0]) / 2e-3, rtol=1e-3)


def test_stepped_beam_jumps_with_its_section(link_file):
    """The moment is continuous at the step, the section modulus is not."""
    steps = """[[geometry.segment]]
until = 0.5
section = { shape = "rectangle", height = 0.02, width = 0.025 }
[[geometry.segment]]
until = 1.0
section = { shape = "rectangle", height = 0.01, width = 0.025 }
"""
    replaced = {'section = { shape = "rectangle", height = 0.015, width = 0.025 }': ""}
    more = f"{steps}\n[stress]\npoints = {{ before = [0.49999999, 0.005, 0.0], at = [0.5, 0.005, 0.0] }}\n"
    stress = make_link(link_file(count=3, replace=replaced, more=more)).body.stress
    np.testing.assert_allclose(stress["at"].stress[0], 8 * stress["before"].stress[0], rtol=1e-5)


SECTIONS = {
    "flat": (RectangleSection(shape="rectangle", height=0.01, width=0.03), rectangle(0.01, 0.03, NU)),
    "tall": (RectangleSection(shape="rectangle", height=0.03, width=0.01), rectangle(0.03, 0.01, NU)),
    "circle": (CircleSection(shape="circle", diameter=0.02), tube(0.02, 0.0, NU)),
    "tube": (TubeSection(shape="tube", outer=0.02, inner=0.014), tube(0.02, 0.014, NU)),
}


def quadrature(record):
    """Points and weights over a section."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    if isinstance(record, RectangleSection):
        y, z = record.height / 2 * nodes, record.width / 2 * nodes
        area = np.outer(weights, weights) * record.height * record.width / 4
        return [(a, b, w) for a, row in zip(y, area, strict=True) for b, w in zip(z, row, strict=True)]
    inner, outer = (record.inner / 2, record.outer / 2) if isinstance(record, TubeSection) else (0.0, 0.01)
    angles = (np.arange(96) + 0.5) * 2 * np.pi / 96
    radii, scale = (inner + outer) / 2 + (outer - inner) / 2 * nodes, (outer - inner) / 2 * weights
    return [
        (r * np.cos(a), r * np.sin(a), r * w * 2 * np.pi / 96)
        for r, w in zip(radii, scale, strict=True)
        for a in angles
    ]


@pytest.mark.parametrize("name", SECTIONS)
def test_stresses_add_up_to_the_section_forces(name):
    """One unit force or moment a column."""
    record, section = SECTIONS[name]
    unit = np.eye(6)
    F, M = np.zeros((3, 6)), np.zeros((3, 6))
    for y, z, area in quadrature(record):
        stress = area * section_stress(record, section, unit[:3], unit[3:], y, z)
        xx, xz, xy = stress[0], stress[4], stress[5]
        F += [xx, xy, xz]
        M += [y * xz - z * xy, z * xx, -y * xx]
    exact = 1e-6 if isinstance(record, RectangleSection) else 2e-3  # the chord mean has a kink at the hole
    np.testing.assert_allclose(F, unit[:3], atol=exact)
    np.testing.assert_allclose(M, unit[3:], atol=exact)


@pytest.mark.parametrize(("ratio", "k"), [(1.0, 0.675), (1.5, 0.848), (2.0, 0.930), (3.0, 0.985), (10.0, 1.000)])
@pytest.mark.parametrize("tall", [False, True])
def test_largest_shear_of_rectangles_in_torsion(ratio, k, tall):
    """k of τ_max = 2 k G φ' a, in the middle of the longer side (Timoshenko & Goodier, §109, table)."""
    a = 0.01
    height, width = (2 * a * ratio, 2 * a) if tall else (2 * a, 2 * a * ratio)
    record, section = RectangleSection(shape="rectangle", height=height, width=width), rectangle(height, width, NU)
    torque = np.zeros((3, 1))
    torque[0] = section.torsion
    y, z = (0.0, a) if tall else (a, 0.0)
    stress = section_stress(record, section, np.zeros((3, 1)), torque, y, z)[:, 0]
    tau, other = (-stress[5], stress[4]) if tall else (stress[4], stress[5])
    assert tau == pytest.approx(2 * k * a, rel=1e-3)
    assert other == pytest.approx(0.0, abs=1e-9)
    corner = section_stress(record, section, np.zeros((3, 1)), torque, height / 2, width / 2)
    np.testing.assert_allclose(corner, 0.0, atol=2.1e-4 * a)  # 16a/π² Σ n⁻² over the odd n > 4000 left out


@pytest.mark.parametrize(
    ("section", "point", "message"),
    [
        (None, (1.2, 0, 0), r"stress\.points\.a: expected x within the length, 0 … 1 m, found 1\.2 m"),
        (None, (0.5, 0.01, 0), r"stress\.points\.a: expected y, z within the section, a rectangle, at x = 0\.5 m"),
        (CIRCLE, (0.5, 0.008, 0.008), "within the section, a circle"),
        ('{ shape = "tube", outer = 0.02, inner = 0.01 }', (0.5, 0, 0), "within the section, a tube"),
    ],
)
def test_points_outside_the_beam(link_file, section, point, message):
    keys = {} if section is None else {"section": section}
    path = link_file(more=f"[stress]\npoints = {{ a = {list(map(float, point))} }}\n", **keys)
    with pytest.raises(InputError, match=message):
        read_link(path)


def test_rectangle():
    section = rectangle(0.015, 0.025, 0.3)
    assert section.I_yy == pytest.approx(0.025 * 0.015**3 / 12)
    assert section.I_zz == pytest.approx(0.015 * 0.025**3 / 12)
    assert section.shear == pytest.approx(0.8497, abs=5e-5)


def test_circle_and_thin_tube():
    circle = tube(0.02, 0.0, 0.3)
    assert circle.I_yy == circle.I_zz == pytest.approx(np.pi * 0.02**4 / 64)
    assert circle.torsion == circle.I_p == pytest.approx(np.pi * 0.02**4 / 32)
    assert circle.shear == pytest.approx(0.886, abs=5e-4)
    thin = tube(0.02, 0.0199, 0.3)
    assert thin.area == pytest.approx(np.pi * 0.01995 * 0.00005, rel=1e-6)
    assert thin.torsion == pytest.approx(2 * np.pi * 0.009975**3 * 0.00005, rel=1e-4)
    assert thin.shear == pytest.approx(2 * 1.3 / (4 + 3 * 0.3), rel=1e-4)
