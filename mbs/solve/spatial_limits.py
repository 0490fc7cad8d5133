"""Joints in space that leave the range which the scene gives them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array
from ..model.spatial_model import SpatialModel


def left_ranges(model: SpatialModel, times: Array, q: Array) -> Iterator[str]:
    """A warning for each joint of the tree whose coordinates are not within its position_limit at `times` (T,).

    `q` (T, n_q); it says when that is first so, and how far they go.
    """
    for node in model.tree.nodes:
        if not node.joint.units:
            continue
        found = node.joint.coordinates(q[:, node.q])
        values = node.joint.turned_around(found) if node.backwards else found
        for (lowest, highest), unit, of_one in zip(node.joint.position_limits, node.joint.units, values.T, strict=True):
            outside = np.flatnonzero((of_one < lowest) | (of_one > highest))
            if outside.size:
                yield (
                    f"{node.joint.label}: leaves its position_limit [{lowest:.6g}, {highest:.6g}] {unit} at t ="
                    f" {times[outside[0]]:.6g} s; it goes from {of_one.min():.6g} to {of_one.max():.6g} {unit}"
                )
