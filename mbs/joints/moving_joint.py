"""Joints that move along an axis: keys of the axis, of limits, motors and friction."""

from collections.abc import Sequence
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ...common.rotations import smallest_turn
from ..fields.field_types import NotNegative, Positive, Quantity, Vector3
from ..fields.spelling import SPATIAL, NormalInPlane, Spelled, as_written
from .joint import Friction, JointRecord, MotorLimits
from .twist_spring import StiffnessSteps

Limit = Annotated[Positive | tuple[Positive, ...], Spelled(Positive, as_written)]
Range = tuple[Quantity, Quantity]


class MovingJoint(JointRecord):
    """A joint with coordinates, which motors may drive. Joints with several take lists of limits, one for each."""

    motor: bool | None = None
    """Presence of motors; by default in open chains only, and not in spherical and free joints."""
    position_limit: Annotated[Range | tuple[Range, ...] | None, Spelled(Range, as_written)] = None
    """Range of the coordinate, [lo, hi], rad (sliding: m). No contact force acts beyond it; a warning has
    time and size of the excess."""
    moment_limit: Limit | None = None
    """Largest torque, N·m (sliding: force, N), at the joint: after the gear."""
    speed_limit: Limit | None = None
    """Largest rate of the joint, rad/s (sliding: m/s)."""
    power_limit: Limit | None = None
    """Largest mechanical power, W."""
    viscous_friction: NotNegative = 0.0
    """Viscous coefficient c, N·m·s/rad (sliding: N·s/m)."""
    coulomb_friction: NotNegative = 0.0
    """Coulomb torque τ_c, N·m (sliding: N)."""
    friction_speed: Positive = 0.01
    """Rate at which dry friction has 76 % of its size, tanh 1, rad/s (sliding: m/s)."""

    @model_validator(mode="after")
    def _has_friction(self) -> Self:
        if "friction_speed" in self.model_fields_set and not self.coulomb_friction:
            raise ValueError('expected the key "friction_speed" only with coulomb_friction, found it alone')
        return self

    @model_validator(mode="after")
    def _limits_fit(self) -> Self:
        count = len(self.units)
        for key in ("moment_limit", "speed_limit", "power_limit"):
            value = getattr(self, key)
            if value is not None and np.size(value) != count:
                wanted = "a number" if count == 1 else f"{count} numbers, one for each coordinate"
                raise ValueError(f"expected {wanted} in {key}, found {np.size(value)}")
        for lowest, highest in self._ranges():
            if not lowest < highest:
                raise ValueError(f"expected position_limit = [least, largest], found [{lowest:g}, {highest:g}]")
        return self

    def _ranges(self) -> tuple[Range, ...]:
        value, count = self.position_limit, len(self.units)
        if value is None:
            return ()
        ranges = tuple(each for each in value if isinstance(each, tuple)) or ((float(value[0]), float(value[1])),)  # type: ignore[arg-type]
        if len(ranges) != count:
            wanted = "one pair [least, largest]" if count == 1 else f"{count} pairs [least, largest]"
            raise ValueError(f"expected {wanted} in position_limit, found {len(ranges)}")
        return ranges

    def has_motor(self, default: bool) -> bool:
        """Whether motors drive the joint; `default` if the scene does not specify it."""
        return default if self.motor is None else self.motor

    @property
    def asks_for_motor(self) -> bool:
        """Whether the scene sets `motor = true`."""
        return bool(self.motor)

    @property
    def motor_limits(self) -> tuple[MotorLimits, ...]:
        """Limits of the motors for each coordinate, N·m, rad/s, W or N, m/s, W; infinite if not given."""
        count = len(self.units)
        limits = (self.moment_limit, self.speed_limit, self.power_limit)
        rows = [np.broadcast_to(np.inf if limit is None else limit, count).tolist() for limit in limits]
        return tuple(MotorLimits(*of_one) for of_one in zip(*rows, strict=True))

    @property
    def position_limits(self) -> tuple[tuple[float, float], ...]:
        """Least and largest value of each coordinate (rad or m); infinite where not given."""
        return self._ranges() or super().position_limits

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """Friction along each coordinate; empty where there is none."""
        if not (self.viscous_friction or self.coulomb_friction):
            return ()
        return (Friction(self.viscous_friction, self.coulomb_friction, self.friction_speed),) * len(self.units)


class AxialJoint(MovingJoint):
    """A joint whose motion is along or about an axis, z of its triads."""

    axis: Annotated[Vector3, NormalInPlane(SPATIAL)] = Field(default=None, validate_default=True)
    """Axis of motion in the axes of the first of `between` (ground: global), of any length."""

    @model_validator(mode="after")
    def _axis_has_direction(self) -> Self:
        check_direction("axis", self.axis)
        return self

    def triads(self) -> tuple[Array, Array]:
        """Their z is along the axis."""
        first = smallest_turn(np.array(self.axis))
        return first, self.orientation.T @ first


class GearedJoint(AxialJoint):
    """A joint with one coordinate, whose motor may drive it by a rotor and a gear, rigid or compliant."""

    gear_ratio: Positive = 1.0
    """Rotor turns per turn of the joint (sliding: rotor rotation per joint displacement, rad/m)."""
    rotor_inertia: NotNegative = 0.0
    """Moment of inertia of the rotor about its axis, kg·m², before the gear."""
    stiffness: Positive | StiffnessSteps | None = None
    """Stiffness of a compliant gear, N·m/rad (sliding: N/m), or { values = [K1, K2, …], torques = [T1, …] } in steps of
    its torque (force); default: rigid."""
    damping: NotNegative = 0.0
    """Damping of that gear, N·m·s/rad (sliding: N·s/m)."""

    @model_validator(mode="after")
    def _has_rotor_behind_spring(self) -> Self:
        if self.stiffness is None and self.damping:
            raise ValueError('expected the key "damping" only with stiffness, found it alone')
        if self.stiffness is not None and not self.rotor_inertia:
            raise ValueError("expected a rotor_inertia above 0 with stiffness, found none: the rotor turns freely")
        return self


def check_direction(key: str, axis: Sequence[float]) -> None:
    """Raise `ValueError` for an axis without direction."""
    if not any(axis):
        raise ValueError(f"expected {key} with a direction, found {list(axis)}")
