"""Forces and moments on sections. Global axes, SI units, (T, …)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .tree import KinematicTree, Motion, Node


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


def _in_global_axes(F: Array, node: Node, force: Array, q: Array) -> Wrench:
    """What `force` (T, freedoms) along a joint does on its outer side; F (T, 3, 3): axes of the inner one."""
    acting = np.einsum("tij,tj->ti", node.joint.action(q[:, node.q]), force)
    return Wrench(*(np.einsum("tij,tj->ti", F, part) for part in (acting[:, :3], acting[:, 3:])))


def without_work(tree: KinematicTree, node: Node, on_outer: Wrench, q: Array, frames: Sequence[Motion]) -> Wrench:
    """What a joint does to its outer side, about where that is, less what of it does work along the joint.

    That is what drives, loads and brakes it along its coordinates: Sᵀ (force, moment) is 0 of the rest, S = `motion`.
    """
    F = tree.pose(node.inner, q, frames).F
    in_axes = np.hstack([np.einsum("tji,tj->ti", F, part) for part in on_outer])
    along = np.einsum("tik,ti->tk", node.joint.motion(q[:, node.q]), in_axes)
    return on_outer.plus(_in_global_axes(F, node, along, q), -1.0)
