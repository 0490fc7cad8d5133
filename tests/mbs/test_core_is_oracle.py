"""C++ = the readable NumPy version, to 1e-12 of the largest value, at random states of every mechanism of the zoo."""

import numpy as np
import pytest
import zoo
from mechanisms import assemble, energies, evaluate, joint_state, oracle_of, random_state, relative

from ffrobot.mbs import _core
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.model.model import ModalLoad

T = 0.37


@pytest.fixture(params=zoo.ALL)
def case(request):
    assembly = assemble(zoo.build(request.param))
    rng = np.random.default_rng(1)
    q, v = random_state(rng, assembly.system.coordinates)
    return assembly.system, oracle_of(assembly), q, v


@pytest.mark.parametrize("name", zoo.ALL)
def test_accelerations_multipliers_and_energies(name):
    assembly = assemble(zoo.build(name))
    q, v = joint_state(np.random.default_rng(1), assembly)
    assert_solved(assembly, q, v)
    assert relative(energies(assembly, q, v), oracle_of(assembly).energies(q, v)) < 1e-13


def assert_solved(assembly, q, v, share=1e-12):
    (a, lambda_), (expected_a, expected_lambda) = evaluate(assembly, T, q, v), oracle_of(assembly).solve(T, q, v)
    assert relative(a, expected_a) < share
    if len(lambda_):
        assert relative(lambda_, expected_lambda) < share


def test_constraints_rates_and_jacobian(case):
    system, oracle, q, v = case
    for got, expected in zip(system.constraints(T, q, v), oracle.constraint_values(T, q, v), strict=True):
        assert relative(got, expected) < 1e-14


def test_forces_of_a_motion(case):
    """M a − Q of any a, with rotors, friction and loads."""
    system, oracle, q, v = case
    a = np.random.default_rng(5).standard_normal(len(q))
    expected = oracle.mass_matrix(q) @ a - oracle.forces(T, q, v)
    assert relative(system.required_forces(np.array([T]), q[None], v[None], a[None])[0], expected) < 1e-13


@pytest.mark.parametrize("name", zoo.ALL)
def test_what_sensors_read_of_rows(name):
    """Values, rates and accelerations."""
    assembly = assemble(zoo.build(name))
    oracle, rng = oracle_of(assembly), np.random.default_rng(6)
    (q, v), a = random_state(rng, oracle.size), rng.standard_normal(oracle.size)
    measures = [*assembly.constraint_measures, *(measure for measure, _ in assembly.rotors)]
    rows = [*(row for row, _ in oracle.constraints), *(row for row, _ in oracle.rotors)]
    if not rows:
        return
    states = [oracle.row(row, q, v) for row in rows]
    expected = [[at.value, at.rate, at.gradient @ a + at.bias] for at in states]
    sensing = _core.Sensing(assembly.system, [(measure, order) for measure in measures for order in range(3)], [])
    assert relative(sensing.read(q[None], v[None], a[None])[0], np.ravel(expected)) < 1e-13


def test_forces_at_rest(case):
    system, oracle, q, _ = case
    assert relative(system.force_at_rest(T, q), oracle.forces(T, q, np.zeros_like(q))) < 1e-13


@pytest.mark.parametrize("seed", range(20))
def test_many_states_of_a_general_pair(seed):
    """Several random pairs at large deformation (p of order one) and speed."""
    rng = np.random.default_rng(seed)
    assembly = assemble(zoo.chain(rng, 2))
    q, v = joint_state(rng, assembly, modal=1.0)
    assert_solved(assembly, q, 5 * v)


@pytest.mark.parametrize("modes", [1, 2, 9, 30])
@pytest.mark.parametrize("dense_damping", [False, True])
def test_mode_counts_and_damping(modes, dense_damping):
    rng = np.random.default_rng(modes)
    bodies = zoo.clouds(rng, 2, n=modes, points=40, dense_damping=dense_damping)
    vector = rng.standard_normal(modes)
    load = ModalLoad("b2", vector, parse_expression("3+t"))
    model = zoo.make_model(bodies, [load], joint=zoo.serial_joints(2), trajectory=[zoo.tip_path("b2")], load=zoo.LOADS)
    assembly = assemble(model)
    assert_solved(assembly, *joint_state(rng, assembly))


def test_gradients_are_the_derivatives_of_the_constraints():
    """C_q against central differences of C, and Ċ = C_q q̇ − ∂target/∂t: not only the oracle's word for it."""
    assembly = assemble(zoo.build("mixed"))
    system = assembly.system
    q, v = random_state(np.random.default_rng(2), system.coordinates)
    _, rate, C_q = system.constraints(T, q, v)
    h = 1e-6
    columns = [
        (system.constraints(T, q + h * e, v)[0] - system.constraints(T, q - h * e, v)[0]) / (2 * h)
        for e in np.eye(len(q))
    ]
    assert relative(C_q, np.array(columns).T) < 1e-9
    target_rates = np.array([c.target(T)[1] for c in assembly.constraints])
    assert relative(rate, C_q @ v - target_rates) < 1e-14


def test_accelerations_meet_the_second_derivative_of_the_constraints():
    """C̈ = 0 by differences of Ċ along the motion."""
    assembly = assemble(zoo.build("mixed backwards"))
    system, (q, v) = assembly.system, joint_state(np.random.default_rng(3), assembly)
    a, _ = evaluate(assembly, T, q, v)
    h = 1e-5

    def rate(s):
        return system.constraints(T + s, q + s * v + s**2 / 2 * a, v + s * a)[1]

    assert np.abs(rate(h) - rate(-h)).max() / (2 * h) < 1e-8 * np.abs(a).max()
