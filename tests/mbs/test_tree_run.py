"""Runs in joint coordinates give the motion of the oracle, whose equations SciPy integrates in absolute coordinates."""

from dataclasses import replace

import numpy as np
import pytest
import velocity_transformation
import zoo
from links import arm, ritz_link
from mechanisms import always, assemble, forward, make_model, oracle_of, pcid, relative, revolute
from rods import rod
from scipy.integrate import solve_ivp

from ffrobot.mbs.analysis.elastic_joints import add_transmission
from ffrobot.mbs.analysis.forward import run_forward
from ffrobot.mbs.analysis.outcome import EarlierRun
from ffrobot.mbs.analysis.pcid import run_pcid
from ffrobot.mbs.analysis.replay import ActuatorSet
from ffrobot.mbs.fields.state_forces import state_function
from ffrobot.mbs.joints.measure import Marker
from ffrobot.mbs.model.planar_body import from_rigid_body
from ffrobot.mbs.model.planar_tree import PlanarTree
from ffrobot.mbs.scene.bodies import RigidBody
from ffrobot.mbs.solve.initial_state import undeformed_state

KEYS = {"end": 0.05, "output_step": 0.005, "tolerance": 1e-10, "integrator": "dop853"}
DRIVEN = (
    "chain of 2",
    "backwards",
    "mixed",
    "mixed backwards",
    "tree",
    "loaded",
    "mixed, as built",
    "stiffened",
    "driven, as built",
)


def oracle_motion(outcome, oracle, times):
    """q and v (T, coordinates) at `times`, by SciPy from where the outcome starts."""
    n = outcome.q.shape[1]

    def slopes(t, y):
        return np.concatenate([y[n:], oracle.solve(t, y[:n], y[n:])[0]])

    start, span = np.concatenate([outcome.q[0], outcome.v[0]]), (outcome.time[0], outcome.time[-1])
    found = solve_ivp(slopes, span, start, method="DOP853", t_eval=times, rtol=1e-10, atol=1e-12)
    return found.y[:n].T, found.y[n:].T


def compare(found, share, loads=()):
    """Motion, and what follows from it at each output; `loads` (row, size) act beside those of the scene."""
    oracle = oracle_of(found.assembly)
    oracle.loads += loads
    q, v = oracle_motion(found, oracle, found.time)
    at_outputs = [oracle.solve(*state) for state in zip(found.time, found.q, found.v, strict=True)]
    expected = {"q": q, "v": v, "a": np.array([a for a, _ in at_outputs])}
    expected["lambda_"] = np.array([multipliers for _, multipliers in at_outputs])
    for name, numbers in expected.items():
        if numbers.size:
            peak = max(np.abs(numbers).max(), 1e-6)  # nothing but rounding in joints of what falls freely
            assert relative(getattr(found, name), numbers, peak) < (share if name in "qv" else 1e-8), name
    assert found.residual.max() < 1e-9


@pytest.mark.parametrize("name", DRIVEN)
def test_inverse_dynamics(name):
    """At outputs, and between them, where recorded steps are made again."""
    model, times = zoo.build(name), np.sort(np.random.default_rng(0).uniform(0.0, KEYS["end"], 20))
    found = run_pcid(model, pcid(**KEYS), True, always)
    compare(found, 1e-7)
    if found.tau is None:
        return
    tau, F_p = found.details.actuation_source(found).sample(times.tolist())
    oracle, is_trajectory = oracle_of(found.assembly), np.array(found.assembly.is_trajectory)
    for k, (t, q, v) in enumerate(zip(times, *oracle_motion(found, oracle, times), strict=True)):
        C_q = oracle.constraint_values(t, q, v)[2]
        T_q = np.array([oracle.row(row, q, v).gradient for row in model.motors.values()])
        D = velocity_transformation.by_definition(oracle, C_q[~is_trajectory], T_q)
        force = -D.T @ C_q[is_trajectory].T @ oracle.solve(t, q, v)[1][is_trajectory]
        assert relative(np.concatenate([tau[k], F_p[k]]), force, np.abs(found.F_p).max()) < 1e-7


@pytest.mark.parametrize("name", [*DRIVEN, "free-flying", "loaded, frame motors"])
def test_free_motion(name):
    compare(run_forward(zoo.build(name), forward(**KEYS), None, ActuatorSet(), always), 1e-7)


def test_rows_in_several_blocks():
    """Joints of a chain that keep their angles, all but the last, and projection onto them."""
    angles = {f"b{k}": 0.1 * k for k in range(1, 19)}
    kept = [
        {"name": f"turn {k}", "joint": f"j{k}", "value": f"0.1+{0.1 * (-1) ** k}*t+0.05*t**2"} for k in range(1, 18)
    ]
    model = zoo.chain(np.random.default_rng(1), 18, trajectory=kept, initial={"angles": angles})
    compare(run_pcid(model, pcid(**KEYS), False, always), 1e-7)


def test_motion_under_forces_of_the_motion_of_points():
    def pull(_, position, velocity):
        return *(-30 * position - 2 * velocity), 0.5 * position[0] * velocity[1]

    model = replace(zoo.build("mixed"), state_forces=((Marker("b2", "side"), state_function(pull)),))
    compare(run_forward(model, forward(**KEYS), None, ActuatorSet(), always), 1e-7)


@pytest.mark.parametrize("motors", ["section", "frame"])
@pytest.mark.parametrize("name", ["chain of 3", "mixed backwards"])
def test_free_motion_with_gears_that_give(name, motors):
    model = zoo.geared(name, motors=motors)
    found = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    assert len(found.assembly.model.bodies) > len(model.bodies)
    compare(found, 1e-7)


@pytest.mark.parametrize(("integrator", "tolerance"), [("radau", 1e-8), ("generalized-alpha", 3e-3)])
def test_gears_on_frames_with_implicit_integrators(integrator, tolerance):
    """Their springs are among the stiff forces."""
    keys = KEYS | {"integrator": integrator, "tolerance": tolerance}
    model = zoo.geared("chain of 3", motors="frame")
    compare(run_forward(model, forward(**keys), None, ActuatorSet(), always), 2 * tolerance)


@pytest.mark.parametrize("motors", ["section", "frame"])
def test_gears_that_set_out_from_nothing(motors):
    """In no gravity, without damping: rounding of stiff springs is not what steps follow."""
    gear = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 4e4}
    joints = [revolute("O", "ground", "link1.root", **gear), revolute("A", "link1.tip", "link2.root", **gear)]
    load = [{"joint": "O", "moment": "4*sin(2*t)**4"}, {"joint": "A", "moment": "sin(2*t)**4"}]
    bodies = [rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)]
    initial = {"angles": {"link1": 0.4, "link2": 1.3}}
    model = make_model(bodies, joint=joints, load=load, initial=initial, gravity=(0.0, 0.0), motors=motors)
    found = run_forward(model, forward(**KEYS | {"end": 0.5}), None, ActuatorSet(), always)
    compare(found, 1e-7)
    assert found.statistics.steps < 400  # as in absolute coordinates; it ended at the start before


def test_replay_with_gears_that_give():
    """Motors turn outputs, from twists that carry the moments of the inverse analysis on."""
    gear = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 3e3, "damping": 2.0}
    joints = [revolute("O", "ground", "link1.root", **gear), revolute("A", "link1.tip", "link2.root", **gear)]
    model = arm(joint=joints)
    source = add_transmission(run_pcid(model, pcid(**KEYS), True, always))
    replay = forward(**KEYS, actuation="inverse", apply="joints")
    compare(run_forward(model, replay, source, ActuatorSet(), always), 1e-7)


@pytest.mark.parametrize("apply", ["joints", "trajectory"])
def test_replay(apply):
    """What was found acts, at any time: moments of motors as loads of the oracle, forces of the path along it."""
    model = arm()
    source = run_pcid(model, pcid(**KEYS), True, always)
    found = run_forward(model, forward(**KEYS, actuation="inverse", apply=apply), source, ActuatorSet(), always)
    if apply == "trajectory":
        assert relative(found.q, source.q) < 1e-6
        return
    acting = source.details.actuation_source(source)
    motors = enumerate(model.motors.values())
    compare(found, 1e-7, [(row, lambda t, k=k: acting.sample([t])[0][0, [k]]) for k, row in motors])


@pytest.mark.parametrize(("integrator", "tolerance"), [("radau", 1e-8), ("dopri5", 1e-8), ("generalized-alpha", 3e-3)])
@pytest.mark.parametrize("name", ["chain of 2", "mixed backwards", "loaded", "loaded, frame motors", "mixed, as built"])
def test_every_integrator(name, integrator, tolerance):
    model, keys = zoo.build(name), KEYS | {"integrator": integrator, "tolerance": tolerance}
    compare(run_pcid(model, pcid(**keys), False, always), 2 * tolerance)


LOOPS = ("four-bar", "slider-crank", "slider-crank, as built")


@pytest.mark.parametrize("name", LOOPS)
def test_loops_that_move_freely(name):
    compare(run_forward(zoo.build(name), forward(**KEYS | {"tolerance": 1e-9}), None, ActuatorSet(), always), 2e-7)


@pytest.mark.parametrize("name", LOOPS)
def test_inverse_dynamics_of_loops(name):
    compare(run_pcid(zoo.build(name), pcid(**KEYS), True, always), 2e-7)


def parallelogram(link, *, cranks=2):
    """Cranks of 0.3 m that fall from 60° above the flat posture, side by side under a coupler of 1 m."""
    feet = np.linspace(0.0, 1.0, cranks)
    names = [f"crank{k}" for k in range(cranks)]
    points = {f"at{k}": (float(x), 0.0) for k, x in enumerate(feet)}
    coupler = RigidBody(mass=0.8, inertia=0.8 / 12, center=(0.5, 0.0), points=points)
    bodies = [link(name, 0.3) for name in names] + [from_rigid_body("coupler", coupler)]
    joints = [revolute(f"foot{k}", "ground", f"{name}.root", at=(float(feet[k]), 0.0)) for k, name in enumerate(names)]
    joints += [revolute(f"head{k}", f"{name}.tip", f"coupler.at{k}") for k, name in enumerate(names)]
    angles = dict.fromkeys(names, 1.0) | {"coupler": 0.0}
    return make_model(bodies, joint=joints, trajectory=[], initial={"angles": angles})


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_a_parallelogram_that_falls_flat_stops_and_says_why(tolerance):
    """Branches meet there; steps that would jump over the posture do not."""
    model = parallelogram(lambda name, length: rod(name, length, 0.5))
    outcome = run_forward(model, forward(end=1.0, tolerance=tolerance), None, ActuatorSet(), always)
    assert outcome.status == "step underflow"
    assert "singular" in outcome.statistics.cause
    angle = outcome.q[-1, 2]
    assert 0.0 < angle < 0.3
    assert 0.2 < outcome.statistics.time_reached < 0.6


def test_runs_go_on_where_they_were_stopped():
    """To the last bit."""
    model, analysis = arm(), pcid(**KEYS)
    whole = run_pcid(model, analysis, True, always)
    stopped = run_pcid(model, analysis.model_copy(update={"max_steps": whole.statistics.steps // 2}), True, always)
    assert stopped.status == "too many steps"
    earlier = EarlierRun(stopped.motion, stopped.forces, stopped.statistics, stopped.continuation, "run")
    again = run_pcid(model, analysis, True, always, earlier)
    for name in ("q", "v", "a", "lambda_", "tau"):
        assert np.array_equal(getattr(again, name), getattr(whole, name)), name
    assert np.array_equal(again.continuation.recording.states, whole.continuation.recording.states)


LONE = {
    "rail": {"type": "prismatic", "axis": (0.6, 0.8)},
    "weld": {"type": "weld"},
    "hinge": {"type": "revolute"},
}


@pytest.mark.parametrize("condition", ["cantilever", "simply-supported"])
@pytest.mark.parametrize("kind", LONE)
def test_forces_on_the_ground_of_a_link_alone(kind, condition):
    """They follow from nothing else that is judged: unobserved, they erred by up to 4.8 tolerances."""
    joint = {"name": "O", "between": ("ground", "beam.root"), **LONE[kind]}
    load = [{"point": "beam.tip", "y": "20+3*sin(9*t)"}]
    model = make_model([ritz_link("beam", condition, modes=6, mass=2.0, EI=50.0)], joint=[joint], load=load)
    runs = [
        run_forward(model, forward(**KEYS | {"end": 0.3, "tolerance": tolerance}), None, ActuatorSet(), always)
        for tolerance in (1e-6, 1e-10)
    ]
    found, exact = runs
    for name in ("q", "v", "lambda_"):
        assert relative(getattr(found, name), getattr(exact, name)) < 0.4e-6, name


def test_rows_that_hardly_differ_at_the_start_are_all_kept():
    """Of an angle and a way across the tip's, the tip 8e-6 rad off: rounding leaves 1e-16/δ² of their multipliers.

    Steps do not shrink for that: the angle follows its path, multipliers are those of absolute coordinates.
    """
    off, rods = 8e-6, [rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)]
    paths = [
        {"name": "tip", "point": "link2.tip", "x": f"2*cos(0.5)*cos({off}+t**2)"},
        {"name": "A", "joint": "A", "value": "1"},
    ]
    model = arm(rods, trajectory=paths, initial={"angles": {"link1": off - 0.5, "link2": off + 0.5}})
    assembly = assemble(model)
    start, tree = undeformed_state(assembly), PlanarTree(assembly)
    assert len(tree.core.keep_independent_rows(*tree.state(start.q, start.v))) == 1  # by pivoting
    keys = KEYS | {"tolerance": 1e-6}
    found = run_pcid(model, pcid(**keys), False, always)
    assert found.statistics.status == "completed"
    np.testing.assert_allclose(found.q[:, 2], off + found.time**2 - 0.5, atol=1e-9)
    oracle = oracle_of(assembly)
    for t, q, v, multipliers in zip(found.time, found.q, found.v, found.lambda_, strict=True):
        assert relative(multipliers, oracle.solve(t, q, v)[1]) < 1e-5


def test_a_load_that_has_no_value_any_more_ends_the_run():
    """Errors that are no numbers, of one group of many, are not taken for small ones: it went on past the end."""
    rods = [rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)]
    model = arm(rods, trajectory=[], load=[{"joint": "O", "moment": "sqrt(0.5-t)"}])
    found = run_forward(model, forward(end=1.0, output_step=0.01), None, ActuatorSet(), always)
    assert found.statistics.status == "step underflow"
    assert 'joint "O", angle has no finite value' in found.statistics.cause
    assert found.statistics.time_reached <= 0.5
