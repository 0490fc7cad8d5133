"""Motion that is wholly prescribed, by the core: modal coordinates by functions of time, joints by paths. SI units."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .. import _core
from .._core import TimeFunction
from ..model.model import Model
from ..model.nodes import rows_of_joint
from ..model.system import frame_share, turning_motors


class Prescribed(NamedTuple):
    """States q (T, n_q), v, a (T, n_v), multipliers (T, equations), required forces M v̇ − Q (T, n_v); SI units."""

    q: Array
    v: Array
    a: Array
    multipliers: Array
    required: Array


def following_motors(model: Model, q: Array | None = None) -> Model:
    """The robot with motors that stay as at q (n_q,), rad and m, in place of paths.

    None: their equations have no `target`; `RedefinedMotion` of the core sets it.
    """
    rows = [row for row in model.rows if not row.is_trajectory]
    for joint, coordinates in model.motors.items():
        node = model.driven(joint)
        targets: list[TimeFunction | None] = [None] * len(coordinates)
        if q is not None:
            targets = [TimeFunction.constant(value) for value in q[node.q.start + coordinates - node.v.start].tolist()]
        rows += rows_of_joint(joint, node, coordinates, targets)
    return replace(model, rows=tuple(rows))


PrescribedMotion = _core.PlanarPrescribedMotion | _core.SpatialPrescribedMotion


def prescribed_motion(model: Model, motion: PrescribedMotion, modes: Array, times: Array, near: Array) -> Prescribed:
    """The motion at `times` (T,), s, for `modes` (3, T, n): p, ṗ, p̈, m·√kg and s, from postures `near` (T, n_q), SI.

    From one posture, near the first, each is sought next to the one before. Multipliers balance the forces on joints,
    which move freely; the forces on modes that are left hold the shape.
    Raises `SolveError` where no posture meets the constraint equations.
    """
    states = motion.motion(times.tolist(), modes[0], modes[1], modes[2], near)
    is_met = np.isfinite(states.q).all(axis=1)
    if not is_met.all():
        raise SolveError(
            f"{model.scene.path}: no posture was found at t = {times[int(is_met.argmin())]:g} s: the prescribed shape"
            " takes the trajectories out of reach"
        )
    return Prescribed(states.q, states.v, states.a, states.multipliers * model.row_signs, states.required)


def left_slopes(
    model: Model, motion: PrescribedMotion, modes: tuple[Array, Array, Array], times: Array, near: Array
) -> tuple[Array, Array, Array]:
    """Derivatives M, D, K (T, n + motors, n), SI units, of residual modal forces and motor torques by p̈, ṗ and p.

    At `times` (T,), s, with `modes` p, ṗ, p̈ (T, n), m·√kg and s, and postures near (T, n_q), rad and m.
    """
    at, n = times.tolist(), modes[0].shape[1]
    M, D, K = (x.reshape(len(times), -1, n) for x in motion.derivatives(at, *modes, near))
    turning = turning_motors(model)
    if turning and M.shape[1] > n:
        of_modes = ~model.tree.joint_columns
        rows = n + np.cumsum([0, *(len(columns) for columns in model.motors.values())])
        row_of = dict(zip(model.motors, rows.tolist(), strict=False))
        states = motion.motion(at, *modes, near)
        for k in np.flatnonzero(np.isfinite(states.q).all(axis=1)):
            for joint in turning:
                share, row = frame_share(model, joint, states.q[k]), row_of[joint]
                for x in (M, D, K):
                    x[k, :n] -= model.sign(joint) * np.outer(share.direction[of_modes], x[k, row])
                K[k, :n] -= model.sign(joint) * states.tau[k, row - n] * share.slope[np.ix_(of_modes, of_modes)]
    return M, D, K
