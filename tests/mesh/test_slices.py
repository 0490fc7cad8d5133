"""Cross sections of solid meshes: area and moments, exactly where faces are plane."""

import time
from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI
from solid_parts import integrate, rectangle

from ffrobot.mesh.compat import create_solid_mesh
from ffrobot.mesh.records import CircleSection, Hole, TubeSection
from ffrobot.mesh.slices import section_quadratures
from ffrobot.mesh.structured import structured_box

CELLS = ("tetrahedron", "hexahedron")
BOX, TAPER = ((0.015, 0.025), (0.015, 0.025)), ((0.03, 0.05), (0.015, 0.025))  # (height, width) of root and tip


def dolfinx_mesh(part):
    return create_solid_mesh(MPI.COMM_SELF, part.cell, part.degree, part.cells, part.points)


def section_quadrature(mesh, x, degree):
    (section,) = section_quadratures(mesh, np.array([x]), degree)
    return section


def moments(section):
    """Area, ∫y, ∫z, ∫y², ∫z², ∫yz."""
    y, z, w = section.points[:, 1], section.points[:, 2], section.weights
    return np.array([w.sum(), w @ y, w @ z, w @ y**2, w @ z**2, w @ (y * z)])


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize(
    ("ends", "x"),
    [*((BOX, x) for x in (0.0, 1e-12, 0.05, 0.1, 1 / 3, 0.5, 0.7777, 1 - 1e-12, 1.0)),
     *((TAPER, x) for x in (0.0, 0.1, 0.456, 1.0))],
)  # fmt: skip
def test_sections_are_exact_also_in_planes_of_the_mesh(cell, ends, x):
    mesh = dolfinx_mesh(structured_box(1.0, *ends, (10, 2, 3), cell))
    h, w = ((1 - x) * root + x * tip for root, tip in zip(*ends, strict=True))
    section = section_quadrature(mesh, x, 2)
    expected = h * w * np.array([1, 0, 0, h**2 / 12, w**2 / 12, 0])
    np.testing.assert_allclose(moments(section), expected, rtol=1e-12, atol=1e-19)
    np.testing.assert_allclose(section.points[:, 0], x, atol=1e-9)
    np.testing.assert_allclose(section.y_range, [-h / 2, h / 2], atol=1e-15)
    np.testing.assert_allclose(section.z_range, [-w / 2, w / 2], atol=1e-15)


def test_a_step_is_seen_from_the_larger_x():
    """Two boxes of height 1 and 2 that meet at x = 1: the section there is the second's."""
    box = structured_box(2.0, (2, 1), (2, 1), (2, 4, 1), "tetrahedron")
    middle = box.points[box.corners].mean(axis=1)
    kept = (middle[:, 0] > 1) | (np.abs(middle[:, 1]) < 0.5)
    mesh = dolfinx_mesh(replace(box, cells=box.cells[kept], cell_tag=box.cell_tag[kept]))
    for x, height in ((0.0, 1), (0.999, 1), (1.0, 2), (1.5, 2), (2.0, 2)):
        section = section_quadrature(mesh, x, 2)
        assert section.weights.sum() == pytest.approx(height)
        assert section.y_range == pytest.approx((-height / 2, height / 2))


def test_the_degree_is_that_of_the_rule():
    """∫ y⁴ z² dA over a rectangle needs degree 6: lower rules miss it."""
    mesh = dolfinx_mesh(structured_box(1.0, (1, 1), (1, 1), (1, 1, 1), "tetrahedron"))
    exact = 2 * 0.5**5 / 5 * 2 * 0.5**3 / 3
    errors = []
    for degree in (2, 4, 6):
        s = section_quadrature(mesh, 0.3, degree)
        errors.append(abs(s.weights @ (s.points[:, 1] ** 4 * s.points[:, 2] ** 2) / exact - 1))
    assert errors[2] < 1e-12 < 1e-4 < errors[0]


@pytest.mark.parametrize(
    ("geometry", "x", "expected"),
    [
        ({"section": CircleSection(shape="circle", diameter=0.05)}, 0.377, np.pi * 0.025**2),
        ({"section": TubeSection(shape="tube", outer=0.05, inner=0.03)}, 0.377, np.pi * (0.025**2 - 0.015**2)),
        ({"section": rectangle(0.06, 0.02), "hole": (Hole(position=0.5, diameter=0.04),)}, 0.5, 0.02 * 0.02),
        (
            {"section": rectangle(0.06, 0.02), "hole": (Hole(position=0.5, diameter=0.04),)},
            0.512,
            0.02 * (0.06 - 2 * np.sqrt(0.02**2 - 0.012**2)),
        ),
    ],
)
def test_curved_cells_are_cut_where_they_are_curved(solid, mesh_part, geometry, x, expected):
    part = mesh_part(solid(**geometry))
    assert part.degree == 2
    section = section_quadrature(dolfinx_mesh(part), x, 4)
    assert section.weights.sum() == pytest.approx(expected, rel=2e-3)
    np.testing.assert_allclose(section.points[:, 0], x, atol=2e-5)


def test_sections_add_up_to_the_volume(solid, mesh_part):
    """∫ A dx by Gauss points within a hole; with 8 elements around it 9e-6 off, with five times as many 3e-7."""
    part = mesh_part(solid(section=rectangle(0.06, 0.02), hole=(Hole(position=0.5, diameter=0.04),)))
    mesh = dolfinx_mesh(part)
    t, w = np.polynomial.legendre.leggauss(44)
    # sin substitution: the section's area has square-root ends at the rim of the hole.
    x, wx = 0.5 + 0.02 * np.sin(np.pi / 2 * t), 0.02 * np.pi / 2 * np.cos(np.pi / 2 * t) * w
    inside = sum(wk * section_quadrature(mesh, xk, 2).weights.sum() for xk, wk in zip(x, wx, strict=True))
    assert inside + 0.96 * 0.06 * 0.02 == pytest.approx(integrate(part), rel=2e-5)


def test_sections_of_a_large_mesh_are_fast():
    """50 sections of 24 000 tetrahedra (P2: 1.1e5 dofs): 0.15 s measured, half a second is the aim."""
    mesh = dolfinx_mesh(structured_box(1.0, (0.015, 0.025), (0.015, 0.025), (200, 4, 5), "tetrahedron"))
    begin = time.process_time()
    for x in np.linspace(0, 1, 50):
        section_quadrature(mesh, x, 4)
    assert time.process_time() - begin < 0.5
