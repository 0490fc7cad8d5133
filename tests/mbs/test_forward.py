"""Forward dynamics under the actuation of an inverse analysis: with all of it, it stays on the inverse solution."""

import numpy as np
import pytest
from links import arm
from mechanisms import always, forward, pcid, relative

from ffrobot.mbs.analyses import run_forward, run_pcid
from ffrobot.mbs.observation import point_motion

FULL = {"link1": np.eye(3), "link2": np.eye(3)}  # patches that reach every mode


@pytest.fixture(scope="module")
def model():
    return arm()


def pair(model, apply, tolerance, projector=FULL):
    inverse = run_pcid(model, pcid(tolerance=tolerance), True, always)
    analysis = forward(tolerance=tolerance, actuation="inverse", apply=apply)
    outcome = run_forward(model, analysis, inverse, projector, always)
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
def test_the_difference_falls_with_the_tolerance(model, apply):
    """Both lie far below the tolerance, where chance in the two runs' steps counts: ratios of 90 to 300 were seen."""
    loose, tight = (departure(*pair(model, apply, tolerance)).max() for tolerance in (1e-4, 1e-7))
    assert tight < 0.05 * loose


def test_joint_moments_alone_leave_the_path(model):
    """The modal forces are missing: the links deflect and ring at once (Shaban 2022, Fig. 17)."""
    departures = departure(*pair(model, "joints", 1e-6))
    assert departures[0] == 0
    assert departures[:11].max() > 1e-3  # within a tenth of a second
    assert departures.max() > 0.01


def test_joint_moments_alone_are_the_full_actuation_with_patches_that_do_nothing(model):
    nothing = {"link1": np.zeros((3, 3)), "link2": np.zeros((3, 3))}
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
    inverse = run_pcid(model, pcid(tolerance=1e-7, output_step=0.5), True, always)
    analysis = forward(tolerance=1e-7, output_step=0.01, actuation="inverse", apply="joints+pzt")
    outcome = run_forward(model, analysis, inverse, FULL, always)
    reference = run_pcid(model, pcid(tolerance=1e-7), False, always)
    assert departure(reference, outcome).max() < 1e-7
