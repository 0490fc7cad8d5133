"""Forward dynamics under the actuation of an inverse analysis: with all of it, it stays on the inverse solution."""

from dataclasses import replace

import numpy as np
import pytest
from links import arm
from mechanisms import forward, pcid
from oracle_runs import place_of, run
from patch_sets import FULL

from ffrobot.mbs.model.body import transformed


@pytest.fixture(scope="module")
def model():
    return arm()


def pair(model, apply, tolerance, **of_forward):
    inverse = run(model, pcid(tolerance=tolerance))
    analysis = forward(tolerance=tolerance, actuation="inverse", apply=apply, **of_forward)
    outcome = run(model, analysis, inverse, FULL)
    assert outcome.status == "completed"
    return inverse, outcome


def departure(inverse, outcome):
    """Of the tip, relative to its way: (T,)."""
    tips = [place_of(o, "link2.tip") for o in (inverse, outcome)]
    return np.linalg.norm(tips[1] - tips[0], axis=1) / np.ptp(tips[0], axis=0).max()


@pytest.mark.parametrize("apply", ["joints+pzt", "trajectory"])
def test_with_all_forces_the_steps_are_those_of_the_inverse_run(model, apply):
    """And the motion, to round-off: the actuation is that of PCID's own stages."""
    inverse, outcome = pair(model, apply, 1e-4, integrator="dop853")
    assert inverse.statistics.steps == outcome.statistics.steps
    assert departure(inverse, outcome).max() < 1e-11
    assert outcome.statistics.evaluations < 1.1 * inverse.statistics.evaluations


def test_voltages_act_on_the_modes_of_the_links_that_are_simulated(model):
    """Those of the other sign, on which the same patches push the other way: the motion is that of the inverse run."""
    turned = [transformed(body, -np.eye(body.n_modes), body.stiffness) for body in model.bodies]
    inverse = run(model, pcid(tolerance=1e-7))
    analysis = forward(tolerance=1e-7, actuation="inverse", apply="joints+pzt")
    outcome = run(replace(model, bodies=tuple(turned)), analysis, inverse, FULL)
    assert departure(inverse, outcome).max() < 1e-7
