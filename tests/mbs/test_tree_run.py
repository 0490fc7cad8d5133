"""Runs in joint coordinates give what those in absolute ones do; which run in what is decided before the first step."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from links import arm, ritz_link
from mechanisms import always, assemble, forward, make_model, pcid, relative, revolute
from rods import rod

from ffrobot.mbs.analysis import drive
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


@pytest.fixture
def in_absolute(monkeypatch):
    """Makes runs stay in absolute coordinates."""

    def stay():
        monkeypatch.setattr(drive, "tree_start", lambda *_: "asked for")

    return stay


def compare(found, expected, share):
    assert found.statistics.coordinates == "joint"
    assert expected.statistics.coordinates == "absolute: asked for"
    for name in ("q", "v", "a", "lambda_", "tau", "F_p"):
        if (numbers := getattr(expected, name)) is not None and numbers.size:
            peak = max(np.abs(numbers).max(), 1e-6)  # nothing but rounding in joints of what falls freely
            assert relative(getattr(found, name), numbers, peak) < share, name
    assert found.residual.max() < 1e-9


@pytest.mark.parametrize("name", DRIVEN)
def test_inverse_dynamics(name, in_absolute):
    """At outputs, and between them, where recorded steps are made again."""
    model, times = zoo.build(name), np.sort(np.random.default_rng(0).uniform(0.0, KEYS["end"], 20)).tolist()
    found = run_pcid(model, pcid(**KEYS), True, always)
    in_absolute()
    expected = run_pcid(model, pcid(**KEYS), True, always)
    compare(found, expected, 1e-7)
    forces = [source.details.actuation_source(source).sample(times) for source in (found, expected)]
    for of_tree, of_system in zip(*forces, strict=True):
        assert relative(of_tree, of_system) < 1e-7


@pytest.mark.parametrize("name", [*DRIVEN, "free-flying", "loaded, frame motors"])
def test_free_motion(name, in_absolute):
    model = zoo.build(name)
    found = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    in_absolute()
    compare(found, run_forward(model, forward(**KEYS), None, ActuatorSet(), always), 1e-7)


def test_rows_in_several_blocks(in_absolute):
    """Joints of a chain that keep their angles, all but the last, and projection onto them."""
    angles = {f"b{k}": 0.1 * k for k in range(1, 19)}
    kept = [
        {"name": f"turn {k}", "joint": f"j{k}", "value": f"0.1+{0.1 * (-1) ** k}*t+0.05*t**2"} for k in range(1, 18)
    ]
    model = zoo.chain(np.random.default_rng(1), 18, trajectory=kept, initial={"angles": angles})
    found = run_pcid(model, pcid(**KEYS), False, always)
    in_absolute()
    compare(found, run_pcid(model, pcid(**KEYS), False, always), 1e-7)


def test_motion_under_forces_of_the_motion_of_points(in_absolute):
    def pull(_, position, velocity):
        return *(-30 * position - 2 * velocity), 0.5 * position[0] * velocity[1]

    model = replace(zoo.build("mixed"), state_forces=((Marker("b2", "side"), state_function(pull)),))
    found = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    in_absolute()
    compare(found, run_forward(model, forward(**KEYS), None, ActuatorSet(), always), 1e-7)


@pytest.mark.parametrize("name", ["chain of 3", "mixed backwards"])
def test_free_motion_with_gears_that_give(name, in_absolute):
    model = zoo.geared(name)
    found = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    in_absolute()
    expected = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    assert len(found.assembly.model.bodies) > len(model.bodies)
    compare(found, expected, 1e-7)


def test_gears_that_set_out_from_nothing(in_absolute):
    """In no gravity, without damping: rounding of stiff springs is not what steps follow."""
    gear = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 4e4}
    joints = [revolute("O", "ground", "link1.root", **gear), revolute("A", "link1.tip", "link2.root", **gear)]
    load = [{"joint": "O", "moment": "4*sin(2*t)**4"}, {"joint": "A", "moment": "sin(2*t)**4"}]
    bodies = [rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)]
    initial = {"angles": {"link1": 0.4, "link2": 1.3}}
    model = make_model(bodies, joint=joints, load=load, initial=initial, gravity=(0.0, 0.0))
    keys = KEYS | {"end": 0.5}
    found = run_forward(model, forward(**keys), None, ActuatorSet(), always)
    in_absolute()
    expected = run_forward(model, forward(**keys), None, ActuatorSet(), always)
    compare(found, expected, 1e-7)
    assert found.statistics.steps < 1.5 * expected.statistics.steps  # 0.9 times; it ended at the start before


def test_replay_with_gears_that_give(in_absolute):
    """Motors turn outputs, from twists that carry the moments of the inverse analysis on."""
    gear = {"gear_ratio": 60.0, "rotor_inertia": 2e-4, "stiffness": 3e3, "damping": 2.0}
    joints = [revolute("O", "ground", "link1.root", **gear), revolute("A", "link1.tip", "link2.root", **gear)]
    model = arm(joint=joints)
    source = add_transmission(run_pcid(model, pcid(**KEYS), True, always))
    replay = forward(**KEYS, actuation="inverse", apply="joints")
    found = run_forward(model, replay, source, ActuatorSet(), always)
    in_absolute()
    compare(found, run_forward(model, replay, source, ActuatorSet(), always), 1e-7)


@pytest.mark.parametrize("apply", ["joints", "trajectory"])
def test_replay(apply, in_absolute):
    """What is recorded in joint coordinates acts in them, and in absolute ones."""
    model = arm()
    source = run_pcid(model, pcid(**KEYS), True, always)
    replay = forward(**KEYS, actuation="inverse", apply=apply)
    found = run_forward(model, replay, source, ActuatorSet(), always)
    assert source.statistics.coordinates == found.statistics.coordinates == "joint"
    in_absolute()
    expected = run_forward(model, replay, source, ActuatorSet(), always)
    compare(found, expected, 1e-7)
    in_system = run_pcid(model, pcid(**KEYS), True, always)
    compare(found, run_forward(model, replay, in_system, ActuatorSet(), always), 1e-7)
    if apply == "trajectory":
        assert relative(found.q, source.q) < 1e-6


@pytest.mark.parametrize(("integrator", "tolerance"), [("radau", 1e-8), ("dopri5", 1e-8), ("generalized-alpha", 3e-3)])
@pytest.mark.parametrize("name", ["chain of 2", "mixed backwards", "loaded", "loaded, frame motors", "mixed, as built"])
def test_every_integrator(name, integrator, tolerance, in_absolute):
    """Within what the tolerance leaves to both."""
    model, keys = zoo.build(name), KEYS | {"integrator": integrator, "tolerance": tolerance}
    found = run_pcid(model, pcid(**keys), False, always)
    in_absolute()
    compare(found, run_pcid(model, pcid(**keys), False, always), 2 * tolerance)


LOOPS = ("four-bar", "slider-crank", "slider-crank, as built")


@pytest.mark.parametrize("name", LOOPS)
def test_loops_that_move_freely(name, in_absolute):
    model, keys = zoo.build(name), KEYS | {"tolerance": 1e-9}
    found = run_forward(model, forward(**keys), None, ActuatorSet(), always)
    in_absolute()
    compare(found, run_forward(model, forward(**keys), None, ActuatorSet(), always), 2e-7)


@pytest.mark.parametrize("name", LOOPS)
def test_inverse_dynamics_of_loops(name, in_absolute):
    model = zoo.build(name)
    found = run_pcid(model, pcid(**KEYS), True, always)
    in_absolute()
    compare(found, run_pcid(model, pcid(**KEYS), True, always), 2e-7)


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
    assert outcome.statistics.coordinates == "joint"
    assert outcome.status == "step underflow"
    assert "singular" in outcome.statistics.cause
    angle = outcome.q[-1, 2]
    assert 0.0 < angle < 0.3
    assert 0.2 < outcome.statistics.time_reached < 0.6


@pytest.mark.parametrize("stopped_in", ["joint", "absolute"])
def test_runs_go_on_in_the_coordinates_in_which_they_were_stopped(stopped_in, in_absolute, monkeypatch):
    """To the last bit."""
    model, analysis = arm(), pcid(**KEYS)
    with monkeypatch.context() as patch:
        if stopped_in == "absolute":
            patch.setattr(drive, "tree_start", lambda *_: "asked for")
        whole = run_pcid(model, analysis, True, always)
        stopped = run_pcid(model, analysis.model_copy(update={"max_steps": whole.statistics.steps // 2}), True, always)
    assert stopped.status == "too many steps"
    earlier = EarlierRun(stopped.motion, stopped.forces, stopped.statistics, stopped.continuation, "run")
    again = run_pcid(model, analysis, True, always, earlier)
    assert again.statistics.coordinates.partition(":")[0] == stopped_in
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
    assert found.statistics.coordinates == "joint"
    for name in ("q", "v", "lambda_"):
        assert relative(getattr(found, name), getattr(exact, name)) < 0.4e-6, name


def test_rows_that_hardly_differ_at_the_start_are_all_kept(in_absolute):
    """Of an angle and a way across the tip's, the tip 8e-6 rad off: rounding leaves 1e-16/δ² of their multipliers."""
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
    in_absolute()
    expected = run_pcid(model, pcid(**keys), False, always)
    assert found.statistics.coordinates == "joint"
    assert found.statistics.status == expected.statistics.status == "step underflow"
    assert "singular" in found.statistics.cause
    assert relative(found.lambda_[0], expected.lambda_[0]) < 1e-4


def test_a_load_that_has_no_value_any_more_ends_the_run():
    """Errors that are no numbers, of one group of many, are not taken for small ones: it went on past the end."""
    rods = [rod("link1", 1.0, 1.0), rod("link2", 1.0, 1.0)]
    model = arm(rods, trajectory=[], load=[{"joint": "O", "moment": "sqrt(0.5-t)"}])
    found = run_forward(model, forward(end=1.0, output_step=0.01), None, ActuatorSet(), always)
    assert found.statistics.coordinates == "joint"
    assert found.statistics.status == "step underflow"
    assert 'joint "O", angle has no finite value' in found.statistics.cause
    assert found.statistics.time_reached <= 0.5
