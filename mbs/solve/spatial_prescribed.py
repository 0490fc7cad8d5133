"""Motion in space that is wholly prescribed: modal coordinates by functions of time, joints by the rows of paths."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .._core import TimeFunction
from ..model.spatial_accelerations import Accelerated, row_accelerations
from ..model.spatial_inverse import required_forces
from ..model.spatial_model import SpatialModel, row_values, target_rates
from .spatial_posture import solve_posture
from .state import State


class Prescribed(NamedTuple):
    """States q (T, n_q), v and a (T, n_v), the forces M v̇ − Q (T, n_v) that they take, and multipliers (T, rows)."""

    q: Array
    v: Array
    a: Array
    required: Array
    multipliers: Array


def prescribed_motion(
    model: SpatialModel, shape: Sequence[Sequence[TimeFunction]], times: Array, start: State
) -> Prescribed:
    """At `times` (T,), with p_k(t) of each body of the tree in `shape`, from a posture near the first.

    As many rows as joints have freedoms are independent. The multipliers are those that go with joints that move
    freely: what is left of the forces on the modes holds the shape.

    Raises `SolveError` where no posture meets the rows.
    """
    tree, joints = model.tree, model.tree.joint_columns
    q, v, a = _modal(model, shape, times, start.q)
    q = _postures(model, times, q)
    C_v = row_values(model, q, times)[1]
    by_joints = np.linalg.pinv(C_v[:, :, joints])
    rates = target_rates(model, q, times) - np.einsum("tij,tj->ti", C_v, v)
    v[:, joints] = np.einsum("tij,tj->ti", by_joints, rates)
    frames = tree.frames(q)
    bias = row_accelerations(model, Accelerated(tree, q, v, a, frames), times)
    a[:, joints] = -np.einsum("tij,tj->ti", by_joints, bias)
    required = required_forces(model, Accelerated(tree, q, v, a, frames), times)
    multipliers = -np.einsum("tji,tj->ti", by_joints, required[:, joints])
    return Prescribed(q, v, a, required, multipliers)


def _modal(
    model: SpatialModel, shape: Sequence[Sequence[TimeFunction]], times: Array, q: Array
) -> tuple[Array, Array, Array]:
    """States with the joints of q (n_q,) and the shape, and v and a of the modes alone."""
    found = np.broadcast_to(q, (len(times), model.tree.n_q)).copy()
    v, a = np.zeros((2, len(times), model.tree.n_v))
    for node, functions in zip(model.tree.nodes, shape, strict=True):
        samples = np.array([function.sample(times) for function in functions]).reshape(len(functions), 3, len(times))
        found[:, node.p_q], v[:, node.p_v], a[:, node.p_v] = np.moveaxis(samples, 0, -1)
    return found, v, a


def _postures(model: SpatialModel, times: Array, q: Array) -> Array:
    """Q (T, n_q) with joints that meet the rows, each found from the one before it; modes are kept."""
    modes = np.concatenate([np.arange(node.p_q.start, node.p_q.stop) for node in model.tree.nodes])
    found, at = np.zeros_like(q), q[0]
    for k, t in enumerate(times):
        at = at.copy()
        at[modes] = q[k, modes]
        moved = solve_posture(model, float(t), at)
        if moved is None:
            raise SolveError(
                f"{model.scene.path}: no posture was found at t = {t:g} s: the prescribed shape takes the trajectories"
                " out of reach"
            )
        found[k] = at = moved
    return found
