"""Sections swept along beams: they are closed, have the right volume, and their corners move as plane sections do."""

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle, tube

from ffrobot.pictures.shapes import body_surface

RECTANGLE, TUBE = {"section": rectangle(0.02, 0.03)}, {"section": tube(0.04, 0.03)}
STEPPED = {"segment": [{"until": 0.25} | TUBE, {"until": 1.0} | RECTANGLE]}


def beam(geometry):
    """With modes of all families."""
    link = beam_link(1.0, None, 4, modes={"count": 12, "family": "all"})
    return modal_body(link | {"geometry": {"kind": "beam", "length": 1.0} | geometry})


def volume(mesh):
    """∫ x·n dA / 3 over the faces: the mean of the two ways to divide a quadrilateral."""
    corners = mesh.points[mesh.cells]
    a, b, c, d = corners.transpose(1, 0, 2)
    first = np.einsum("ci,ci->", a, np.cross(b, c) + np.cross(c, d))
    other = np.einsum("ci,ci->", b, np.cross(c, d) + np.cross(d, a))
    return (first + other) / 12


def polygon(diameter, q=16):
    return q / 8 * diameter**2 * np.sin(2 * np.pi / q)


@pytest.mark.parametrize(
    ("geometry", "expected"),
    [(RECTANGLE, 0.0006), (TUBE, polygon(0.04)), (STEPPED, 0.25 * polygon(0.04) + 0.75 * 0.0006)],
    ids=["rectangle", "tube", "stepped"],
)
def test_surface_is_closed_and_holds_the_volume(geometry, expected):
    mesh = body_surface(beam(geometry))
    assert volume(mesh) == pytest.approx(expected, rel=1e-12)  # positive: normals point outwards
    sides = np.stack([mesh.cells, np.roll(mesh.cells, -1, axis=1)], axis=2).reshape(-1, 2)
    assert {tuple(side) for side in sides} == {tuple(side[::-1]) for side in sides}  # each once in either direction


def test_corners_move_with_their_section():
    """All six motions at once, of a place that is a station: Φ + θ × a."""
    body = beam(RECTANGLE)
    p = 1e-3 * np.arange(1.0, 1.0 + len(body.family))
    mesh, place = body_surface(body), body.interpolate(0.5)
    ring = np.flatnonzero(np.abs(mesh.points[:, 0] - 0.5) < 1e-12)
    arm = mesh.points[ring] - [0.5, 0.0, 0.0]
    assert {tuple(a) for a in arm.round(12)} == {(0.0, y, z) for y in (-0.01, 0.01) for z in (-0.015, 0.015)}
    assert {"torsion", "in-plane-bending", "out-of-plane-bending"} <= set(body.family)
    expected = place.translation @ p + np.cross(place.rotation @ p, arm)
    np.testing.assert_allclose(mesh.mode_shapes[ring] @ p, expected, rtol=0, atol=1e-12)
