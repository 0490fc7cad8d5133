"""Forces in the joints of a tree in space: what each body needs for its motion, summed from the outermost inwards."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from .._core import TimeFunction
from ..model.spatial_inverse import body_forces
from ..model.spatial_rows import SpatialRow
from ..model.spatial_transmission import rotors
from ..model.spatial_wrench import Wrench, along_joint, row_wrenches
from .spatial_motion import SpatialMotion


def reactions(motion: SpatialMotion) -> Mapping[str, Wrench]:
    """By joint: force on its second side, and moment about where that side is, N and N·m.

    A joint of the tree carries what its body and all that hangs on it need, less what else acts there and what drives
    the joint; one that closes a loop has its multipliers, and friction and loads along it.
    """
    rows = zip(motion.model.rows, -motion.multipliers.T, strict=True)
    along_rows = [(row, size) for row, size in rows if row.kind != "coordinate"]  # that drives its joint
    # What acts along a joint that closes a loop is part of what it carries, as in the tree.
    return _carried(motion, _needed(motion), [*along_rows, *motion.along_cut], _driving(motion))


def reactions_of_loops(motion: SpatialMotion, forces: Array) -> Mapping[str, Wrench]:
    """What forces (T, rows that close loops) along these rows are in `reactions`."""
    none = np.zeros((len(motion.time), 3))
    rows = [row for row in motion.model.rows if not row.is_trajectory]
    totals = [Wrench(none, none) for _ in motion.model.tree.nodes]
    return _carried(motion, totals, list(zip(rows, forces.T, strict=True)), {})


def _needed(motion: SpatialMotion) -> list[Wrench]:
    """By body what it needs for its motion, less loads and what rotors do; moments about the global origin."""
    tree, state, gravity, totals = motion.model.tree, motion.accelerated, np.array(motion.model.scene.gravity), []
    for node, of_frame, frame in zip(tree.nodes, state.of_frames(), motion.frames, strict=True):
        needed = body_forces(node, state, of_frame, gravity)
        totals.append(Wrench(needed.force, needed.moment).seen_from(frame.r))
    loads = [(load.point, load.components) for load in motion.model.scene.load if load.point is not None]
    for point, components in (*loads, *motion.applied):
        number = tree.index[point.partition(".")[0]]
        totals[number] = totals[number].plus(load_wrench(motion, point, components), -1.0)
    for rotor in rotors(state):  # the body that carries it turns its angular momentum
        if rotor.first.body >= 0:
            moment = rotor.torque[:, None] * rotor.axis + rotor.gyroscopic
            totals[rotor.first.body] = totals[rotor.first.body].plus(Wrench(np.zeros_like(moment), moment))
    return totals


def _carried(
    motion: SpatialMotion,
    totals: list[Wrench],
    along_rows: Sequence[tuple[SpatialRow, Array]],
    driving: Mapping[str, Array],
) -> dict[str, Wrench]:
    """By joint what it carries of what bodies need, `totals`, under forces (T,) along rows, less what drives it."""
    tree, loops = motion.model.tree, dict[str, Wrench]()
    for row, size in along_rows:
        on_a, on_b = row_wrenches(tree, row, size, motion.q, motion.time, motion.frames)
        for section, acting in ((row.a, on_a), (row.b, on_b)):
            if section.body >= 0:
                totals[section.body] = totals[section.body].plus(acting, -1.0)
        if not row.is_trajectory:
            second, on_second = (row.b, on_b) if row.sign > 0 else (row.a, on_a)
            at_joint = on_second.seen_from(-tree.motion(second, motion.q, motion.frames).r)
            loops[row.owner] = loops[row.owner].plus(at_joint) if row.owner in loops else at_joint
    found = dict(loops)
    for number in reversed(range(len(tree.nodes))):
        node = tree.nodes[number]
        if node.inner.body >= 0:
            totals[node.inner.body] = totals[node.inner.body].plus(totals[number])
        at = tree.motion(node.inner if node.backwards else node.outer, motion.q, motion.frames).r
        carried, sign = totals[number], -1.0 if node.backwards else 1.0
        if node.joint.name in driving:
            drive = along_joint(tree, node, driving[node.joint.name], motion.q, motion.frames)
            carried = carried.plus(drive, -1.0)
        found[node.joint.name] = Wrench(sign * carried.force, sign * carried.moment).seen_from(-at)
    return found


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
            moments[joint] = motion.gears[joint].moment[:, None] if joint in motion.gears else size[:, None]
    for joint, moment in moments.items():
        node = model.tree.nodes[model.tree.carried[joint]]
        along = np.zeros((len(motion.time), node.v.stop - node.v.start))
        along[:, model.columns(joint) - node.v.start] = -moment if node.backwards else moment
        found[joint] = along
    return found


def load_wrench(motion: SpatialMotion, point: str, components: Mapping[str, TimeFunction]) -> Wrench:
    """A given load at a point, moments about the global origin."""
    values = {name: function.sample(motion.time)[0] for name, function in components.items()}
    none = np.zeros(len(motion.time))
    force, moment = (np.stack([values.get(key, none) for key in keys], axis=1) for keys in ("xyz", ("mx", "my", "mz")))
    return Wrench(force, moment).seen_from(motion.section(point).r)
