"""The linear equations about a motion against the nonlinear ones: errors fall with the perturbation squared."""

from dataclasses import replace

import numpy as np
import pytest
import zoo
from links import arm, arm_links, ritz_link
from mechanisms import make_model, oracle_of, pcid, relative, revolute
from planar_runs import run

from ffrobot.common.errors import SolveError
from ffrobot.mbs import _core
from ffrobot.mbs.model.model import ModalLoad
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.mbs.solve.linearisation import Linearisation, held_by_motors, linearise

constant = _core.TimeFunction.constant


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "stiffened"])
def motion(request):
    """One instant of the arm's inverse dynamics, where everything moves."""
    model = arm(arm_links(damping_ratio=0.02, stiffening=request.param), analysis=(pcid(end=0.4, output_step=0.1),))
    outcome = run(model, model.scene.analysis[0])
    return model, outcome


def driven(model, outcome, row, tau=None):
    """The arm with the moments and modal forces of one output in place of its trajectory."""
    tau = outcome.tau[row] if tau is None else tau
    loads = tuple((motor, constant(float(m))) for motor, m in zip(model.motors.values(), tau, strict=True))
    modal = tuple(
        ModalLoad(body.name, outcome.F_p[row, outcome.modal_columns(body.name)], constant(1.0)) for body in model.bodies
    )
    model = replace(model, loads=loads, modal_loads=modal)
    return MechanismSystem(model, model.joints, model.loads)


def state_of(model, near, s, s_dot):
    """(q, v) with closed joints for s = (motor coordinates, p) and their rates."""
    k = len(model.motors)
    held = held_by_motors(model, near)
    shifted = [replace(c, target=constant(float(value))) for c, value in zip(held, s[:k], strict=True)]
    assembly = MechanismSystem(model, [*model.joints, *shifted])
    frames = assembly.frame_coordinates
    modes = np.setdiff1d(np.arange(len(near)), frames)
    q, v, rest = near.copy(), np.zeros_like(near), np.zeros_like(near)
    q[modes], v[modes] = s[k:], s_dot[k:]
    for _ in range(6):
        C, _, C_q = assembly.system.constraints(0.0, q, rest)
        q[frames] -= np.linalg.solve(C_q[:, frames], C)
    wanted = np.array([s_dot[shifted.index(c)] if c in shifted else 0.0 for c in assembly.constraints])
    v[frames] = np.linalg.solve(C_q[:, frames], wanted - C_q[:, modes] @ v[modes])
    return q, v


def motor_jets(model, assembly, q, v, a):
    """Values, rates and accelerations of s."""
    oracle = oracle_of(assembly)
    rows = [oracle.row(row, q, v) for row in model.motors.values()]
    modes = np.setdiff1d(np.arange(len(q)), assembly.frame_coordinates)
    value = np.concatenate([[row.value for row in rows], q[modes]])
    rate = np.concatenate([[row.rate for row in rows], v[modes]])
    return value, rate, np.concatenate([[row.gradient @ a + row.bias for row in rows], a[modes]])


def test_forces_of_the_motion_are_those_of_the_inverse_analysis(motion):
    model, outcome = motion
    linear = linearise(model, outcome.time[2], outcome.q[2], outcome.v[2], outcome.a[2])
    assert linear.names == ("joint/O", "joint/A", *(f"modal/link{b}/{k}" for b in (1, 2) for k in (1, 2, 3)))
    assert relative(linear.force, np.concatenate([outcome.tau[2], outcome.F_p[2]])) < 1e-9


def test_error_about_a_motion_falls_with_the_perturbation_squared(motion):
    model, outcome = motion
    row, k = 2, len(model.motors)
    linear = linearise(model, outcome.time[row], outcome.q[row], outcome.v[row], outcome.a[row])
    assembly = driven(model, outcome, row)
    s, s_dot, s_ddot = motor_jets(model, assembly, outcome.q[row], outcome.v[row], outcome.a[row])
    rng = np.random.default_rng(5)
    ds, ds_dot, du = rng.standard_normal((3, len(s)))
    ds[k:] *= 0.01
    inputs = np.column_stack([linear.inputs["joint/O"], linear.inputs["joint/A"]]) @ du[:k]
    predicted = np.linalg.solve(linear.M, inputs - linear.D @ ds_dot - linear.K @ ds)

    def error(size):
        shifted = driven(model, outcome, row, outcome.tau[row] + size * du[:k])
        q, v = state_of(model, outcome.q[row], s + size * ds, s_dot + size * ds_dot)
        a, _ = oracle_of(shifted).solve(0.0, q, v)
        return np.linalg.norm(motor_jets(model, shifted, q, v, a)[2] - s_ddot - size * predicted)

    errors = np.array([error(size) for size in (4e-3, 2e-3, 1e-3)])
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.05)
    assert errors[-1] < 1e-2 * np.linalg.norm(1e-3 * predicted)


def test_outputs_and_inputs_are_dual(motion):
    """A force at a point works on the point's motion: one gradient serves both."""
    model, outcome = motion
    linear = linearise(model, 0.2, outcome.q[2], outcome.v[2], outcome.a[2], ("link2.tip",))
    for axis in "xy":
        np.testing.assert_array_equal(
            linear.inputs[f"force/link2.tip/{axis}"], linear.outputs[f"point/link2.tip/{axis}"]
        )
    assert list(linear.outputs)[:2] == ["joint/O", "joint/A"]
    np.testing.assert_allclose(linear.inputs["joint/A"], np.eye(len(linear.names))[1], atol=1e-12)


def with_motors(model, *names):
    """The model with motors on these joints, and where it starts."""
    model = replace(model, motors={name: model.scene.coordinate(name) for name in names})
    return model, undeformed_state(MechanismSystem(model, model.joints)).q


@pytest.mark.parametrize(
    ("name", "motors", "expected"),
    [
        ("four-bar", ["j1"], ["joint/j1"]),
        ("chain of 2", ["j2"], ["joint/j2", "joint/j1"]),
        ("chain of 2", [], ["joint/j1", "joint/j2"]),
        ("free-flying", [], ["joint/j1", "frame/b1/x", "frame/b2/x", "frame/b2/y"]),
    ],
)
def test_independent_coordinates(name, motors, expected):
    """Motors first, then the other joints, then frames."""
    model, q = with_motors(zoo.build(name, trajectory=()), *motors)
    names = Linearisation(model, q).names
    rows = [name for name in names if not name.startswith("modal/")]
    assert len(names) == model.degrees_of_freedom + sum(body.n_modes for body in model.bodies)
    assert [row.partition("/")[0] for row in rows] == [row.partition("/")[0] for row in expected]
    assert [row for row in rows if row.startswith("joint")] == [row for row in expected if row.startswith("joint")]


def test_of_too_many_motors_as_many_are_taken_as_are_independent():
    model, q = with_motors(zoo.build("slider-crank", trajectory=()), "j1", "j2", "rail")
    linear = linearise(model, 0.0, q, 0 * q, 0 * q)
    assert sum(name.startswith("joint/") for name in linear.names) == 1
    assert set(linear.inputs) == {"joint/j1", "joint/j2", "joint/rail"}


def slider_crank(**angles):
    """A crank, a rod, and a slider on a rail whose motor drives it all."""
    joints = [revolute("O", "ground", "link1.root"), revolute("A", "link1.tip", "link2.root")]
    joints += [revolute("B", "link2.tip", "slider.root")]
    joints += [{"name": "rail", "type": "prismatic", "between": ("ground", "slider.root"), "axis": (1.0, 0.0)}]
    bodies = [*arm_links(), ritz_link("slider", "cantilever")]
    return with_motors(make_model(bodies, joint=joints, initial={"angles": angles}), "rail")


def test_singular_configuration_is_refused():
    """Stretched, the slider no longer determines the crank."""
    model, bent = slider_crank(link1=0.7, link2=-0.7)
    _, stretched = slider_crank()
    linearisation = Linearisation(model, bent)
    assert linearisation.names[0] == "joint/rail"
    linearisation.at(0.0, bent, 0 * bent, 0 * bent)
    with pytest.raises(SolveError, match="joint/rail do not determine the configuration"):
        linearisation.at(0.0, stretched, 0 * bent, 0 * bent)
