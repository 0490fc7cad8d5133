import gc

import basix
import numpy as np
import pytest
from costs import memory
from solids import body_of, model_of, write_solid

from ffrobot.common.errors import InputError
from ffrobot.fe_models.solid.invariants import shape_integrals
from ffrobot.mesh.compat import geometry_nodes, lagrange_element, node_map

LENGTH, HEIGHT, WIDTH, RHO = 1.0, 0.015, 0.025, 7850.0


@pytest.mark.parametrize(
    ("cell", "order"),
    [("hexahedron", 1), ("tetrahedron", 2), pytest.param("tetrahedron", 1, marks=pytest.mark.nightly)],
)
def test_mass_and_moments_of_a_box_are_exact(tmp_path, cell, order):
    body = body_of(write_solid(tmp_path, cell=cell, order=order, divisions=(8, 2, 2), count=1, family="all"))
    mass = RHO * LENGTH * HEIGHT * WIDTH
    np.testing.assert_allclose(body.mass, mass, rtol=1e-12)
    np.testing.assert_allclose(body.first_moment, [mass * LENGTH / 2, 0, 0], atol=1e-12 * mass)
    exact = mass * np.diag([LENGTH**2 / 3, HEIGHT**2 / 12, WIDTH**2 / 12])
    np.testing.assert_allclose(body.second_moment, exact, rtol=1e-10, atol=1e-12 * mass)


def test_invariants_are_the_sums_over_quadrature_points(tmp_path):
    """Of five random fields: the integrals hold for any displacements, modes or not."""
    model, solid = model_of(write_solid(tmp_path, order=2, divisions=(6, 2, 2)))
    X = np.random.default_rng(1).standard_normal((3 * model.owned, 5))
    found = shape_integrals(model, X)
    points, rule = basix.make_quadrature(basix.CellType.tetrahedron, 4)
    corners = solid.mesh.geometry.x[geometry_nodes(solid.mesh)]
    volume = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1]))
    w = RHO * volume[:, None] * rule
    x = np.einsum("qv,cvi->cqi", np.column_stack([1 - points.sum(axis=1), points]), corners)
    N = lagrange_element(model.V).tabulate(0, points)[0, :, :, 0]
    Phi = np.einsum("qd,cdin->cqin", N, X.reshape(-1, 3, 5)[node_map(model.V)])
    np.testing.assert_allclose(found.S_bar, np.einsum("cq,cqin->in", w, Phi), atol=1e-12)
    np.testing.assert_allclose(found.I_bar, np.einsum("cq,cqk,cqln->kln", w, x, Phi), atol=1e-12)
    np.testing.assert_allclose(found.S_bar_kl, np.einsum("cq,cqkm,cqln->klmn", w, Phi, Phi), atol=1e-12)


def test_rigid_faces_that_touch_are_refused(tmp_path):
    side = '[[interface]]\nname = "side"\nposition = [0.5, 0.0075, 0.0]\nnormal = [0.0, 1.0, 0.0]\ncoupling = "rigid"\n'
    path = write_solid(tmp_path, condition="cantilever", divisions=(4, 1, 1), count=1, more=side)
    with pytest.raises(InputError, match=r"interface\.coupling of side: expected rigid faces that do not touch"):
        body_of(path)


def test_mean_supports_hold_section_averages(tmp_path):
    body = body_of(write_solid(tmp_path, condition="simply-supported", family="all", count=6))
    root, tip = body.interfaces["root"], body.interfaces["tip"]
    scale = np.abs(body.stations.translation).max()
    np.testing.assert_allclose(root.translation, 0, atol=1e-9 * scale)
    np.testing.assert_allclose(root.rotation[0], 0, atol=1e-7 * scale)
    np.testing.assert_allclose(tip.translation[1:], 0, atol=1e-9 * scale)
    # The sections at the ends are the faces.
    np.testing.assert_allclose(body.stations.translation[-1], tip.translation, atol=1e-9 * scale)
    np.testing.assert_allclose(body.stations.rotation[-1], tip.rotation, rtol=1e-7, atol=1e-7 * scale)
    np.testing.assert_allclose(tip.position, [1.0, 0, 0], atol=1e-12)


def test_families_are_found_in_batches(tmp_path):
    every = body_of(write_solid(tmp_path, family="all", count=24, divisions=(24, 1, 1)))
    for family in ("in-plane-bending", "out-of-plane-bending", "torsion", "axial"):
        expected = [f for f, name in zip(every.frequency, every.family, strict=True) if name == family]
        assert expected, family
        found = body_of(write_solid(tmp_path, family=family, count=len(expected), divisions=(24, 1, 1)))
        assert set(found.family) == {family}
        np.testing.assert_allclose(found.frequency, expected, rtol=1e-9)


def test_square_section_bends_in_its_two_planes(tmp_path):
    square = {"height": 0.02, "width": 0.02, "cell": "hexahedron", "order": 2, "divisions": (20, 2, 2)}
    body = body_of(write_solid(tmp_path, **square, family="all", count=6))
    for k in range(6):
        u = np.abs(body.stations.translation[:, :, k]).max(axis=0)
        if body.family[k] == "in-plane-bending":
            assert u[2] < 1e-6 * u[1]
        if body.family[k] == "out-of-plane-bending":
            assert u[1] < 1e-6 * u[2]


def test_more_modes_than_there_are(tmp_path):
    path = write_solid(tmp_path, cell="hexahedron", order=1, divisions=(1, 1, 1), family="all", count=100)
    with pytest.raises(InputError, match=r"modes.count: expected at most .* which has 18 "):
        body_of(path)


def test_a_search_for_modes_that_hardly_exist_ends(tmp_path):
    """A plate across the link's axis: of ever more modes that would be computed almost none bends."""
    path = write_solid(tmp_path, length=0.0016, cell="hexahedron", order=1, divisions=(2, 6, 8), count=4)
    with pytest.raises(InputError, match=r"modes.count: expected 4 modes of .* among the lowest 360, found [0-3] "):
        body_of(path)


def test_nothing_of_a_solid_stays_in_memory(tmp_path):
    """PETSc keeps objects that only Python let go: matrices and factors of 10 000 unknowns are 35 MB a body.

    Each body would leave them. The heap of a process that ran other tests may grow once by more.
    """

    def memory_after(number):
        body_of(
            write_solid(tmp_path, cell="hexahedron", order=2, divisions=(60 + number, 3, 1), condition="cantilever")
        )
        gc.collect()
        return memory()

    grown = np.diff([memory_after(number) for number in range(4)])
    assert min(grown) < 10.0  # found: 0
