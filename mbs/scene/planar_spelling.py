"""Planar scenes in the records of 3D: what their fields cannot say one by one (`fields/spelling.py` reads those).

Guesses of absolute angles become joint coordinates, and the angles that welds and prismatic joints keep.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeVar

from ..fields.field_types import GROUND
from ..joints.joint import JointRecord
from .mechanism import MechanismKeys
from .topology import Edge, spanning_forest

S = TypeVar("S", bound=MechanismKeys)
Values = Mapping[str, float]


def in_3d(scene: S) -> S:
    """The scene with guesses of joints for those of bodies; the scene itself where it is spatial.

    The guess of a revolute joint is the angle of its second body on the first, in rad; welds and prismatic joints keep
    that angle. Likewise for rates. Bodies that no joint carries are in the plane on one of their own name.
    """
    if scene.space != "planar":
        return scene
    initial = scene.initial
    angles = _of_bodies(scene, initial.angles, initial.joints)
    rates = _of_bodies(scene, initial.rates, initial.joint_rates)
    turning = [joint for joint in scene.joint if _turns(joint)]
    floating = [body for body, carrier in scene.topology.carriers.items() if carrier is None]

    def guesses(of_bodies: Values) -> dict[str, Any]:
        return {joint.name: _turn(of_bodies, joint) for joint in turning} | {
            body: (0.0, 0.0, of_bodies.get(body, 0.0)) for body in floating
        }

    start = {
        "joints": guesses(angles) | initial.joints,
        "joint_rates": guesses(rates) | initial.joint_rates,
        "angles": {},
        "rates": {},
    }

    def named(of_joints: Mapping[str, Any], of_bodies: Values) -> frozenset[str]:
        between = (joint.name for joint in turning if {*joint.bodies} <= {GROUND, *of_bodies})
        return frozenset({*of_joints, *between})

    kept = initial.naming(
        joints=named(initial.joints, initial.angles), joint_rates=named(initial.joint_rates, initial.rates)
    )
    joints = tuple(
        joint if _turns(joint) else joint.model_copy(update={"rpy": (0.0, 0.0, _turn(angles, joint))})
        for joint in scene.joint
    )
    return scene.model_copy(update={"joint": joints, "initial": kept.model_copy(update=start)})


def _turns(joint: JointRecord) -> bool:
    return joint.type == "revolute"


def _turn(of_bodies: Values, joint: JointRecord) -> float:
    """Of the second body against the first, by absolute angles or rates."""
    first, second = (0.0 if body == GROUND else of_bodies.get(body, 0.0) for body in joint.bodies)
    return second - first


def _of_bodies(scene: MechanismKeys, given: Values, of_joints: Mapping[str, Any]) -> dict[str, float]:
    """Angles or rates by body: where not given, that of the body that carries it and what the joint between adds.

    All others are 0 where joints have no guesses, too. Trees avoid prismatic joints, then those without a guess.
    """
    angles = dict(given)
    if not of_joints:
        return angles
    edges = [
        Edge(joint.between, 2 * (joint.type == "prismatic") + (joint.name not in of_joints)) for joint in scene.joint
    ]
    for body, carrier in spanning_forest([body.name for body in scene.body], edges).carriers.items():
        if carrier is not None and body not in angles:
            joint = scene.joint[carrier.joint]
            turn = of_joints.get(joint.name, 0.0) if _turns(joint) else 0.0
            angles[body] = angles.get(carrier.parent, 0.0) + (turn if joint.between[1] == carrier.own else -turn)
    return angles
