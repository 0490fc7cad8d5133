"""Forward dynamics in space under given loads, and under the actuation that an inverse analysis found."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..model.spatial_system import Drive, PointDrive
from ..scene.spatial.loads import OF_POINT
from ..solve.spatial_statics import initial_state
from ..solve.state import State
from .forward import Forward
from .spatial_drive import spatial_drive
from .spatial_replay import motor_forces_of, path_wrenches, replayed
from .spatial_run import SpatialContext, SpatialRun, without_paths


def run_spatial_forward(context: SpatialContext, analysis: Forward) -> SpatialRun:
    """Motion alone: nothing is specified. With an actuation it starts where the earlier analysis did.

    Raises `InputError` where what is to be applied does not fit the robot, `SolveError` where there is no equilibrium
    to start from.
    """
    model, progress = without_paths(context.model), context.progress
    if analysis.actuation is None:
        return spatial_drive(model, analysis, initial_state(model), progress)
    source = context.runs[analysis.actuation]
    drives: list[Drive] = []
    points: list[PointDrive] = []
    if analysis.apply == "joints":
        drives, unresolved = _motors(source, analysis)
    else:
        drives, points, unresolved = _paths(source, analysis)
    start = State(source.q[0], source.v[0])
    warnings: tuple[str, ...] = ()
    if unresolved > analysis.tolerance:
        off = f"off by {unresolved:.1e} of the largest"
        warnings = (f'the forces of "{analysis.actuation}" change too fast to be replayed: {off}',)
    return spatial_drive(model, analysis, start, progress, drives=drives, point_drives=points, warnings=warnings)


def _paths(source: SpatialRun, analysis: Forward) -> tuple[list[Drive], list[PointDrive], float]:
    """Forces and moments on the points of paths, and along the coordinates of joints that follow one."""
    model = source.model
    rows = [(k, row) for k, row in enumerate(model.rows) if row.is_trajectory and row.kind == "coordinate"]

    def forces(run: SpatialRun) -> Array:
        along = [-run.multipliers[:, k : k + 1] * row.sign for k, row in rows]
        return np.hstack([*along, *path_wrenches(run).values()])

    found = replayed(source, forces, analysis.last_time, analysis.tolerance)
    directions = np.eye(model.tree.n_v)[[row.coordinate for _, row in rows]]
    drives = [Drive(direction, size) for direction, size in zip(directions, found.functions, strict=False)]
    sizes = iter(found.functions[len(rows) :])
    points = [
        PointDrive(point, {component: next(sizes) for component in OF_POINT})
        for point in path_wrenches(source.rows(slice(0, 1)))
    ]
    return drives, points, found.unresolved


def _motors(source: SpatialRun, analysis: Forward) -> tuple[list[Drive], float]:
    """Moments of all motors along their coordinates."""
    model = source.model
    if not model.motors:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected joints with motors for "joints", found'
            " none: name them with motor = true"
        )

    joints = {joint.name: joint for joint in model.scene.joint}
    most = np.array([limits.moment for name in model.motors for limits in joints[name].motor_limits])
    most = most if analysis.limits else np.full_like(most, np.inf)

    def moments(run: SpatialRun) -> Array:
        return np.clip(np.hstack(list(motor_forces_of(run).moments.values())), -most, most)

    found = replayed(source, moments, analysis.last_time, analysis.tolerance)
    directions = [
        model.sign(joint) * np.eye(model.tree.n_v)[column]
        for joint, columns in model.motors.items()
        for column in columns
    ]
    drives = [Drive(direction, size) for direction, size in zip(directions, found.functions, strict=True)]
    return drives, found.unresolved
