"""Rows of constraints between sections of a tree: what they measure, and how it changes with velocities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ...common.arrays import Array, Booleans
from ...common.rotations import logarithm
from ...common.structs import struct
from .._core import TimeFunction
from ..fields.orientations import OrientationLaw
from .tree import Motion, Node, Section

ConstraintKind = Literal["point", "slide", "dot", "rotation", "turn", "coordinate"]


@struct
class ConstraintRow:
    """One constraint: a measure of section b on section a that follows `target`, or is 0."""

    owner: str  # the joint or trajectory
    # "point", f·(r_b − r_a) with f in global axes; "slide", the same with f in axes of a; "dot", f·g with f in axes of
    # a and g in axes of b; "rotation", the turn of b against a about f, global axes; "turn", the angle of g of b about
    # f of a, unit vectors across each other in axes of both; "coordinate", the joint coordinate v[coordinate], `sign`
    # times
    kind: ConstraintKind
    a: Section
    b: Section
    f: Array
    g: Array
    is_trajectory: bool = True
    # coordinate, q_index: in v and q; of "turn" and "slide" rows it is taken off, where there is one
    coordinate: int = -1
    q_index: int = -1
    sign: float = 1.0
    target: TimeFunction | None = None  # of points, angles and coordinates
    # an orientation in time: of "rotation" rows that of a, whose triad is then A(t); of "dot" rows that of b
    law: OrientationLaw | None = None


def coordinate_row(
    owner: str, node: Node, target: TimeFunction | None = None, column: int | None = None, sign: float = 1.0
) -> ConstraintRow:
    """By which v[`column`] of the joint of a node, by default the first of its own, follows `target`, `sign` times."""
    k, none = node.v.start if column is None else column, np.zeros(3)
    return ConstraintRow(
        owner, "coordinate", node.inner, node.outer, none, none, coordinate=k, q_index=node.q.start + k - node.v.start,
        sign=sign, target=target,
    )  # fmt: skip


def rows_of_joint(
    owner: str, node: Node, columns: Array, targets: Sequence[TimeFunction | None], sign: float = 1.0
) -> list[ConstraintRow]:
    """By which v[`columns`] of the joint of a node follow `targets`, `sign` times.

    Of planar joints between its sections, `sign` 1: the core prescribes no coordinates whose axes turn.
    """
    if node.joint.type != "planar":
        at = zip(columns.tolist(), targets, strict=True)
        return [coordinate_row(owner, node, target, k, sign) for k, target in at]
    x, y, z = np.eye(3)
    measures: tuple[tuple[ConstraintKind, Array, Array], ...] = (("slide", x, x), ("slide", y, y), ("turn", z, x))
    return [
        ConstraintRow(owner, kind, node.inner, node.outer, f, g, target=target)
        for (kind, f, g), target in zip(measures, targets, strict=True)
    ]


def value_and_gradient(row: ConstraintRow, a: Motion, b: Motion, q: Array, times: Array) -> tuple[Array, Array]:
    """C (T,) at q (T, n_q) and `times` (T,), and its derivative C_v (T, n_v), from the motions of its sections."""
    value, gradient = _measured(row, a, b, q, times)
    if row.target is not None:
        value = value - row.target.sample(times)[0]
    if row.kind in ("turn", "slide") and row.coordinate >= 0:
        value = value - q[:, row.q_index]
        gradient[:, row.coordinate] -= 1.0
    return value - 2 * np.pi * np.round(value / (2 * np.pi)) if row.kind == "turn" else value, gradient


def _measured(row: ConstraintRow, a: Motion, b: Motion, q: Array, times: Array) -> tuple[Array, Array]:
    """Without its target, and the coordinate that is taken off."""
    if row.kind == "coordinate":
        gradient = np.zeros((len(q), a.L.shape[-1]))
        gradient[:, row.coordinate] = row.sign
        return row.sign * q[:, row.q_index], gradient
    turning = b.L[:, 3:] - a.L[:, 3:]
    if row.kind == "rotation":
        assert row.law is not None
        residual = logarithm(b.F @ np.swapaxes(row.law.sample(times), -1, -2))
        return residual @ row.f, np.einsum("i,tij->tj", row.f, b.L[:, 3:])
    if row.kind == "turn":
        return turned_by(row, a, b), np.einsum("ti,tij->tj", turning_axis(row, a, b), turning)
    if row.kind == "dot":
        f = np.einsum("tij,j->ti", a.F, row.f)
        g = b.F @ row.g if row.law is None else row.law.sample(times)[:, :, 2]
        return np.sum(f * g, axis=-1), -np.einsum("ti,tij->tj", np.cross(f, g), turning)
    f = np.einsum("tij,j->ti", a.F, row.f) if row.kind == "slide" else np.broadcast_to(row.f, a.r.shape)
    d = b.r - a.r
    gradient = np.einsum("ti,tij->tj", f, b.L[:, :3] - a.L[:, :3])
    if row.kind == "slide":
        gradient = gradient + np.einsum("ti,tij->tj", np.cross(f, d), a.L[:, 3:])
    return np.sum(f * d, axis=-1), gradient


def is_turned_over(rows: Sequence[ConstraintRow], a: Motion, b: Motion, times: Array) -> Booleans:
    """Whether z of b points against z of a (T,), or x against x, at `times` (T,) at which "dot" rows of both are 0.

    `rows`: x and y of a with z of b and, of joints that do not turn, x of a with y of b.
    """
    first, second, *still = rows
    z = b.F @ first.g if first.law is None else first.law.sample(times)[:, :, 2]
    found: Booleans = np.sum(a.F @ np.cross(first.f, second.f) * z, axis=-1) < 0.0
    for row in still:
        found |= np.sum(a.F @ row.f * (b.F @ np.cross(row.g, first.g)), axis=-1) < 0.0
    return found


def turned_by(row: ConstraintRow, a: Motion, b: Motion) -> Array:
    """The angle (T,) of a "turn" row, within ±π: that of b's g about a's f, from a's g on."""
    axis, zero, turned = a.F @ row.f, a.F @ row.g, b.F @ row.g
    return np.arctan2(np.sum(np.cross(axis, zero) * turned, axis=-1), np.sum(zero * turned, axis=-1))


def turning_axis(row: ConstraintRow, a: Motion, b: Motion) -> Array:
    """Its rate (T, 3) by the angular velocity of b against a; core/recursion/constrained_aba/constraints.h."""
    axis, turned = a.F @ row.f, b.F @ row.g
    along = np.sum(axis * turned, axis=-1, keepdims=True)
    return axis - along / (1.0 - along**2) * (turned - along * axis)
