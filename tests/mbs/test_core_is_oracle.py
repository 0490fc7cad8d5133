"""Mechanisms in the plane, at random states of the whole zoo: the equations of each body, and rows in NumPy, hold."""

import numpy as np
import pytest
import zoo
from body_equations import energies
from mechanisms import ModalLoad
from oracle_runs import evaluated, posture_of, random_tree_state
from prescribed_oracle import residuals

from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.quantities.motion import constraint_violation
from ffrobot.mbs.quantities.supply import totals

T = 0.37


def assert_solved(robot, q, v):
    assert max(residuals(evaluated(robot, T, q, v).motion)) < 1e-12


@pytest.mark.parametrize("name", zoo.ALL)
def test_accelerations_multipliers_energies_and_rows(name):
    """Where loops close; in a state on all joints and paths C and Ċ vanish, and the residual that results have of C̈."""
    robot = zoo.build(name)
    q, v = posture_of(robot, np.random.default_rng(1))
    assert_solved(robot, q, v)
    motion = evaluated(robot, 0.0, q, v).motion
    for key, expected in vars(energies(motion)).items():
        np.testing.assert_allclose(vars(totals(motion)[0])[key], expected, rtol=1e-11, atol=1e-12, err_msg=key)
    assert constraint_violation(motion).max() < 1e-11


@pytest.mark.parametrize("modes", [1, 2, 9, 30])
@pytest.mark.parametrize("dense_damping", [False, True])
def test_mode_counts_and_damping(modes, dense_damping):
    rng = np.random.default_rng(modes)
    bodies = zoo.clouds(rng, 2, n=modes, points=40, dense_damping=dense_damping)
    load = ModalLoad("b2", rng.standard_normal(modes), parse_expression("3+t"))
    robot = zoo.make_model(bodies, [load], joint=zoo.serial_joints(2), trajectory=[zoo.tip_path("b2")], load=zoo.LOADS)
    assert_solved(robot, *random_tree_state(rng, robot))
