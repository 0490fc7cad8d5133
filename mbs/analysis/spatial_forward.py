"""Forward dynamics in space under given loads, and under the actuation that an inverse analysis found."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from .._core import TimeFunction
from ..fields.waypoints import spline
from ..model.spatial_drives import Drive, Drives, FrameDrive, PointDrive
from ..model.spatial_gears import with_compliance_in_space
from ..model.spatial_model import SpatialModel, modal_direction, without_paths
from ..model.spatial_motors import MotorForces
from ..scene.spatial.loads import OF_POINT
from ..solve.spatial_statics import hanging_joints, initial_state
from ..solve.state import State
from .context import Context
from .elastic_joints import DEGREE
from .forward_keys import ForwardKeys
from .outcome import Outcome
from .spatial_drive import spatial_drive
from .spatial_gears import wound_up
from .spatial_replay import left_paths, motor_forces_of, path_wrenches, replay_times, replayed

Moments = Mapping[str, Sequence[TimeFunction]]
"""By joint, on its second side along each coordinate, N·m or N."""


class Applied(NamedTuple):
    """What acts, how far its functions of time are off (share of the largest value), and whether that was stopped.

    `moments` are those of `drives` that act along joints.
    """

    drives: Drives
    moments: Moments
    unresolved: float
    was_stopped: bool


def run_spatial_forward(context: Context, analysis: ForwardKeys) -> Outcome:
    """Motion alone: nothing is specified. With an actuation it starts where the earlier analysis did.

    Raises `InputError` where what is to be applied does not fit the robot, `SolveError` where there is no equilibrium
    to start from.
    """
    model, progress = with_compliance_in_space(without_paths(context.model)), context.progress
    if analysis.actuation is None:
        start = initial_state(model)
        told = tuple(hanging_joints(model, start))
        return spatial_drive(model, analysis, start, progress, warnings=told, earlier=context.earlier)
    source = context.outcomes[analysis.actuation]
    if model.tree.gears:
        return _behind_gears(source, model, analysis, context)
    if analysis.apply == "points":
        applied = _points(context, source, analysis)
    else:
        by_paths = analysis.apply == "trajectory"
        applied = _paths(source, analysis) if by_paths else _actuators(context, source, analysis)
    progress = _stop if applied.was_stopped else progress
    start = State(source.q[0], source.v[0])
    warnings: tuple[str, ...] = ()
    if applied.unresolved > analysis.tolerance:
        off = f"off by {applied.unresolved:.1e} of the largest"
        warnings = (f'the forces of "{analysis.actuation}" change too fast for a forward simulation: {off}',)
    run = spatial_drive(
        model, analysis, start, progress, drives=applied.drives, warnings=warnings,
        times=replay_times(source, analysis), earlier=context.earlier,
    )  # fmt: skip
    if analysis.apply == "trajectory":  # others act without what makes up for vibrations
        statistics = run.statistics
        warnings = (*statistics.warnings, *left_paths(source, run))
        run = replace(run, statistics=replace(statistics, warnings=warnings))
    return _commanded(run, applied.moments)


def _commanded(run: Outcome, moments: Moments) -> Outcome:
    """With what acts along joints at its outputs, and at times between."""

    def told(of: Outcome) -> Outcome:
        sampled = {joint: [f.sample(of.time)[0] for f in sizes] for joint, sizes in moments.items() if sizes}
        commanded = {joint: np.stack(values, axis=1) for joint, values in sampled.items()}
        return replace(of, forces=replace(of.forces, commanded=commanded))

    return told(run) if run.look_closer is None else replace(told(run), look_closer=cache(lambda: told(run.closer)))


def _by_joint(model: SpatialModel, functions: Iterable[TimeFunction]) -> dict[str, list[TimeFunction]]:
    """The next functions of each motor, in the order of `SpatialModel.motors`."""
    following = iter(functions)
    return {joint: [next(following) for _ in columns] for joint, columns in model.motors.items()}


def _behind_gears(source: Outcome, model: SpatialModel, analysis: ForwardKeys, context: Context) -> Outcome:
    """Where gears of `model` give: moments at the outputs of `source` and splines between these, as in the plane."""
    if analysis.apply != "joints":
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected "joints" for joints with stiffness,'
            f' found "{analysis.apply}"'
        )
    if source.model.tree.gears:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": actuation: expected an inverse analysis for joints'
            f' with stiffness, found "{source.analysis.name}"'
        )
    wound = wound_up(source, model)
    most = largest_moments(source.model, limits=analysis.limits)
    wanted = np.hstack([wound.moments[joint] for joint in model.motors])
    given = np.clip(wanted, -most, most)
    sizes = spline(source.time, given, 1 if np.any(given != wanted) else DEGREE)
    along = [Drive(direction, size) for direction, size in zip(_directions(model), sizes, strict=True)]
    run = spatial_drive(
        model, analysis, State(wound.q[0], wound.v[0]), context.progress, drives=Drives(tuple(along)),
        times=replay_times(source, analysis), earlier=context.earlier,
    )  # fmt: skip
    return _commanded(run, _by_joint(model, sizes))


def _stop(t: float) -> bool:
    """Of a run that was stopped before it began: its first output alone."""
    return False


def largest_moments(model: SpatialModel, *, limits: bool) -> Array:
    """(motors,) N·m or N, infinite where limits do not count."""
    joints = {joint.name: joint for joint in model.scene.joint}
    most = np.array([of.moment for name in model.motors for of in joints[name].motor_limits])
    return most if limits else np.full_like(most, np.inf)


def _directions(model: SpatialModel) -> list[Array]:
    """Along v (n_v,), of each motor."""
    return [model.sign(joint) * np.eye(model.tree.n_v)[k] for joint, columns in model.motors.items() for k in columns]


def _paths(source: Outcome, analysis: ForwardKeys) -> Applied:
    """Forces and moments on the points of paths, and along the coordinates of joints that follow one."""
    model = source.model
    rows = [(k, row) for k, row in enumerate(model.rows) if row.is_trajectory and row.kind == "coordinate"]

    def forces(run: Outcome) -> Array:
        along = [-run.multipliers[:, k : k + 1] for k, _ in rows]
        return np.hstack([*along, *path_wrenches(run).values()])

    found = replayed(source, forces, replay_times(source, analysis), analysis.tolerance)
    unit, moments = np.eye(model.tree.n_v), found.functions[: len(rows)]
    along = [Drive(row.sign * unit[row.coordinate], size) for (_, row), size in zip(rows, moments, strict=True)]
    sizes = iter(found.functions[len(rows) :])
    points = [
        PointDrive(point, {component: next(sizes) for component in OF_POINT})
        for point in path_wrenches(source.at(slice(0, 1)))
    ]
    by_joint = {model.joint_of(row): [size] for (_, row), size in zip(rows, moments, strict=True)}
    return Applied(Drives(tuple(along), tuple(points)), by_joint, found.unresolved, found.was_stopped)


def _points(context: Context, source: Outcome, analysis: ForwardKeys) -> Applied:
    """Forces at the actuation points, as they were along the motion of the source: in global axes."""

    def forces(run: Outcome) -> Array:
        return np.hstack(list(context.at_points(run).values()))

    found = replayed(source, forces, replay_times(source, analysis), analysis.tolerance)
    sizes = iter(found.functions)
    points = tuple(
        PointDrive(point, {axis: next(sizes) for axis in "xyz"}) for point in context.at_points(source.at(slice(0, 1)))
    )
    return Applied(Drives(at_points=points), {}, found.unresolved, found.was_stopped)


def _actuators(context: Context, source: Outcome, analysis: ForwardKeys) -> Applied:
    """Moments of all motors along their coordinates, and what voltages of patches do on modes."""
    model = source.model
    _check_motors(model, analysis)
    most = largest_moments(model, limits=analysis.limits)

    def forces(run: Outcome) -> Array:
        found = motor_forces_of(run)
        moments = np.clip(np.hstack(list(found.moments.values())), -most, most)
        return np.hstack([moments, *_supplied(context, analysis, found).values()])

    found = replayed(source, forces, replay_times(source, analysis), analysis.tolerance)
    sizes = iter(found.functions)
    motors = list(motor_drives(model, sizes))
    with_patches = _supplied(context, analysis, motor_forces_of(source.at(slice(0, 1))))
    modal = tuple(drive for body in with_patches for drive in modal_drives(model, body, sizes))
    along = tuple(drive for drive in motors if isinstance(drive, Drive))
    on_frames = tuple(drive for drive in motors if isinstance(drive, FrameDrive))
    moments = _by_joint(model, found.functions)
    return Applied(Drives(along + modal, on_frames=on_frames), moments, found.unresolved, found.was_stopped)


def _supplied(context: Context, analysis: ForwardKeys, found: MotorForces) -> dict[str, Array]:
    """Modal forces of patches (T, n) by body, where they are applied."""
    return dict(context.supply(found.modal, analysis.limits)) if analysis.apply == "joints+pzt" else {}


def motor_drives(model: SpatialModel, sizes: Iterator[TimeFunction]) -> Iterator[Drive | FrameDrive]:
    """The motors with the next functions, in the order of `SpatialModel.motors`; their signs are those of the joint."""
    joints = {joint.name: joint for joint in model.scene.joint}
    for joint, columns in model.motors.items():
        for column in columns:
            size = next(sizes)
            if model.scene.motors == "frame" and joints[joint].units == ("rad",):
                yield FrameDrive(model.tree.carried[joint], model.sign(joint), size)
            else:
                yield Drive(model.sign(joint) * np.eye(model.tree.n_v)[column], size)


def modal_drives(model: SpatialModel, body: str, sizes: Iterator[TimeFunction]) -> Iterator[Drive]:
    """Forces on the modes of the file of a body, one function of time after the other, along v of its tree."""
    modes = model.tree.nodes[model.tree.index[body]].body.modal_transform
    for unit in np.eye(len(modes)):
        yield Drive(modal_direction(model, body, unit), next(sizes))


def _check_motors(model: SpatialModel, analysis: ForwardKeys) -> None:
    if not model.motors:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected joints with motors for'
            f' "{analysis.apply}", found none: name them with motor = true'
        )
