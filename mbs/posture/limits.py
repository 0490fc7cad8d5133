"""Joints that leave their range in the scene.

Coordinates of the tree are watched by the core while it integrates, between outputs, too. Others are looked at in
outputs: those of joints at which loops are cut, and of planar joints that lead backwards, are no entries of the state.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..joints.joint import JointRecord
from ..model.model import Model
from ..model.nodes import Node
from ..model.tree import KinematicTree

ROUND_OFF = 1e-12  # rad or m

Seen = tuple[float, float, float | None]
"""Least and largest value, and when the range was left first, s."""


class Watched(NamedTuple):
    """A coordinate of a joint with a limit that the C++ core watches, as `sign` times a coordinate of the tree."""

    joint: JointRecord
    number: int  # of the joint's coordinates
    v: int  # number in v of the tree's coordinate
    sign: float

    @property
    def limits(self) -> tuple[float, float]:
        """Lower and upper limit of the tree's coordinate, rad or m."""
        lowest, highest = sorted(self.sign * limit for limit in self.joint.position_limits[self.number])
        return lowest, highest

    def seen(self, other: Seen) -> Seen:
        """Turn least and largest value of the tree's coordinate, rad or m, into those of the joint's."""
        least, largest = sorted(self.sign * value + 0.0 for value in other[:2])
        return least, largest, other[2]


def watched(tree: KinematicTree) -> list[Watched]:
    """Coordinates with limits that the core watches."""
    ways = []
    for node in tree.nodes:
        if _is_limited(node.joint) and not _is_sampled(node):
            # Which of q with which sign, read off numbers that all differ
            for number, entry in enumerate(node.coordinates(np.arange(1.0, tree.n_q + 1))):
                if np.isfinite(node.joint.position_limits[number]).any():
                    at = abs(int(entry)) - 1 - node.q.start + node.v.start
                    ways.append(Watched(node.joint, number, at, float(np.sign(entry))))
    return ways


def watch_limits(scene: _core.TreeScene, tree: KinematicTree) -> None:
    """Have the core watch coordinates with limits (`watched`) while it integrates `scene`."""
    for one in watched(tree):
        lowest, highest = one.limits
        scene.add_limit(one.v, lowest - ROUND_OFF, highest + ROUND_OFF)


def left_ranges(model: Model, ranges: Sequence[Seen] | None, times: Array, q: Array, v: Array) -> Iterator[str]:
    """Yield a warning for each coordinate outside its position_limit: the first time, and its range.

    `ranges`: what the core found of each of `watched`; None where it did not integrate the motion. Coordinates
    without these are looked at in outputs at `times` (T,), s: `q` (T, n_q), `v` (T, n_v), rad, m and s.
    """
    of_core = zip(watched(model.tree), ranges, strict=True) if ranges is not None else ()
    seen = [(one.joint, one.number, one.seen(values)) for one, values in of_core]
    for joint, number, values in limited_coordinates(model, times, q, v, every=ranges is None):
        lowest, highest = joint.position_limits[number]
        outside = times[(values < lowest - ROUND_OFF) | (values > highest + ROUND_OFF)]
        seen.append((joint, number, (values.min(), values.max(), outside[0] if outside.size else None)))
    for joint, number, (least, largest, left_at) in seen:
        (lowest, highest), unit = joint.position_limits[number], joint.units[number]
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


def limited_coordinates(
    model: Model, times: Array, q: Array, v: Array, *, every: bool
) -> Iterator[tuple[JointRecord, int, Array]]:
    """Yield joint, number and values (T,), rad or m, of coordinates of limited joints that the core does not watch.

    Motion q (T, n_q), v (T, n_v), SI units, at `times` (T,), s. With `every`, also those that the core watches.
    """
    for node in model.tree.nodes:
        if _is_limited(node.joint) and (every or _is_sampled(node)):
            yield from ((node.joint, number, values) for number, values in enumerate(node.coordinates(q).T))
    if any(map(_is_limited, model.tree.cut_joints)):
        for one, motion in zip(model.cut, model.along_cut.motions(q, v, times), strict=True):
            yield one.joint, one.number, motion.coordinate
