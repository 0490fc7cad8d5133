"""Motor and modal forces in place of those that hold a trajectory: F_je = −Dᵀ C_sqᵀ λ_s (Shabana 2022, Eq. 21)."""

import numpy as np
import pytest
import velocity_transformation
import zoo
from mechanisms import oracle_of, pcid, relative
from oracle_runs import evaluated, posture_of, run

from ffrobot.common.errors import InputError

LONG = "chain of 24"
OPEN = ["chain of 2", "chain of 3", "chain of 6", LONG, "backwards", "mixed", "mixed backwards", "tree", "loaded"]
CLOSED = ["four-bar", "slider-crank"]


def resolved(name, seed=0, **keys):
    """What is found in one deformed, moving state on the constraints, and the oracle's mechanism."""
    robot = zoo.build(name, **keys)
    found = evaluated(robot, 0.0, *posture_of(robot, np.random.default_rng(seed)))
    return found, oracle_of(found.assembly)


def split_rows(found, mechanism):
    """C_mq, C_sq and T_q."""
    q, v = found.q[0], found.v[0]
    gradients = np.array([state.gradient for state in mechanism.rows(q, v)])
    is_trajectory = np.array(found.assembly.is_trajectory)
    motors = [mechanism.row(row, q, v).gradient for row in found.robot.motors.values()]
    return gradients[~is_trajectory], gradients[is_trajectory], np.array(motors)


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", OPEN)
def test_open_chain_with_the_velocity_transformation_of_its_joints(name, motors):
    found, mechanism = resolved(name, motors=motors)
    D = velocity_transformation.open_chain(mechanism, found.robot.scene, found.q[0])
    C_mq, C_sq, T_q = split_rows(found, mechanism)
    assert np.abs(C_mq @ D).max() < 1e-12  # D is what it says: no motion at the joints …
    count = len(T_q)
    np.testing.assert_allclose(T_q @ D, np.eye(count, D.shape[1]), atol=1e-12)  # … but the motors' own
    force = -D.T @ C_sq.T @ found.lambda_[0]
    assert relative(found.tau[0], force[:count]) < 1e-12
    assert relative(found.F_p[0], force[count:]) < 1e-12


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", CLOSED)
def test_closed_loop_with_a_named_motor(name, motors):
    found, mechanism = resolved(name, motors=motors)
    C_mq, C_sq, T_q = split_rows(found, mechanism)
    assert len(T_q) == 1
    D = velocity_transformation.by_definition(mechanism, C_mq, T_q)
    force = -D.T @ C_sq.T @ found.lambda_[0]
    assert relative(found.tau[0], force[:1]) < 1e-12
    assert relative(found.F_p[0], force[1:]) < 1e-12


@pytest.mark.parametrize("name", OPEN + CLOSED)
def test_actuation_does_the_work_of_the_trajectory_forces(name):
    """τ·ȧ + F_p·ṗ = −λ_s·(rate of the trajectory), joint forces doing none: the virtual work identity as powers."""
    found, mechanism = resolved(name, seed=1)
    _, C_sq, T_q = split_rows(found, mechanism)
    v = found.v[0]
    p_dot = np.concatenate([v[mechanism.columns[body.name]][3:] for body in mechanism.bodies])
    power = -found.lambda_[0] * (C_sq @ v)
    terms = np.concatenate([found.tau[0] * (T_q @ v), found.F_p[0] * p_dot, -power])
    assert abs(terms.sum()) < 1e-11 * np.abs(terms).max()


def test_motors_at_frames_and_sections_share_moments_and_differ_in_modal_forces():
    """With p held, sections and frames turn alike, so τ is the same; the reactions bend the links only at sections."""
    section, robot = resolved("chain of 2")[0], zoo.build("chain of 2", motors="frame")
    in_tree = []
    for of_bodies, in_section in ((section.q[0], section.outcome.q[0]), (section.v[0], section.outcome.v[0])):
        turns = [of_bodies[section.coordinates(name)][2] for name in ("b1", "b2")]
        moved = in_section.copy()  # frames turn against each other by the coordinates of these motors
        moved[[robot.model.columns(joint)[0] for joint in ("j1", "j2")]] = turns[0], turns[1] - turns[0]
        in_tree.append(moved)
    frame = evaluated(robot, 0.0, *in_tree)
    assert relative(frame.q, section.q) < 1e-12
    assert relative(frame.tau[0], section.tau[0]) < 1e-12
    assert relative(frame.F_p[0], section.F_p[0]) > 1e-2


def test_too_few_named_motors_are_refused():
    joints = zoo.serial_joints(2)
    joints[0]["motor"], joints[1]["motor"] = True, False
    with pytest.raises(InputError, match=r"as many motors as the mechanism has degrees of freedom \(2\), found 1"):
        run(zoo.build("chain of 2", joint=joints), pcid())
