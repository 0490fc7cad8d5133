"""Revolute joints: two points coincide, the second side turns about an axis of the first."""

from typing import Literal

from .joint import ALIGNED, POINT, Along
from .moving_joint import GearedJoint


class RevoluteJoint(GearedJoint):
    """Two points coincide, the second side turns about `axis` by its coordinate, rad; in planar scenes about z.

    Drivetrain: `rotor_inertia` J (kg·m²) of a rotor that sits on the first body, its axis that of the joint, and turns
    `gear_ratio` times as fast as the second side does on the first. Between the gear of a motor and the second body a
    spring `stiffness` (N·m/rad; default: rigid; or in steps of the torque) and a damper `damping` (N·m·s/rad).
    """

    type: Literal["revolute"]
    units = ("rad",)
    axes = (5,)
    loop_equations = (POINT, *ALIGNED)
    along = (Along("turn", 2),)
