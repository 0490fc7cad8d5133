"""Prescribed motion in 3D in NumPy, an oracle of the core: pseudoinverses of Jacobians, bodies by Kane's equations."""

from typing import NamedTuple

import numpy as np
from body_equations import required_forces
from row_wrenches import spin_of_modes
from tree_accelerations import Accelerated, row_accelerations

from ffrobot.common.arrays import Array
from ffrobot.mbs.model.model import row_values, target_rates
from ffrobot.mbs.solve.posture import solve_postures

RANK = 1e-10  # of the largest singular value


class Prescribed(NamedTuple):
    """q (T, n_q), v, a (T, n_v), multipliers (T, rows), M v̇ − Q (T, n_v), and C_v (T, rows, n_v)."""

    q: Array
    v: Array
    a: Array
    multipliers: Array
    required: Array
    C_v: Array


def prescribed_motion(model, modes, times, near):
    """With `modes` (3, T, n) p, ṗ, p̈ at `times` (T,), joints by all rows, from postures near (T, n_q)."""
    tree, joints = model.tree, model.tree.joint_columns
    q = near.copy()
    q[:, np.concatenate([np.r_[node.p_q] for node in tree.nodes])] = modes[0]
    q, is_met = solve_postures(model, times, q)
    assert is_met.all()
    v, a = np.zeros((2, len(times), tree.n_v))
    v[:, ~joints], a[:, ~joints] = modes[1:]
    frames = tree.frames(q)
    C_v = row_values(model, q, times, frames)[1]
    by_joints = np.linalg.pinv(C_v[:, :, joints], rcond=RANK)
    v[:, joints] = np.einsum("tij,tj->ti", by_joints, target_rates(model, q, times) - np.einsum("tij,tj->ti", C_v, v))
    a[:, joints] = -np.einsum(
        "tij,tj->ti", by_joints, row_accelerations(model, Accelerated(tree, q, v, a, frames), times)
    )
    required = required_forces(model, Accelerated(tree, q, v, a, frames), times)
    multipliers = -np.einsum("tji,tj->ti", by_joints, required[:, joints])
    return Prescribed(q, v, a, multipliers, required, C_v)


class Motor(NamedTuple):
    """Along `sign` v[coordinate]; on frames in place of sections where it `turns_frames`."""

    coordinate: int
    sign: float
    turns_frames: bool


def split(model, found, motors):
    """τ (T, motors), multipliers of loops (T, loop rows), and what both leave (T, n_v) of `found.required`."""
    joints = model.tree.joint_columns
    G = np.array([motor.sign * np.eye(model.tree.n_v)[motor.coordinate] for motor in motors])
    acting = np.concatenate([-found.C_v[:, model.loop_rows], np.broadcast_to(G, (len(found.q), *G.shape))], axis=1)
    by = np.linalg.pinv(acting[:, :, joints], rcond=RANK)
    sizes = np.einsum("tji,tj->ti", by, found.required[:, joints])
    left = found.required - np.einsum("tij,ti->tj", acting, sizes)
    loops, tau = np.split(sizes, [acting.shape[1] - len(motors)], axis=1)
    frames = model.tree.frames(found.q)
    for k, motor in enumerate(motors):
        if motor.turns_frames:
            node = next(node for node in model.tree.nodes if node.v.start == motor.coordinate)
            axis = model.tree.motion(node.inner, found.q, frames).F[:, :, 2]
            for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
                if section.body >= 0:
                    turn = side * motor.sign * tau[:, k, None] * axis
                    left[:, model.tree.nodes[section.body].p_v] += np.einsum(
                        "ti,tij->tj", turn, spin_of_modes(model, found.q, frames, section)
                    )
    return tau, loops, left
