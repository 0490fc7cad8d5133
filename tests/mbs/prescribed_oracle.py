"""Motions under rows in NumPy, an oracle of the core: what is left of forces and rows, and prescribed motion.

Pseudoinverses of Jacobians, bodies by Kane's equations.
"""

from typing import NamedTuple

import numpy as np
import tree_oracle
from body_equations import accelerated, required_forces
from tree_oracle import row_values, target_rates

from ffrobot.mbs.quantities.motion import constraint_rows


def residuals(motion):
    """M v̇ − Q + C_vᵀλ, and C̈ less what targets ask for, the largest, both relative to their largest terms."""
    state, at = accelerated(motion), motion.time
    needed, at_rest = (required_forces(motion.model, state._replace(a=a), at) for a in (state.a, 0 * state.a))
    of_rows = np.einsum("tji,tj->ti", constraint_rows(motion)[1], motion.multipliers)
    forces = max(np.abs(x).max(initial=0.0) for x in (needed - at_rest, at_rest, of_rows))
    accelerations = max(np.abs(state.a).max(), np.abs(state.v).max() ** 2, 1.0)
    left = row_accelerations(motion.model, state, at)
    return np.abs(needed + of_rows).max() / forces, np.abs(left).max(initial=0.0) / accelerations


def row_accelerations(model, state, times):
    """C̈ (T, rows) at `times` (T,), less what their targets ask for: 0 where the motion keeps to the constraints."""

    def rates(q, t):
        C_v = row_values(model, q, times + t)[1]
        return np.einsum("tij,tj->ti", C_v, state.v) - target_rates(model, q, times + t)

    slopes = tree_oracle.rate(rates, state.tree, state.q, state.v)
    return np.einsum("tij,tj->ti", row_values(model, state.q, times)[1], state.a) + slopes


class Motor(NamedTuple):
    """Along `sign` v[coordinate]; on frames in place of sections where it `turns_frames`."""

    coordinate: int
    sign: float
    turns_frames: bool


def unmet(model, found, motors):
    """Forces (T, n_v) that motors and loops leave of `found.required`, by its τ and multipliers of loops."""
    C_v, frames = row_values(model, found.q, np.zeros(len(found.q)))[1], tree_oracle.frames(model.tree, found.q)
    left = found.required + np.einsum("tij,ti->tj", C_v[:, model.loop_rows], found.loops)
    for k, motor in enumerate(motors):
        left[:, motor.coordinate] -= motor.sign * found.tau[:, k]
        if motor.turns_frames:
            node = next(node for node in model.tree.nodes if node.v.start == motor.coordinate)
            axis = tree_oracle.motion(model.tree, node.inner, found.q, frames).F[:, :, 2]
            for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
                if section.body >= 0:
                    turned = tree_oracle.motion(model.tree, section, found.q, frames).L - frames[section.body].L
                    left += np.einsum("ti,tij->tj", side * motor.sign * found.tau[:, k, None] * axis, turned[:, 3:])
    return left
