"""The distributed mesh: regions, faces and surface are the part's, whatever the number of processes."""

from pathlib import Path

import numpy as np
import pytest
import ufl
from dolfinx import fem

from ffrobot.mesh.compat import coordinate_element, geometry_nodes
from ffrobot.mesh.records import CircleSection, PartTables, PlaceRecord, SolidMeshRecord
from ffrobot.mesh.solid_mesh import solid_mesh

LINK = Path("link.toml")


def total(form):
    return fem.assemble_scalar(fem.form(form))


@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_faces_and_volume_by_dolfinx(solid, cell):
    grip = PlaceRecord(name="grip", position=(0.5, 0.0, 0.0125), normal=(0.0, 0.0, 1.0))
    body = solid_mesh(PartTables(LINK, solid(), SolidMeshRecord(cell=cell), (grip,)))
    ds = ufl.Measure("ds", domain=body.mesh, subdomain_data=body.facet_tags)
    one = fem.Constant(body.mesh, 1.0)
    x = ufl.SpatialCoordinate(body.mesh)
    assert total(one * ufl.dx(body.mesh)) == pytest.approx(0.000375)
    for name, area, first in (("root", 0.000375, 0.0), ("tip", 0.000375, 1.0), ("grip", 0.015, 0.5)):
        assert total(one * ds(body.part.faces[name])) == pytest.approx(area)
        assert total(x[0] * ds(body.part.faces[name])) == pytest.approx(area * first, abs=1e-12)


@pytest.mark.parametrize("mesh", [{}, {"cell": "hexahedron"}, {"divisions": (60, 6, 6)}])
def test_the_surface_is_closed_and_faces_outward(solid, mesh):
    surface = solid_mesh(PartTables(LINK, solid(), SolidMeshRecord(**mesh))).surface
    corners = surface.points[surface.triangles]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    assert np.linalg.norm(vectors, axis=1).sum() == pytest.approx(2 * (0.025 + 0.015) + 2 * 0.000375)
    assert np.einsum("ti,ti->", vectors, corners.mean(axis=1)) / 3 == pytest.approx(0.000375)
    edges = np.concatenate([surface.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    _, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    assert np.all(count == 2)


def test_surface_points_are_where_their_cells_say(solid):
    body = solid_mesh(PartTables(LINK, solid(section=CircleSection(shape="circle", diameter=0.1))))
    surface = body.surface
    np.testing.assert_array_equal(np.sort(surface.rows), np.arange(len(surface.points)))
    nodes = body.mesh.geometry.x[geometry_nodes(body.mesh)[surface.cells]]
    values = coordinate_element(body.mesh).tabulate(0, surface.X)[0, ..., 0]
    found = np.einsum("kv,kvi->ki", values, nodes)
    np.testing.assert_allclose(found, surface.points[surface.rows], atol=1e-14)
