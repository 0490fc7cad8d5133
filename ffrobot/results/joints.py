"""Joints as the scene text of a results file has them: coordinates, units, limits of motors, planar and 3D."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from ..common.arrays import Array
from ..common.meanings import meaning
from ..mbs.joints.joint import JointRecord, MotorLimits
from ..mbs.joints.joints import JOINT_TYPES

Scene = Mapping[str, Any]
"""A scene file as TOML has it."""


class Coordinate(NamedTuple):
    """One coordinate of a joint."""

    joint: str
    column: str  # "" or "[0]", "[1]", … in datasets `coordinate`, `rate` and `moment`
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
    """The class of a joint with `keys` of a scene, by its key `type`."""
    return JOINT_TYPES[str(keys["type"])]


Coordinates = Mapping[str, Coordinate]
"""By label: the joint's name, with a number where it has several coordinates."""


def labelled_coordinates(scene: Scene) -> Coordinates:
    """Return the coordinates of all joints by label, in the order of the scene and of their datasets."""
    coordinates = {}
    for keys in scene.get("joint", []):
        units = joint_type(keys).units
        limits = [np.broadcast_to(keys.get(f"{of}_limit") or np.inf, len(units)) for of in ("moment", "speed", "power")]
        for k, (unit, *of_one) in enumerate(zip(units, *limits, strict=True)):
            label, column = (f" {k + 1}", f"[{k}]") if len(units) > 1 else ("", "")
            of_motor = MotorLimits(*map(float, of_one))
            coordinates[f"{keys['name']}{label}"] = Coordinate(keys["name"], column, unit, of_motor)
    return coordinates


def joint_coordinates(scene: Scene, name: str) -> tuple[Coordinate, ...]:
    """The coordinates of a joint in the order of its datasets; none of one that does not move, or is not there."""
    return tuple(one for one in labelled_coordinates(scene).values() if one.joint == name)


def unit_of(scene: Scene, name: str) -> str:
    """Return the unit of dataset `name` of an analysis, "" if unknown; of a joint's, by the unit of its coordinates."""
    known, parts = meaning(name), name.split("/")
    units = known.unit.split(", ") if known is not None else []
    if parts[0] == "joints" and len(units) == 2:  # of angles, of displacements
        kinds = {one.unit for one in joint_coordinates(scene, parts[1])}
        units = [unit for unit, kind in zip(units, ("rad", "m"), strict=True) if kind in kinds]
    return ", ".join(units)
