"""A payload summed into the invariants = a second, rigid body welded to the point."""

from dataclasses import replace

import numpy as np
import pytest
from material_points import random_cloud
from mechanisms import assemble, evaluate, make_model, random_state, relative
from mechanisms import energies as core_energies
from oracle import Mechanism

from ffrobot.mbs._core import MeasureKind
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.joints.measure import Marker, Measure
from ffrobot.mbs.model.masses import with_payload
from ffrobot.mbs.model.planar_body import from_rigid_body
from ffrobot.mbs.scene.bodies import RigidBody

MASS = 0.7


def welded(body, mass, inertia, gravity):
    """The body and, welded to its tip, a rigid one; its coordinates are all the weld leaves to the first."""
    rigid = RigidBody(mass=mass, inertia=1.0, center=(0.0, 0.0), points={"root": (0.0, 0.0)})
    load = from_rigid_body("load", rigid)
    load = replace(load, inertia=inertia)  # scene files refuse zero, where nothing would hold it
    ends, zero = (Marker(body.name, "tip"), Marker("load", "root")), parse_expression("0")
    rows = [(Measure(k, getattr(MeasureKind, k), *ends), zero) for k in ("x", "y", "angle")]
    return Mechanism([body, load], gravity, rows)


@pytest.mark.parametrize("inertia", [0.0, 0.05])
@pytest.mark.parametrize("seed", range(5))
def test_payload_moves_as_a_welded_body(seed, inertia):
    rng = np.random.default_rng(seed)
    body = random_cloud(rng, "body").planar_body()
    loaded = with_payload(body, "tip", MASS, inertia)
    q, v = random_state(rng, 3 + loaded.n_modes)
    T = np.linalg.lstsq(body.modal_transform, loaded.modal_transform, rcond=None)[0]  # p = T p_loaded
    assembly = assemble(make_model([loaded]))
    a, _ = evaluate(assembly, 0.0, q, v)

    apart = welded(body, MASS, inertia, (0.0, -9.81))
    q_body, v_body = (np.concatenate([x[:3], T @ x[3:]]) for x in (q, v))
    tip = apart.marker(Marker("body", "tip"), np.append(q_body, np.zeros(3)), np.append(v_body, np.zeros(3)))
    q_apart, v_apart = np.concatenate([q_body, tip.position]), np.concatenate([v_body, tip.velocity])
    a_apart, _ = apart.solve(0.0, q_apart, v_apart)
    assert relative(np.concatenate([a[:3], T @ a[3:]]), a_apart[:-3]) < 1e-10
    energies = apart.energies(q_apart, v_apart)
    assert relative(core_energies(assembly, q, v), energies) < 1e-12


def test_modes_with_payload_are_orthonormal_and_decoupled():
    rng = np.random.default_rng(0)
    body = random_cloud(rng, "body").planar_body()
    loaded = with_payload(body, "tip", MASS, 0.05)
    tip = body.points["tip"]
    T = np.linalg.lstsq(body.modal_transform, loaded.modal_transform, rcond=None)[0]
    m_ff = np.eye(4) + MASS * tip.translation.T @ tip.translation + 0.05 * np.outer(tip.rotation, tip.rotation)
    np.testing.assert_allclose(T.T @ m_ff @ T, np.eye(4), atol=1e-13)
    np.testing.assert_allclose(T.T @ np.diag(body.stiffness) @ T, np.diag(loaded.stiffness), atol=1e-12)
    assert np.all(loaded.stiffness < body.stiffness)  # mass lowers every frequency


def test_payload_on_a_rigid_body_follows_steiner():
    link = RigidBody(mass=2.0, inertia=0.1, center=(0.4, 0.1), points={"tip": (1.0, 0.2)})
    loaded = with_payload(from_rigid_body("link", link), "tip", 0.5, 0.01)
    assert loaded.mass == pytest.approx(2.5, rel=1e-15)
    np.testing.assert_allclose(loaded.first_moment, [2 * 0.4 + 0.5, 2 * 0.1 + 0.5 * 0.2], rtol=1e-15)
    assert loaded.inertia == pytest.approx(0.1 + 2 * (0.16 + 0.01) + 0.01 + 0.5 * 1.04, rel=1e-15)
