"""A new type of joint is a record of its own and an entry in the list of types."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np
import pytest
import velocity_transformation
from material_points import random_cloud
from mechanisms import (
    assemble,
    checked_scene,
    core_run,
    forward,
    on_constraints,
    oracle_of,
    pcid,
    relative,
    revolute,
)
from planar_runs import run, trajectory_force
from pydantic import Field

from ffrobot.common.errors import InputError
from ffrobot.common.validation import validate
from ffrobot.mbs import _core
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.fields.field_types import Vector2
from ffrobot.mbs.joints.joints import JOINT_TYPES, Joint
from ffrobot.mbs.joints.measure import Measure, relative_angle, slide
from ffrobot.mbs.joints.moving_joint import MovingJoint
from ffrobot.mbs.joints.transmission import Rotor
from ffrobot.mbs.model.model import ZERO, build_model
from ffrobot.mbs.model.planar_body import from_rigid_body
from ffrobot.mbs.model.planar_tree import PlanarTree
from ffrobot.mbs.model.system import MechanismSystem
from ffrobot.scene.scene import Scene


class SlotJoint(MovingJoint):
    """A pin in a slot: the second point slides along `way`, a direction of the first body, and turns there."""

    type: Literal["slot"]
    way: Vector2

    locates: ClassVar[bool] = False

    def constraints(self, angle):
        x, y = np.array(self.way) / np.hypot(*self.way)
        return (slide(f"{self.label}, across the slot", *self.markers, (-y, x)),)

    def coordinate(self, motors):
        return relative_angle(self.label, *self.markers)

    def rotor_measure(self, motors):
        return Rotor(self.coordinate(motors), self.rotor_inertia)


class GuideJoint(SlotJoint):
    """The same, but its coordinate is the way along the slot."""

    type: Literal["guide"]

    def coordinate(self, motors):
        x, y = np.array(self.way) / np.hypot(*self.way)
        return slide(f"{self.label}, along the slot", *self.markers, (x, y))

    def rotor_measure(self, motors):
        return Rotor(self.coordinate(motors), self.rotor_inertia * self.gear_ratio**2)


class RailJoint(GuideJoint):
    """A pin on a line along the ground's x axis, the second side of it; its coordinate is the way in x."""

    type: Literal["rail"]

    def constraints(self, angle):
        return (Measure(f"{self.label}, y", _core.MeasureKind.y, *self.markers),)

    def coordinate(self, motors):
        return Measure(f"{self.label}, x", _core.MeasureKind.x, *self.markers)


class SceneWithSlots(Scene):
    """A scene whose list of types has more entries."""

    joint: tuple[
        Annotated[get_args(Joint)[0] | SlotJoint | GuideJoint | RailJoint, Field(discriminator="type")], ...
    ] = ()


def scene_with(joint, trajectory=()):
    point = {"mass": 2.0, "inertia": 0.5, "center": [0.0, 0.0], "points": {"pin": [0.0, 0.0]}}
    keys = {
        "name": "slot",
        "gravity": [0.0, -9.81],
        "body": [{"name": "a", "rigid": point}],
        "joint": [joint],
        "trajectory": list(trajectory),
        "initial": {"rates": {"a": 3.0}},
        "analysis": [{"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.1}],
        "path": "slot.toml",
        "text": "",
    }
    return validate(SceneWithSlots, keys, Path("slot.toml"))


def test_a_pin_slides_in_an_inclined_slot_and_turns():
    """Down a slope of 30° without friction: s = ½ g sin 30° t²; it turns on as it did."""
    scene = scene_with({"name": "S", "type": "slot", "between": ["ground", "a.pin"], "way": [3.0**0.5, -1.0]})
    model = build_model(scene, [from_rigid_body("a", scene.body[0].rigid)])
    assert list(model.motors) == ["S"]
    outcome = run(model, forward(tolerance=1e-9))
    distance = 0.25 * 9.81 * outcome.time**2
    expected = np.column_stack([distance * 3.0**0.5 / 2, -distance / 2, 3.0 * outcome.time])
    assert relative(outcome.q, expected) < 1e-8


def on_arm(slot=None, **tables):
    """An arm on a pin, and a disk whose pin slides along it and turns there, or does so on the ground."""
    arm = {"mass": 1.5, "inertia": 0.2, "center": [0.4, 0.1], "points": {"root": [0.0, 0.0], "slot": [0.3, 0.05]}}
    disk = {"mass": 2.0, "inertia": 0.5, "center": [0.1, 0.2], "points": {"pin": [0.05, 0.0], "rim": [0.3, 0.1]}}
    keys = {"name": "slot", "gravity": [0.0, -9.81], "path": "slot.toml", "text": "", **tables}
    keys["body"] = [{"name": "arm", "rigid": arm}, {"name": "disk", "rigid": disk}]
    keys["joint"] = [revolute("O", "ground", "arm.root"), SLOT | (slot or {})]
    keys["initial"] = {"angles": {"arm": 0.4, "disk": 0.9}, "rates": {"arm": 0.7, "disk": -1.1}}
    keys["analysis"] = [{"name": "fall", "kind": "forward", "end": 1.0, "output_step": 0.1}]
    scene = validate(SceneWithSlots, keys, Path("slot.toml"))
    return build_model(scene, [from_rigid_body(body.name, body.rigid) for body in scene.body])


SLOT = {"name": "S", "type": "slot", "between": ["arm.slot", "disk.pin"], "way": [2.0, 0.5]}
PATHS = [
    {"name": "place", "point": "disk.rim", "x": "0.6+0.1*t", "y": "0.5*cos(t)"},
    {"name": "turn", "angle": "disk", "value": "0.9+t**2"},
]
AS_BUILT = {
    "rotor": {"rotor_inertia": 0.3},
    "friction": {"viscous_friction": 0.4, "coulomb_friction": 0.3, "friction_speed": 0.5},
    "both": {"rotor_inertia": 0.3, "viscous_friction": 0.4},
}


@pytest.mark.parametrize("kind", ["slot", "guide", "rail"])
@pytest.mark.parametrize("what", [None, *AS_BUILT])
@pytest.mark.parametrize("paths", [(), PATHS])
def test_what_acts_along_its_coordinate(kind, what, paths):
    """Accelerations, multipliers and energies are those of the oracle; the disk is a free body of the tree.

    Along the way, a direction that turns with the arm, as about the pin.
    """
    slot = AS_BUILT.get(what, {}) | {"type": kind}
    if kind == "rail":  # it holds one direction of the place
        slot, paths = slot | {"between": ["ground", "disk.pin"], "at": [0.5, 0.2]}, paths[1:]
    model = on_arm(slot, trajectory=list(paths), load=[{"joint": "S", "moment": "2+t"}])
    assembly = assemble(model)
    start, rng = undeformed_state(assembly), np.random.default_rng(0)
    q, v = on_constraints(assembly, 0.0, start.q, start.v + rng.standard_normal(len(start.v)))
    tree, oracle = PlanarTree(assembly), oracle_of(assembly)
    a, multipliers = oracle.solve(0.0, q, v)
    found_a, found = tree.evaluate(0.0, q, v)
    assert relative(found_a, a) < 1e-12
    assert relative(found, multipliers) < 1e-12
    energies = tree.both.energies(*(x[None] for x in tree.state(q, v)))[0]
    np.testing.assert_allclose(energies, oracle.energies(q, v), rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("what", AS_BUILT)
def test_what_would_act_along_a_direction_of_the_ground_between_two_bodies_is_refused(what):
    """It would turn with the first of them."""
    model = on_arm(AS_BUILT[what] | {"type": "rail"})
    expected = r'kind = "forward" quantities that joint coordinates define, .* direction of the ground \(.*"S", x\)'
    with pytest.raises(InputError, match=expected):
        run(model, forward(end=0.3))


def test_forces_of_paths_carry_the_motion_out_again():
    arm = {"name": "arm", "joint": "O", "value": "0.4+0.3*t**2"}
    model = on_arm(AS_BUILT["both"], trajectory=[arm, PATHS[1]])
    source = run(model, pcid(end=0.3, tolerance=1e-10))
    assert source.status == "completed"
    assert source.tau is None  # as many motors as freedom: the way along the slot has none
    replay = forward(end=0.3, tolerance=1e-10, actuation="inverse", apply="trajectory")
    again = run(model, replay, source)
    assert relative(again.q, source.q) < 1e-8


def trammel(kind, slot, *trajectory):
    """A flexible body of which two points slide in slots of the ground; a motor moves it along the second."""
    body = random_cloud(np.random.default_rng(3), "a").planar_body()
    x, y = body.points["tip"].position - body.points["root"].position
    keys = {"name": "trammel", "gravity": [0.0, -9.81], "path": "slot.toml", "text": "", "trajectory": trajectory}
    keys["body"] = [{"name": "a", "rigid": {"mass": 1.0, "inertia": 1.0, "center": [0.0, 0.0]}}]
    keys["joint"] = [
        {"name": "A", "type": "slot", "between": ["ground", "a.root"], "way": [1.0, 0.0]},
        {"name": "B", "between": ["ground", "a.tip"], "at": [0.4 * x, 0.4 * y], "way": [y, x], "motor": True}
        | slot
        | {"type": kind},
    ]
    keys["analysis"] = [{"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}]
    return build_model(validate(SceneWithSlots, keys, Path("slot.toml")), [body])


@pytest.mark.parametrize("kind", ["slot", "guide"])
@pytest.mark.parametrize("what", [None, *AS_BUILT])
def test_a_motor_along_its_coordinate(kind, what):
    """What it does in place of a path's forces, by definition; its moment carries the motion out again."""
    model = trammel(kind, AS_BUILT.get(what, {}), {"name": "turn", "angle": "a", "value": "t**2"})
    source = run(model, pcid(end=0.1, tolerance=1e-10))
    assert source.status == "completed"
    oracle, is_trajectory = oracle_of(source.assembly), np.array(source.assembly.is_trajectory)
    for k in (0, 5, 10):
        C_q = oracle.constraint_values(0.0, source.q[k], source.v[k])[2]
        T_q = np.array([oracle.row(row, source.q[k], source.v[k]).gradient for row in model.motors.values()])
        D = velocity_transformation.by_definition(oracle, C_q[~is_trajectory], T_q)
        force = -D.T @ C_q[is_trajectory].T @ source.lambda_[k][is_trajectory]
        assert relative(source.tau[k], force[:1]) < 1e-11
        assert relative(source.F_p[k], force[1:]) < 1e-11
    modes = len(source.F_p[0])
    patches = _core.Patches(0, _core.Allocation(*3 * (np.eye(modes),), np.full(modes, np.inf), np.ones(modes)))
    motors = _core.Motors(0, np.array([np.inf]))
    assembly = MechanismSystem(model, model.joints, [(row, ZERO) for row in model.motors.values()])
    run = core_run(
        assembly, source.q[0], source.v[0], source.time.tolist(), tolerance=1e-10,
        external_loads=_core.Actuation(actuation_source(source), [motors, patches]),
    )  # fmt: skip
    assert relative(run.q, source.q) < 1e-7


@pytest.mark.parametrize("integrator", ["radau", "generalized-alpha"])
def test_implicit_integrators(integrator):
    model = on_arm(AS_BUILT["friction"])
    exact = run(model, forward(end=0.3, tolerance=1e-9, integrator="dop853"))
    found = run(model, forward(end=0.3, tolerance=1e-5, integrator=integrator))
    assert relative(found.q, exact.q) < 1e-4


def test_prescribed_motion():
    """A pin in a slot of the ground, its place along it and its angle given: forces are those of the free body."""
    paths = [{"name": "turn", "angle": "a", "value": "t**2"}, {"name": "slide", "point": "a.pin", "x": "t**2"}]
    scene = scene_with({"name": "S", "type": "slot", "between": ["ground", "a.pin"], "way": [1.0, 0.0]}, paths)
    model = build_model(scene, [from_rigid_body("a", scene.body[0].rigid)])
    outcome = run(model, Fcid(name="held", kind="fcid", shape="zero", end=1.0, output_step=0.1))
    np.testing.assert_allclose(outcome.a, [[2.0, 0.0, 2.0]] * 11, atol=1e-13)
    expected = {"turn": 0.5 * 2.0, "slide": 2.0 * 2.0}
    for name, force in expected.items():
        np.testing.assert_allclose(trajectory_force(outcome, name)[:, 0], force, rtol=1e-13)


def test_its_keys_are_checked():
    between = {"name": "S", "between": ["ground", "a.pin"]}
    with pytest.raises(InputError, match='joint "S": way: expected a value, since this key is required'):
        scene_with(between | {"type": "slot"})
    with pytest.raises(InputError, match='joint "S": expected the key "way" only in slot or guide or rail joints'):
        scene_with(between | {"type": "revolute", "way": [1.0, 0.0]})
    with pytest.raises(
        InputError, match='joint "S": type: expected "revolute", "prismatic", "weld", "slot", "guide" or "rail"'
    ):
        scene_with(between | {"type": "slit"})
    with pytest.raises(InputError, match=r'joint "S": wy: expected one of the keys .*did you mean "way"'):
        scene_with(between | {"type": "slot", "way": [1.0, 0.0], "wy": 1.0})


def test_the_list_has_every_type_once():
    assert list(JOINT_TYPES) == ["revolute", "prismatic", "weld"]
    assert all(name == record.type_name() for name, record in JOINT_TYPES.items())


@pytest.mark.parametrize("key", ["moment_limit", "gear_ratio", "rotor_inertia", "viscous_friction"])
def test_a_weld_has_no_keys_of_motors(key):
    with pytest.raises(InputError, match=f'"{key}" only in revolute or prismatic joints, found it in a weld joint'):
        checked_scene([{"name": "W", "type": "weld", "between": ["ground", "a.root"], key: 1.0}])


def test_a_weld_has_no_coordinate_for_trajectories_and_loads():
    from ffrobot.scene.load import make_scene

    rigid = {"mass": 1.0, "inertia": 1.0, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0], "tip": [1.0, 0.0]}}
    with pytest.raises(InputError) as caught:
        make_scene(
            name="weld",
            gravity=[0.0, 0.0],
            body=[{"name": "a", "rigid": rigid}, {"name": "b", "rigid": rigid}],
            joint=[revolute("O", "ground", "a.root"), {"name": "W", "type": "weld", "between": ["a.tip", "b.root"]}],
            trajectory=[{"name": "turn", "joint": "W", "value": "t"}],
            load=[{"joint": "W", "moment": 1.0}],
            analysis=[{"name": "run", "kind": "pcid", "end": 1.0, "output_step": 0.1}],
        )
    lines = str(caught.value).splitlines()
    for key in ('trajectory "turn": joint', "load no. 1: joint"):
        assert any(f'{key}: expected a joint that moves ("O"), found "W", a weld' in line for line in lines)
