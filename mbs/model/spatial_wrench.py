"""Forces and moments on sections in space, and those of the rows of constraints. Global axes, SI units, (T, …)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .spatial_rows import SpatialRow
from .spatial_tree import Motion, Node, SpatialTree


class Wrench(NamedTuple):
    """Force and moment (T, 3), global axes."""

    force: Array
    moment: Array

    def seen_from(self, arm: Array) -> Wrench:
        """The same acting at `arm` (T, 3) from where moments are about: force, and moment about there."""
        return Wrench(self.force, self.moment + np.cross(arm, self.force))

    def plus(self, other: Wrench, sign: float = 1.0) -> Wrench:
        """The sum, or with sign −1 the difference."""
        return Wrench(self.force + sign * other.force, self.moment + sign * other.moment)


def along_joint(tree: SpatialTree, node: Node, force: Array, q: Array, frames: Sequence[Motion]) -> Wrench:
    """What `force` (T, freedoms) along the joint that carries a body does on its outer side, about where that is.

    The opposite acts on its inner side.
    """
    F = tree.motion(node.inner, q, frames).F
    acting = np.einsum("tij,tj->ti", node.joint.action(q[:, node.q]), force)
    return Wrench(*(np.einsum("tij,tj->ti", F, part) for part in (acting[:, :3], acting[:, 3:])))


def row_wrenches(
    tree: SpatialTree, row: SpatialRow, size: Array, q: Array, times: Array, frames: Sequence[Motion]
) -> tuple[Wrench, Wrench]:
    """What a row does on sections a and b with a force `size` (T,) along it, moments about the global origin.

    At q (T, n_q) and `times` (T,), with the `frames` there.
    """
    zero = np.zeros((len(times), 3))
    a, b = (tree.motion(section, q, frames) for section in (row.a, row.b))
    if row.kind == "coordinate":
        on_b = along_joint(tree, tree.nodes[row.b.body], row.sign * size[:, None], q, frames).seen_from(b.r)
    elif row.kind in ("point", "slide"):
        f = np.einsum("tij,j->ti", a.F, row.f) if row.kind == "slide" else np.broadcast_to(row.f, a.r.shape)
        on_b = Wrench(size[:, None] * f, zero).seen_from(b.r)
    elif row.kind == "turn":
        on_b = Wrench(zero, size[:, None] * np.einsum("tij,j->ti", a.F, row.f))
    elif row.kind == "rotation":
        on_b = Wrench(zero, size[:, None] * row.f)
    else:
        f = np.einsum("tij,j->ti", a.F, row.f)
        g = b.F @ row.g if row.law is None else row.law.sample(times)[:, :, 2]
        on_b = Wrench(zero, -size[:, None] * np.cross(f, g))
    return Wrench(-on_b.force, -on_b.moment), on_b
