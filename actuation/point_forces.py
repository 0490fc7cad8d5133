"""Generalized driving forces of bodies as forces at their actuation points (Shabana 2022, Eqs. 5–10)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..mbs.analysis.outcome import Outcome
from ..mbs.model.motors import path_forces, path_forces_on_bodies
from ..mbs.scene.space import SPACES
from .points import DEPENDENT, PointSet


@dataclass(frozen=True)
class PointForces:
    """Forces at the actuation points of one body over time.

    Attributes:
        force: (T, c) N along each component, body axes.
        unmet: (T, 6 + n) Q_a − L_a F_a on R and on the rotation, both in axes of the body, and on p: N, N·m, N/√kg; in
            the plane (T, 3 + n) on (R, θ, p), R in global axes.
        residual: (T,) its norm with the scale of the set, N.
        rank: least rank of the scaled L_a.
        condition_number: largest of the scaled L_a.
    """

    force: Array
    unmet: Array
    residual: Array
    rank: int
    condition_number: float


def solve_points(chosen: PointSet, run: Outcome) -> PointForces:
    """L_a F_a = Q_a at every output time."""
    node = run.model.tree.nodes[run.model.tree.index[chosen.body]]
    Q_a = find_driving_forces(run)[chosen.body]
    p = run.q[:, node.p_q]
    scaled = chosen.scaled(p)
    force = np.einsum("tck,tk->tc", np.linalg.pinv(scaled, rcond=DEPENDENT), chosen.scale * Q_a)
    unmet = Q_a - np.einsum("tkc,tc->tk", chosen.L_a(p), force)
    residual = np.linalg.norm(unmet * chosen.scale, axis=1)
    sizes = np.linalg.svd(scaled, compute_uv=False)
    rank = int(np.count_nonzero(sizes > DEPENDENT * sizes[:, :1], axis=1).min())
    condition = float((sizes[:, 0] / sizes[:, -1]).max())
    if (space := SPACES[run.model.scene.space]).is_plane:
        F = run.model.tree.frames(run.q)[run.model.tree.index[chosen.body]].F
        on_frame = np.einsum("tij,tj->ti", F, unmet[:, :3]), unmet[:, 3:6]
        unmet = np.column_stack([space.along(on_frame[0]), space.about(on_frame[1]), unmet[:, 6:]])
    return PointForces(force, unmet, residual, rank, condition)


def forces_at_points(chosen: Mapping[str, PointSet], run: Outcome) -> dict[str, Array]:
    """By "BODY.POINT" the force (T, 3) there, N, global axes, along the motion of a run.

    Raises `InputError` where a body without points has driving forces.
    """
    tree, found = run.model.tree, {}
    driven = find_driving_forces(run)
    largest = max(float(np.abs(Q_a).max(initial=0.0)) for Q_a in driven.values())
    for body, Q_a in driven.items():
        if body not in chosen and np.abs(Q_a).max(initial=0.0) > DEPENDENT * largest:
            raise InputError(
                f'{run.model.scene.path}: analysis "{run.analysis.name}": expected [[actuation_points]] on every body'
                f' that trajectories drive or that has a prescribed shape, found none on "{body}"'
            )
    frames = tree.frames(run.q)
    for body, points in chosen.items():
        F = frames[tree.index[body]].F
        force = solve_points(points, run).force
        for k, name in enumerate(points.names):
            found[f"{body}.{name}"] = force[:, k : k + 1] * (F @ points.direction[:, k])
    return found


def find_driving_forces(run: Outcome) -> dict[str, Array]:
    """Q_a by body, (T, 6 + n): force and moment on its frame, both in its axes, and on its modes."""
    model = run.model
    found = path_forces_on_bodies(model, run.time, run.q, run.multipliers)
    if run.forces.required is not None:  # a shape is held besides, by forces on the modes alone
        held = run.forces.required - path_forces(model, run.time, run.q, run.multipliers)
        for node in model.tree.nodes:
            found[node.body.name][:, 6:] += held[:, node.p_v]
    return found
