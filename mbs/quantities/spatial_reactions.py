"""Forces in the joints of a tree in space: what each body needs for its motion, summed from the outermost inwards."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .._core import TimeFunction
from ..model.spatial_inverse import body_forces
from ..model.spatial_model import SpatialRow
from ..model.spatial_transmission import rotors
from .spatial_motion import SpatialMotion


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


def reactions(motion: SpatialMotion) -> Mapping[str, Wrench]:
    """By joint: force on its second side, and moment about where that side is, N and N·m.

    A joint of the tree carries what its body and all that hangs on it need, less what else acts there; one that closes
    a loop has its multipliers.
    """
    tree, state, gravity, totals = motion.model.tree, motion.accelerated, np.array(motion.model.scene.gravity), []
    for node, of_frame, frame in zip(tree.nodes, state.of_frames(), motion.frames, strict=True):
        needed = body_forces(node, state, of_frame, gravity)
        totals.append(Wrench(needed.force, needed.moment).seen_from(frame.r))
    loops: dict[str, Wrench] = {}
    for k, row in enumerate(motion.model.rows):
        on_a, on_b = _of_row(motion, row, -motion.multipliers[:, k])
        for section, acting in ((row.a, on_a), (row.b, on_b)):
            if section.body >= 0:
                totals[section.body] = totals[section.body].plus(acting, -1.0)
        if not row.is_trajectory:
            at_joint = on_b.seen_from(-tree.motion(row.b, motion.q, motion.frames).r)
            loops[row.owner] = loops[row.owner].plus(at_joint) if row.owner in loops else at_joint
    for load in motion.model.scene.load:
        if load.point is not None:
            number = tree.index[load.point.partition(".")[0]]
            totals[number] = totals[number].plus(_of_load(motion, load.point, load.components), -1.0)
    for rotor in rotors(state):  # the body that carries it turns its angular momentum
        if rotor.first.body >= 0:
            moment = rotor.torque[:, None] * rotor.axis + rotor.gyroscopic
            totals[rotor.first.body] = totals[rotor.first.body].plus(Wrench(np.zeros_like(moment), moment))
    found = dict(loops)
    for number in reversed(range(len(tree.nodes))):
        node = tree.nodes[number]
        if node.inner.body >= 0:
            totals[node.inner.body] = totals[node.inner.body].plus(totals[number])
        at = tree.motion(node.inner if node.backwards else node.outer, motion.q, motion.frames).r
        sign = -1.0 if node.backwards else 1.0
        acting = Wrench(sign * totals[number].force, sign * totals[number].moment)
        found[node.joint.name] = acting.seen_from(-at)
    return found


def _of_row(motion: SpatialMotion, row: SpatialRow, size: Array) -> tuple[Wrench, Wrench]:
    """What a row does on sections a and b with a force `size` (T,) along it, moments about the global origin."""
    tree, zero = motion.model.tree, np.zeros((len(motion.time), 3))
    a, b = (tree.motion(section, motion.q, motion.frames) for section in (row.a, row.b))
    if row.kind == "coordinate":  # a moment or force between the two sides, along the joint's own axis
        S = tree.nodes[row.b.body].joint.motion(motion.q[:, tree.nodes[row.b.body].q])[:, :, 0]
        force, moment = (row.sign * size[:, None] * np.einsum("tij,tj->ti", a.F, x) for x in (S[:, :3], S[:, 3:]))
        on_b = Wrench(force, moment).seen_from(b.r)
    elif row.kind in ("point", "slide"):
        f = np.einsum("tij,j->ti", a.F, row.f) if row.kind == "slide" else np.broadcast_to(row.f, a.r.shape)
        on_b = Wrench(size[:, None] * f, zero).seen_from(b.r)
    elif row.kind == "rotation":
        on_b = Wrench(zero, size[:, None] * row.f)
    else:
        f = np.einsum("tij,j->ti", a.F, row.f)
        g = b.F @ row.g if row.law is None else row.law.sample(motion.time)[:, :, 2]
        on_b = Wrench(zero, -size[:, None] * np.cross(f, g))
    return Wrench(-on_b.force, -on_b.moment), on_b


def _of_load(motion: SpatialMotion, point: str, components: Mapping[str, TimeFunction]) -> Wrench:
    """A given load at a point, moments about the global origin."""
    values = {name: function.sample(motion.time)[0] for name, function in components.items()}
    none = np.zeros(len(motion.time))
    force, moment = (np.stack([values.get(key, none) for key in keys], axis=1) for keys in ("xyz", ("mx", "my", "mz")))
    return Wrench(force, moment).seen_from(motion.section(point).r)
