"""Joint coordinates as independent coordinates: rates of the motors, and what p does while they stand still."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ..analysis.planar_outcome import PlanarOutcome
from ..model.model import ZERO, Constraint
from ..model.system import MechanismSystem


def motor_rates(outcome: PlanarOutcome) -> Array:
    """Rates T_q q̇ of the motor coordinates (T, motors), rad/s, or m/s for prismatic joints.

    The motor rows are those that `motors` of the scene defines: between sections or between frames.
    """
    T_q = _gradients(outcome)[:, len(outcome.assembly.model.joints) :]
    rates: Array = np.einsum("trk,tk->tr", T_q, outcome.v)
    return rates


def held_joint_motion(outcome: PlanarOutcome) -> Array:
    """∂q/∂p (T, coordinates, modes of all bodies) with all joints closed and all motors at rest.

    The modal columns of the velocity transformation D of Shabana 2022, Eq. 18: C_mq δq = 0 and T_q δq = 0 give δ(R, θ).
    Needs as many motors as the mechanism with rigid links has degrees of freedom.
    """
    frames = outcome.assembly.frame_coordinates
    modes = np.setdiff1d(np.arange(outcome.q.shape[1]), frames)
    rows = _gradients(outcome)
    motion = np.zeros((len(rows), outcome.q.shape[1], len(modes)))
    motion[:, modes, np.arange(len(modes))] = 1.0
    motion[:, frames] = -np.linalg.solve(rows[:, :, frames], rows[:, :, modes])
    return motion


def motor_joint_motion(outcome: PlanarOutcome, rows: slice) -> Array:
    """∂q/∂γ (outputs, coordinates, motors) of the motor coordinates γ with all joints closed and p kept."""
    gradients, frames = _gradients(outcome)[rows], outcome.assembly.frame_coordinates
    closed = len(outcome.assembly.model.joints)
    unit = np.eye(gradients.shape[1])[:, closed:]
    motion = np.zeros((len(gradients), outcome.q.shape[1], unit.shape[1]))
    motion[:, frames] = np.linalg.solve(gradients[:, :, frames], np.broadcast_to(unit, (len(gradients), *unit.shape)))
    return motion


def _gradients(outcome: PlanarOutcome) -> Array:
    """Gradients (T, rows, coordinates) of the joint constraints and then of the motor coordinates."""
    model = outcome.assembly.model
    motors = [Constraint(row, ZERO, name, "motor", is_trajectory=False) for name, row in model.motors.items()]
    wanted = [*model.joints, *motors]
    assembly = MechanismSystem(model, wanted)
    order = [assembly.constraints.index(constraint) for constraint in wanted]
    gradients: Array = assembly.system.constraint_jacobians(outcome.q)[:, order]
    return gradients
