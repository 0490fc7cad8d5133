"""Prismatic joints: the second body slides along an axis of the first and does not turn on it."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from pydantic import model_validator

from ..fields.field_types import Vector2
from .joint import MotorSide
from .measure import Measure, relative_angle, slide
from .moving_joint import MovingJoint
from .transmission import Rotor


class PrismaticJoint(MovingJoint):
    """The second point slides along `axis`, a direction in the frame of the first body, and keeps its angle.

    The angle is that of the initial guess. `at` (m) is the position of the joint on the ground. Without `motor`, joints
    of open chains are driven. Limits of the motor: N, m/s, W.

    Drivetrain: `rotor_inertia` J (kg·m²) of a rotor that turns by `gear_ratio` N (rad/m); friction on the displacement
    γ along the axis, −(c γ̇ + τ_c tanh(γ̇/γ̇_s)): `viscous_friction` c (N·s/m), `coulomb_friction` τ_c (N),
    `friction_speed` γ̇_s (m/s).
    """

    type: Literal["prismatic"]
    axis: Vector2 | None = None
    """Direction of motion in the axes of the first body (ground: global axes), of any length."""

    locates: ClassVar[bool] = False  # it leaves the place along its axis open
    force_unit: ClassVar[str] = "N"

    @model_validator(mode="after")
    def _axis_has_direction(self) -> PrismaticJoint:
        if self.axis is None or not any(self.axis):
            found = "none" if self.axis is None else f"{list(self.axis)}"
            raise ValueError(f"expected an axis that is not zero in a prismatic joint, found {found}")
        return self

    def constraints(self, angle: float) -> tuple[Measure, ...]:
        """The way across the axis, m, and the change of the angle, rad."""
        (x, y), (a, b) = self.unit_axis, self.markers
        return slide(f"{self.label}, across the axis", a, b, (-y, x)), relative_angle(self.label, a, b, angle)

    def coordinate(self, motors: MotorSide) -> Measure:
        """The way along the axis, m."""
        return slide(f"{self.label}, along the axis", *self.markers, self.unit_axis)

    def rotor_measure(self, motors: MotorSide) -> Rotor:
        """The way along the axis with the mass J N², kg; that the first body turns is left out."""
        return Rotor(self.coordinate(motors), self.rotor_inertia * self.gear_ratio**2)

    @property
    def unit_axis(self) -> tuple[float, float]:
        """Direction of motion, axes of the first body."""
        assert self.axis is not None
        x, y = np.array(self.axis) / np.hypot(*self.axis)
        return float(x), float(y)
