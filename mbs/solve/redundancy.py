"""Constraints that repeat or contradict each other, in every configuration or in the one at the start."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..model.system import MechanismSystem
from .position import SINGULAR, frame_gradients, rank_ratio, solve_positions
from .reach import owners

REDUNDANT = 1e-10  # ratio of singular values below which constraints repeat each other in every configuration


def check_redundancy(assembly: MechanismSystem, q: Array) -> None:
    """Raise `InputError` for constraints that depend on each other near q (coordinates,).

    Those that do in a configuration chosen at random do in all.
    """
    if not assembly.constraints:
        return
    shift = np.random.default_rng(0).uniform(-0.3, 0.3, len(q)) * assembly.scales
    for position in assembly.first:  # deformations stay small
        shift[position + 3 :] *= 1e-3
    _, _, C_q = assembly.system.constraints(0.0, q + shift, np.zeros_like(q))
    C_q *= assembly.scales
    left, values, _ = np.linalg.svd(C_q / np.linalg.norm(C_q, axis=1, keepdims=True))
    rank = int(np.count_nonzero(values > REDUNDANT * values[0]))
    if rank == len(assembly.constraints):
        return
    involved = np.abs(left[:, rank:]).max(axis=1) > 1e-6
    labels = [c.measure.label for c, is_involved in zip(assembly.constraints, involved, strict=True) if is_involved]
    raise InputError(
        f"{assembly.model.scene.path}: expected independent constraints, found {len(assembly.constraints) - rank} too"
        f" many among {'; '.join(labels)}: they repeat or contradict each other"
    )


def check_regular(assembly: MechanismSystem, q: Array) -> None:
    """Raise `InputError` where constraints that differ cannot be told apart at q (coordinates,).

    It says whether they cannot everywhere on the way (redundant in this geometry), or just there.
    """
    if rank_ratio(assembly, 0.0, q) >= SINGULAR:
        return
    path, names = assembly.model.scene.path, owners(assembly.constraints)
    loop = MechanismSystem(assembly.model, assembly.model.joints)
    J = frame_gradients(loop, 0.0, q)
    values, right = np.linalg.svd(J)[1:]
    missing = int(np.count_nonzero(values < SINGULAR * values[0]))
    free = right[len(J) - missing :].sum(axis=0) * loop.scales[loop.frame_coordinates]
    moved = q.copy()
    moved[loop.frame_coordinates] += 0.05 * free
    beside = solve_positions(loop, 0.0, moved)
    if missing and beside is not None and rank_ratio(loop, 0.0, beside) < SINGULAR:
        raise InputError(
            f"{path}: joint: expected joints that each take something away from the motion, found {missing} too many"
            f" among {owners(loop.constraints)}: in this geometry (parallel cranks?) rigid links move all the same,"
            " and the distribution of the force is undetermined. Omit a joint, or use flexible links"
        )
    raise InputError(
        f"{path}: initial: expected a configuration in which the links can follow {names} in every direction, found a"
        " singular one (an arm stretched or folded, a mechanism at a dead centre?). Bend it, or move the start of"
        " the trajectory"
    )
