"""Motion in space that is wholly prescribed: modal coordinates by functions of time, joints by the rows of paths."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from ..model.spatial_known_motion import KnownStates, required_forces, row_accelerations
from ..model.spatial_model import SpatialModel, row_values, target_rates
from ..model.spatial_motors import split_forces
from .quasi_static import quasi_static_shape
from .spatial_posture import BoolArray, solve_postures
from .state import State

ONE_BY_ONE = 50  # groups of neighbours, each looked for from the last posture of the one before it


class Prescribed(NamedTuple):
    """States q (T, n_q), v and a (T, n_v), the forces M v̇ − Q (T, n_v) that they take, and multipliers (T, rows)."""

    q: Array
    v: Array
    a: Array
    required: Array
    multipliers: Array


def prescribed_motion(
    model: SpatialModel, modes: Array, times: Array, start: State, near: Array | None = None
) -> Prescribed:
    """At `times` (T,), with `modes` (3, T, n): p, ṗ and p̈ of all bodies, from a posture near the first.

    `near` (T, n_q): joints close to what is looked for, where they are known; all times are then solved at once.

    As many rows as joints have freedoms are independent. The multipliers are those that go with joints that move
    freely: what is left of the forces on the modes holds the shape.

    Raises `SolveError` where no posture meets the rows.
    """
    joints = model.tree.joint_columns
    q = np.tile(start.q, (len(times), 1))
    q[:, modal_places(model)] = modes[0]
    if near is None:
        q = _postures(model, times, q)
    else:
        q[:, joint_places(model)] = near[:, joint_places(model)]
        q, is_met = solve_postures(model, times, q)
        _check_met(model, times, is_met)
    q, v, a, C_v = _moved(model, modes, times, q)
    required = required_forces(model, KnownStates(q, v, a), times)
    multipliers = -np.einsum("tji,tj->ti", np.linalg.pinv(C_v[:, :, joints]), required[:, joints])
    return Prescribed(q, v, a, required, multipliers)


def motion_near(model: SpatialModel, modes: Array, times: Array, guess: Array) -> tuple[Array, Array, Array, BoolArray]:
    """Q, v and a with `modes` (3, T, n) at `times`, from guesses (T, n_q) of postures; and where one was found (T,).

    Elsewhere they are those of the guess.
    """
    q = guess.copy()
    q[:, modal_places(model)] = modes[0]
    q, is_met = solve_postures(model, times, q)
    q = np.where(is_met[:, None], q, guess)
    return *_moved(model, modes, times, q)[:3], is_met


def _moved(model: SpatialModel, modes: Array, times: Array, q: Array) -> tuple[Array, Array, Array, Array]:
    """Q, v, a and C_v (T, rows, n_v) of joints that follow the rows, at postures q (T, n_q) that meet them."""
    tree, joints = model.tree, model.tree.joint_columns
    v, a = np.zeros((2, len(times), tree.n_v))
    v[:, ~joints], a[:, ~joints] = modes[1:]
    frames = tree.frames(q)
    C_v = row_values(model, q, times, frames)[1]
    by_joints = np.linalg.pinv(C_v[:, :, joints])
    rates = target_rates(model, q, times, frames) - np.einsum("tij,tj->ti", C_v, v)
    v[:, joints] = np.einsum("tij,tj->ti", by_joints, rates)
    bias = row_accelerations(model, KnownStates(q, v, a), times)
    a[:, joints] = -np.einsum("tij,tj->ti", by_joints, bias)
    return q, v, a, C_v


def spatial_quasi_static_shape(model: SpatialModel, times: Array, start: State, *, by_motors: bool) -> Array:
    """Of all bodies p (T, n) at `times` (T,), with which motors alone move the robot along its paths, ṗ = p̈ = 0.

    Without `by_motors`, with which the forces on the paths do. Raises `SolveError` where links are too soft.
    """

    def left_on_modes(at: Array, p: Array, near: Array | None) -> tuple[Array, Array]:
        found = prescribed_motion(model, np.array([p, 0 * p, 0 * p]), at, start, near)
        frames = model.tree.frames(found.q)
        C_v = row_values(model, found.q, at, frames)[1]
        if by_motors:
            left = split_forces(model, found.q, frames, C_v, found.required).left
        else:
            left = found.required + np.einsum("tij,ti->tj", C_v, found.multipliers)
        return found.q, left[:, ~model.tree.joint_columns]

    K = np.concatenate([node.body.stiffness for node in model.tree.nodes])
    shape = quasi_static_shape(left_on_modes, K, times)
    if np.isfinite(shape).all():
        return shape
    raise SolveError(
        f"{model.scene.path}: no static shape was found between t = {times[0]:g} and {times[-1]:g} s: the links are too"
        " soft for their loads there"
    )


def modal_places(model: SpatialModel) -> Array:
    """Where the modes of all bodies stand in q."""
    return np.concatenate([np.arange(node.p_q.start, node.p_q.stop) for node in model.tree.nodes])


def joint_places(model: SpatialModel) -> Array:
    """Where the joints of all bodies stand in q."""
    return np.concatenate([np.arange(node.q.start, node.q.stop) for node in model.tree.nodes])


def _check_met(model: SpatialModel, times: Array, is_met: BoolArray) -> None:
    """Raise `SolveError` for the first of the times (T,) at which no posture was found."""
    if not is_met.all():
        raise SolveError(
            f"{model.scene.path}: no posture was found at t = {times[int(is_met.argmin())]:g} s: the prescribed shape"
            " takes the trajectories out of reach"
        )


def _postures(model: SpatialModel, times: Array, q: Array) -> Array:
    """Q (T, n_q) with joints that meet the rows, modes kept: some one after the other, those between from these."""
    modes = modal_places(model)
    found, at, stride = np.zeros_like(q), q[0], -(-len(times) // ONE_BY_ONE)
    for k in range(0, len(times), stride):
        guess = q[k : k + stride].copy()
        guess[:] = at
        guess[:, modes] = q[k : k + stride, modes]
        some, is_met = solve_postures(model, times[k : k + stride], guess)
        _check_met(model, times[k : k + stride], is_met)
        found[k : k + stride], at = some, some[-1]
    return found
