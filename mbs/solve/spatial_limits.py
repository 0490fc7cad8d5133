"""Joints in space that leave the range which the scene gives them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from ..joints.spatial.joint import SpatialJoint
from ..model.spatial_cut_motion import cut_motions
from ..model.spatial_model import SpatialModel


def left_ranges(model: SpatialModel, times: Array, q: Array, v: Array) -> Iterator[str]:
    """A warning for each joint whose coordinates are not within its position_limit at `times` (T,).

    `q` (T, n_q), `v` (T, n_v); it says when that is first so, and how far they go.
    """
    for joint, values in (*_in_tree(model, q), *_at_cuts(model, times, q, v)):
        for (lowest, highest), unit, of_one in zip(joint.position_limits, joint.units, values, strict=True):
            outside = np.flatnonzero((of_one < lowest) | (of_one > highest))
            if outside.size:
                yield (
                    f"{joint.label}: leaves its position_limit [{lowest:.6g}, {highest:.6g}] {unit} at t ="
                    f" {times[outside[0]]:.6g} s; it goes from {of_one.min():.6g} to {of_one.max():.6g} {unit}"
                )


def _in_tree(model: SpatialModel, q: Array) -> Iterator[tuple[SpatialJoint, Array]]:
    """Joints of the tree with their coordinates (k, T)."""
    for node in model.tree.nodes:
        if node.joint.units:
            found = node.joint.coordinates(q[:, node.q])
            yield node.joint, (node.joint.turned_around(found) if node.backwards else found).T


def _at_cuts(model: SpatialModel, times: Array, q: Array, v: Array) -> Iterator[tuple[SpatialJoint, Array]]:
    """Joints at which loops are cut, where they have limits."""
    limited = {joint.name: joint for joint in model.tree.loops if np.isfinite(joint.position_limits).any()}
    if limited:
        motions = cut_motions(model, q, v, times)
        for name, joint in limited.items():
            own = (motion for one, motion in zip(model.cut, motions, strict=True) if one.joint.name == name)
            yield joint, np.array([motion.coordinate for motion in own])
