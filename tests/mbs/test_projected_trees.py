"""Mechanisms in 3D that move in a plane: the recursion in the plane is the recursion in 3D."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoint_scenes import motor_on_frames, tree_model
from random_mechanisms import random_beam, random_solid, stiffened
from trees_in_a_plane import TYPES, flat_and_stiffened, flat_beam, planar_model

from ffrobot.mbs import _core
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.model.drives import Drive
from ffrobot.mbs.model.gears import with_compliance
from ffrobot.mbs.model.system import MultibodySystem

TIMES = [0.0, 0.3, 0.8]
CLOSE = 1e-11
WAVE = parse_expression("1.3*sin(3*t) + 0.4")


def states(rng, tree):
    q, v = 0.4 * rng.standard_normal((len(TIMES), tree.n_q)), rng.standard_normal((len(TIMES), tree.n_v))
    for node in tree.nodes:
        q[:, node.p_q] *= 0.03  # sections turn by up to one radian
    return np.hstack([q, v])


def assert_same(system, at):
    """Accelerations, multipliers, energies, and all forces of both, at states (T, n_q + n_v)."""
    assert system.plane is not None
    space = _core.tree_outputs(system.core, system.scene, TIMES, at, system.replay)
    plane = _core.tree_outputs(*system.integrated[:2], TIMES, at, system.replay)
    for found, expected in (
        (plane.accelerations, space.accelerations),
        (system.multipliers(plane.multipliers), space.multipliers * system.model.row_signs),
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE * np.abs(expected).max(initial=0.0))
    assert_same_forces(system, at, plane.multipliers)
    assert_same_derivatives(system, at[0])


def assert_same_derivatives(system, state):
    """Of accelerations by q, v and modal forces; those of space are compared with differences of its evaluations."""
    q, v = np.split(state, [system.model.tree.n_q])
    found, expected = (
        core.derivatives(scene, 0.0, q, v, np.zeros(len(v)))
        for core, scene in (system.integrated[:2], (system.core, system.scene))
    )
    modes = ~system.model.tree.joint_columns  # pins of the plane pass no moments on: none act there
    for key, columns in (("a_q", slice(None)), ("a_v", slice(None)), ("a_f", modes)):
        of_plane, of_space = (getattr(of, key)[:, columns] for of in (found, expected))
        size = np.abs(of_space).max(initial=1.0)
        np.testing.assert_allclose(of_plane, of_space, rtol=0, atol=1e-10 * size, err_msg=key)


def assert_same_forces(system, at, multipliers):
    """At accelerations that nothing makes, less what joints carry across the plane, which the plane does not see."""
    (q, v), axes = np.hsplit(at, [system.model.tree.n_q]), system.plane.axes
    known = (TIMES, q, v, np.random.default_rng(0).standard_normal(v.shape))
    core, scene, _ = system.integrated
    space = system.core.motion_forces(system.scene, *known, multipliers @ system.plane.spread.T)
    plane = core.motion_forces(scene, *known, multipliers)
    count = len(TIMES)
    in_plane = (space.joints.reshape(count, -1, 2, 3) @ axes.T).reshape(count, -1, 6)[..., [0, 1, 5]]
    for found, expected in (
        (plane.bodies.reshape(count, -1, 3) @ axes, space.bodies.reshape(count, -1, 3)),
        (plane.rotors.reshape(count, -1, 3) @ axes, space.rotors.reshape(count, -1, 3)),
        (plane.joints.reshape(count, -1, 3), in_plane),
        (plane.modal, space.modal),
        (core.states_totals(scene, q, v)[:, [0, 1, 3]], system.core.states_totals(system.scene, q, v)[:, [0, 1, 3]]),
    ):
        np.testing.assert_allclose(found, expected, rtol=0, atol=CLOSE * np.abs(expected).max(initial=0.0))


@pytest.mark.parametrize("kind", ["rigid", "solid", "beam", "supported", "stiffened"])
@pytest.mark.parametrize("joint", TYPES)
def test_trees_of_one_joint_and_kind(joint, kind):
    """In planes that stand anyhow."""
    rng = np.random.default_rng(TYPES.index(joint))
    types = ["revolute", joint, joint]
    for _ in range(3):
        system = MultibodySystem(planar_model(rng, types, (kind,)))
        assert_same(system, states(rng, system.model.tree))


@pytest.mark.parametrize("rotor", [{}, {"rotor_inertia": 0.02, "gear_ratio": 7.0}], ids=["plain", "rotors"])
@pytest.mark.parametrize("seed", range(4))
def test_trees_under_all_that_acts(seed, rotor):
    """Friction, rotors, moments in joints, loads at points along all axes, motors on frames, rows that are followed."""
    rng = np.random.default_rng(seed)
    friction = {"viscous_friction": 0.7, "coulomb_friction": 0.3, "friction_speed": 0.2}
    load = {key: parse_expression(f"{k} + t") for k, key in enumerate(("x", "y", "z", "mx", "my", "mz"))}
    followed = [{"name": f"of {joint}", "joint": joint, "value": parse_expression("sin(t)")} for joint in ("j2", "j5")]
    model = planar_model(
        rng, ["revolute", "prismatic", "revolute", "weld", "revolute", "revolute"],
        joint_keys={"revolute": friction | rotor, "prismatic": friction},
        load=({"point": "b2.tip"} | load, {"point": "b5.side"} | load, {"joint": "j3", "moment": WAVE}),
        trajectory=followed,
    )  # fmt: skip
    push = Drive(rng.standard_normal(model.tree.n_v), WAVE)
    system = MultibodySystem(replace(model, modal_loads=(push,)), motor_on_frames(model, 0, WAVE))
    assert list(system.integrated.rows) == [0, 1]
    assert_same(system, states(rng, model.tree))


@pytest.mark.parametrize("across", range(3))
def test_paths_in_a_global_plane(across):
    """Rows of points, in the plane across one of the axes, on sections that modes move."""
    rng = np.random.default_rng(across)
    places = {"xyz"[k]: parse_expression("0.3*sin(t)") for k in range(3) if k != across}
    model = planar_model(
        rng, ["revolute"] * 4, ("beam", "supported", "solid"), np.eye(3)[across],
        trajectory=({"name": "path", "point": "b4.tip"} | places,),
    )  # fmt: skip
    system = MultibodySystem(model)
    assert len(system.integrated.rows) == 2
    assert_same(system, states(rng, model.tree))


def test_gears_that_give():
    """Their outputs have no mass of their own."""
    rng = np.random.default_rng(4)
    keys = {"rotor_inertia": 0.02, "gear_ratio": 7.0, "stiffness": 9.0, "damping": 0.6}
    model = with_compliance(planar_model(rng, ["revolute"] * 3, joint_keys={"revolute": keys}))
    assert len(model.tree.gears) == 3
    assert_same(MultibodySystem(model), states(rng, model.tree))


def chain(**changes):
    """A model of two beams in a plane, of which something is otherwise."""
    rng = np.random.default_rng(0)
    tables = [
        {"name": "j1", "type": "revolute", "between": ("ground", "b1.root"), "axis": [0.0, 0.0, 1.0]},
        {"name": "j2", "type": "revolute", "between": ("b1.tip", "b2.root"), "axis": [0.0, 0.0, 1.0]},
    ]
    tables[1] |= changes.pop("second", {})
    bodies = [flat_beam(rng, "b1"), changes.pop("body", lambda rng: flat_beam(rng, "b2"))(rng)]
    return tree_model(type("Bodies", (), {"bodies": bodies}), tables, **changes)


ZERO, TIME = parse_expression("0"), parse_expression("t")
PATH = {"name": "path", "point": "b2.tip", "x": ZERO, "y": TIME}


@pytest.mark.parametrize(
    ("changes", "is_planar"),
    [
        ({}, True),
        ({"trajectory": (PATH,)}, True),
        ({"trajectory": (PATH | {"z": ZERO},)}, False),
        ({"trajectory": (PATH | {"rotation_vector": (ZERO, ZERO, TIME)},)}, False),
        ({"second": {"axis": [1e-9, 0.0, 1.0]}}, False),
        ({"second": {"type": "prismatic", "axis": [1.0, 0.0, 0.0]}}, True),
        ({"second": {"type": "prismatic", "axis": [1.0, 0.0, 1e-9]}}, False),
        ({"second": {"type": "screw", "lead": 0.1}}, False),
        ({"second": {"type": "planar"}}, True),
        ({"second": {"type": "planar"}, "body": lambda rng: flat_beam(rng, "b2", "simply-supported")}, True),
        ({"body": lambda rng: random_beam(rng, "b2", (2, 1, 0, 0))}, False),
        ({"body": lambda rng: random_solid(rng, "b2")}, False),
        ({"body": lambda rng: stiffened(rng, flat_beam(rng, "b2"))}, False),
        ({"body": lambda rng: flat_and_stiffened(rng, "b2")}, True),
    ],
)  # fmt: skip
def test_what_does_not_move_in_a_plane(changes, is_planar):
    """Is solved in 3D: axes that are not parallel, links that bend otherwise, rows across the plane."""
    assert (MultibodySystem(chain(**changes)).plane is not None) == is_planar


def test_rigid_slides_in_two_directions_have_a_plane():
    """Without an axis that turns: one of the global planes."""
    model = planar_model(np.random.default_rng(2), ["prismatic", "prismatic"], ("rigid",), [0.0, 1.0, 0.0])
    system = MultibodySystem(model)
    np.testing.assert_array_equal(np.abs(system.plane.axes[2]), [0.0, 1.0, 0.0])
    assert_same(system, states(np.random.default_rng(3), model.tree))


@pytest.mark.parametrize("kinds", [("beam",), ("supported",), ("beam", "rigid")])
def test_forces_without_moments_on_pins(kinds):
    """At points of chains whose joints then pass no moments on; with one at the last point they do."""
    rng = np.random.default_rng(7)
    force = {"x": parse_expression("1 + t"), "y": parse_expression("2 - t")}
    for moment in ({}, {"mz": parse_expression("3*t")}):
        load = ({"point": "b1.tip"} | force, {"point": "b3.side"} | force | moment)
        system = MultibodySystem(planar_model(rng, ["revolute"] * 3, kinds, np.eye(3)[2], load=load))
        assert_same(system, states(rng, system.model.tree))
