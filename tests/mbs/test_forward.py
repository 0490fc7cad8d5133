"""Forward dynamics under the actuation of an inverse analysis: with all of it, it stays on the inverse solution."""

import numpy as np
import pytest
import velocity_transformation
from links import arm
from mechanisms import forward, oracle_of, pcid, relative, revolute
from oracle_runs import point_motion, run
from patch_sets import FULL, N, patches
from scipy.optimize import lsq_linear

from ffrobot.mbs.analysis.fcid import Fcid


@pytest.fixture(scope="module")
def model():
    return arm()


def pair(model, apply, tolerance, actuator_set=FULL, **of_forward):
    inverse = run(model, pcid(tolerance=tolerance))
    analysis = forward(tolerance=tolerance, actuation="inverse", apply=apply, **of_forward)
    outcome = run(model, analysis, inverse, actuator_set)
    assert outcome.status == "completed"
    return inverse, outcome


def departure(inverse, outcome):
    """Of the tip, relative to its way: (T,)."""
    tips = [point_motion(o, "link2.tip").position for o in (inverse, outcome)]
    return np.linalg.norm(tips[1] - tips[0], axis=1) / np.ptp(tips[0], axis=0).max()


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_full_actuation_stays_on_the_inverse_solution(model, apply, tolerance):
    """Measured for 1e-6: tip 1e-8 of its way, deflections 2e-7 of their peak; see the ratios below."""
    inverse, outcome = pair(model, apply, tolerance)
    assert departure(inverse, outcome).max() < tolerance
    assert relative(outcome.q, inverse.q) < tolerance
    deflections = [point_motion(o, "link2.tip").deflection for o in (inverse, outcome)]
    assert relative(deflections[1], deflections[0]) < 10 * tolerance


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
def test_of_other_steps_the_difference_falls_with_the_tolerance(model, apply):
    """Both lie far below the tolerance, where chance in the two runs' steps counts."""
    loose, tight = (departure(*pair(model, apply, tolerance, integrator="dopri5")).max() for tolerance in (1e-4, 1e-7))
    assert tight < 0.05 * loose


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
def test_with_the_steps_of_the_inverse_run_rounding_is_all_that_is_left(model, apply):
    """Stages of both runs are those of one method for both (`RecordedMotion`): their errors are the same."""
    inverse, outcome = pair(model, apply, 1e-4, integrator="dop853")
    assert departure(inverse, outcome).max() < 1e-11
    assert outcome.statistics.steps == inverse.statistics.steps


def test_joint_moments_alone_leave_the_path(model):
    """The modal forces are missing: the links deflect and ring at once (Shabana 2022, Fig. 17)."""
    departures = departure(*pair(model, "joints", 1e-6))
    assert departures[0] == 0
    assert departures[:11].max() > 1e-3  # within a tenth of a second
    assert departures.max() > 0.01


def test_joint_moments_alone_are_the_full_actuation_with_patches_that_do_nothing(model):
    nothing = patches(np.zeros((N, N)))
    _, idle = pair(model, "joints+pzt", 1e-6, nothing)
    _, joints = pair(model, "joints", 1e-6)
    assert relative(idle.q, joints.q) < 1e-6


def test_motors_at_frames_work_as_well(model):
    """Other modal forces, the same motion."""
    inverse, outcome = pair(arm(motors="frame"), "joints+pzt", 1e-7)
    assert relative(inverse.F_p, pair(model, "joints", 1e-7)[0].F_p) > 0.1
    assert departure(inverse, outcome).max() < 1e-7


def test_outputs_between_those_of_the_inverse_run_are_as_good(model):
    """The actuation comes from the dense output, not from samples at output times."""
    inverse = run(model, pcid(tolerance=1e-7, output_step=0.5))
    analysis = forward(tolerance=1e-7, output_step=0.01, actuation="inverse", apply="joints+pzt")
    outcome = run(model, analysis, inverse, FULL)
    reference = run(model, pcid(tolerance=1e-7))
    assert departure(reference, outcome).max() < 1e-7


@pytest.mark.parametrize("integrator", ["dopri5", "radau"])
def test_recordings_of_other_integrators_are_replayed(model, integrator):
    inverse = run(model, pcid(tolerance=1e-5, integrator=integrator))
    analysis = forward(tolerance=1e-5, actuation="inverse", apply="joints+pzt")
    outcome = run(model, analysis, inverse, FULL)
    assert outcome.status == "completed"
    assert departure(inverse, outcome).max() < 1e-5


@pytest.mark.parametrize("shape", ["zero", "static"])
def test_forward_run_under_fcid_keeps_path_and_shape(model, shape):
    """Links that ring in PCID keep a shape that is prescribed: straight, or sagging."""
    analysis = Fcid(name="fcid", kind="fcid", shape=shape, end=1.0, output_step=0.01)
    inverse = run(model, analysis)
    following = forward(tolerance=1e-6, actuation="fcid", apply="joints+pzt")
    outcome = run(model, following, inverse, FULL)
    assert departure(inverse, outcome).max() < 1e-6
    modal = np.r_[inverse.coordinates("link1")][3:], np.r_[inverse.coordinates("link2")][3:]
    for own in modal:
        size = max(np.abs(inverse.q[:, own]).max(), 1e-3)
        assert np.abs(outcome.q[:, own] - inverse.q[:, own]).max() < 1e-5 * size


def limited_arm():
    joints = [
        revolute("O", "ground", "link1.root", moment_limit=12.0),
        revolute("A", "link1.tip", "link2.root", moment_limit=4.0),
    ]
    return arm(joint=joints)


@pytest.mark.parametrize("kind", ["pcid", "fcid"])
def test_saturated_actuators_give_what_their_limits_leave(kind):
    """Dᵀ (M q̈ − Q) = (clip(τ), Φ_V V) at every output, V by SciPy's bounded least squares."""
    model = limited_arm()
    Phi = np.random.default_rng(2).standard_normal((N, N))
    limit = np.array([3.0, 1.0, 0.5])
    inverse = (
        run(model, pcid(tolerance=1e-7))
        if kind == "pcid"
        else run(model, Fcid(name="inverse", kind="fcid", shape="zero", end=1.0, output_step=0.01))
    )
    analysis = forward(tolerance=1e-7, actuation="inverse", apply="joints+pzt", limits=True)
    actuator_set = patches(Phi, limit)
    outcome = run(model, analysis, inverse, actuator_set)
    tau = np.clip(inverse.tau, [-12.0, -4.0], [12.0, 4.0])
    assert np.any(tau != inverse.tau)
    mechanism, saturated = oracle_of(outcome.assembly), 0
    for k in range(0, 101, 10):
        q, v = outcome.q[k], outcome.v[k]
        C_mq = np.array([row.gradient for row in mechanism.rows(q, v)])[~np.array(outcome.assembly.is_trajectory)]
        T_q = np.array([mechanism.row(row, q, v).gradient for row in model.motors.values()])
        D, supplied = velocity_transformation.by_definition(mechanism, C_mq, T_q), [tau[k]]
        for name in ("link1", "link2"):
            wanted = inverse.F_p[k, inverse.modal_columns(name)]
            V = lsq_linear(Phi, wanted, (-limit, limit), method="bvls", tol=1e-14).x
            saturated += np.count_nonzero(np.abs(V) >= limit)
            supplied.append(Phi @ V)
        needed = D.T @ (mechanism.mass_matrix(q) @ outcome.a[k] - mechanism.forces(outcome.time[k], q, v))
        assert (
            relative(needed, np.concatenate(supplied)) < 1e-6
        )  # the inverse run between its outputs, to its tolerance
    assert saturated > 10


def test_limits_that_are_never_reached_change_nothing(model):
    inverse = run(model, pcid(tolerance=1e-6))
    wide = patches(np.eye(N), np.full(N, 1e6))
    runs = [
        run(model, forward(tolerance=1e-6, actuation="inverse", apply="joints+pzt", limits=limits), inverse, e)
        for limits, e in ((True, wide), (False, FULL))
    ]
    np.testing.assert_array_equal(runs[0].q, runs[1].q)
