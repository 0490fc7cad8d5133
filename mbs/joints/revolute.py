"""Revolute joints: two points coincide, the second side turns about an axis of the first."""

from typing import Literal, Self

from pydantic import model_validator

from ..fields.field_types import NotNegative, Positive
from .joint import ALIGNED, POINT, Along
from .moving_joint import AxialJoint
from .twist_spring import StiffnessSteps


class RevoluteJoint(AxialJoint):
    """Two points coincide, the second side turns about `axis` by its coordinate, rad; in planar scenes about z.

    Drivetrain: `rotor_inertia` J (kg·m²) of a rotor that sits on the first body, its axis that of the joint, and turns
    `gear_ratio` times as fast as the second side does on the first. Between the gear of a motor and the second body a
    spring `stiffness` (N·m/rad; default: rigid; or in steps of the torque) and a damper `damping` (N·m·s/rad).
    """

    type: Literal["revolute"]
    gear_ratio: Positive = 1.0
    """Rotor turns per turn of the joint."""
    rotor_inertia: NotNegative = 0.0
    """Moment of inertia of the rotor about its axis, kg·m², before the gear."""
    stiffness: Positive | StiffnessSteps | None = None
    """Stiffness of a compliant gear, N·m/rad, or { values = [K1, K2, …], torques = [T1, …] } in steps of its torque;
    default: rigid."""
    damping: NotNegative = 0.0
    """Damping of that gear, N·m·s/rad."""

    @model_validator(mode="after")
    def _has_rotor_behind_spring(self) -> Self:
        if self.stiffness is None and self.damping:
            raise ValueError('expected the key "damping" only with stiffness, found it alone')
        if self.stiffness is not None and not self.rotor_inertia:
            raise ValueError("expected a rotor_inertia above 0 with stiffness, found none: the rotor turns freely")
        return self

    units = ("rad",)
    axes = (5,)
    loop_equations = (POINT, *ALIGNED)
    along = (Along("turn", 2),)
