"""A new type of joint is a record of its own and an entry in the list of types."""

from pathlib import Path
from typing import Annotated, ClassVar, Literal, get_args

import numpy as np
import pytest
from mechanisms import always, checked_scene, forward, relative, revolute
from pydantic import Field

from ffrobot.common.errors import InputError
from ffrobot.common.validation import validate
from ffrobot.mbs.analysis.fcid import Fcid, run_fcid
from ffrobot.mbs.analysis.forward import run_forward
from ffrobot.mbs.fields.field_types import Vector2
from ffrobot.mbs.joints.joints import JOINT_TYPES, Joint
from ffrobot.mbs.joints.measure import relative_angle, slide
from ffrobot.mbs.joints.moving_joint import MovingJoint
from ffrobot.mbs.joints.transmission import Rotor
from ffrobot.mbs.model.model import build_model
from ffrobot.mbs.model.planar_body import from_rigid_body
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


class SceneWithSlots(Scene):
    """A scene whose list of types has one more entry."""

    joint: tuple[Annotated[get_args(Joint)[0] | SlotJoint, Field(discriminator="type")], ...] = ()


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
    outcome = run_forward(model, forward(tolerance=1e-9), None, {}, always)
    distance = 0.25 * 9.81 * outcome.time**2
    expected = np.column_stack([distance * 3.0**0.5 / 2, -distance / 2, 3.0 * outcome.time])
    assert relative(outcome.q, expected) < 1e-8


def test_what_knows_joint_coordinates_alone_refuses_it_by_name():
    paths = [{"name": "turn", "angle": "a", "value": "t**2"}, {"name": "slide", "point": "a.pin", "x": "t**2"}]
    slot = {"name": "S", "type": "slot", "between": ["ground", "a.pin"], "way": [1.0, 0.0]}
    scene = scene_with(slot, paths)
    model = build_model(scene, [from_rigid_body("a", scene.body[0].rigid)])
    with pytest.raises(InputError, match=r'kind = "fcid" what joint coordinates can tell, found joint "S", slot'):
        run_fcid(model, Fcid(name="held", kind="fcid", shape="zero", end=1.0, output_step=0.1))


def test_its_keys_are_checked():
    between = {"name": "S", "between": ["ground", "a.pin"]}
    with pytest.raises(InputError, match='joint "S": way: expected a value, since this key is required'):
        scene_with(between | {"type": "slot"})
    with pytest.raises(InputError, match='joint "S": expected the key "way" only in slot joints, found it in a revol'):
        scene_with(between | {"type": "revolute", "way": [1.0, 0.0]})
    with pytest.raises(InputError, match='joint "S": type: expected "revolute", "prismatic", "weld" or "slot"'):
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
