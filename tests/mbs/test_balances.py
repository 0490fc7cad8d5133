"""Energy and momentum: what drives put in is found again, and what nothing touches stays."""

import numpy as np
import pytest
import tree_oracle
from body_equations import given_forces
from links import arm, arm_links
from mechanisms import forward, pcid
from oracle_runs import energy_and_losses, run
from scipy.integrate import simpson

OUTPUT_STEP = 2.5e-4  # fine enough that Simpson's rule errs by less than 1e-10 here


@pytest.mark.parametrize("tolerance", [1e-4, 1e-6, 1e-8])
def test_work_of_the_trajectory_forces_is_energy_gained_and_dissipated(tolerance):
    outcome = run(arm(arm_links(damping_ratio=0.02)), pcid(output_step=OUTPUT_STEP, tolerance=tolerance))
    rates = np.column_stack([row.target.sample(outcome.time)[1] for row in outcome.model.rows])
    power = np.sum(-outcome.lambda_ * rates, axis=1)
    work, (total, losses) = simpson(power, x=outcome.time), energy_and_losses(outcome)
    assert losses > 1e-3
    assert abs(work - losses - (total[-1] - total[0])) < tolerance * np.abs(power).max()


def test_work_of_given_loads_is_energy_gained_and_dissipated():
    """Forward: a joint moment, and force and moment on a point that moves and turns."""
    tolerance = 1e-8
    loads = [
        {"joint": "A", "moment": "4*sin(5*t)"},
        {"point": "link2.tip", "x": "3*cos(4*t)", "y": "2", "moment": "0.3*t"},
    ]
    model = arm(arm_links(damping_ratio=0.02), trajectory=[], load=loads)
    outcome = run(model, forward(output_step=OUTPUT_STEP, tolerance=tolerance))
    run_of = outcome.outcome
    given = given_forces(model.model, run_of.q, tree_oracle.frames(model.model.tree, run_of.q), run_of.time)
    power = np.sum(given * run_of.v, axis=1)
    work, (total, losses) = simpson(power, x=outcome.time), energy_and_losses(outcome)
    assert losses > 1e-3
    assert abs(work - losses - (total[-1] - total[0])) < 10 * tolerance * np.ptp(total)
