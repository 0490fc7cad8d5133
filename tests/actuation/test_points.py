"""Actuation points: what the program chooses, what it refuses, and forward runs under the forces it finds."""

from dataclasses import replace

import numpy as np
import pytest
from beam_links import moved
from patches_on_links import patches, planar_body

from ffrobot.actuation.points import ActuationPoints, make_point_set, with_points
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.body import rigid_body
from ffrobot.mbs.scene.space import PLANE


def point_set(body, planar, **keys):
    return make_point_set(ActuationPoints(body="link", **keys), body, planar, PLANE)


def chosen(body, planar=None, **keys):
    return point_set(body, planar_body(body) if planar is None else planar, **keys)


def test_points_of_a_rigid_body_go_by_name():
    places = {"root": np.zeros(3), "tip": np.array([1.0, 0.0, 0.0])}
    rod = rigid_body("link", 1.0, np.array([0.5, 0.0, 0.0]), np.diag([0.06, 0.06, 0.1]), places)
    points = point_set(None, rod)
    assert sorted(points.axes) == ["x", "y", "y"]
    assert set(with_points(rod, points).points) >= {"actuation1", "actuation2", "actuation3"}
    with pytest.raises(InputError, match="expected points of the rigid body by name"):
        point_set(None, rod, axial=(0.5,))
    with pytest.raises(InputError, match="expected points that carry all 3 generalized forces of the body, found 2"):
        point_set(None, replace(rod, points={"tip": rod.points["tip"]}))


def test_a_body_whose_points_cannot_carry_everything(cantilever):
    """All stations of a link with one of its modes twice: nothing tells the two apart."""
    planar = planar_body(cantilever(4))
    twin = np.array([0, 1, 2, 2])
    doubled = replace(planar, modal_transform=planar.modal_transform[:, twin], stiffness=planar.stiffness[twin])
    with pytest.raises(InputError, match="expected points that carry all 7 generalized forces of the body, found 6"):
        chosen(cantilever(4), doubled)


def test_distances_count_from_the_root_wherever_the_origin_is(cantilever):
    body, away = cantilever(4), moved(cantilever(4), lambda x: x - 0.3 * np.eye(3)[0])
    here, there = (chosen(link, axial=(0.2,), transverse=(0.5, "tip")) for link in (body, away))
    for point, other in zip(here.points, there.points, strict=True):
        np.testing.assert_allclose(other.translation, point.translation, atol=1e-12)
    assert len(chosen(away).points) == len(chosen(body).points)
    np.testing.assert_allclose(patches(away).Phi_V, patches(body).Phi_V, rtol=1e-9)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"transverse": (1.0, "tip")}, "found two at 1.0 and tip that coincide"),
        ({"axial": (0.4, 0.6)}, "found 2 of which only 1 are independent"),
        ({"transverse": tuple(np.linspace(0, 1, 8))}, r"coordinates \(7\), found 8"),
        ({"axial": ("middle",)}, 'expected a point of the body .* found "middle"'),
    ],
)
def test_components_that_are_refused(cantilever, keys, message):
    with pytest.raises(InputError, match=message):
        chosen(cantilever(4), **keys)
