"""The postures in which a robot can start: that of the scene, and others in which the links reach the same places."""

from __future__ import annotations

import tomllib
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ..model.model import Model
from ..scene.mechanism import Word
from .branch_names import branch_names, is_so
from .posture import mobility
from .reach import as_guess, random_angles, regular_postures, turning_joints
from .start import undeformed_posture

TRIES = 600  # random postures from which Newton looks for others
SAME = 1e-6  # rad: angles that differ by less


class StartPosture(NamedTuple):
    """One of them.

    `q` (n_q,); `guess`, the line of [initial] that chooses it; `away` (rad), the largest turn to it; `branch`, how
    its joints stand, by name (see `branch_names`).
    """

    q: Array
    guess: str
    away: float
    branch: dict[str, Word]

    @property
    def guesses(self) -> dict[str, tuple[float, ...]]:
        """The coordinates of that line by joint, rad."""
        joints = tomllib.loads(self.guess)["joints"]
        read = {name: value if isinstance(value, list) else [value] for name, value in joints.items()}
        return {name: tuple(map(_number, values)) for name, values in read.items()}


def start_postures(model: Model) -> list[StartPosture]:
    """The start of the scene, then all others that are found, the nearest first.

    Others are looked for where constraint equations determine every joint at t = 0; their angles are within ±π.
    Raises `InputError` where the scene has no start.
    """
    start = undeformed_posture(model).q
    nodes, columns = turning_joints(model)
    found = [StartPosture(start, as_guess(nodes, start), 0.0, branch_names(model, start))]
    state = mobility(model, start)
    if not columns.size or not model.rows or state.followed < state.freedom:
        return found
    others = regular_postures(model, random_angles(start, columns, TRIES))
    for q in others:
        if all(_turn(q, one.q, columns) > SAME for one in found):
            q[columns] = np.angle(np.exp(1j * q[columns]))
            found.append(StartPosture(q, as_guess(nodes, q), _turn(q, start, columns), branch_names(model, q)))
    return sorted(found, key=lambda one: one.away)


def chosen_start(model: Model) -> StartPosture | None:
    """The start that `initial.branch` names, the nearest to the guess of those that do; None where it names none.

    Raises `InputError` where no start is so.
    """
    wanted = model.scene.initial.branch
    if not wanted:
        return None
    found = start_postures(model)
    for one in found:
        if all(_is_so(model, one.q, joint, word) for joint, word in wanted.items()):
            return one
    asked = ", ".join(f'{joint} = "{word}"' for joint, word in wanted.items())
    raise InputError(
        f"{model.scene.path}: initial.branch: expected one of the {len(found)} postures that were found, found {asked},"
        " which none of them is: see ffrobot pose without this key"
    )


def _is_so(model: Model, q: Array, joint: str, word: Word) -> bool:
    """Whether the `joint` is "up", …, in the posture q (n_q,)."""
    if joint not in model.tree.carried:
        raise InputError(
            f'{model.scene.path}: initial.branch: expected joints of the tree, found "{joint}", which is cut'
        )
    return is_so(model, q, model.tree.nodes[model.tree.carried[joint]], word)


def _number(text: str | float) -> float:
    return float(np.radians(float(text.removesuffix("*deg")))) if isinstance(text, str) else text


def _turn(q: Array, other: Array, columns: Indices) -> float:
    """The largest difference of angles without whole turns, rad."""
    return float(np.abs(np.angle(np.exp(1j * (q[columns] - other[columns])))).max())
