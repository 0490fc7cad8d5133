"""How joints at which loops are cut move: read off the motion of their two sides."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .cut import measured
from .model import Model
from .tree import Motion


class CutMotion(NamedTuple):
    """Of a coordinate along a joint at which a loop is cut."""

    coordinate: Array  # (T,), full turns counted
    rate: Array  # (T,)
    is_counted: bool  # whether the times are close enough together to count its turns


def cut_motions(
    model: Model, q: Array, v: Array, times: Array, frames: Sequence[Motion] | None = None
) -> list[CutMotion]:
    """Of each of `model.cut` at q (T, n_q), v (T, n_v) and `times` (T,); angles begin nearest to their guesses."""
    tree, found = model.tree, []
    values, gradients = measured(tree, model.cut, q, tree.frames(q) if frames is None else frames)
    for one, value, G, guess in zip(model.cut, values.T, gradients.swapaxes(0, 1), _guesses(model), strict=True):
        rate = np.einsum("tj,tj->t", G, v)
        coordinate, is_counted = _unwound(value, rate, times, guess) if one.row.kind == "turn" else (value, True)
        found.append(CutMotion(coordinate, rate, is_counted))
    return found


def _guesses(model: Model) -> Iterator[float]:
    """The coordinates as [initial] has them, else 0; a spherical joint has none, whose guess is a rotation vector."""
    given = model.scene.initial.joints
    for joint in model.tree.cut_joints:
        if joint.along:
            of_joint = np.atleast_1d(np.array(given.get(joint.name, np.zeros(len(joint.along))), dtype=float))
            yield from (float(value) for value in of_joint)


def _unwound(angle: Array, rate: Array, times: Array, guess: float) -> tuple[Array, bool]:
    """The angle (T,) with full turns: each the nearest to where the rates lead from the one before.

    Rates lead there by cubics with the slopes of their differences. Turns are counted where these are near the
    trapezoidal rule and the angle found.
    """
    if len(times) < 2:
        return angle + 2 * np.pi * np.round((guess - angle) / (2 * np.pi)), True
    h, slope = np.diff(times), np.gradient(rate, times, edge_order=2 if len(times) > 2 else 1)
    rough = h * (rate[1:] + rate[:-1]) / 2
    way = rough - h**2 * np.diff(slope) / 12
    turns = np.round((np.append(guess, way) - np.append(angle[0], np.diff(angle))) / (2 * np.pi))
    found: Array = angle + 2 * np.pi * np.cumsum(turns)
    off = np.abs(way - np.array([rough, np.diff(found)])).max()
    return found, bool(off < np.pi / 2)
