"""A payload summed into the invariants = a second, rigid body welded to the point."""

from dataclasses import replace

import numpy as np
import pytest
from bodies_by_invariants import PlanarBody, PlanarPoint, in_3d, rigid_body
from marker_measures import Kind, Marker, Measure
from material_points import random_cloud
from mechanisms import Assembly, Robot, make_model, oracle_of, random_state, relative
from oracle import Mechanism

from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.model.masses import with_payload

MASS = 0.7


def in_plane(body):
    """The invariants of a body in 3D that moves in the plane, as the oracle has them."""
    S = body.S_bar_kl
    points = {
        label: PlanarPoint(at.position[:2], at.translation[:2], at.rotation[2]) for label, at in body.points.items()
    }
    return PlanarBody(
        name=body.name, mass=body.mass, inertia=body.inertia[2, 2], first_moment=body.first_moment[:2],
        stiffness=body.stiffness, damping=body.damping, S_bar=body.S_bar[:2], h=body.spin[2],
        j=body.I_bar[0, 0] + body.I_bar[1, 1], S_tilde=body.spin_slope[2], m_xy=S[0, 0] + S[1, 1], points=points,
        modal_transform=body.modal_transform, length=body.length,
    )  # fmt: skip


def loaded(body, mass, inertia):
    """By the product, on the body in 3D."""
    return in_plane(with_payload(in_3d(body), "tip", mass, np.zeros(3), np.diag([0.0, 0.0, inertia])))


def welded(body, mass, inertia, gravity):
    """The body and, welded to its tip, a rigid one; its coordinates are all the weld leaves to the first."""
    load = replace(rigid_body("load", mass, 0.0, (0.0, 0.0), {"root": (0.0, 0.0)}), inertia=inertia)
    ends, zero = (Marker(body.name, "tip"), Marker("load", "root")), parse_expression("0")
    rows = [(Measure(kind.name, kind, *ends), zero) for kind in (Kind.x, Kind.y, Kind.angle)]
    return Mechanism([body, load], gravity, rows)


@pytest.mark.parametrize("inertia", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(5))
def test_payload_moves_as_a_welded_body(seed, inertia):
    rng = np.random.default_rng(seed)
    body = random_cloud(rng, "body").planar_body()
    with_load = loaded(body, MASS, inertia)
    q, v = random_state(rng, 3 + with_load.n_modes)
    T = np.linalg.lstsq(body.modal_transform, with_load.modal_transform, rcond=None)[0]  # p = T p_loaded
    alone = oracle_of(Assembly(Robot(make_model([with_load]).scene, (with_load,)), ()))
    a, _ = alone.solve(0.0, q, v)

    apart = welded(body, MASS, inertia, (0.0, -9.81))
    q_body, v_body = (np.concatenate([x[:3], T @ x[3:]]) for x in (q, v))
    tip = apart.marker(Marker("body", "tip"), np.append(q_body, np.zeros(3)), np.append(v_body, np.zeros(3)))
    q_apart, v_apart = np.concatenate([q_body, tip.position]), np.concatenate([v_body, tip.velocity])
    a_apart, _ = apart.solve(0.0, q_apart, v_apart)
    assert relative(np.concatenate([a[:3], T @ a[3:]]), a_apart[:-3]) < 1e-10
    assert relative(alone.energies(q, v), apart.energies(q_apart, v_apart)) < 1e-12


def test_modes_with_payload_are_orthonormal_and_decoupled():
    rng = np.random.default_rng(0)
    body = random_cloud(rng, "body").planar_body()
    with_load = loaded(body, MASS, 0.05)
    tip = body.points["tip"]
    T = np.linalg.lstsq(body.modal_transform, with_load.modal_transform, rcond=None)[0]
    m_ff = np.eye(4) + MASS * tip.translation.T @ tip.translation + 0.05 * np.outer(tip.rotation, tip.rotation)
    np.testing.assert_allclose(T.T @ m_ff @ T, np.eye(4), atol=1e-13)
    np.testing.assert_allclose(T.T @ np.diag(body.stiffness) @ T, np.diag(with_load.stiffness), atol=1e-12)
    assert np.all(np.sort(with_load.stiffness) < np.sort(body.stiffness))  # mass lowers every frequency


def test_payload_on_a_rigid_body_follows_steiner():
    link = rigid_body("link", 2.0, 0.1, (0.4, 0.1), {"tip": (1.0, 0.2)})
    with_load = loaded(link, 0.5, 0.01)
    assert with_load.mass == pytest.approx(2.5, rel=1e-15)
    np.testing.assert_allclose(with_load.first_moment, [2 * 0.4 + 0.5, 2 * 0.1 + 0.5 * 0.2], rtol=1e-15)
    assert with_load.inertia == pytest.approx(0.1 + 2 * (0.16 + 0.01) + 0.01 + 0.5 * 1.04, rel=1e-14)
