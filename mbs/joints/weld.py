"""Welds: the second body moves with the first."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from .joint import JointRecord, MotorSide
from .measure import Measure, coincident, relative_angle


class WeldJoint(JointRecord):
    """Two points coincide and their angle, that of the initial guess, stays; `at` (m) on the ground."""

    type: Literal["weld"]
    motor: bool | None = None
    """Only `false`: a weld cannot be driven."""

    @model_validator(mode="after")
    def _has_no_motor(self) -> WeldJoint:
        if self.motor:
            raise ValueError("expected no motor in a weld, which cannot move, found motor = true")
        return self

    def constraints(self, angle: float) -> tuple[Measure, ...]:
        """Differences of x and y of the two points, m, and the change of the angle, rad."""
        a, b = self.markers
        return *coincident(self.label, a, b), relative_angle(self.label, a, b, angle)

    def coordinate(self, motors: MotorSide) -> None:
        """It has none."""
        return
