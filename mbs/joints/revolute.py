"""Revolute joints: two points coincide, the second body turns on the first."""

from __future__ import annotations

from typing import Literal

from pydantic import model_validator

from .. import _core
from ..fields.field_types import NotNegative, Positive
from .joint import MotorSide
from .measure import FRAME, Marker, Measure, coincident, relative_angle
from .moving_joint import MovingJoint
from .transmission import ElasticGear, Rotor


class RevoluteJoint(MovingJoint):
    """Two points coincide; `at` (m) is the position of the joint on the ground.

    Without `motor`, joints of open chains are driven. Limits of the motor: N·m, rad/s, W.

    Drivetrain: `rotor_inertia` J (kg·m²) of a rotor that sits on the first body and turns `gear_ratio` N times as fast
    as the second does on the first; friction on the joint's coordinate γ, −(c γ̇ + τ_c tanh(γ̇/γ̇_s)):
    `viscous_friction` c (N·m·s), `coulomb_friction` τ_c (N·m), `friction_speed` γ̇_s (rad/s). Between the gear of a
    motor and the second body a spring `stiffness` (N·m/rad; default: rigid) and a damper `damping` (N·m·s/rad).
    """

    type: Literal["revolute"]
    stiffness: Positive | None = None
    """Stiffness of a compliant gear, N·m/rad; default: rigid."""
    damping: NotNegative = 0.0
    """Damping of that gear, N·m·s/rad."""

    @model_validator(mode="after")
    def _has_rotor_behind_spring(self) -> RevoluteJoint:
        if self.stiffness is None and self.damping:
            raise ValueError('expected the key "damping" only with stiffness, found it alone')
        if self.stiffness is not None and not self.rotor_inertia:
            raise ValueError("expected a rotor_inertia above 0 with stiffness, found none: the rotor turns freely")
        return self

    def constraints(self, angle: float) -> tuple[Measure, ...]:
        """Differences of x and y of the two points, m."""
        return coincident(self.label, *self.markers)

    def coordinate(self, motors: MotorSide) -> Measure:
        """The angle of the second section, or frame, on the first, rad."""
        a, b = self.markers
        if motors == "frame":
            a, b = (Marker(marker.body, FRAME, marker.position) for marker in (a, b))
        return relative_angle(self.label, a, b)

    def rotor_measure(self, motors: MotorSide) -> Rotor:
        """N α_b − (N − 1) α_a of a rotor on the first body a behind a gear of ratio N, with J.

        Spong 1987 neglects the part of α_a: his approximation is N² J γ̇²/2. The angles are those of the coordinate.
        """
        coordinate, N = self.coordinate(motors), self.gear_ratio
        label, gear = f"rotor of {self.label}", _core.MeasureKind.gear
        return Rotor(Measure(label, gear, coordinate.a, coordinate.b, gear_ratios=(N, N - 1)), self.rotor_inertia)

    def elastic_gear(self, motors: MotorSide) -> ElasticGear | None:
        """The gear with its spring, where `stiffness` is given."""
        if self.stiffness is None:
            return None
        coordinate, N, rotor = self.coordinate(motors), self.gear_ratio, f"{self.name}/rotor"
        label, gear = f"motor of {self.label}", _core.MeasureKind.gear
        motor = Measure(label, gear, coordinate.a, Marker(rotor), gear_ratios=(1.0, 1 / N))
        return ElasticGear(self.name, rotor, N, self.rotor_inertia, self.stiffness, self.damping, motor, coordinate)
