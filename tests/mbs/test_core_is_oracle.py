"""C++ in the plane = the readable NumPy version, to 1e-12 of the largest value, at random states of the whole zoo."""

import numpy as np
import pytest
import zoo
from mechanisms import ModalLoad, oracle_of, relative
from oracle_runs import energies, evaluated, posture_of, random_tree_state

from ffrobot.mbs.fields.expressions import parse_expression

T = 0.37


def assert_solved(robot, q, v, share=1e-12):
    """Multipliers are those of the rows that the tree has, the last ones of the oracle's."""
    found = evaluated(robot, T, q, v)
    a, lambda_ = oracle_of(found.assembly).solve(T, found.q[0], found.v[0])
    assert relative(found.a[0], a) < share
    if robot.trajectories:
        assert relative(found.lambda_[0], lambda_[found.assembly.is_trajectory]) < share


@pytest.mark.parametrize("name", zoo.ALL)
def test_accelerations_multipliers_energies_and_rows(name):
    """Where loops close; in a state on all joints and paths C and Ċ vanish, and the residual that results have of C̈."""
    robot = zoo.build(name)
    q, v = posture_of(robot, np.random.default_rng(1))
    assert_solved(robot, q, v, 1e-11 if robot.model.loop_rows.any() else 1e-12)
    found = evaluated(robot, 0.0, q, v)
    oracle = oracle_of(found.assembly)
    expected = oracle.energies(found.q[0], found.v[0])
    assert relative(np.ravel(list(energies(found).values())), expected) < 1e-12
    C, C_dot, _ = oracle.constraint_values(0.0, found.q[0], found.v[0])
    assert np.abs(C).max(initial=0.0) < 1e-12
    assert np.abs(C_dot).max(initial=0.0) < 1e-11
    assert found.motion.violation.max() < 1e-11


@pytest.mark.parametrize("seed", range(20))
def test_many_states_of_a_general_pair(seed):
    """Several random pairs at large deformation (p of order one) and speed."""
    rng = np.random.default_rng(seed)
    robot = zoo.chain(rng, 2)
    q, v = random_tree_state(rng, robot, modal=1.0)
    assert_solved(robot, q, 5 * v)


@pytest.mark.parametrize("modes", [1, 2, 9, 30])
@pytest.mark.parametrize("dense_damping", [False, True])
def test_mode_counts_and_damping(modes, dense_damping):
    rng = np.random.default_rng(modes)
    bodies = zoo.clouds(rng, 2, n=modes, points=40, dense_damping=dense_damping)
    load = ModalLoad("b2", rng.standard_normal(modes), parse_expression("3+t"))
    robot = zoo.make_model(bodies, [load], joint=zoo.serial_joints(2), trajectory=[zoo.tip_path("b2")], load=zoo.LOADS)
    assert_solved(robot, *random_tree_state(rng, robot))
