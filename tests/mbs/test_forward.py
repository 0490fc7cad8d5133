"""Forward dynamics under the actuation of an inverse analysis: with all of it, it stays on the inverse solution."""

from dataclasses import replace

import numpy as np
import pytest
from links import arm
from mechanisms import forward, pcid
from oracle_runs import point_motion, run
from patch_sets import FULL

from ffrobot.mbs.model.body import transformed


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
def test_of_other_steps_the_difference_falls_with_the_tolerance(model, apply):
    """Both lie far below the tolerance, where chance in the two runs' steps counts."""
    loose, tight = (departure(*pair(model, apply, tolerance, integrator="dopri5")).max() for tolerance in (1e-4, 1e-7))
    assert tight < 0.05 * loose


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
def test_with_all_forces_the_steps_are_those_of_the_inverse_run(model, apply):
    """And the motion, to round-off: the actuation is that of PCID's own stages."""
    inverse, outcome = pair(model, apply, 1e-4, integrator="dop853")
    assert inverse.statistics.steps == outcome.statistics.steps
    assert departure(inverse, outcome).max() < 1e-11
    assert outcome.statistics.evaluations < 1.1 * inverse.statistics.evaluations


def test_joint_moments_alone_leave_the_path(model):
    """The modal forces are missing: the links deflect and ring at once (Shabana 2022, Fig. 17)."""
    departures = departure(*pair(model, "joints", 1e-6))
    assert departures[0] == 0
    assert departures[:11].max() > 1e-3  # within a tenth of a second
    assert departures.max() > 0.01


def test_outputs_between_those_of_the_inverse_run_are_as_good(model):
    """The actuation comes from the dense output, not from samples at output times."""
    inverse = run(model, pcid(tolerance=1e-7, output_step=0.5))
    analysis = forward(tolerance=1e-7, output_step=0.01, actuation="inverse", apply="joints+pzt")
    outcome = run(model, analysis, inverse, FULL)
    reference = run(model, pcid(tolerance=1e-7))
    assert departure(reference, outcome).max() < 1e-7


def test_voltages_act_on_the_modes_of_the_links_that_are_simulated(model):
    """Those of the other sign, on which the same patches push the other way: the motion is that of the inverse run."""
    turned = [transformed(body, -np.eye(body.n_modes), body.stiffness) for body in model.bodies]
    inverse = run(model, pcid(tolerance=1e-7))
    analysis = forward(tolerance=1e-7, actuation="inverse", apply="joints+pzt")
    outcome = run(replace(model, bodies=tuple(turned)), analysis, inverse, FULL)
    assert departure(inverse, outcome).max() < 1e-7
