"""Forces in the joints of a tree in 3D: what the core's Newton–Euler algorithm sums from the outermost body inwards."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ..model.spatial_known_motion import MotionForces, multiplier_forces
from ..model.spatial_tree import Node
from ..model.spatial_wrench import Wrench, along_joint
from .spatial_motion import SpatialMotion


def reactions(motion: SpatialMotion) -> Mapping[str, Wrench]:
    """By joint: force on its second side, and moment about where that side is, N and N·m.

    A joint of the tree carries what its body and all that hangs on it need, less what else acts there and what drives
    the joint; one that closes a loop has its multipliers, and friction and loads along it.
    """
    forces, tree = motion.behind_gears.forces, motion.model.tree
    found = _carried(motion, forces)
    for one, on_a, on_b in forces.along_cut():
        joint = one.joint.name
        found[joint] = found[joint].plus(on_b if one.row.sign > 0 else on_a)
    for joint, along in _driving(motion).items():
        node = tree.nodes[tree.carried[joint]]
        drive = along_joint(tree, node, along, motion.q, motion.frames)
        found[joint] = found[joint].plus(_on_second(motion, node, drive), -1.0)
    return found


def reactions_of_loops(motion: SpatialMotion, forces: Array) -> Mapping[str, Wrench]:
    """What forces (T, rows that close loops) along these rows are in `reactions`."""
    multipliers = np.zeros_like(motion.multipliers)
    multipliers[:, motion.model.loop_rows] = -forces
    return _carried(motion, multiplier_forces(motion.system, motion.q, motion.time, multipliers))


def _carried(motion: SpatialMotion, forces: MotionForces) -> dict[str, Wrench]:
    """By joint what it carries, with what drives it."""
    found, model = dict[str, Wrench](), motion.model
    for number, row in enumerate(model.rows):
        if not row.is_trajectory:
            on_b = forces.of_row(number)[1]
            found[row.owner] = found[row.owner].plus(on_b) if row.owner in found else on_b
    for number, node in enumerate(model.tree.nodes):
        found[node.joint.name] = _on_second(motion, node, forces.of_joint(number))
    return found


def _on_second(motion: SpatialMotion, node: Node, on_outer: Wrench) -> Wrench:
    """Of what acts on the outer side of the joint that carries a body: the same, or what answers it, on the second."""
    if not node.backwards:
        return on_outer
    outer, inner = (
        motion.model.tree.motion(section, motion.q, motion.frames).r for section in (node.outer, node.inner)
    )
    return Wrench(-on_outer.force, -on_outer.moment).seen_from(outer - inner)


def _driving(motion: SpatialMotion) -> dict[str, Array]:
    """By joint what drives it (T, freedoms), along v of the tree: forces of paths, or motors where these act.

    Behind a gear that gives it is the moment of the motor.
    """
    model, found = motion.model, dict[str, Array]()
    is_held = any(row.is_trajectory for row in model.rows)
    moments = {} if is_held else dict(motion.driving or motion.motor_moments)
    for row, size in zip(model.rows, -motion.multipliers.T, strict=True):
        if row.kind == "coordinate":
            joint = model.joint_of(row)
            along = size + motion.felt(row)
            moments[joint] = (motion.gears[joint].moment if joint in motion.gears else along)[:, None]
    for joint, moment in moments.items():
        node = model.tree.nodes[model.tree.carried[joint]]
        along = np.zeros((len(motion.time), node.v.stop - node.v.start))
        along[:, model.columns(joint) - node.v.start] = -moment if node.backwards else moment
        found[joint] = along
    return found
