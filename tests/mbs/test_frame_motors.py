"""Motors that turn frames: what the core makes of them is the virtual work of two frames; how many there have to be."""

from dataclasses import replace

import numpy as np
import pytest
import tree_oracle
import zoo
from beam_links import beam_link, rectangle
from body_equations import Accelerated
from checkpoint_mechanisms import CASES, load
from checkpoint_scenes import as_scene, checkpoint_scene, coordinates, motor_on_frames, tree_model
from mechanisms import pcid
from moving_trees import state_of
from oracle_runs import run
from random_mechanisms import random_tree

import ffrobot
from ffrobot.mbs import _core
from ffrobot.mbs.linear.linearisation import LinearEquations
from ffrobot.mbs.model.build import build_model
from ffrobot.mbs.model.known_motion import required_forces
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.quantities.supply import actuator_forces
from ffrobot.run.bodies import load_bodies

MOMENT = 0.7  # N·m
MOMENT_OF_TIME = _core.TimeFunction.constant(MOMENT)


def driven_state(turned):
    """A chain of three solids and beams at random q and v under a motor in its second joint: model, and state."""
    tree = random_tree(np.random.default_rng(8), ["revolute"] * 3, ("solid", "beam"), chain=True, size=0.02)
    plain, tables = as_scene(tree, turned)
    model = tree_model(plain, tables)
    system = MultibodySystem(model, motor_on_frames(model, 1, MOMENT_OF_TIME))
    rng = np.random.default_rng(1)
    q = model.tree.at_rest(coordinates(model, plain, turned))
    for node in model.tree.nodes:
        q[node.p_q] = 0.03 * rng.standard_normal(node.body.n_modes)
    v = rng.standard_normal(model.tree.n_v)
    state = np.concatenate([q, v])[None]
    a = _core.tree_outputs(system.core, system.scene, [0.1], state, system.replay).accelerations
    return model, Accelerated(model.tree, q[None], v[None], a, tree_oracle.frames(model.tree, q[None]))


@pytest.mark.parametrize("turned", [False, True])
def test_generalized_forces_are_the_virtual_work_of_the_frames(turned):
    """M v̇ − Q of what the core finds is τ z·(∂ω_b − ∂ω_a), z of the joint, ω of the two frames."""
    model, state = driven_state(turned)
    node = model.tree.nodes[1]
    axis = tree_oracle.motion(model.tree, node.inner, state.q, state.frames).F[0, :, 2]
    expected = MOMENT * axis @ (state.frames[1].L[0, 3:] - state.frames[node.inner.body].L[0, 3:])
    (found,) = required_forces(MultibodySystem(model), state, np.array([0.1]))
    np.testing.assert_allclose(found, expected, atol=1e-9 * MOMENT)
    modal = ~model.tree.joint_columns
    assert np.abs(expected[modal]).max() > 1e-3 * MOMENT


@pytest.mark.parametrize("turned", [False, True])
def test_linear_models_are_those_of_motions_beside_it(turned):
    """Under a moment that stays as it is the motion itself is one of them, begun a little later: δ = v.

    Its jerk is found by differences of accelerations along it. Of what drives it, the moment alone is left.
    """
    model, state = driven_state(turned)
    on_frames = replace(model, scene=model.scene.model_copy(update={"motors": "frame"}))
    q, v, a = state.q[0], state.v[0], state.a[0]
    linearisation = LinearEquations(on_frames, q)
    found, tree = linearisation.at(0.0, q, v, a), model.tree
    expected = np.zeros(tree.n_v)
    joint = tree.nodes[1].joint.name
    expected[found.names.index(f"joint/{joint}")] = model.sign(joint) * MOMENT
    np.testing.assert_allclose(found.force, expected, atol=1e-8)

    system = MultibodySystem(model, motor_on_frames(model, 1, MOMENT_OF_TIME))

    def acceleration(dt):
        beside = np.concatenate([tree.integrate(q, dt * v), v + dt * a])
        return _core.tree_outputs(system.core, system.scene, [0.0], beside[None], system.replay).accelerations[0]

    h = 1e-4  # of a straight line through the state, along which the motion begins
    s, signs = linearisation.independent, found.transformation[linearisation.independent].diagonal()
    jerk = (acceleration(-2 * h) - 8 * acceleration(-h) + 8 * acceleration(h) - acceleration(2 * h)) / (12 * h)
    terms = [found.M @ (signs * jerk[s]), found.D @ (signs * a[s]), found.K @ (signs * v[s])]
    np.testing.assert_allclose(sum(terms), 0, atol=1e-6 * max(np.abs(term).max() for term in terms))
    held = LinearEquations(model, q).at(0.0, q, v, a)  # with sections driven K is another
    assert np.abs(held.K - found.K).max() > 1e-4 * MOMENT


LINK = beam_link(0.4, rectangle(0.01, 0.02), 8, nu=0.3)  # fmt: skip


def test_gears_do_not_give_between_frames_where_modes_tilt_their_axis():
    """No angle goes with a moment between frames there, of which a spring could be a function."""
    joint, gear = {"type": "revolute", "axis": [0.0, 0.0, 1.0]}, {"rotor_inertia": 1e-3, "stiffness": 2e3}
    scene = ffrobot.make_scene(
        name="arm", space="spatial", motors="frame", gravity=[0.0, 0.0, -9.8],
        body=[{"name": name, "link": LINK | {"modes": {"count": 2, "family": "all"}}} for name in ("upper", "fore")],
        joint=[joint | {"name": "shoulder", "between": ["ground", "upper.root"]},
               joint | gear | {"name": "elbow", "between": ["upper.tip", "fore.root"]}],
        analysis=[{"name": "rest", "kind": "linear"}],
    )  # fmt: skip
    with pytest.raises(ffrobot.InputError, match=r"modes tilt the joint's axis .\"elbow\"."):
        ffrobot.solve(scene)


def test_too_few_named_motors_are_refused():
    joints = zoo.serial_joints(2)
    joints[0]["motor"], joints[1]["motor"] = True, False
    with pytest.raises(
        ffrobot.InputError, match=r"as many motors as the mechanism has degrees of freedom \(2\), found 1"
    ):
        run(zoo.build("chain of 2", joint=joints), pcid())


CLOSE = 2e-9  # of the peak: the digits in which two step sizes of the numbers agree


def motion_of(name):
    """The samples of a checkpoint as a motion, its motors between frames: multipliers of paths are their forces."""
    scene, data = checkpoint_scene(name).model_copy(update={"motors": "frame"}), load(name)
    model = build_model(scene, [body.spatial for body in load_bodies(scene, lambda _: None).values()])
    tree, samples = model.tree, data["samples"]
    time = np.array([sample["t"] for sample in samples])
    q, v = np.zeros((len(time), tree.n_q)), np.zeros((len(time), tree.n_v))
    angles, rates = (np.array([sample[key] for sample in samples]) for key in ("joints", "joint_rates"))
    first = 0
    for node in tree.nodes:
        count = node.joint.freedoms
        q[:, node.q], v[:, node.v] = angles[:, first : first + count], rates[:, first : first + count]
        first += count
        if node.body.n_modes:
            q[:, node.p_q] = [sample["bodies"][node.body.name]["modal"] for sample in samples]
            v[:, node.p_v] = [sample["bodies"][node.body.name]["modal_velocity"] for sample in samples]
    forces = np.array([sample["path_force"] for sample in samples])
    multipliers = -forces[:, : len(model.rows)]
    return state_of(model, time, q, v, np.zeros_like(v), multipliers), data


def close(found, expected, scale=None):
    expected = np.array(expected)
    np.testing.assert_allclose(found, expected, atol=CLOSE * max(np.abs(expected).max(), scale or 1e-12))


@pytest.mark.parametrize("name", [name for name in CASES if name != "slider_crank_3d"])
def test_motors_between_frames(name):
    """The same moments, other modal forces: no angle, but a virtual work."""
    motion, data = motion_of(name)
    close(np.hstack(list(actuator_forces(motion).moments.values())), [sample["moments"] for sample in data["samples"]])
    for body, values in actuator_forces(motion).modal.items():
        if values.shape[1]:
            close(values, [sample["bodies"][body]["modal_force_frame"] for sample in data["samples"]])
