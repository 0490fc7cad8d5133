"""The tangent of the equations of motion against differences of the readable ones: they close in with h²."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from mechanisms import assemble, oracle_of, random_state, relative

from ffrobot.mbs import _core
from ffrobot.mbs.fields.state_forces import state_function
from ffrobot.mbs.joints.measure import Marker
from ffrobot.mbs.model.masses import system_mass_matrix
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.mbs.solve.absolute_linearisation import ForcesOfMotion, position_derivative
from ffrobot.mbs.solve.gradients import gradient_rates, gradients
from ffrobot.mbs.solve.initial_state import undeformed_state
from ffrobot.mbs.solve.linearisation import Linearisation

T = 0.37
STEP = 2e-3


def differences(function, x, h):
    """Central differences of `function` in every entry of x, column by column."""
    return np.column_stack([(function(x + h * e) - function(x - h * e)) / (2 * h) for e in np.eye(len(x))])


def assert_derivative(got, function, x):
    """`got` is the limit of central differences, and these have order 2 where they do not meet it at once."""
    wide, narrow = (differences(function, x, h) for h in (STEP, STEP / 2))
    extrapolated = (4 * narrow - wide) / 3
    size = max(np.abs(extrapolated).max(), 1.0)
    errors = [np.abs(d - got).max() / size for d in (wide, narrow)]
    assert relative(got, extrapolated, size) < 1e-8
    if errors[0] > 1e-9:
        assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.05)


@pytest.fixture(params=[name for name in zoo.ALL if not name.startswith("chain") or name == "chain of 3"])
def case(request):
    assembly = assemble(zoo.build(request.param))
    rng = np.random.default_rng(1)
    q, v = random_state(rng, assembly.system.coordinates)
    a, multipliers = rng.standard_normal(len(q)), rng.standard_normal(len(assembly.constraints))
    return assembly, oracle_of(assembly), (q, v, a), multipliers


def test_tangent_is_the_derivative_of_the_equations_of_motion(case):
    assembly, oracle, (q, v, a), multipliers = case
    forces = ForcesOfMotion(assembly.model, [c.measure for c in assembly.constraints]).at(T, q, v, -multipliers)

    def residual(q, v):
        forces = oracle.mass_matrix(q) @ a - oracle.forces(T, q, v)
        return forces + oracle.constraint_values(T, q, v)[2].T @ multipliers

    assert relative(system_mass_matrix(assembly, q), oracle.mass_matrix(q)) < 1e-14
    assert_derivative(forces.damping(a), lambda v: residual(q, v), v)
    assert_derivative(forces.stiffness(a), lambda q: residual(q, v), q)


def pull(t, position, velocity):
    """A cubic spring, a damper that grows with height, and a moment, at the time T."""
    force = -3.0 * (position - 0.2) * (1 + position @ position) - (1 + position[1] ** 2) * velocity
    return *force, 0.4 * position[0] * velocity[1] + t


@pytest.mark.parametrize("name", ["chain of 2", "loaded", "stiffened"])
def test_tangent_of_a_force_that_depends_on_the_motion(name):
    """What it adds to K and D; differences inside leave about 1e-9."""
    bare = assemble(zoo.build(name))
    model = replace(bare.model, state_forces=((Marker("b2", "side"), state_function(pull)),))
    q, v = random_state(np.random.default_rng(2), bare.system.coordinates)

    def tangents(assembly):
        forces, rest = ForcesOfMotion(assembly.model, []).at(T, q, v, np.zeros(0)), np.zeros_like(q)
        return forces.damping(rest), forces.stiffness(rest)

    def force(q, v):
        """Q of the pull alone: M a + C_qᵀλ with it, and without."""
        totals = []
        for assembly in (assemble(model), bare):
            oracle = oracle_of(assembly)
            a, multipliers = oracle.solve(T, q, v)
            C_q = oracle.constraint_values(T, q, v)[2]
            totals.append(system_mass_matrix(assembly, q) @ a + C_q.T @ multipliers)
        return totals[0] - totals[1]

    (D, K), (D_bare, K_bare) = tangents(assemble(model)), tangents(bare)
    assert_derivative(D_bare - D, lambda v: force(q, v), v)
    assert_derivative(K_bare - K, lambda q: force(q, v), q)


def test_tangents_of_rows_are_the_derivatives_of_their_accelerations(case):
    assembly, oracle, (q, v, a), _ = case
    measures, rows = assembly.constraint_measures, [constraint.measure for constraint in assembly.constraints]
    sensing = _core.Sensing(assembly.system, [(measure, 2) for measure in measures], [])

    def by_core(x):
        return sensing.read(x, np.tile(v, (len(x), 1)), np.tile(a, (len(x), 1)))

    def accelerations(q, v):
        return np.array([state.gradient @ a + state.bias for state in (oracle.row(row, q, v) for row in rows)])

    assert (
        relative(gradients(assembly, measures, q), np.array([oracle.row(row, q, v).gradient for row in rows])) < 1e-14
    )
    assert_derivative(2 * gradient_rates(assembly, measures, q, v), lambda v: accelerations(q, v), v)
    assert_derivative(position_derivative(assembly, by_core, q), lambda q: accelerations(q, v), q)


def test_loads_take_part():
    """A force along a slide, whose direction turns with the configuration."""
    loaded, free = (zoo.build("mixed", load=load) for load in ([{"joint": "j3", "moment": "2.0"}], []))
    ((measure, _),) = (load for load in loaded.loads if load not in free.loads)
    size = assemble(loaded).system.coordinates
    q, v = random_state(np.random.default_rng(3), size)
    rest = np.zeros(size)
    given, cancelled, none = (
        ForcesOfMotion(model, [measure]).at(T, q, v, np.array([pull])).stiffness(rest)
        for model, pull in ((loaded, 0.0), (loaded, -2.0), (free, 0.0))
    )
    assert np.abs(given - none).max() > 0.1
    assert relative(cancelled, none) < 1e-14


def reduced_force(assembly, oracle, near, t):
    """Generalized forces on s = (motor coordinates, p) that a motion (s, ṡ, s̈) with closed joints needs."""
    rows = [c.measure for c in assembly.constraints] + list(assembly.model.motors.values())
    modes = np.setdiff1d(np.arange(oracle.size), assembly.frame_coordinates)
    held, k = len(assembly.constraints), len(assembly.model.motors)

    def split(s):
        return np.concatenate([np.zeros(held), s[:k], s[k:]])

    def gradients(q, v):
        states = [oracle.row(row, q, v) for row in rows]
        values = np.array([state.value for state in states])
        G = np.vstack([[state.gradient for state in states], np.eye(oracle.size)[modes]])
        bias = np.concatenate([[state.bias for state in states], np.zeros(len(modes))])
        return np.concatenate([values, q[modes]]), G, bias

    def force(s, s_dot, s_ddot):
        q = near.copy()
        for _ in range(5):  # s is near: Newton doubles the digits each time
            values, G, _ = gradients(q, np.zeros_like(q))
            q -= np.linalg.solve(G, values - split(s))
        _, G, _ = gradients(q, np.zeros_like(q))
        v = np.linalg.solve(G, split(s_dot))
        _, _, bias = gradients(q, v)
        a = np.linalg.solve(G, split(s_ddot) - bias)
        H = np.linalg.solve(G, np.eye(len(G))[:, held:])
        return H.T @ (oracle.mass_matrix(q) @ a - oracle.forces(t, q, v)), (q, v, a)

    values = gradients(near, np.zeros_like(near))[0][held:]
    return values, force


@pytest.mark.parametrize("name", ["mixed backwards", "slider-crank", "loaded", "stiffened", "stiffened, driven"])
def test_linear_equations_are_the_derivative_of_those_in_independent_coordinates(name):
    """About a motion far from equilibrium, so that every term with Ḣ and Ḧ counts."""
    model = replace(zoo.build(name), trajectories=())
    assembly = MechanismSystem(model, model.joints, model.loads, list(model.motors.values()))
    rng = np.random.default_rng(4)
    near = undeformed_state(assembly).q
    modes = np.setdiff1d(np.arange(len(near)), assembly.frame_coordinates)
    near[modes] += 0.1 * rng.standard_normal(len(modes))
    s, force = reduced_force(assembly, oracle_of(assembly), near, T)
    s_dot, s_ddot = rng.standard_normal((2, len(s)))
    expected, (q, v, a) = force(s, s_dot, s_ddot)
    linearisation = Linearisation(model, q)
    assert (linearisation.tree is None) == name.startswith("stiffened")
    linear = linearisation.at(T, q, v, a)
    motors = [linear.names.index(f"joint/{name}") for name in model.motors]
    order = [*motors, *range(len(motors), len(s))]
    assert relative(linear.force[order], expected) < 1e-10
    assert_derivative(linear.M[np.ix_(order, order)], lambda x: force(s, s_dot, x)[0], s_ddot)
    assert_derivative(linear.D[np.ix_(order, order)], lambda x: force(s, x, s_ddot)[0], s_dot)
    assert_derivative(linear.K[np.ix_(order, order)], lambda x: force(x, s_dot, s_ddot)[0], s)
