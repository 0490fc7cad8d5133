"""The mechanism of a planar scene as one in space, records to records."""

from __future__ import annotations

from typing import NamedTuple

from ....common.errors import InputError
from ...fields.field_types import GROUND
from ...joints.joints import Joint
from ...joints.spatial.joint import SpatialJoint
from ...joints.spatial.joints import SPATIAL_JOINT_TYPES
from ..bodies import Body
from ..initial import Initial
from ..mechanism import MechanismKeys, MechanismScene
from ..spatial.bodies import BodyInSpace, SpatialPayload, SpatialRigidBody
from ..spatial.initial import SpatialInitial
from ..spatial.loads import SpatialLoad
from ..spatial.mechanism import SpatialMechanismScene
from ..spatial.trajectories import SpatialTrajectory
from .keys import Keys, given_keys, joint_keys, load_keys, payload_keys, place, rigid_keys
from .not_carried import not_carried


class Start(NamedTuple):
    """Where joints stand at t = 0, by name: coordinates (rad, or m where prismatic) and their rates."""

    joints: dict[str, float]
    joint_rates: dict[str, float]


def mechanism_in_space(scene: MechanismScene, start: Start | None = None) -> SpatialMechanismScene:
    """The same mechanism in the plane z = 0, with its path and text; `start` in place of what [initial] guesses.

    Joints of the tree stand before those that close loops: the loops are cut in space where they are cut in the plane.

    Raises `InputError` with a line for each thing that cannot be said in space.
    """
    if refused := [f"{scene.path}: {problem}" for problem in not_carried(scene)]:
        raise InputError("\n".join(refused))
    return SpatialMechanismScene(**mechanism_keys(scene, start), path=scene.path, text=scene.text)


def mechanism_keys(scene: MechanismKeys, start: Start | None = None) -> Keys:
    """The keys of the mechanism in space."""
    kept = ("name", "motors", "geometric_stiffening")
    found = {key: value for key, value in given_keys(scene).items() if key in kept}
    return found | {
        "space": "planar",
        "gravity": place(scene.gravity),
        "body": tuple(_body(body) for body in scene.body),
        "joint": tuple(_joint(scene, scene.joint[number]) for number in _tree_first(scene)),
        "trajectory": tuple(SpatialTrajectory(**given_keys(path)) for path in scene.trajectory),
        "load": tuple(SpatialLoad(**load_keys(given_keys(load))) for load in scene.load),
        "payload": tuple(SpatialPayload(**payload_keys(given_keys(payload))) for payload in scene.payload),
        "initial": _initial(scene.initial, guessed_start(scene) if start is None else start),
    }


def guessed_start(scene: MechanismKeys) -> Start:
    """What [initial] says of joints, absolute angles of bodies as relative ones; 0 where it says nothing."""
    return Start(
        {joint.name: guess for joint in scene.joint if (guess := _guess(scene, joint)) is not None},
        {joint.name: rate for joint in scene.joint if (rate := _rate(scene, joint)) is not None},
    )


def _guess(scene: MechanismKeys, joint: Joint) -> float | None:
    given = scene.initial.joints.get(joint.name, 0.0)
    return _turn(scene.guessed_angles, joint) if joint.type == "revolute" else _way(given, joint)


def _rate(scene: MechanismKeys, joint: Joint) -> float | None:
    given = scene.initial.joint_rates.get(joint.name, 0.0)
    return _turn(scene.guessed_rates, joint) if joint.type == "revolute" else _way(given, joint)


def _way(given: float, joint: Joint) -> float | None:
    return given if joint.type == "prismatic" else None  # welds have no coordinate


def _turn(of_bodies: dict[str, float], joint: Joint) -> float:
    """Of the second body against the first, by absolute angles or rates."""
    first, second = (0.0 if body == GROUND else of_bodies.get(body, 0.0) for body in joint.bodies)
    return second - first


def _initial(initial: Initial, start: Start) -> SpatialInitial:
    return SpatialInitial(state=initial.state, joints=dict(start.joints), joint_rates=dict(start.joint_rates))


def _tree_first(scene: MechanismKeys) -> list[int]:
    loops = scene.topology.loop_joints
    return [*(number for number in range(len(scene.joint)) if number not in loops), *loops]


def _body(body: Body) -> BodyInSpace:
    keys = given_keys(body)
    if body.rigid is not None:
        keys["rigid"] = SpatialRigidBody(**rigid_keys(given_keys(body.rigid)))
    return BodyInSpace.model_construct(set(keys), **keys)  # its files were found when the planar record was made


def _joint(scene: MechanismKeys, joint: Joint) -> SpatialJoint:
    record = SPATIAL_JOINT_TYPES[joint.type]
    return record(**joint_keys(given_keys(joint), _turn(scene.guessed_angles, joint)))
