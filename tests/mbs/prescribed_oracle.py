"""Motions under rows in NumPy, an oracle of the core: what is left of forces and rows, and prescribed motion.

Pseudoinverses of Jacobians, bodies by Kane's equations.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import tree_oracle
from body_equations import absolute_accelerations, absolute_states, accelerated, mechanism_of, required_forces, triad
from row_wrenches import spin_of_modes
from tree_oracle import row_values
from triad_measures import Along, Dot, Way

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
    mechanism = mechanism_of(state.tree, np.zeros(3))
    accelerations, found = absolute_accelerations(mechanism, state), np.zeros((len(times), len(model.rows)))
    for r, row in enumerate(model.rows):
        if row.kind == "coordinate":
            found[:, r] = row.sign * state.a[:, row.coordinate]
        measures = [] if row.kind == "coordinate" else measures_of(state.tree, row)
        for k, at in enumerate(absolute_states(mechanism, state) if measures else ()):
            rows = [mechanism.row(one, at.q, at.v) for one in measures]
            second = [of.gradient @ accelerations[k] + of.bias for of in rows]
            found[k, r] = second[0] if len(rows) == 1 else angle_acceleration(*rows, *second)
        if measures and row.coordinate >= 0:  # of a rotor beside the joint that closes a loop
            found[:, r] -= state.a[:, row.coordinate]
        if row.target is not None:
            found[:, r] -= row.target.sample(times)[2]
    return found


def measures_of(tree, row):
    """Rows between triads whose axes are directions of the row: its value, or cosine and sine of an angle."""

    def along(section, direction):
        at = triad(tree, section)
        return replace(at, triad=np.outer(at.triad @ direction, [1.0, 0.0, 0.0]))

    if row.kind == "point":
        return [Along(triad(tree, row.a), triad(tree, row.b), row.f)]
    if row.kind == "slide":
        return [Way(along(row.a, row.f), triad(tree, row.b), 0)]
    if row.kind == "dot":
        return [Dot(along(row.a, row.f), along(row.b, row.g), 0, 0)]
    return [Dot(along(row.a, x), along(row.b, row.g), 0, 0) for x in (row.g, np.cross(row.f, row.g))]


def angle_acceleration(cosine, sine, of_cosine, of_sine):
    """d²/dt² of atan2(s, c), by their second derivatives."""
    c, c_dot, s, s_dot = cosine.value, cosine.rate, sine.value, sine.rate
    found = (c * of_sine - s * of_cosine) / (c**2 + s**2)
    return found - 2 * (c * c_dot + s * s_dot) * (c * s_dot - s * c_dot) / (c**2 + s**2) ** 2


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
                    turn = side * motor.sign * found.tau[:, k, None] * axis
                    of_modes = spin_of_modes(model, found.q, frames, section)
                    left[:, model.tree.nodes[section.body].p_v] += np.einsum("ti,tij->tj", turn, of_modes)
    return left
