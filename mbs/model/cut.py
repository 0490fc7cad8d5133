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
    row: ConstraintRow  # measures `row.sign` times the coordinate
    friction: Friction | None  # along it
    loads: tuple[TimeFunction, ...]  # given forces of time along it, N·m or N

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
        for number, friction in enumerate(frictions):
            loads = tuple(load.moments[number] for load in scene.load if load.joint == joint.name)
            yield CutCoordinate(joint, cut_row(tree, joint, number), friction, loads)


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
