"""Actuation points: what the program chooses, what it refuses, and forward runs under the forces it finds."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ffrobot.actuation.points import ActuationPoints, point_set, with_points
from ffrobot.common.errors import InputError
from ffrobot.mbs.model.masses import with_payload
from ffrobot.mbs.model.planar_body import from_modal_body, from_rigid_body
from ffrobot.mbs.scene.bodies import RigidBody

SCENE = Path("scene.toml")


def chosen(body, planar=None, **keys):
    planar = planar or from_modal_body("link", body)
    return point_set(SCENE, ActuationPoints(body="link", **keys), body, planar)


def test_automatic_choice_of_a_bending_link(cantilever):
    """One axial and n + 2 transverse components, spread over the link."""
    points = chosen(cantilever(10))
    assert sorted(points.axes) == ["axial"] + 12 * ["transverse"]
    places = [point.position[0] for point, axis in zip(points.points, points.axes, strict=True) if axis == "transverse"]
    assert min(places) == 0.0
    assert max(places) == 1.0
    assert np.all(np.diff(np.sort(places)) > 0)


def test_automatic_choice_is_better_conditioned_than_even_spacing(cantilever):
    body = cantilever(10)
    conditions = [
        np.linalg.cond(points.scale[:, None] * points.equations().L_a(np.zeros(10)))
        for points in (chosen(body), chosen(body, axial=(1.0,), transverse=tuple(np.linspace(0, 1, 12))))
    ]
    assert conditions[0] < conditions[1]


def test_columns_are_the_gradients_of_the_points(cantilever):
    """L_a = [A e; e·(A_θ u rotated back); Φ_eᵀ]: differences of r = R + A (x + Φ p) along e."""
    body = cantilever(4)
    planar = from_modal_body("link", body)
    points = chosen(body, planar, axial=(1.0,), transverse=(0.25, "tip"))
    p, theta, h = 1e-2 * np.arange(1.0, 5.0), 0.7, 1e-6
    A = np.array([[np.cos(theta), -np.sin(theta)], [np.sin(theta), np.cos(theta)]])

    def position(point, x):
        c, s = np.cos(x[2]), np.sin(x[2])
        return x[:2] + np.array([[c, -s], [s, c]]) @ (point.position + point.translation @ x[3:])

    x = np.concatenate([[0.3, -0.2, theta], p])
    L_a = points.equations().L_a(p)
    for k, (point, direction) in enumerate(zip(points.points, points.direction.T, strict=True)):
        slopes = [
            (position(point, x + h * unit) - position(point, x - h * unit)) @ (A @ direction) / (2 * h)
            for unit in np.eye(len(x))
        ]
        in_global = np.concatenate([A @ L_a[:2, k], L_a[2:, k]])
        np.testing.assert_allclose(in_global, slopes, atol=1e-8)


def test_square_and_least_squares_solutions(cantilever):
    body = cantilever(6)
    rng = np.random.default_rng(1)
    p, Q_a = 1e-2 * rng.standard_normal(6), rng.standard_normal(9)
    square = chosen(body)
    F_a = square.equations().solve(0.0, p, Q_a)
    np.testing.assert_allclose(square.equations().L_a(p) @ F_a, Q_a, atol=1e-11)
    few = chosen(body, axial=(1.0,), transverse=(0.2, 0.6, 1.0))
    L_a = few.scale[:, None] * few.equations().L_a(p)
    expected = np.linalg.lstsq(L_a, few.scale * Q_a, rcond=None)[0]
    np.testing.assert_allclose(few.equations().solve(0.0, p, Q_a), expected, rtol=1e-9)


def test_a_payload_does_not_move_the_points(cantilever):
    """Modes are made anew with it; what a component does at its point stays what it is."""
    body = cantilever(10)
    loaded = with_payload(from_modal_body("link", body), "tip", 3.0, 0.1)
    (tip,) = chosen(body, loaded, transverse=(1.0,)).points
    np.testing.assert_allclose(tip.translation, loaded.points["tip"].translation, atol=1e-12)


def test_points_of_a_rigid_body_go_by_name():
    rod = RigidBody(mass=1.0, inertia=0.1, center=(0.5, 0.0), points={"root": (0.0, 0.0), "tip": (1.0, 0.0)})
    planar = from_rigid_body("link", rod)
    points = point_set(SCENE, ActuationPoints(body="link"), None, planar)
    assert sorted(points.axes) == ["axial", "transverse", "transverse"]
    assert set(with_points(planar, points).points) >= {"actuation1", "actuation2", "actuation3"}
    with pytest.raises(InputError, match="expected points of the rigid body by name"):
        point_set(SCENE, ActuationPoints(body="link", axial=(0.5,)), None, planar)


def test_a_body_whose_points_cannot_carry_everything(cantilever):
    """All stations of a link with one of its modes twice: nothing tells the two apart."""
    planar = from_modal_body("link", cantilever(4))
    twin = np.array([0, 1, 2, 2])
    doubled = replace(planar, modal_transform=planar.modal_transform[:, twin], stiffness=planar.stiffness[twin])
    with pytest.raises(InputError, match="expected points that carry all 7 generalized forces of the body, found 6"):
        chosen(cantilever(4), doubled)


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        (
            {"transverse": (0.1, 0.2, 0.1)},
            "transverse: expected points apart .*, found two at 0.1 and 0.1",
        ),
        ({"transverse": (1.0, "tip")}, "found two at 1.0 and tip that coincide"),
        ({"axial": (0.4, 0.6)}, "found 2 of which only 1 are independent"),
        ({"transverse": tuple(np.linspace(0, 1, 8))}, r"coordinates \(7\), found 8"),
        ({"transverse": (-0.1,)}, "within the link, 0 … 1 m, found -0.1 m"),
        ({"axial": ("middle",)}, 'expected a point of the body .* found "middle"'),
    ],
)
def test_components_that_are_refused(cantilever, keys, message):
    with pytest.raises(InputError, match=f'scene.toml: actuation_points "link": .*{message}'):
        chosen(cantilever(4), **keys)
