"""Motor and modal forces in place of those that hold a trajectory: F_je = −Dᵀ C_sqᵀ λ_s (Shabana 2022, Eq. 21)."""

import numpy as np
import pytest
import velocity_transformation
import zoo
from mechanisms import assemble, core_run, on_constraints, oracle_of, relative

from ffrobot.common.errors import InputError
from ffrobot.mbs.solve.initial_state import undeformed_state

LONG = "chain of 24"
OPEN = ["chain of 2", "chain of 3", "chain of 6", LONG, "backwards", "mixed", "mixed backwards", "tree", "loaded"]
CLOSED = ["four-bar", "slider-crank"]


def resolved(assembly, seed=0):
    """(q, v, λ, τ, F_p) the core reports at one deformed, moving state on the constraints."""
    rng = np.random.default_rng(seed)
    start = undeformed_state(assembly)
    q, v = start.q.copy(), start.v + rng.standard_normal(len(start.v))
    for body, first in zip(assembly.model.bodies, assembly.first, strict=True):
        q[first + 3 : first + 3 + body.n_modes] = 0.05 * rng.standard_normal(body.n_modes)
    q, v = on_constraints(assembly, 0.0, q, v)
    run = core_run(assembly, q, v, [0.0, 1e-6], max_steps=1, motors=assembly.model.motors.values())
    assert run.residual[0].max() < 1e-12
    return run.q[0], run.v[0], run.multipliers[0], run.tau[0], run.F_p[0]


def split_rows(assembly, mechanism, q, v):
    """C_mq, C_sq and T_q."""
    gradients = np.array([state.gradient for state in mechanism.rows(q, v)])
    is_trajectory = np.array(assembly.is_trajectory)
    motors = [mechanism.row(row, q, v).gradient for row in assembly.model.motors.values()]
    return gradients[~is_trajectory], gradients[is_trajectory], np.array(motors)


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", OPEN)
def test_open_chain_with_the_velocity_transformation_of_its_joints(name, motors):
    assembly = assemble(zoo.build(name, motors=motors))
    mechanism = oracle_of(assembly)
    q, v, lambda_, tau, F_p = resolved(assembly)
    D = velocity_transformation.open_chain(mechanism, assembly.model.scene, q)
    C_mq, C_sq, T_q = split_rows(assembly, mechanism, q, v)
    assert np.abs(C_mq @ D).max() < 1e-12  # D is what it says: no motion at the joints …
    count = len(T_q)
    np.testing.assert_allclose(T_q @ D, np.eye(count, D.shape[1]), atol=1e-12)  # … but the motors' own
    force = -D.T @ C_sq.T @ lambda_[assembly.is_trajectory]
    assert relative(tau, force[:count]) < 1e-12
    assert relative(F_p, force[count:]) < 1e-12


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", CLOSED)
def test_closed_loop_with_a_named_motor(name, motors):
    assembly = assemble(zoo.build(name, motors=motors))
    mechanism = oracle_of(assembly)
    q, v, lambda_, tau, F_p = resolved(assembly)
    C_mq, C_sq, T_q = split_rows(assembly, mechanism, q, v)
    assert len(T_q) == 1
    D = velocity_transformation.by_definition(mechanism, C_mq, T_q)
    force = -D.T @ C_sq.T @ lambda_[assembly.is_trajectory]
    assert relative(tau, force[:1]) < 1e-12
    assert relative(F_p, force[1:]) < 1e-12


@pytest.mark.parametrize("name", OPEN + CLOSED)
def test_actuation_does_the_work_of_the_trajectory_forces(name):
    """τ·ȧ + F_p·ṗ = −λ_s·(rate of the trajectory), joint forces doing none: the virtual work identity as powers."""
    assembly = assemble(zoo.build(name))
    mechanism = oracle_of(assembly)
    q, v, lambda_, tau, F_p = resolved(assembly, seed=1)
    _, C_sq, T_q = split_rows(assembly, mechanism, q, v)
    p_dot = np.concatenate([v[mechanism.columns[body.name]][3:] for body in mechanism.bodies])
    power = -lambda_[assembly.is_trajectory] * (C_sq @ v)
    terms = np.concatenate([tau * (T_q @ v), F_p * p_dot, -power])
    assert abs(terms.sum()) < 1e-12 * np.abs(terms).max()


def test_motors_at_frames_and_sections_share_moments_and_differ_in_modal_forces():
    """With p held, sections and frames turn alike, so τ is the same; the reactions bend the links only at sections."""
    section, frame = (resolved(assemble(zoo.build("chain of 2", motors=motors))) for motors in ("section", "frame"))
    assert relative(frame[3], section[3]) < 1e-13
    assert relative(frame[4], section[4]) > 1e-2


def test_too_few_named_motors_are_refused():
    joints = zoo.serial_joints(2)
    joints[0]["motor"], joints[1]["motor"] = True, False
    with pytest.raises(InputError, match=r"as many motors as the mechanism has degrees of freedom \(2\), found 1"):
        zoo.build("chain of 2", joint=joints)
