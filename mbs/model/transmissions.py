"""Joints as they are built: the rotors, frictions and elastic gears of a scene."""

from __future__ import annotations

from collections.abc import Iterator

from ..joints.measure import Measure
from ..joints.transmission import ElasticGear, Friction, Rotor
from ..scene.mechanism import MechanismKeys


def joint_rotors(scene: MechanismKeys) -> Iterator[Rotor]:
    """The rotors with inertia."""
    for joint in scene.joint:
        if (rotor := joint.rotor(scene.motors)) is not None:
            yield rotor


def joint_gears(scene: MechanismKeys) -> Iterator[ElasticGear]:
    """The elastic gears."""
    for joint in scene.joint:
        if (gear := joint.elastic_gear(scene.motors)) is not None:
            yield gear


def joint_frictions(scene: MechanismKeys) -> Iterator[tuple[Measure, Friction]]:
    """The joint coordinates on which friction acts."""
    for joint in scene.joint:
        if joint.friction is not None:
            yield scene.coordinate(joint.name), joint.friction
