"""Joints as the scene text of a results file has them: coordinates, units, limits of motors, planar and 3D."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..common.arrays import Array
from ..mbs.joints.joint import JointRecord, MotorLimits
from ..mbs.joints.joints import JOINT_TYPES

Scene = Mapping[str, Any]
"""A scene file as TOML has it."""


class Coordinate(NamedTuple):
    """One coordinate of a joint."""

    label: str  # what tells it from the joint's others: "" of a single one, " 1", " 2" of several
    column: str  # which column of `coordinate`, `rate` and `moment` it is: "", or "[0]", "[1]"
    unit: str  # "rad" or "m"
    limits: MotorLimits  # of its motor; infinite where the scene gives none

    def of(self, values: Array) -> Array:
        """Column (T,) of this coordinate in a joint's dataset `values`, (T,) or (T, coordinates), of the same unit."""
        return values.reshape(len(values), -1)[:, int(self.column[1:-1] or 0)]

    @property
    def force_unit(self) -> str:
        """Unit of force or torque along the coordinate, "N·m" or "N"."""
        return "N·m" if self.unit == "rad" else "N"


def joint_type(keys: Mapping[str, Any]) -> type[JointRecord]:
    """The record of a joint with these keys."""
    return JOINT_TYPES[str(keys["type"])]


def joint_coordinates(scene: Scene, name: str) -> tuple[Coordinate, ...]:
    """The coordinates of a joint in the order of its datasets; none of one that does not move, or is not there."""
    keys: Scene = next((keys for keys in scene.get("joint", []) if keys["name"] == name), {})
    units = joint_type(keys).units if keys else ()
    limits = [np.broadcast_to(keys.get(f"{what}_limit") or np.inf, len(units)) for what in ("moment", "speed", "power")]
    several = len(units) > 1
    return tuple(
        Coordinate(f" {k + 1}" if several else "", f"[{k}]" if several else "", unit, MotorLimits(*map(float, of_one)))
        for k, (unit, *of_one) in enumerate(zip(units, *limits, strict=True))
    )


Coordinates = Mapping[str, tuple[str, Coordinate]]
"""Joint and coordinate by label: the joint's name, with a number where it has several coordinates."""


def labelled_coordinates(scene: Scene) -> Coordinates:
    """Return the coordinates of all joints by label, in the order of the scene."""
    names = [str(joint["name"]) for joint in scene.get("joint", [])]
    return {f"{name}{one.label}": (name, one) for name in names for one in joint_coordinates(scene, name)}
