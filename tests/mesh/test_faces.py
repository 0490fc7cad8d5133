"""Faces are found by plane, by group, by position and normal; what cannot be found is told with what is there."""

import numpy as np
import pytest
from solid_parts import face_area, rectangle

from ffrobot.common.errors import InputError
from ffrobot.mesh.faces import PartBoundary
from ffrobot.mesh.records import CircleSection, Hole, PlaceRecord, SurfacePatches


def fork(occ):
    """A bar between two eyes, in millimetres: bores of 40 and 30 at x = 60 and 940, axes along z, and one between."""
    body = occ.addBox(0, -30, -10, 1000, 60, 20)
    eyes = [(3, occ.addCylinder(x, 0, -10, 0, 0, 20, 30)) for x in (0, 1000)]
    joined, _ = occ.fuse([(3, body)], eyes)
    occ.cut(joined, [(3, occ.addCylinder(x, 0, -50, 0, 0, 100, r)) for x, r in ((60, 20), (940, 15), (500, 22))])


def at(name, position, normal):
    return PlaceRecord(name=name, position=position, normal=normal)


def bore(name, x):
    return at(name, (x, 0.0, 0.0), (0.0, 0.0, 1.0))


def test_a_box_has_six_smooth_faces(solid, mesh_part):
    faces = PartBoundary.of(mesh_part(solid())).smooth_faces
    assert [face.area for face in faces] == pytest.approx([0.025] * 2 + [0.015] * 2 + [0.000375] * 2)
    np.testing.assert_allclose(np.sum([face.normal for face in faces], axis=0), 0, atol=1e-12)


def test_a_bar_has_a_mantle_with_an_axis(solid, mesh_part):
    mantle, *ends = PartBoundary.of(mesh_part(solid(section=CircleSection(shape="circle", diameter=0.05)))).smooth_faces
    assert abs(mantle.axis[0]) > 0.999
    assert len(ends) == 2


@pytest.mark.parametrize("cell", ["tetrahedron", "hexahedron"])
def test_a_face_is_picked_by_position_and_normal(solid, mesh_part, cell):
    part = mesh_part(solid(), (at("grip", (0.9, 0.0075, 0.0), (0.0, 2.0, 0.1)),), cell=cell)
    corners = part.points[part.facets[part.facet_tag == part.faces["grip"]]]
    np.testing.assert_allclose(corners[..., 1], 0.0075, atol=1e-12)
    assert face_area(part, "grip") == pytest.approx(0.025)


def test_bores_are_picked_by_their_center(solid, mesh_part, step_file):
    geometry = solid(file=step_file(fork), unit="mm", origin=(60.0, 0.0, 0.0), length=0.88)
    part = mesh_part(geometry, (bore("root", 0.0), bore("tip", 0.88), bore("middle", 0.44)))
    for name, center, radius in (("root", 0.0, 0.02), ("tip", 0.88, 0.015), ("middle", 0.44, 0.022)):
        corners = part.points[part.facets[part.facet_tag == part.faces[name]]].reshape(-1, 3)
        np.testing.assert_allclose(np.hypot(corners[:, 0] - center, corners[:, 1]), radius, rtol=1e-6)
        assert face_area(part, name) == pytest.approx(2 * np.pi * radius * 0.02, rel=0.05)


def test_a_missing_root_is_told_with_the_faces_there(solid, mesh_part, step_file):
    with pytest.raises(InputError) as error:
        mesh_part(solid(file=step_file(fork), unit="mm"))
    first, *listed = str(error.value).splitlines()
    assert first == (
        "link.toml: root: expected a plane face at x = 0 with the outward normal -x, or an [[interface]] table of that "
        "name, found none. The part's faces:"
    )
    assert len(listed) == 6
    # Which bore is where, roughly: its triangles are coarse.
    bores = sorted(float(line.split("(")[1].split(",")[0]) for line in listed if "axis (0, 0, 1)" in line)
    assert bores == pytest.approx([0.06, 0.5, 0.94], abs=1e-3)


@pytest.mark.parametrize(
    ("interface", "says"),
    [
        (at("a", (0.5, 0.02, 0.0), (0.0, 1.0, 0.0)), "found none nearer than 0.0125 m"),
        (at("a", (0.5, 0.0075, 0.0), (0.0, 1.0, 1.0)), "found none. The part's faces"),
        (at("a", (0.5, 0.0075, 0.0), (0.0, 0.0, 0.0)), "interface.normal of a: expected a direction"),
    ],
)
def test_a_face_that_is_not_there_is_refused(solid, mesh_part, interface, says):
    with pytest.raises(InputError, match=says):
        mesh_part(solid(), (interface,))


def test_faces_equally_near_are_refused(solid, mesh_part):
    holes = (Hole(position=0.4, diameter=0.04), Hole(position=0.6, diameter=0.04))
    geometry = solid(section=rectangle(0.06, 0.04), hole=holes)
    assert "a" in mesh_part(geometry, (bore("a", 0.401),)).faces
    with pytest.raises(InputError, match="found none nearer than"):
        mesh_part(geometry, (bore("a", 0.5),))


def test_two_names_may_share_a_face_but_not_a_part_of_it(solid, mesh_part):
    part = mesh_part(solid(), (at("grip", (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),))
    assert part.faces["grip"] == part.faces["tip"]
    patches = SurfacePatches(centers=(0.25, 0.75), length=0.1, width=0.02)
    with pytest.raises(InputError, match=r'interface patch/0/top: expected faces that do not overlap.*"grip"'):
        mesh_part(solid(), (at("grip", (0.5, 0.0075, 0.0), (0.0, 1.0, 0.0)),), patches)


def test_a_table_may_only_add_to_root_and_tip(solid, mesh_part):
    part = mesh_part(solid(), (PlaceRecord(name="tip"), PlaceRecord(name="half", position=0.5)))
    assert set(part.faces) == {"root", "tip"}


def test_faces_of_two_prongs_count_together(solid, mesh_part, step_file):
    def prongs(occ):
        occ.addBox(0, -30, -10, 1000, 60, 20)
        occ.cut([(3, 1)], [(3, occ.addBox(0, -10, -10, 300, 20, 20))])

    part = mesh_part(solid(file=step_file(prongs), unit="mm"))
    assert face_area(part, "root") == pytest.approx(2 * 0.02 * 0.02)
    assert face_area(part, "tip") == pytest.approx(0.06 * 0.02)
