"""Mechanisms in the plane, at random states of the whole zoo: the equations of each body, and rows in NumPy, hold."""

import numpy as np
import pytest
import zoo
from body_equations import energies, residuals
from oracle_runs import evaluated, posture_of

from ffrobot.mbs.quantities.motion import constraint_violation
from ffrobot.mbs.quantities.supply import totals


@pytest.mark.parametrize("name", zoo.ALL)
def test_accelerations_multipliers_energies_and_rows(name):
    """Where loops close; in a state on all joints and paths C and Ċ vanish, and the residual that results have of C̈."""
    robot = zoo.build(name)
    q, v = posture_of(robot, np.random.default_rng(1))
    assert max(residuals(evaluated(robot, 0.37, q, v).motion)) < 1e-12
    motion = evaluated(robot, 0.0, q, v).motion
    for key, expected in vars(energies(motion)).items():
        np.testing.assert_allclose(vars(totals(motion)[0])[key], expected, rtol=1e-11, atol=1e-12, err_msg=key)
    assert constraint_violation(motion).max() < 1e-11
