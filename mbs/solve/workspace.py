"""Postures of a robot over a grid of joint coordinates, or of places of a point, on the branch of its start."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Indices
from ...common.errors import InputError
from ...common.rotations import logarithm
from ...common.structs import struct
from .._core import TimeFunction
from ..fields.field_types import GROUND
from ..fields.orientations import OrientationLaw
from ..fields.waypoints import spline
from ..model.model import Model, row_of_joint, row_values, without_paths
from ..model.rows import ConstraintRow
from .posture import solve_postures
from .start import undeformed_posture

TOGETHER = 500  # postures that are solved at once


@struct
class GridAxis:
    """One direction of a grid: a joint's coordinate, or "x", "y" or "z" of the point; `unit` is "rad" or "m"."""

    name: str
    values: Array
    is_place: bool = False
    unit: str = "m"


class Postures(NamedTuple):
    """Undeformed postures, one for each point of the grid, the last axis fastest.

    q (P, n_q) of the robot with rigid gears; `reached` (P,) whether there is one on the branch of the start; `within`
    (P,) whether it keeps the limits of the joints.
    """

    q: Array
    reached: Booleans
    within: Booleans


def grid_postures(model: Model, axes: Sequence[GridAxis], point: str, *, keeps_orientation: bool) -> Postures:
    """Postures over the grid: each by Newton from a neighbor that is solved, beginning next to the start of the scene.

    Joints that the grid leaves open move as little as they can from the neighbor. `point` is where the model has it.
    With `keeps_orientation` its body keeps the orientation that it has at the start.
    Raises `InputError` for axes that the robot has not, or that ask for more than it can do.
    """
    start, shape = undeformed_posture(model).q, tuple(len(axis.values) for axis in axes)
    values = np.stack(np.meshgrid(*(axis.values for axis in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    rows = [_row(model, axis, point, values[:, k]) for k, axis in enumerate(axes)]
    measured = row_values(model=replace(model, rows=tuple(rows)), q=start[None], times=np.zeros(1))[0][0] + values[0]
    if keeps_orientation:
        rows += _orientation(model, point, start)
    robot = without_paths(model)
    robot = replace(robot, rows=(*robot.rows, *rows))
    seed = tuple(int(np.abs(axis.values - now).argmin()) for axis, now in zip(axes, measured, strict=True))
    q, reached = _flooded(robot, start, shape, int(np.ravel_multi_index(seed, shape)))
    return Postures(q, reached, within_limits(model, q))


def _flooded(model: Model, start: Array, shape: tuple[int, ...], seed: int) -> tuple[Array, Booleans]:
    """From neighbor to neighbor, round by round; a posture that fails is tried again from the next neighbor."""
    count = int(np.prod(shape))
    q, reached = np.tile(start, (count, 1)), np.zeros(count, dtype=bool)
    trial, guess = np.array([seed]), start[None]
    while len(trial):
        found, is_met = _solved(model, trial, guess)
        new = trial[is_met]
        q[new], reached[new] = found[is_met], True
        ahead, origin = _neighbors(new, shape)
        open_ones = ~reached[ahead]
        trial, first = np.unique(ahead[open_ones], return_index=True)
        guess = q[origin[open_ones][first]]
    return q, reached


def _solved(model: Model, numbers: Indices, guess: Array) -> tuple[Array, Booleans]:
    parts = [slice(k, k + TOGETHER) for k in range(0, len(numbers), TOGETHER)]
    found = [solve_postures(model, numbers[part].astype(float), guess[part]) for part in parts]
    return np.concatenate([q for q, _ in found]), np.concatenate([met for _, met in found])


def _neighbors(numbers: Indices, shape: tuple[int, ...]) -> tuple[Indices, Indices]:
    """Grid points next to these along one axis, and which of these each is next to."""
    place = np.array(np.unravel_index(numbers, shape))
    ahead, origin = [], []
    for axis in range(len(shape)):
        for step in (-1, 1):
            moved = place.copy()
            moved[axis] += step
            inside = (moved[axis] >= 0) & (moved[axis] < shape[axis])
            ahead.append(np.ravel_multi_index(tuple(moved[:, inside]), shape))
            origin.append(numbers[inside])
    return np.concatenate(ahead).astype(np.intp), np.concatenate(origin).astype(np.intp)


def _row(model: Model, axis: GridAxis, point: str, values: Array) -> ConstraintRow:
    """What keeps the coordinate of an axis at `values` (P,), by the number of the posture as its time."""
    (target,) = spline(np.arange(float(len(values))), values[:, None], 1)
    if axis.is_place:
        e, (ground, section) = np.eye(3)["xyz".index(axis.name)], map(model.tree.section, (GROUND, point))
        return ConstraintRow(axis.name, "point", ground, section, e, e, target=target)
    joints = {joint.name: joint for joint in model.scene.joint}
    joint = joints[axis.name]
    if len(joint.units) != 1:
        raise InputError(
            f"{model.scene.path}: grid: expected a joint with one coordinate, found {joint.label} with"
            f" {len(joint.units)} coordinates"
        )
    return row_of_joint(model.tree, joint, axis.name, target)


def _orientation(model: Model, point: str, start: Array) -> list[ConstraintRow]:
    """Rows by which the body of `point` is turned as at the start: about z in the plane, about all axes else."""
    tree = model.tree
    ground, section = map(tree.section, (GROUND, point))
    triad = tree.motion(section, start[None], tree.frames(start[None])).F[0]
    reference = logarithm(triad)
    law = OrientationLaw(
        "rotation_vector", (TimeFunction.constant(0.0),) * 3, (reference[0], reference[1], reference[2])
    )
    axes = np.eye(3)[2:] if model.scene.is_planar else np.eye(3)
    return [ConstraintRow("orientation", "rotation", ground, section, e, e, law=law) for e in axes]


def within_limits(model: Model, q: Array) -> Booleans:
    """(P,) whether postures q (P, n_q) keep the limits of the joints of the tree with one coordinate each."""
    within = np.ones(len(q), dtype=bool)
    for joint in model.scene.joint:
        if joint.name in model.tree.carried and len(joint.units) == 1:
            node = model.tree.nodes[model.tree.carried[joint.name]]
            lowest, highest = joint.position_limits[0]
            value = node.sign * q[:, node.q.start]
            within &= (value >= lowest) & (value <= highest)
    return within
