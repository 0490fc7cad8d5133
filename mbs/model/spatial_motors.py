"""What motors and modal forces do in place of the forces on a path: the split of generalized forces in space."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.rotations import left_jacobian, left_jacobian_slope
from .spatial_model import SpatialModel
from .spatial_tree import Motion, Section


@dataclass(frozen=True)
class MotorForces:
    """τ (T, k) by joint, N·m or N, on its second side, and F_p (T, n) by body, what patches would have to supply.

    F_p belongs to the modes of the modal body file.
    """

    moments: Mapping[str, Array]
    modal: Mapping[str, Array]


def path_forces(model: SpatialModel, C_v: Array, multipliers: Array) -> Array:
    """−C_sᵀλ_s (T, n_v): what the forces on the paths do along v, with C_v (T, rows, n_v) and λ (T, rows)."""
    path = ~model.loop_rows
    found: Array = -np.einsum("tij,ti->tj", C_v[:, path], multipliers[:, path])
    return found


class SplitForces(NamedTuple):
    """τ (T, k) by joint, EᵀF_p (T, n_v) and ν (T, loop rows)."""

    moments: dict[str, Array]
    left: Array
    loops: Array


def split_forces(model: SpatialModel, q: Array, frames: Sequence[Motion], C_v: Array, wanted: Array) -> SplitForces:
    """Gᵀτ + EᵀF_p + C_mᵀν = `wanted` (T, n_v), with C_v (T, rows, n_v) at q (T, n_q).

    In joint coordinates without loops τ are the components of the right side along the motors' coordinates and F_p
    those along the modes; loops share them out with ν.
    """
    joints, loops = model.tree.joint_columns, C_v[:, model.loop_rows]
    motors = np.concatenate([*model.motors.values(), np.zeros(0, dtype=int)]).astype(int)
    G = np.broadcast_to(np.eye(model.tree.n_v)[motors], (len(q), len(motors), model.tree.n_v))
    rows = np.concatenate([loops, G], axis=1)
    found = np.einsum("tji,tj->ti", np.linalg.pinv(rows[:, :, joints]), wanted[:, joints])
    left = wanted - np.einsum("tij,ti->tj", rows, found)
    moments, first = {}, loops.shape[1]
    for name, numbers in model.motors.items():
        moments[name] = model.sign(name) * found[:, first : first + len(numbers)]
        first += len(numbers)
    if model.scene.motors == "frame":
        _move_to_frames(model, q, frames, moments, left)
    return SplitForces(moments, left, found[:, : loops.shape[1]])


def motor_forces(model: SpatialModel, q: Array, frames: Sequence[Motion], C_v: Array, wanted: Array) -> MotorForces:
    """The same, modal forces by body and in the modes of the modal body files."""
    moments, left, _ = split_forces(model, q, frames, C_v, wanted)
    stored = {node.body.name: left[:, node.p_v] @ node.body.on_file for node in model.tree.nodes}
    return MotorForces(moments, stored)


def _move_to_frames(
    model: SpatialModel, q: Array, frames: Sequence[Motion], moments: Mapping[str, Array], left: Array
) -> None:
    """Motors that turn frames, not sections: what they do less on the modes, modal forces do more."""
    tree = model.tree
    for joint in turning_motors(model):
        node = tree.nodes[tree.carried[joint]]
        axis = tree.motion(node.inner, q, frames).F[:, :, 2]
        along = model.sign(joint) * moments[joint]
        for section, sign in ((node.outer, 1.0), (node.inner, -1.0)):
            if section.body >= 0:
                turn = np.einsum("ti,tij->tj", axis, spin_of_modes(model, q, frames, section))
                left[:, tree.nodes[section.body].p_v] += sign * along * turn


def turning_motors(model: SpatialModel) -> list[str]:
    """Joints whose motors can turn frames in place of sections: those with one angle."""
    return [joint.name for joint in model.scene.motor_joints if joint.units == ("rad",)]


class FrameShare(NamedTuple):
    """What a unit moment of a motor on frames, along the tree's coordinate, does on modes beside.

    `direction` (n_v,), and `slope` (n_v, n_v), its derivative along v: the axis turns with the section.
    """

    direction: Array
    slope: Array


def frame_share(model: SpatialModel, joint: str, q: Array) -> FrameShare:
    """Of the motor of a revolute joint at q (n_q,): −Φ_rᵀ J_l(φ) z of both its sections.

    Why: core/recursion/frame_motor.h.
    """
    tree = model.tree
    direction, slope = np.zeros(tree.n_v), np.zeros((tree.n_v, tree.n_v))
    node = tree.nodes[tree.carried[joint]]
    for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
        if section.body >= 0 and section.point:
            of = tree.nodes[section.body]
            Phi_r, axis = of.body.points[section.point].rotation, side * section.triad[:, 2]
            phi = Phi_r @ q[of.p_q]
            direction[of.p_v] -= Phi_r.T @ left_jacobian(phi) @ axis
            slope[of.p_v, of.p_v] -= Phi_r.T @ left_jacobian_slope(phi, axis) @ Phi_r
    return FrameShare(direction, slope)


def spin_of_modes(model: SpatialModel, q: Array, frames: Sequence[Motion], section: Section) -> Array:
    """A J_l Φ_r (T, 3, n): the section's angular velocity by ṗ."""
    node = model.tree.nodes[section.body]
    Phi_r = node.body.points[section.point].rotation if section.point else np.zeros((3, node.body.n_modes))
    phi = q[:, node.p_q] @ Phi_r.T
    found: Array = frames[section.body].F @ left_jacobian(phi) @ Phi_r
    return found
