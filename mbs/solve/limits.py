"""Joints that leave the range which the scene gives them.

Those of the tree are watched by the core while it integrates, between outputs, too. Others are looked at in outputs:
joints at which loops are cut have no coordinate in the tree, and those of planar joints that lead backwards are no
entries of the state.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..joints.joint import JointRecord
from ..model.cut_motion import cut_motions
from ..model.model import Model
from ..model.tree import KinematicTree, Node

Seen = tuple[float, float, float | None]
"""Least and largest value, and when the range was left first, s."""


class Watched(NamedTuple):
    """A coordinate with a limit that the core watches: `sign` times that with this index in the tree's v."""

    joint: JointRecord
    number: int  # of the joint's coordinates
    v: int
    sign: float

    @property
    def limits(self) -> tuple[float, float]:
        """In the core: of the tree's coordinate."""
        lowest, highest = self.joint.position_limits[self.number]
        return (lowest, highest) if self.sign > 0 else (-highest, -lowest)

    def seen(self, found: Seen) -> Seen:
        """Of the joint's coordinate, from what the core has found."""
        least, largest, left_at = found
        return (least, largest, left_at) if self.sign > 0 else (0.0 - largest, 0.0 - least, left_at)


def watched(tree: KinematicTree) -> list[Watched]:
    """Coordinates that the core watches: none where joints have no limits."""
    found = []
    for node in tree.nodes:
        if _is_limited(node.joint) and not _is_sampled(node):
            # Which of q with which sign, read off numbers that all differ
            numbers = node.joint.coordinates(np.arange(1.0, node.joint.q_count + 1))
            numbers = node.joint.turned_around(numbers) if node.backwards else numbers
            for number, entry in enumerate(numbers):
                if np.isfinite(node.joint.position_limits[number]).any():
                    at = node.v.start + abs(int(entry)) - 1
                    found.append(Watched(node.joint, number, at, float(np.sign(entry))))
    return found


def watch_limits(scene: _core.TreeScene, tree: KinematicTree) -> None:
    """Have the core watch them."""
    for one in watched(tree):
        scene.add_limit(one.v, *one.limits)


def left_ranges(model: Model, found: Sequence[Seen], times: Array, q: Array, v: Array) -> Iterator[str]:
    """A warning for each coordinate that left its position_limit: when it first did, and how far it goes.

    `found` is what the core has seen of `watched`; the others are looked at in outputs at `times` (T,): `q` (T, n_q),
    `v` (T, n_v).
    """
    for one, seen in zip(watched(model.tree), found, strict=True):
        yield from _messages(one.joint, one.number, one.seen(seen))
    for joint, values in (*_sampled_in_tree(model, q), *_at_cuts(model, times, q, v)):
        for number, of_one in enumerate(values):
            lowest, highest = joint.position_limits[number]
            outside = np.flatnonzero((of_one < lowest) | (of_one > highest))
            left_at = float(times[outside[0]]) if outside.size else None
            yield from _messages(joint, number, (float(of_one.min()), float(of_one.max()), left_at))


def _messages(joint: JointRecord, number: int, seen: Seen) -> Iterator[str]:
    (lowest, highest), unit, (least, largest, left_at) = joint.position_limits[number], joint.units[number], seen
    if left_at is not None:
        yield (
            f"{joint.label}: leaves its position_limit [{lowest:.6g}, {highest:.6g}] {unit} at t ="
            f" {left_at:.6g} s; it goes from {least:.6g} to {largest:.6g} {unit}"
        )


def _is_limited(joint: JointRecord) -> bool:
    return bool(np.isfinite(joint.position_limits).any())


def _is_sampled(node: Node) -> bool:
    """Whether the joint's coordinates are no entries of q: the ways of planar ones turn with the body."""
    return node.backwards and node.joint.type == "planar"


def _sampled_in_tree(model: Model, q: Array) -> Iterator[tuple[JointRecord, Array]]:
    """Joints of the tree that the core does not watch, with their coordinates (k, T)."""
    for node in model.tree.nodes:
        if _is_limited(node.joint) and _is_sampled(node):
            yield node.joint, node.coordinates(q).T


def _at_cuts(model: Model, times: Array, q: Array, v: Array) -> Iterator[tuple[JointRecord, Array]]:
    """Joints at which loops are cut, where they have limits."""
    limited = {joint.name: joint for joint in model.tree.cut_joints if _is_limited(joint)}
    if limited:
        motions = cut_motions(model, q, v, times)
        for name, joint in limited.items():
            own = (motion for one, motion in zip(model.cut, motions, strict=True) if one.joint.name == name)
            yield joint, np.array([motion.coordinate for motion in own])
