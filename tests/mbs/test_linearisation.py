"""Linear equations against differences of the nonlinear ones: all joints, loops, in motion; what goes in and out."""

import ctypes
from dataclasses import replace

import numpy as np
import pytest
import zoo
from links import arm, arm_links, ritz_link
from mechanisms import make_model, pcid, revolute
from moving_trees import differences, moving
from oracle_runs import run
from random_mechanisms import TYPES
from tree_oracle import row_values

from ffrobot.common.errors import SolveError
from ffrobot.mbs import _core
from ffrobot.mbs._core import StateFunction
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.mbs.scene.loads import Load

KINDS = ("rigid", "solid", "beam", "supported beam", "stiffened solid", "stiffened beam")


MOVING = [*((joint, 0) for joint in TYPES), *((joint, 1) for joint in ("revolute", "spherical", "universal"))]


def kinds_of(joint, loops=0):
    """Points of loops have no geometric stiffness."""
    return ("rigid", "beam") if joint == "free" else KINDS[:4] if loops else KINDS


@pytest.mark.parametrize(("joint", "loops"), MOVING)
def test_derivatives_are_those_of_evaluations(joint, loops):
    rng = np.random.default_rng(TYPES.index(joint))
    motion, system = moving(rng, [joint] * 3, kinds_of(joint, loops), loops=loops)
    tree, q, v = motion.model.tree, motion.q[0], motion.v[0]
    target = rng.standard_normal(len(motion.model.rows))
    force = rng.standard_normal(tree.n_v)
    scene = _core.TreeScene()
    for of_row in target:
        scene.add_target(parse_expression(f"{of_row / 2}*t**2"))
    found = system.core.derivatives(scene, 0.0, q, v, force)

    def a(dq=0.0, dv=0.0, df=0.0):
        return system.core.evaluate(tree.integrate(q, np.zeros(tree.n_v) + dq), v + dv, target, force + df, None)[0]

    # By forces a is linear: with a step of 1 differences are exact but for rounding, which a small step magnifies.
    for derivative, by, h in ((found.a_q, "dq", 1e-5), (found.a_v, "dv", 1e-5), (found.a_f, "df", 1.0)):
        expected = differences(lambda x, by=by: a(**{by: x}), tree.n_v, h)
        np.testing.assert_allclose(derivative, expected, rtol=0, atol=2e-8 * max(1, np.abs(expected).max()))
    if loops:
        np.testing.assert_allclose(found.value_q, row_values(motion.model, q[None], np.zeros(1))[1][0], atol=1e-12)
        expected = differences(lambda x: system.core.measure(tree.integrate(q, x), v)[1], tree.n_v)
        np.testing.assert_allclose(found.rate_q, expected, atol=1e-8 * np.abs(expected).max())


def pull(t, position, rate, force):
    """On a section: a cubic spring, a damper that turns with it, moments of its orientation, and of its spin."""
    r, R, v, omega = np.array(position[:3]), np.array(position[3:12]).reshape(3, 3), rate[:3], rate[3:6]
    force[:3] = -3.0 * (r - 0.2) * (1 + r @ r) - R @ np.diag([1.0, 2.0, 0.5]) @ R.T @ v
    force[3:6] = 2.0 * R[:, 0] + t * R[:, 1] - np.square(omega) * np.sign(omega)


@pytest.mark.parametrize("joint", ["revolute", "spherical", "free"])
def test_derivatives_with_a_force_of_the_motion(joint):
    """Its own derivatives are central differences, which leave about 1e-9."""
    numbers = ctypes.POINTER(ctypes.c_double)

    @ctypes.CFUNCTYPE(None, ctypes.c_double, numbers, numbers, numbers)
    def compiled(t, position, rate, force):
        position, rate, force = (np.ctypeslib.as_array(x, (n,)) for x, n in ((position, 12), (rate, 6), (force, 6)))
        pull(t, position, rate, force)

    motion, _ = moving(np.random.default_rng(TYPES.index(joint)), [joint] * 3, kinds_of(joint))
    model, q, v, t = motion.model, motion.q[0], motion.v[0], 0.7
    body = model.tree.nodes[-1].body
    function = StateFunction.compiled(ctypes.cast(compiled, ctypes.c_void_p).value, is_planar=False)
    load = Load(point=f"{body.name}.{list(body.points)[-1]}", force=function)
    system = MultibodySystem(replace(model, scene=model.scene.model_copy(update={"load": (load,)})))
    found, n = system.core.derivatives(system.scene, t, q, v, np.zeros(model.tree.n_v)), model.tree.n_v

    def a(dq=0.0, dv=0.0):
        states = np.concatenate([model.tree.integrate(q, np.zeros(n) + dq), v + dv])[None]
        return _core.tree_outputs(system.core, system.scene, [t], states, None).accelerations[0]

    without = MultibodySystem(model)
    without = without.core.derivatives(without.scene, t, q, v, np.zeros(n))
    for key, by in (("a_q", "dq"), ("a_v", "dv")):
        expected = differences(lambda x, by=by: a(**{by: x}), n, 1e-4)
        difference = getattr(found, key) - expected
        np.testing.assert_allclose(difference, 0, atol=2e-7 * max(1, np.abs(expected).max()))
        assert np.abs(getattr(without, key) - expected).max() > 1e3 * np.abs(difference).max()


@pytest.mark.parametrize(("joint", "loops"), MOVING)
def test_the_motion_itself_is_one_of_the_motions_beside_it(joint, loops):
    """Begun a little later, a free motion is δ = v, δs̈ the rate of its accelerations."""
    motion, system = moving(
        np.random.default_rng(20 + TYPES.index(joint)), [joint] * 3, kinds_of(joint, loops), loops=loops
    )
    q, v, a = motion.q[0], motion.v[0], motion.a[0]
    linearisation = LinearEquations(motion.model, q)
    found = linearisation.at(0.0, q, v, a)
    s = linearisation.independent
    core = system.core.derivatives(system.scene, 0.0, q, v, np.zeros(motion.model.tree.n_v))
    signs = found.transformation[s].diagonal()
    jerk = signs * (core.a_q @ v + core.a_v @ a)[s]
    terms = [found.M @ jerk, found.D @ (signs * a[s]), found.K @ (signs * v[s])]
    np.testing.assert_allclose(sum(terms), 0, atol=1e-9 * max(np.abs(term).max() for term in terms))
    np.testing.assert_allclose(found.force, 0, atol=1e-9 * max(1.0, np.abs(found.M @ a[s]).max()))


@pytest.mark.parametrize("stiffened", [False, True])
def test_outputs_and_inputs_are_dual(stiffened):
    """A force at a point works on the point's motion: one gradient serves both."""
    found = run(arm(arm_links(damping_ratio=0.02, stiffening=stiffened)), pcid(end=0.2, output_step=0.1))
    one, model = found.outcome, found.robot.model.without_paths()
    linear = LinearEquations(model, one.q[-1], ("link2.tip",)).at(one.time[-1], one.q[-1], one.v[-1], one.a[-1])
    for axis in "xy":
        np.testing.assert_array_equal(
            linear.inputs[f"force/link2.tip/{axis}"], linear.outputs[f"point/link2.tip/{axis}"]
        )
    assert "force/link2.tip/z" not in linear.inputs
    assert list(linear.outputs)[:2] == ["joint/O", "joint/A"]
    np.testing.assert_allclose(linear.inputs["joint/A"], np.eye(len(linear.names))[1], atol=1e-12)


@pytest.mark.parametrize(
    ("name", "driven", "expected"),
    [
        ("four-bar", ["j1"], ["joint/j1"]),
        ("chain of 2", ["j2"], ["joint/j2", "joint/j1"]),
        ("chain of 2", [], ["joint/j1", "joint/j2"]),
    ],
)
def test_independent_coordinates(name, driven, expected):
    """Motors first, then the other joints, then modes."""
    joints = [joint | {"motor": joint["name"] in driven} for joint in zoo.build(name).tables["joint"]]
    model = zoo.build(name, trajectory=[], joint=joints).model
    names = LinearEquations(model, undeformed_posture(model).q).names
    assert [one for one in names if not one.startswith("modal/")] == expected
    assert len(names) == len(expected) + sum(node.body.n_modes for node in model.tree.nodes)


def test_singular_configuration_is_refused():
    """Stretched, the slider no longer determines the crank."""
    joints = [revolute(*one, motor=False) for one in (("O", "ground", "link1.root"), ("A", "link1.tip", "link2.root"))]
    joints += [revolute("B", "link2.tip", "slider.root", motor=False)]
    joints += [{"name": "rail", "type": "prismatic", "between": ("ground", "slider.root"), "axis": (1.0, 0.0),
                "motor": True}]  # fmt: skip
    bodies = [*arm_links(), ritz_link("slider", "cantilever")]
    bent, stretched = (
        make_model(bodies, joint=joints, initial={"angles": {"link1": angle, "link2": -angle}}).model
        for angle in (0.7, 0.0)
    )
    q, rest = undeformed_posture(bent).q, np.zeros(bent.tree.n_v)
    linearisation = LinearEquations(bent, q)
    assert linearisation.names[0] == "joint/rail"
    linearisation.at(0.0, q, rest, rest)
    with pytest.raises(SolveError, match="joint/rail do not determine the posture"):
        linearisation.at(0.0, undeformed_posture(stretched).q, rest, rest)
