"""Forward dynamics in space under given loads, and under the actuation that an inverse analysis found."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ..fields.waypoints import spline
from ..model.spatial_accelerations import Accelerated
from ..model.spatial_gears import with_compliance_in_space
from ..model.spatial_model import SpatialModel
from ..model.spatial_system import Drive
from ..solve.spatial_statics import initial_state
from ..solve.state import State
from .elastic_joints import DEGREE
from .forward import Forward
from .spatial_drive import spatial_drive
from .spatial_gears import gears_of_motion
from .spatial_replay import motor_forces_of, replayed
from .spatial_run import SpatialContext, SpatialRun, without_paths


def run_spatial_forward(context: SpatialContext, analysis: Forward) -> SpatialRun:
    """Motion alone: nothing is specified. With an actuation it starts where the earlier analysis did.

    Raises `InputError` where what is to be applied does not fit the robot, `SolveError` where there is no equilibrium
    to start from.
    """
    model = with_compliance_in_space(without_paths(context.model))
    if analysis.actuation is None:
        return spatial_drive(model, analysis, initial_state(model), context.progress)
    source = context.runs[analysis.actuation]
    if model.tree.gears:
        return _behind_gears(source, model, analysis, context)
    drives, unresolved = _motors(source, analysis)
    start = State(source.q[0], source.v[0])
    warnings: tuple[str, ...] = ()
    if unresolved > analysis.tolerance:
        off = f"off by {unresolved:.1e} of the largest"
        warnings = (f'the forces of "{analysis.actuation}" change too fast to be replayed: {off}',)
    return spatial_drive(model, analysis, start, context.progress, drives=drives, warnings=warnings)


def _behind_gears(source: SpatialRun, model: SpatialModel, analysis: Forward, context: SpatialContext) -> SpatialRun:
    """Where gears of `model` give: moments at the outputs of `source` and splines between these, as in the plane."""
    if analysis.apply != "joints":
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected "joints" beside joints with stiffness,'
            f' found "{analysis.apply}"'
        )
    if source.model.tree.gears:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": actuation: expected an inverse analysis beside joints'
            f' with stiffness, found "{source.analysis.name}"'
        )
    state = Accelerated(source.model.tree, source.q, source.v, source.a, source.model.tree.frames(source.q))
    moments = motor_forces_of(source).moments
    gears = gears_of_motion(source.model, state, source.time, moments)
    supplied = {**moments, **{joint: gear.moment[:, None] for joint, gear in gears.items()}}
    most = _largest_moments(source.model, limits=analysis.limits)
    wanted = np.hstack([supplied[joint] for joint in model.motors])
    given = np.clip(wanted, -most, most)
    sizes = spline(source.time, given, 1 if np.any(given != wanted) else DEGREE)
    outputs = [gear.motor for gear in model.tree.gears]
    known = [gears[gear.joint.joint.name] for gear in model.tree.gears]
    first = State(np.append(source.q[0], [0.0] * len(outputs)), np.append(source.v[0], [0.0] * len(outputs)))
    for node, found in zip(outputs, known, strict=True):
        first.q[node.q.start], first.v[node.v.start] = found.angle[0], found.rate[0]
    drives = [Drive(direction, size) for direction, size in zip(_directions(model), sizes, strict=True)]
    return spatial_drive(model, analysis, first, context.progress, drives=drives)


def _largest_moments(model: SpatialModel, *, limits: bool) -> Array:
    """(motors,) N·m or N, infinite where limits do not count."""
    joints = {joint.name: joint for joint in model.scene.joint}
    most = np.array([of.moment for name in model.motors for of in joints[name].motor_limits])
    return most if limits else np.full_like(most, np.inf)


def _directions(model: SpatialModel) -> list[Array]:
    """Along v (n_v,), of each motor."""
    return [model.sign(joint) * np.eye(model.tree.n_v)[k] for joint, columns in model.motors.items() for k in columns]


def _motors(source: SpatialRun, analysis: Forward) -> tuple[list[Drive], float]:
    """Moments of all motors along their coordinates."""
    model = source.model
    if not model.motors:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected joints with motors for "joints", found'
            " none: name them with motor = true"
        )

    most = _largest_moments(model, limits=analysis.limits)

    def moments(run: SpatialRun) -> Array:
        return np.clip(np.hstack(list(motor_forces_of(run).moments.values())), -most, most)

    found = replayed(source, moments, analysis.last_time, analysis.tolerance)
    drives = [Drive(direction, size) for direction, size in zip(_directions(model), found.functions, strict=True)]
    return drives, found.unresolved
