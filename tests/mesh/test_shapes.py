"""Shapes drawn out along x: volume and moments of the drawing, in the link's frame; where nodes of a beam lie."""

import os
import signal

import numpy as np
import pytest
from solid_parts import face_area, integrate, rectangle

from ffrobot.common.errors import InputError
from ffrobot.mesh.records import CircleSection, Hole, SurfacePatches, TubeSection
from ffrobot.mesh.structured import graded_nodes, with_points

CELLS = ("tetrahedron", "hexahedron")
TAPER = {"section": rectangle(0.03, 0.05), "tip_section": rectangle(0.015, 0.025)}


@pytest.mark.parametrize("mesh", [{}, {"cell": "hexahedron"}, {"divisions": (7, 2, 3)}, {"size": 0.02}])
def test_a_box_has_its_mass_and_inertia(solid, mesh_part, mesh):
    part = mesh_part(solid(), **mesh)
    height, width, volume = 0.015, 0.025, 0.015 * 0.025
    assert integrate(part) == pytest.approx(volume, rel=1e-12)
    for axis, moment in ((0, 1 / 3), (1, height**2 / 12), (2, width**2 / 12)):
        assert integrate(part, lambda x, axis=axis: x[..., axis] ** 2) == pytest.approx(volume * moment, rel=1e-12)
    assert face_area(part, "root") == pytest.approx(volume, rel=1e-12)
    assert face_area(part, "tip") == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize(
    ("sections", "cell", "volume"),
    [
        # Prismatoid: L/6 (A_root + 4 A_mid + A_tip).
        *((TAPER, cell, (0.03 * 0.05 + 4 * 0.0225 * 0.0375 + 0.015 * 0.025) / 6) for cell in CELLS),
        ({"section": rectangle(0.03, 0.05, wall=0.005)}, None, 0.03 * 0.05 - 0.02 * 0.04),
    ],
)
def test_shapes_with_plane_faces_have_their_volume(solid, mesh_part, sections, cell, volume):
    assert integrate(mesh_part(solid(**sections), cell=cell)) == pytest.approx(volume, rel=1e-12)


@pytest.mark.parametrize(
    ("section", "area"),
    [
        (CircleSection(shape="circle", diameter=0.025), np.pi * 0.025**2 / 4),
        (TubeSection(shape="tube", outer=0.05, inner=0.03), np.pi * (0.05**2 - 0.03**2) / 4),
    ],
)
def test_round_sections_are_met_by_curved_cells(solid, mesh_part, section, area):
    part = mesh_part(solid(section=section))
    assert part.degree == 2
    assert integrate(part) == pytest.approx(area, rel=1e-3)
    # With straight edges, 8 around, 10 % would be missing: they are chords.
    assert face_area(part, "root") < 0.995 * area


def test_cells_too_long_for_a_thin_curved_wall_are_refused(solid, mesh_part):
    """gmsh's curved cells fold there; straightened they would give the tube more mass than it has."""
    tube = solid(length=0.3, section=TubeSection(shape="tube", outer=0.04, inner=0.0372))
    with pytest.raises(InputError, match=r"mesh\.size at which cells follow curved faces, found a volume .* % off"):
        mesh_part(tube, size=0.01)
    assert integrate(mesh_part(tube, size=0.006)) == pytest.approx(0.3 * np.pi / 4 * (0.04**2 - 0.0372**2), rel=1e-3)


@pytest.mark.parametrize(
    ("section", "mesh"),
    [
        (rectangle(1e-5, 0.025, wall=1e-6), {}),
        (rectangle(0.015, 0.025), {"size": 1e-5}),
        (rectangle(1e-4, 1e-4), {"size": 1e-6, "cell": "hexahedron"}),
        (rectangle(), {"divisions": (1000, 1000, 1000)}),
    ],
)
def test_meshes_that_would_never_be_made_are_refused_at_once(solid, mesh_part, section, mesh):
    with pytest.raises(
        InputError, match=r"link\.toml: geometry: expected a mesh\.size that fits the part, found .* cells"
    ):
        mesh_part(solid(section=section), **mesh)


def test_holes_are_cut_out(solid, mesh_part):
    holes = tuple(Hole(position=x, diameter=0.04, offset=0.002) for x in (0.2, 0.5, 0.8))
    part = mesh_part(solid(section=rectangle(0.06, 0.01), hole=holes))
    assert integrate(part) == pytest.approx(0.06 * 0.01 - 3 * np.pi * 0.02**2 * 0.01, rel=1e-4)
    # What is missing in the middle of the section moves the center: −A_hole · offset.
    first = integrate(part, lambda x: x[..., 1])
    assert first == pytest.approx(-3 * np.pi * 0.02**2 * 0.01 * 0.002, rel=1e-2)


@pytest.mark.parametrize("faces", ["top", "bottom", "both"])
def test_patches_lie_on_whole_facets(solid, mesh_part, faces):
    patches = SurfacePatches(count=4, length=0.05, width=0.02, faces=faces)
    part = mesh_part(solid(), patches=patches)
    sides = ("top", "bottom") if faces == "both" else (faces,)
    assert set(part.faces) == {"root", "tip", *(f"patch/{k}/{side}" for k in range(4) for side in sides)}
    for side in sides:
        for k, (begin, end) in enumerate(patches.edges(1.0)):
            corners = part.points[part.facets[part.facet_tag == part.faces[f"patch/{k}/{side}"]]].reshape(-1, 3)
            assert face_area(part, f"patch/{k}/{side}") == pytest.approx(0.05 * 0.02, rel=1e-9)
            np.testing.assert_allclose(corners.min(axis=0)[[0, 2]], [begin, -0.01], atol=1e-12)
            np.testing.assert_allclose(corners.max(axis=0)[[0, 2]], [end, 0.01], atol=1e-12)
            np.testing.assert_allclose(corners[:, 1], 0.0075 if side == "top" else -0.0075, atol=1e-12)


def test_gmsh_says_nothing_and_leaves_interrupts_alone(solid, mesh_part, capfd):
    before = signal.getsignal(signal.SIGINT)
    said = []
    mesh_part(solid(hole=(Hole(position=0.5, diameter=0.005),)), said=said)
    os.write(1, b"heard")
    assert capfd.readouterr() == ("heard", "")
    assert signal.getsignal(signal.SIGINT) is before
    assert said == ["meshing"]


def test_steps_are_nodes_and_a_uniform_mesh_that_meets_them_is_kept():
    nodes = graded_nodes([0.0, 0.3, 0.4, 1.0], 20)
    np.testing.assert_allclose(nodes, np.linspace(0, 1, 21), atol=1e-15)
    assert {0.0, 0.3, 0.4, 1.0} <= set(nodes)


def test_the_longest_element_is_as_short_as_possible():
    nodes = graded_nodes([0.0, 0.1, 1.0], 4)
    np.testing.assert_allclose(nodes, [0.0, 0.1, 0.4, 0.7, 1.0])


def test_points_are_added_once():
    nodes = with_points(np.array([0.0, 0.5, 1.0]), [0.5, 0.5 + 1e-12, 0.25, 1.0])
    np.testing.assert_array_equal(nodes, [0.0, 0.25, 0.5, 1.0])
