"""Strains, stresses and surface patches of solids: fields known exactly, on boxes."""

import numpy as np
import pytest
from fields import CELLS, PATH, B, C, E, H, L, bending, box, field, patch_tags
from mpi4py import MPI

from ffrobot.common.errors import InputError
from ffrobot.fe_models.solid.functionals import outlined_patches
from ffrobot.fe_models.solid.stress import locate, point_stresses, pulled_back, surface_stresses
from ffrobot.mesh.compat import create_solid_mesh, function_space, geometry_nodes


@pytest.mark.parametrize("cell", CELLS)
@pytest.mark.parametrize("order", [1, 2, 3])
def test_linear_displacements_strain_uniformly(cell, order):
    gradient = np.arange(1.0, 10.0).reshape(3, 3)
    space = function_space(box(cell, skew=0.2), order, (3,))
    modes = field(space, lambda x: gradient @ x)
    # A corner, an edge, inside, a face, and a node between cells.
    points = {"a": (0, H / 2, B / 2), "b": (0.4, H / 2, B / 2), "c": (0.31, 0.02, 0.01), "d": (L, 0.03, 0.02)}
    points["e"] = tuple(space.mesh.geometry.x[len(space.mesh.geometry.x) // 2])
    strain = [1, 5, 9, 6 + 8, 3 + 7, 2 + 4]
    for name, point in point_stresses(space, C, modes, points, PATH).items():
        np.testing.assert_allclose(point.position, points[name])
        np.testing.assert_allclose(point.strain[:, 0], strain, rtol=1e-10)
        np.testing.assert_allclose(point.stress[:, 0], C @ strain, rtol=1e-10)
    surface = surface_stresses(space, C, modes, np.array(list(points.values())))
    np.testing.assert_allclose(surface[:, :, 0], np.tile(C @ strain, (5, 1)), rtol=1e-10)


@pytest.mark.parametrize("cell", CELLS)
def test_pure_bending(cell):
    space = function_space(box(cell), 2, (3,))
    points = {"top": (0.5, H / 2, 0.0), "inside": (0.37, 0.03, -0.02), "end": (0.0, -H / 2, B / 2)}
    found = point_stresses(space, C, field(space, bending), points, PATH)
    for name, (_, y, _) in points.items():
        np.testing.assert_allclose(found[name].stress[:, 0], [-E * y, 0, 0, 0, 0, 0], atol=1e-8 * E)


def test_two_materials_and_their_border():
    """Softer by ten beyond x = ½: a strain common to both; the border takes the mean."""
    space = function_space(box("hexahedron"), 1, (3,))
    domain = space.mesh
    cells = domain.topology.index_map(3).size_local
    middles = domain.geometry.x[geometry_nodes(domain)].mean(axis=1)
    by_cell = np.where(middles[:, 0, None, None] < 0.5, C, C / 10)
    assert by_cell.shape == (cells, 6, 6)
    points = {"stiff": (0.2, 0, 0), "soft": (0.8, 0, 0), "border": (0.5, 0.01, 0.01)}
    found = point_stresses(space, by_cell, field(space, lambda x: x * [[1.0], [0.0], [0.0]]), points, PATH)
    for name, factor in (("stiff", 1.0), ("soft", 0.1), ("border", 0.55)):
        np.testing.assert_allclose(found[name].stress[:, 0], factor * C[:, 0], atol=1e-9 * E)
        assert found[name].strain[0, 0] == pytest.approx(1.0)


def test_point_outside_the_part():
    space = function_space(box("tetrahedron"), 1, (3,))
    modes = field(space, lambda x: x)
    with pytest.raises(
        InputError, match=r"link\.toml: stress\.points\.a: expected a point of the part, found .*, 0\.1 m"
    ):
        point_stresses(space, C, modes, {"in": (0.5, 0, 0), "a": (1.1, 0.0, 0.0)}, PATH)
    with pytest.raises(ValueError, match="1 of 2 points are not on the mesh"):
        surface_stresses(space, C, modes, np.array([[0.5, 0, 0], [1.1, 0, 0]]))


@pytest.fixture
def curved():
    """One tetrahedron of degree 2 with bulging edges; nodes in gmsh's order: corners, edges 01 12 02 03 23 13."""
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    edges = [(corners[a] + corners[b]) / 2 for a, b in ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))]
    points = np.vstack([corners, 1.1 * np.array(edges)])
    return create_solid_mesh(MPI.COMM_SELF, "tetrahedron", 2, np.arange(10)[None], points)


def test_curved_cells_are_inverted(curved):
    space = function_space(curved, 2, (3,))
    x = field(space, lambda x: x).reshape(-1, 3)
    reference = np.random.default_rng(1).dirichlet(np.ones(4), size=50)[:, :3]
    values = space.sub(0).element.basix_element.tabulate(0, reference)[0, :, :, 0]
    points = values @ x[space.dofmap.cell_dofs(0)]
    np.testing.assert_allclose(pulled_back(curved, np.zeros(50, dtype=int), points), reference, atol=1e-10)
    assert set(locate(curved, points, 1e-6)[0]) == set(range(50))
    far = 5.0 * np.random.default_rng(2).standard_normal((200, 3))  # the map folds there: found, or known not to be
    found = pulled_back(curved, np.zeros(200, dtype=int), far)
    is_found = np.isfinite(found).all(axis=1)
    values = space.sub(0).element.basix_element.tabulate(0, found[is_found])[0, :, :, 0]
    np.testing.assert_allclose(values @ x[space.dofmap.cell_dofs(0)], far[is_found], atol=1e-4)
    assert 0 < np.count_nonzero(is_found) < 200


def test_point_next_to_a_curved_face(curved):
    """A point of the true face may be off that of the mesh: up to 2 % of a cell it counts, with the strain there."""
    space = function_space(curved, 2, (3,))
    modes = field(space, lambda x: x)
    inside = np.array([0.4, 0.4, 0.4])  # the middle of the bulging face lies at 0.377
    face = np.full(3, (-1 / 9 + 8 / 9 * 0.55) * 1.0)
    found = point_stresses(space, C, modes, {"near": tuple(1.01 * face)}, PATH)["near"]
    np.testing.assert_allclose(found.strain[:3, 0], 1.0, rtol=1e-9)
    assert not len(locate(curved, 1.01 * face[None], 1e-6)[0])
    with pytest.raises(InputError, match="expected a point of the part"):
        point_stresses(space, C, modes, {"off": tuple(1.1 * inside)}, PATH)


@pytest.mark.parametrize("sides", ["both", "top"])
@pytest.mark.parametrize("cell", CELLS)
def test_patch_in_pure_bending(cell, sides):
    """ε_xx = −y: ∫ over the upper patch is −H/2 times its area, without what ε_zz = νy would add."""
    space = function_space(box(cell, (8, 2, 2)), 2, (3,))
    tags, faces, record = patch_tags(space.mesh)
    record = record.model_copy(update={"faces": sides})
    found = outlined_patches(space, tags, faces, record, L, field(space, bending))
    np.testing.assert_allclose(found.edges, [[0.25, 0.5]])
    assert found.width == B
    np.testing.assert_allclose(found.top, -H / 2 * 0.25 * B, rtol=1e-10)
    if sides == "top":
        assert found.bottom is None
    else:
        np.testing.assert_allclose(found.bottom, H / 2 * 0.25 * B, rtol=1e-10)
