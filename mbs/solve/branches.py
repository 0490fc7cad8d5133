"""The postures in which a robot can start: that of the scene, and others in which the links reach the same places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ..model.model import Model
from .posture import mobility
from .reach import as_guess, random_angles, regular_postures, turning_joints
from .start import undeformed_posture

TRIES = 600  # random postures from which Newton looks for others
SAME = 1e-6  # rad: angles that differ by less


class StartPosture(NamedTuple):
    """One of them: `q` (n_q,); `guess`, the line of [initial] that chooses it; `away` (rad), the largest turn to it."""

    q: Array
    guess: str
    away: float


def start_postures(model: Model) -> list[StartPosture]:
    """The start of the scene, then all others that are found, the nearest first.

    Others are looked for where constraint equations determine every joint at t = 0; their angles are within ±π.
    Raises `InputError` where the scene has no start.
    """
    start = undeformed_posture(model).q
    nodes, columns = turning_joints(model)
    found = [StartPosture(start, as_guess(nodes, start), 0.0)]
    state = mobility(model, start)
    if not columns.size or not model.rows or state.followed < state.freedom:
        return found
    others = regular_postures(model, random_angles(start, columns, TRIES))
    for q in others:
        if all(_turn(q, one.q, columns) > SAME for one in found):
            q[columns] = np.angle(np.exp(1j * q[columns]))
            found.append(StartPosture(q, as_guess(nodes, q), _turn(q, start, columns)))
    return sorted(found, key=lambda one: one.away)


def _turn(q: Array, other: Array, columns: Indices) -> float:
    """The largest difference of angles without whole turns, rad."""
    return float(np.abs(np.angle(np.exp(1j * (q[columns] - other[columns])))).max())
