"""Postures of a robot over a grid of joint coordinates, or of places of a point, on the branch of its start."""

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Indices, in_parts
from ...common.errors import InputError
from ...common.rotations import logarithm
from ...common.structs import struct
from ..fields.field_types import GROUND
from ..fields.orientations import OrientationLaw
from ..fields.waypoints import spline
from ..model.build import row_of_joint
from ..model.model import Model
from ..model.nodes import ConstraintRow
from .limits import ROUND_OFF, limited_coordinates
from .start import are_regular, random_angles, turning_joints, undeformed_posture

TURN = "turn"  # axis of a grid: of the body of the point about an axis of it
TOGETHER = 500  # postures that are solved at once
PLACES, TRIES = 32, 16  # that are tried where no neighbor leads, and guesses for each
BEYOND = 1e3  # rad: postures beyond limits of joints come after all others


@struct
class GridAxis:
    """Axis of a grid: coordinate of a joint (its `name`); if `is_place`, "x", "y", "z" of a point, "turn" of its body.

    `values` (n,) are in `unit`, "rad" or "m".
    """

    name: str
    values: Array
    is_place: bool = False
    unit: str = "m"

    @property
    def is_turn(self) -> bool:
        """Whether the body turns."""
        return self.is_place and self.name == TURN


class Postures(NamedTuple):
    """Undeformed postures, rad and m, one for each point of the grid, the last axis fastest.

    q (P, n_q) of the robot with rigid gears; `reached` (P,) whether q is found, on the branch of the start; `within`
    (P,) whether it keeps the limits of the joints.
    """

    q: Array
    reached: Booleans
    within: Booleans


def grid_postures(
    model: Model, axes: Sequence[GridAxis], point: str, *, keeps_orientation: bool, turned_about: Array | None = None
) -> Postures:
    """Postures over the grid: each by Newton from a neighbor that is solved, beginning next to the start of the scene.

    Joints that the grid leaves open move as little as they can from the neighbor. `point` is "BODY.POINT" of the model.
    With `keeps_orientation` its body keeps its orientation at the start. With an axis "turn" it turns from there about
    the unit vector `turned_about` (3,), in axes of a tool or else global ones, and keeps those of x, y and z of the
    start that are no axes of the grid.
    Raises `InputError` for a joint with several coordinates.
    """
    start, shape = undeformed_posture(model).q, tuple(len(axis.values) for axis in axes)
    values = np.stack(np.meshgrid(*(axis.values for axis in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    turn = next((values[:, k] for k, axis in enumerate(axes) if axis.is_turn), np.zeros(1))
    is_row, measured = np.array([not axis.is_turn for axis in axes]), np.zeros(len(axes))
    rows = [_row(model, axes[k], point, values[:, k]) for k in np.flatnonzero(is_row)]
    along = replace(model, rows=tuple(rows))
    measured[is_row] = along.constraints.values(start[None], np.zeros(1))[0][0] + values[0, is_row]
    if turned_about is not None:
        kept = set("xyz") - {axis.name for axis in axes if axis.is_place}
        place = model.tree.places(start[None]).at(model.tree.section(point)).r[0]
        rows += [_row(model, GridAxis(name, place, True), point, place[["xyz".index(name)]]) for name in sorted(kept)]
    if keeps_orientation or turned_about is not None:
        turns = turn[:, None] * (np.zeros(3) if turned_about is None else turned_about)
        ground, section = map(model.tree.section, (GROUND, point))
        triad = model.tree.places(start[None]).at(section).F[0]
        x, y, z = logarithm(triad)
        if point in model.tree.tools:
            turns = turns @ triad.T
        of_time = tuple(spline(np.arange(float(len(turns))), turns, 1))  # the number of the posture
        law = OrientationLaw("rotation_vector", of_time, (x, y, z))
        axes_kept = np.eye(3)[2:] if model.scene.is_planar else np.eye(3)
        rows += [ConstraintRow("orientation", "rotation", ground, section, e, e, law=law) for e in axes_kept]
    robot = model.without_paths()
    robot = replace(robot, rows=(*robot.rows, *rows))
    seed = tuple(int(np.abs(axis.values - now).argmin()) for axis, now in zip(axes, measured, strict=True))
    q, reached = _flooded(robot, start, shape, int(np.ravel_multi_index(seed, shape)))
    return Postures(q, reached, within_limits(model, q))


def _flooded(model: Model, start: Array, shape: tuple[int, ...], seed: int) -> tuple[Array, Booleans]:
    """From neighbor to neighbor, round by round; a posture that fails is tried again from the next neighbor.

    So are those beyond limits of joints, from which others are sought where none within leads.
    """
    count = int(np.prod(shape))
    q, reached, within = np.tile(start, (count, 1)), np.zeros(count, dtype=bool), np.zeros(count, dtype=bool)
    trial, guess, waiting = np.array([seed]), start[None], np.zeros(0, dtype=np.intp)
    while len(trial):
        solved, is_met = _solved(model, trial, guess)
        keeps = is_met & within_limits(model, solved)
        new = keeps | (is_met & ~reached[trial])
        q[trial[new]], reached[trial[new]], within[trial[keeps]] = solved[new], True, True
        waiting = np.append(waiting, trial[new & ~keeps])
        trial, guess = _around(trial[keeps], shape, q, ~within)
        if not len(trial):
            trial, guess = _around(waiting, shape, q, ~reached)
            waiting = waiting[:0]
        if not len(trial):
            trial, guess = _elsewhere(model, start, shape, q, reached)
    return q, reached


def _around(numbers: Indices, shape: tuple[int, ...], q: Array, is_open: Booleans) -> tuple[Indices, Array]:
    """Open neighbors of these postures, each once, and a posture to begin with."""
    ahead, origin = _neighbors(numbers, shape)
    trial, first = np.unique(ahead[is_open[ahead]], return_index=True)
    return trial, q[origin[is_open[ahead]][first]]


def _elsewhere(
    model: Model, start: Array, shape: tuple[int, ...], q: Array, reached: Booleans
) -> tuple[Indices, Array]:
    """A place that is open with a posture (1, n_q) there, next to the start; nothing where there is none.

    Of places without a regular neighbor: these lead no arm out of a straight posture or across a hole in its reach.
    """
    known, (_, columns) = np.flatnonzero(reached), turning_joints(model)
    regular = known[are_regular(model, q[known], known.astype(float))]
    left = np.setdiff1d(np.flatnonzero(~reached), _neighbors(regular, shape)[0])
    none = left[:0], q[:0]
    if not len(left) or not len(columns):
        return none
    some = np.random.default_rng(0).permutation(left)[:PLACES]
    trial = np.repeat(some, TRIES)
    solved, is_met = _solved(model, trial, np.tile(random_angles(start, columns, TRIES), (len(some), 1)))
    trial, solved = trial[is_met], solved[is_met]
    if not len(trial):
        return none
    turns = np.angle(np.exp(1j * (solved[:, columns] - start[columns])))
    solved[:, columns] = start[columns] + turns
    away = np.abs(turns).sum(axis=1) + np.where(within_limits(model, solved), 0.0, BEYOND)
    best = [int(away.argmin())]
    return trial[best], solved[best]


def _solved(model: Model, numbers: Indices, guess: Array) -> tuple[Array, Booleans]:
    parts = in_parts(len(numbers), TOGETHER)
    solved = [model.constraints.postures(guess[part], numbers[part].astype(float)) for part in parts]
    return np.concatenate([q for q, _ in solved]), np.concatenate([met for _, met in solved])


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
    joint = next(joint for joint in model.scene.joint if joint.name == axis.name)
    if len(joint.units) != 1:
        raise InputError(
            f"{model.scene.path}: grid: expected a joint with one coordinate",
            f"{joint.label} with {len(joint.units)} coordinates",
        )
    return row_of_joint(model.tree, joint, axis.name, target)


def within_limits(model: Model, q: Array) -> Booleans:
    """Whether (P,) postures q (P, n_q), rad and m, are within the limits of all joints."""
    cut = any(np.isfinite(joint.position_limits).any() for joint in model.tree.cut_joints)
    if cut and len(q) > 1:  # angles there are by the motion up to them
        return np.array([within_limits(model, one[None])[0] for one in q])
    within, v = np.ones(len(q), dtype=bool), np.zeros((len(q), model.tree.n_v))
    for joint, number, values in limited_coordinates(model, np.zeros(len(q)), q, v, every=True):
        lowest, highest = joint.position_limits[number]
        within &= (values >= lowest - ROUND_OFF) & (values <= highest + ROUND_OFF)
    return within
