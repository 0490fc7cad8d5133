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
from .kinematics import Kinematics
from .rows import ConstraintRow
from .tree import KinematicTree


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
    return found, [replace(row, coordinate=node.v.start) for row, node in zip(rows, nodes, strict=True)]


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


class CutMotion(NamedTuple):
    """Of a coordinate along a joint at which a loop is cut."""

    coordinate: Array  # (T,), full turns counted
    rate: Array  # (T,)
    is_counted: bool  # whether the times are close enough together to count its turns


class AlongCut:
    """Coordinates γ of joints at which loops are cut, measured by the core."""

    def __init__(self, tree: KinematicTree, cut: Sequence[CutCoordinate]) -> None:
        self._n_v, self._all = tree.n_v, cut
        self._rough = [k for k, one in enumerate(cut) if one.friction is not None]
        self._kinematics = Kinematics(tree.nodes, rows=[one.row for one in cut]) if cut else None

    def measured(self, q: Array) -> tuple[Array, Array]:
        """γ (T, cut) at q (T, n_q), angles within ±π, and G (T, cut, n_v)."""
        if self._kinematics is None:
            return np.zeros((len(q), 0)), np.zeros((len(q), 0, self._n_v))
        return self._kinematics.constraints(q, np.zeros(len(q)))

    def resistance(self, q: Array, v: Array) -> Array:
        """Generalized forces (T, n_v) by which friction resists at q (T, n_q) and v (T, n_v)."""
        found = np.zeros_like(v)
        gradients = self.measured(q)[1] if self._rough else found
        for k in self._rough:
            G = gradients[:, k]
            found += self._all[k].resistance(np.einsum("tj,tj->t", G, v))[:, None] * G
        return found

    def damping(self, q: Array) -> Array:
        """D (n_v, n_v) of viscous friction at q (n_q,)."""
        found = np.zeros((self._n_v, self._n_v))
        gradients = self.measured(q[None])[1][0] if self._rough else found
        for k in self._rough:
            friction, G = self._all[k].friction, gradients[k]
            assert friction is not None
            found += friction.viscous * np.outer(G, G)
        return found

    def motions(self, q: Array, v: Array, times: Array) -> list[CutMotion]:
        """Of each at q (T, n_q), v (T, n_v) and `times` (T,); angles begin nearest to their guesses."""
        found = list[CutMotion]()
        if self._kinematics is None:
            return found
        values, rates = self.measured(q)[0], self._kinematics.constraint_rates(q, v, np.zeros(len(q)))
        for one, value, rate in zip(self._all, values.T, rates.T, strict=True):
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
