"""What modal forces that nobody supplies do to the end effector."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ..mbs.analyses import Outcome
from ..mbs.joint_space import held_joint_motion
from .voltages import Voltages

Array = NDArray[np.float64]


def unmet_modal_forces(outcome: Outcome, voltages: Mapping[str, Voltages]) -> Array:
    """F_p (T, modes of all bodies) less what patches do within their limits; all of it on links without patches."""
    assert outcome.F_p is not None
    unmet = outcome.F_p.copy()
    for body, of_body in voltages.items():
        unmet[:, outcome.modal_columns(body)] = of_body.unmet
    return unmet


def predicted_shift(outcome: Outcome, unmet: Array) -> dict[str, Array]:
    """Shift (T, m) of each trajectory's components by unmet modal forces r, where the motors keep their angles.

    To first order, and slowly: δp = −K⁻¹ r, and δ(target) = C_sq ∂q/∂p δp. Vibration that a sudden lack of force starts
    can be twice as large; motors that keep their moments instead of their angles let the arm drift away in time.
    """
    model = outcome.assembly.model
    stiffness = np.concatenate([body.stiffness for body in model.bodies])
    delta_q = np.einsum("tkn,tn->tk", held_joint_motion(outcome), -unmet / stiffness)
    C_q = outcome.assembly.system.constraint_jacobians(outcome.q)
    shift = np.einsum("trk,tk->tr", C_q, delta_q)
    names = [(c.owner, c.component, c.is_trajectory) for c in outcome.assembly.constraints]
    columns: dict[str, list[int]] = {}
    for trajectory in model.trajectories:  # in the order of the scene, unlike the constraints of the assembly
        columns.setdefault(trajectory.owner, []).append(names.index((trajectory.owner, trajectory.component, True)))
    return {owner: shift[:, of_owner] for owner, of_owner in columns.items()}
