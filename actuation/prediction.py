"""What modal forces that nobody supplies do to the end effector."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.arrays import Array
from ..common.plane import rotated
from ..mbs.analysis.planar_outcome import PlanarOutcome
from ..mbs.model.masses import system_mass_matrix
from ..mbs.quantities.joint_space import held_joint_motion, motor_joint_motion
from .patches.voltages import Voltages
from .unsupplied import RINGING, ROWS, Unsupplied


def unmet_modal_forces(outcome: PlanarOutcome, voltages: Mapping[str, Voltages]) -> Array:
    """F_p (T, modes of all bodies) less what patches do within their limits; all of it on links without patches."""
    assert outcome.F_p is not None
    unmet = outcome.F_p.copy()
    for body, of_body in voltages.items():
        unmet[:, outcome.modal_columns(body)] = of_body.unmet
    return unmet


def predicted_shift(outcome: PlanarOutcome, unmet: Array) -> dict[str, Array]:
    """Shift (T, 2), m, global axes, of every point by unmet modal forces r, where motors keep their angles.

    To first order, and slowly: δp = −K⁻¹ r, δq = ∂q/∂p δp, δr = δR + A_θ u δθ + A Φ δp. Vibration that a sudden lack of
    force starts can be twice as large.
    """
    return _shift_of_points(outcome, _held_shift(outcome, unmet), slice(None))


def unsupplied(
    outcome: PlanarOutcome, unmet: Array, shift: Mapping[str, Array], bodies: tuple[str, ...], *, with_patches: bool
) -> Unsupplied:
    """What motors miss by the `unmet` modal forces, of `bodies` above all; their `shift` (T, 2) of points is known."""
    trajectories = outcome.assembly.model.scene.trajectory
    followed = [trajectory.point for trajectory in trajectories if trajectory.point is not None]
    points = {name: np.linalg.norm(shift[name], axis=1) for name in followed or shift}
    point = max(points, key=lambda name: float(points[name].max()))
    rows = slice(None, None, max(1, len(outcome.time) // ROWS))
    freed = np.linalg.norm(_shift_of_points(outcome, _freed_shift(outcome, unmet, rows), rows)[point], axis=1)
    kept = points[point]
    return Unsupplied(bodies, with_patches, point, float(kept.max()), float(kept[0]), RINGING * float(freed.max()))


def _held_shift(outcome: PlanarOutcome, unmet: Array) -> Array:
    """δq (T, coordinates) with the angles of motors kept."""
    stiffness = np.concatenate([body.stiffness for body in outcome.assembly.model.bodies])
    shift: Array = np.einsum("tkn,tn->tk", held_joint_motion(outcome), -unmet / stiffness)
    return shift


def _freed_shift(outcome: PlanarOutcome, unmet: Array, rows: slice) -> Array:
    """δq of these rows with the moments of motors kept: the robot recoils by γ, no momentum comes from within.

    δq = δq_held + R γ with Rᵀ M δq = 0, R = ∂q/∂γ: unmet modal forces do no work while p stands still.
    """
    shift = _held_shift(outcome, unmet)[rows]
    for k, (q, R) in enumerate(zip(outcome.q[rows], motor_joint_motion(outcome, rows), strict=True)):
        MR = system_mass_matrix(outcome.assembly, q) @ R
        shift[k] -= R @ np.linalg.solve(R.T @ MR, MR.T @ shift[k])
    return shift


def _shift_of_points(outcome: PlanarOutcome, delta_q: Array, rows: slice) -> dict[str, Array]:
    """δr (outputs, 2) of every point for δq (outputs, coordinates) of these rows."""
    shifts = {}
    for body in outcome.assembly.model.bodies:
        columns = outcome.coordinates(body.name)
        q, delta = outcome.q[rows, columns], delta_q[:, columns]
        for name, point in body.points.items():
            u = point.position + q[:, 3:] @ point.translation.T
            in_body = delta[:, 3:] @ point.translation.T + delta[:, 2:3] * np.column_stack([-u[:, 1], u[:, 0]])
            shifts[f"{body.name}.{name}"] = delta[:, :2] + rotated(q[:, 2], in_body)
    return shifts
