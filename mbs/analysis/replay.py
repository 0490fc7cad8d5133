"""Which actuators act on a forward run, and along which rows: what an inverse analysis found, carried out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.validation import quoted
from .. import _core
from ..joints.measure import Marker, Measure
from ..model.model import Model
from ..scene.analysis_records import Analysis

if TYPE_CHECKING:
    from .analyses import Outcome


@dataclass(frozen=True)
class PointActuator:
    """Forces at points of one body: the name of the point of each component, and the equations L_a F_a = Q_a."""

    points: tuple[str, ...]
    equations: _core.ActuationPoints


@dataclass(frozen=True)
class ActuatorSet:
    """Actuators by the body they sit on; `patches` know no limits, `limited_patches` theirs."""

    patches: Mapping[str, _core.Allocation] = field(default_factory=dict)
    limited_patches: Mapping[str, _core.Allocation] = field(default_factory=dict)
    points: Mapping[str, PointActuator] = field(default_factory=dict)


def motor_limits(model: Model) -> Array:
    """Largest moment (N·m, or N) of each motor, infinite where the scene gives none."""
    joints = {joint.name: joint for joint in model.scene.joint}
    return np.array([joints[name].motor_limits.moment for name in model.motors])


def applied_actuators(
    model: Model, analysis: Analysis, source: Outcome, actuator_set: ActuatorSet
) -> tuple[list[Measure], list[_core.Actuator]]:
    """Rows along which forces act, and the actuators that set them, in the order in which the core numbers them.

    Raises `InputError` where the motors do not fit the mechanism, or a body has no actuation points.
    """
    if analysis.apply == "trajectory":
        return [c.measure for c in source.assembly.constraints if c.is_trajectory], [_core.TrajectoryForces(0)]
    if analysis.apply == "points":
        return _point_actuators(model, analysis, source, actuator_set)
    if source.tau is None:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected motors that fit the mechanism'
            f" ({model.degrees_of_freedom} of them) for {analysis.apply!r}, found {len(model.motors)}; name them with"
            ' motor = true, or use apply = "trajectory"'
        )
    limits = motor_limits(model)
    motors = _core.Motors(0, limits if analysis.limits else np.full_like(limits, np.inf))
    patches = actuator_set.limited_patches if analysis.limits else actuator_set.patches
    index = {body.name: i for i, body in enumerate(model.bodies)}
    bent = [_core.Patches(index[name], allocation) for name, allocation in patches.items()]
    return list(model.motors.values()), [motors, *(bent if analysis.apply == "joints+pzt" else [])]


def _point_actuators(
    model: Model, analysis: Analysis, source: Outcome, actuator_set: ActuatorSet
) -> tuple[list[Measure], list[_core.Actuator]]:
    driven = [body.name for body in model.bodies if is_driven(source, body.name)]
    missing = [name for name in driven if name not in actuator_set.points]
    if missing:
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected [[actuation_points]] on every body that'
            f' "{source.analysis.name}" drives ({quoted(driven)}), found none on {quoted(missing)}'
        )
    rows: list[Measure] = []
    actuators: list[_core.Actuator] = []
    for i, body in enumerate(model.bodies):
        if body.name not in actuator_set.points:
            continue
        points = actuator_set.points[body.name]
        actuators.append(_core.PointForces(len(rows), i, points.equations))
        for name in points.points:
            for kind in (_core.MeasureKind.x, _core.MeasureKind.y):
                rows.append(Measure(f'actuation point on "{body.name}"', kind, Marker(None), Marker(body.name, name)))
    return rows, actuators


def is_driven(source: Outcome, body: str) -> bool:
    """Whether generalized driving forces Q_a can act on a body: a trajectory or prescribed modes are its own."""
    trajectories = (c.measure for c in source.assembly.constraints if c.is_trajectory)
    prescribed = source.shape_force is not None and source.assembly.model.body(body).n_modes > 0
    return prescribed or any(body in (measure.a.body, measure.b.body) for measure in trajectories)


def actuation_source(source: Outcome) -> _core.ActuationSource:
    """The findings of an inverse analysis at any time of it, not at its outputs alone, in what was integrated."""
    if source.inversion is not None:
        return source.inversion.source()
    assembly = source.integrated or source.assembly
    resolver = None
    if source.tau is not None:
        resolver = _core.ActuatorForces(assembly.system, assembly.is_trajectory, assembly.motor_measures)
    if source.shape is not None:
        return _core.FullyConstrainedActuation(
            assembly.system, source.shape, source.q[0], assembly.is_trajectory, resolver
        )
    assert source.recording is not None
    return _core.RecordedActuation(assembly.system, source.recording, assembly.is_trajectory, resolver)
