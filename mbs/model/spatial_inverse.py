"""Inverse dynamics of a tree in space: the forces that given accelerations take, M v̇ − Q, without solving for any.

Each body by its own equations of (R, θ, p) (Shabana, Dynamics of Multibody Systems, ch. 5), put together by the
Jacobians of its frame (Kane's method). SI units, global axes, states (T, …).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .spatial_accelerations import Accelerated, Acceleration
from .spatial_bending import affine_motions
from .spatial_body import SpatialBody
from .spatial_cut import cut_loads
from .spatial_model import SpatialModel
from .spatial_tree import Motion, Node


class BodyForces(NamedTuple):
    """Force (T, 3), moment about the frame's origin (T, 3) and modal forces (T, n), beside gravity and elasticity."""

    force: Array
    moment: Array
    modal: Array


class Inertia(NamedTuple):
    """Of a bent body, in its axes: s (T, 3) kg·m, J (T, 3, 3) kg·m², ∂J/∂p (T, 3, 3, n), h (T, 3, n)."""

    s: Array
    J: Array
    slope: Array
    h: Array


def body_forces(node: Node, state: Accelerated, of_frame: Acceleration, gravity: Array) -> BodyForces:
    """By which the body moves as it does under `gravity` (3,).

    m R̈ + A (ω̇ × s + ω × (ω × s) + 2 ω × S̄ṗ + S̄p̈) − m g; s × Aᵀ(R̈ − g) + J ω̇ + h p̈ + J̇ ω + ω × (J ω + h ṗ);
    p̈ + S̄ᵀAᵀ(R̈ − g) + hᵀω̇ − ½ ω_i ω_j ∂J_ij/∂p − 2 ω_a H_a ṗ + K p + D ṗ. But for m R̈, all in axes of the body.
    With geometric stiffening, less what affine fields have of this, and with what they have to second order.
    """
    body, frame = node.body, state.frames[state.tree.index[node.body.name]]
    A, omega = frame.F, state.velocity(frame)[1]
    p, p_dot, p_2dot = state.q[:, node.p_q], state.v[:, node.p_v], state.a[:, node.p_v]
    w, w_dot, pull = (np.einsum("tji,tj->ti", A, x) for x in (omega, of_frame.Omega, of_frame.r - gravity))
    s, J, slope, h = bent_inertia(node.body, p)
    Hp_dot = np.einsum("amn,tn->tam", node.body.spin_slope, p_dot)
    own = np.cross(w_dot, s) + np.cross(w, np.cross(w, s) + 2 * p_dot @ body.S_bar.T)
    force = body.mass * pull + own + p_2dot @ body.S_bar.T
    J_dot = np.einsum("tijn,tn->tij", slope, p_dot)
    turning = np.einsum("tij,tj->ti", J, w) + np.einsum("tin,tn->ti", h, p_dot)
    moment = np.cross(s, pull) + np.einsum("tij,tj->ti", J, w_dot) + np.einsum("tin,tn->ti", h, p_2dot)
    moment = moment + np.einsum("tij,tj->ti", J_dot, w) + np.cross(w, turning)
    modal = p_2dot + pull @ body.S_bar + np.einsum("tin,ti->tn", h, w_dot) + body.stiffness * p
    modal = modal + p_dot @ body.damping.T - 0.5 * np.einsum("ti,tj,tijn->tn", w, w, slope)
    modal = modal - 2 * np.einsum("ta,tan->tn", w, Hp_dot)
    if body.stiffening is not None:
        for sign, motion in zip((1.0, -1.0), affine_motions(body, p), strict=True):
            along, about, on_modes = motion.forces(motion.accelerations(pull, w_dot, w, p_dot, p_2dot))
            force, moment, modal = force + sign * along, moment + sign * about, modal + sign * on_modes
    return BodyForces(np.einsum("tij,tj->ti", A, force), np.einsum("tij,tj->ti", A, moment), modal)


def given_forces(model: SpatialModel, q: Array, frames: Sequence[Motion], times: Array) -> Array:
    """Generalized forces (T, n_v) of all given loads at q (T, n_q) and `times` (T,)."""
    tree, found = model.tree, cut_loads(model.tree, model.cut, q, frames, times)
    for direction, size in model.modal_loads:
        found += size.sample(times)[0][:, None] * direction
    for load in model.scene.load:
        values = {name: function.sample(times)[0] for name, function in load.components.items()}
        if load.point is not None:
            L = tree.motion(tree.section(load.point, np.eye(3)), q, frames).L
            none = np.zeros(len(times))
            wrench = np.stack([values.get(name, none) for name in ("x", "y", "z", "mx", "my", "mz")], axis=1)
            found += np.einsum("tij,ti->tj", L, wrench)
        elif load.joint in tree.carried:
            found += np.stack([*values.values()], axis=1) @ model.along(load.joint)
    return found


def bent_inertia(body: SpatialBody, p: Array) -> Inertia:
    """Of the body bent by p (T, n)."""
    S = body.S_bar_kl
    G = np.einsum("ij,kkmn->ijmn", np.eye(3), S) - 0.5 * (S + S.transpose(1, 0, 2, 3))
    Gp = np.einsum("ijmn,tn->tijm", G, p)
    J = body.inertia + np.einsum("ijn,tn->tij", body.inertia_slope, p) + np.einsum("tijm,tm->tij", Gp, p)
    h = body.spin + np.einsum("amn,tm->tan", body.spin_slope, p)
    return Inertia(body.first_moment + p @ body.S_bar.T, J, body.inertia_slope + 2 * Gp, h)
