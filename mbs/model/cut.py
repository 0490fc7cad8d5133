"""Joints at which loops are cut: the tree has no coordinate of theirs, but what acts along it acts on its two sides.

With γ the joint's coordinate, γ̇ = G v: a force f along it is Gᵀf. Friction and loads act so. The output of a rotor is a
body of the tree without inertia beside the loop: its coordinate is γ by a constraint equation, and all that acts along
the joint acts there. States (T, …), SI units.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .._core import TimeFunction
from ..joints.joint import Friction, JointRecord
from ..scene.mechanism import MechanismScene
from .rows import ConstraintRow, value_and_gradient
from .tree import KinematicTree, Motion


class CutCoordinate(NamedTuple):
    """A coordinate of a joint at which a loop is cut."""

    joint: JointRecord  # whose it is; of the second of its sides on the first
    number: int  # of the joint's coordinates
    row: ConstraintRow  # measures `row.sign` times the coordinate
    friction: Friction | None  # along it
    loads: tuple[TimeFunction, ...]  # given forces of time along it, N·m or N
    guess: float  # of its first value, as [initial] has it, else 0

    @property
    def is_loaded(self) -> bool:
        """Whether something acts along it."""
        return self.friction is not None or bool(self.loads)

    def resistance(self, rate: Array) -> Array:
        """Friction (T,) at the coordinate's rate, N·m or N."""
        return np.zeros_like(rate) if self.friction is None else self.friction.resistance(rate)


def with_auxiliary_rotors(tree: KinematicTree) -> tuple[KinematicTree, list[ConstraintRow]]:
    """The tree with the outputs of rotors in joints at which loops are cut, and the rows by which they turn with these.

    They are on the first sides of their joints, whose coordinates theirs are.
    """
    cut = [joint for joint in tree.loops if getattr(joint, "rotor_inertia", 0.0)]
    rows = [cut_row(tree, joint) for joint in cut]
    found = tree.with_outputs([(joint, f"{joint.name}/rotor", row.a) for joint, row in zip(cut, rows, strict=True)])
    nodes = found.nodes[len(tree.nodes) :]
    return found, [
        replace(row, coordinate=node.v.start, q_index=node.q.start) for row, node in zip(rows, nodes, strict=True)
    ]


def cut_coordinates(scene: MechanismScene, tree: KinematicTree) -> Iterator[CutCoordinate]:
    """Of all joints at which loops are cut and whose coordinates the tree has not."""
    for joint in tree.cut_joints:
        frictions = joint.frictions or (None,) * len(joint.along)
        guesses = np.array(scene.initial.joints.get(joint.name, ()), dtype=float).ravel()
        for number, friction in enumerate(frictions):
            loads = tuple(load.moments[number] for load in scene.load if load.joint == joint.name)
            guess = float(guesses[number]) if guesses.size else 0.0
            yield CutCoordinate(joint, number, cut_row(tree, joint, number), friction, loads, guess)


def cut_row(tree: KinematicTree, joint: JointRecord, number: int = 0) -> ConstraintRow:
    """What measures a coordinate of a joint at which a loop is cut, `sign` times: of the second side on the first."""
    along = joint.along[number]
    sides = [tree.section(side, triad, joint.at) for side, triad in zip(joint.between, joint.triads(), strict=True)]
    if joint.name in tree.on_frames:
        sides = [section._replace(still=True) for section in sides]
    a, b = sides[::-1] if along.of_outer else sides
    f, g = np.eye(3)[[along.f, along.g]]
    sign = -1.0 if along.of_outer else 1.0  # of the first side on the second
    return ConstraintRow(joint.name, along.kind, a, b, f, g, is_trajectory=False, sign=sign)


def measured(
    tree: KinematicTree, cut: Sequence[CutCoordinate], q: Array, frames: Sequence[Motion]
) -> tuple[Array, Array]:
    """Coordinates γ (T, cut), angles within ±π, and G (T, cut, n_v)."""
    values, gradients = np.zeros((len(q), len(cut))), np.zeros((len(q), len(cut), tree.n_v))
    for k, one in enumerate(cut):
        a, b = (tree.motion(section, q, frames) for section in (one.row.a, one.row.b))
        value, gradient = value_and_gradient(one.row, a, b, q, np.zeros(len(q)))
        values[:, k], gradients[:, k] = one.row.sign * value, one.row.sign * gradient
    return values, gradients


def cut_resistance(
    tree: KinematicTree, cut: Sequence[CutCoordinate], q: Array, v: Array, frames: Sequence[Motion] | None = None
) -> Array:
    """Generalized forces (T, n_v) by which friction in cut joints resists; `frames` of q where known."""
    rough, found = [one for one in cut if one.friction is not None], np.zeros_like(v)
    if rough:
        _, gradients = measured(tree, rough, q, tree.frames(q) if frames is None else frames)
        for k, one in enumerate(rough):
            G = gradients[:, k]
            found += one.resistance(np.einsum("tj,tj->t", G, v))[:, None] * G
    return found


def cut_damping(tree: KinematicTree, cut: Sequence[CutCoordinate], q: Array) -> Array:
    """D (n_v, n_v) of viscous friction in cut joints at q (n_q,)."""
    rough, found = [one for one in cut if one.friction is not None], np.zeros((tree.n_v, tree.n_v))
    if rough:
        _, gradients = measured(tree, rough, q[None], tree.frames(q[None]))
        for one, G in zip(rough, gradients[0], strict=True):
            assert one.friction is not None
            found += one.friction.viscous * np.outer(G, G)
    return found


class CutMotion(NamedTuple):
    """Of a coordinate along a joint at which a loop is cut."""

    coordinate: Array  # (T,), full turns counted
    rate: Array  # (T,)
    is_counted: bool  # whether the times are close enough together to count its turns


def cut_motions(
    tree: KinematicTree,
    cut: Sequence[CutCoordinate],
    q: Array,
    v: Array,
    times: Array,
    frames: Sequence[Motion] | None = None,
) -> list[CutMotion]:
    """Of each of `cut` at q (T, n_q), v (T, n_v) and `times` (T,); angles begin nearest to their guesses."""
    found = []
    values, gradients = measured(tree, cut, q, tree.frames(q) if frames is None else frames)
    for one, value, G in zip(cut, values.T, gradients.swapaxes(0, 1), strict=True):
        rate = np.einsum("tj,tj->t", G, v)
        turns = one.row.kind == "turn"
        coordinate, is_counted = _unwound(value, rate, times, one.guess) if turns else (value, True)
        found.append(CutMotion(coordinate, rate, is_counted))
    return found


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
