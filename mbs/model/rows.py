"""Rows of constraints between sections of a tree: what they are to measure, which the core does."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .._core import TimeFunction
from ..fields.orientations import OrientationLaw
from .nodes import Node, Section

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
    # in v; of "turn" and "slide" rows it is taken off, where there is one
    coordinate: int = -1
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
        owner, "coordinate", node.inner, node.outer, none, none, coordinate=k, sign=sign, target=target
    )


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
