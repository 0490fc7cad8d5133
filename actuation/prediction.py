"""What modal forces that nobody supplies do to the end effector."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..common.arrays import Array
from ..common.plane import rotated
from ..mbs.analysis.outcome import Outcome
from ..mbs.quantities.joint_space import held_joint_motion
from .patches.voltages import Voltages


def unmet_modal_forces(outcome: Outcome, voltages: Mapping[str, Voltages]) -> Array:
    """F_p (T, modes of all bodies) less what patches do within their limits; all of it on links without patches."""
    assert outcome.F_p is not None
    unmet = outcome.F_p.copy()
    for body, of_body in voltages.items():
        unmet[:, outcome.modal_columns(body)] = of_body.unmet
    return unmet


def predicted_shift(outcome: Outcome, unmet: Array) -> dict[str, Array]:
    """Shift (T, 2), m, global axes, of every point by unmet modal forces r, where motors keep their angles.

    To first order, and slowly: δp = −K⁻¹ r, δq = ∂q/∂p δp, δr = δR + A_θ u δθ + A Φ δp. Vibration that a sudden lack of
    force starts can be twice as large; motors that keep their moments instead of their angles let an arm drift away.
    """
    model = outcome.assembly.model
    stiffness = np.concatenate([body.stiffness for body in model.bodies])
    delta_q = np.einsum("tkn,tn->tk", held_joint_motion(outcome), -unmet / stiffness)
    shifts = {}
    for body in model.bodies:
        q, delta = (x[:, outcome.coordinates(body.name)] for x in (outcome.q, delta_q))
        for name, point in body.points.items():
            u = point.position + q[:, 3:] @ point.translation.T
            in_body = delta[:, 3:] @ point.translation.T + delta[:, 2:3] * np.column_stack([-u[:, 1], u[:, 0]])
            shifts[f"{body.name}.{name}"] = delta[:, :2] + rotated(q[:, 2], in_body)
    return shifts
