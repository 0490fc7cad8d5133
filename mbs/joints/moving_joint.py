"""Joints that move: keys of their motors, gears and friction."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from pydantic import model_validator

from ..fields.field_types import NotNegative, Positive
from .joint import JointRecord, MotorSide
from .measure import Measure
from .transmission import Friction, MotorLimits, Rotor


class MovingJoint(JointRecord):
    """A joint with a coordinate γ, which a motor may drive."""

    motor: bool | None = None
    """Presence of a motor; by default in open chains only."""
    moment_limit: Positive | None = None
    """Largest torque, N·m (prismatic: force, N), at the joint: after the gear."""
    speed_limit: Positive | None = None
    """Largest rate of the joint, rad/s (prismatic: m/s)."""
    power_limit: Positive | None = None
    """Largest mechanical power, W."""
    gear_ratio: Positive = 1.0
    """Rotor turns per turn of the joint (prismatic: rad/m)."""
    rotor_inertia: NotNegative = 0.0
    """Moment of inertia of the rotor about its axis, kg·m², before the gear."""
    viscous_friction: NotNegative = 0.0
    """Viscous coefficient c, N·m·s/rad (prismatic: N·s/m)."""
    coulomb_friction: NotNegative = 0.0
    """Coulomb torque τ_c, N·m (prismatic: N)."""
    friction_speed: Positive = 0.01
    """Rate at which dry friction has 76 % of its size, tanh 1, rad/s (prismatic: m/s)."""

    @model_validator(mode="after")
    def _has_friction(self) -> MovingJoint:
        if "friction_speed" in self.model_fields_set and not self.coulomb_friction:
            raise ValueError('expected the key "friction_speed" only with coulomb_friction, found it alone')
        return self

    @abstractmethod
    def coordinate(self, motors: MotorSide) -> Measure:
        """γ of the second side on the first."""

    @abstractmethod
    def rotor_measure(self, motors: MotorSide) -> Rotor:
        """The measure along which `rotor_inertia` moves, and what inertia it has along it."""

    def has_motor(self, default: bool) -> bool:
        """Whether a motor drives it; `default` where the scene leaves that open."""
        return default if self.motor is None else self.motor

    @property
    def asks_for_motor(self) -> bool:
        """Whether the scene says `motor = true`."""
        return bool(self.motor)

    @property
    def motor_limits(self) -> MotorLimits:
        """What its motor can do; infinite where the scene gives no limit."""
        limits = (self.moment_limit, self.speed_limit, self.power_limit)
        return MotorLimits(*(np.inf if limit is None else limit for limit in limits))

    @property
    def given_gear_ratio(self) -> float | None:
        """`gear_ratio` where the scene gives it."""
        return self.gear_ratio if "gear_ratio" in self.model_fields_set else None

    def rotor(self, motors: MotorSide) -> Rotor | None:
        """The rotor of its motor, where it has inertia."""
        return self.rotor_measure(motors) if self.rotor_inertia else None

    @property
    def friction(self) -> Friction | None:
        """Friction along γ; None where there is none."""
        if not (self.viscous_friction or self.coulomb_friction):
            return None
        return Friction(self.viscous_friction, self.coulomb_friction, self.friction_speed)
