"""Forward dynamics under given loads, and under the actuation that an inverse analysis found."""

from __future__ import annotations

import numpy as np

from ...common.errors import InputError
from ...common.validation import quoted
from .. import _core
from ..joints.measure import Marker, Measure
from ..model.model import ZERO, Model
from ..model.raised_mass import coordinate_factors, integrated
from ..model.system import MechanismSystem
from ..solve.state import State
from .context import AnyContext, Context
from .drive import Progress, drive, initial_state
from .elastic_joints import drive_sizes, with_compliance, with_rotors
from .forward_keys import ForwardKeys
from .outcome import AnyOutcome, EarlierRun
from .planar_outcome import PlanarOutcome
from .replay import ActuatorSet, actuation_source, motor_limits, replay_times
from .spatial_forward import run_spatial_forward


class Forward(ForwardKeys):
    """Motion under the loads of the scene and the inputs computed by the inverse analysis `actuation`.

    `apply` selects the inputs: motor torques, motor torques and patch voltages, forces along the trajectories, or
    forces at the actuation points. `limits` saturates motors and patches at their limits.
    """

    def run(self, context: AnyContext) -> AnyOutcome:
        """Motion alone: nothing is specified."""
        if isinstance(context, Context):
            return run_spatial_forward(context, self)
        source = context.source(self.actuation)
        actuators = context.make_actuators(has_raised_masses(source))
        return run_forward(context.model, self, source, actuators, context.progress, context.earlier)


def run_forward(
    model: Model,
    analysis: Forward,
    source: PlanarOutcome | None,
    actuator_set: ActuatorSet,
    progress: Progress,
    earlier: EarlierRun | None = None,
) -> PlanarOutcome:
    """Forward dynamics under given loads, and the actuation of the earlier analysis `source` where there is one.

    Motors turn elastic gears with the moments at the outputs of `source` and splines between these.
    It goes on with an `earlier` run of the same analysis.
    """
    exact = with_compliance(model)
    model = integrated(exact) if has_raised_masses(source) else exact
    if source is None:
        assembly = MechanismSystem(model, model.joints, model.loads)
        reported = None if model is exact else MechanismSystem(exact, exact.joints, exact.loads)
        return drive(assembly, analysis, initial_state(assembly), progress, reported=reported, earlier=earlier)
    loads = model.loads if source.details.loads is None else source.details.loads
    rows, actuators = applied_actuators(model, analysis, source, actuator_set)
    sizes, moved = [ZERO] * len(rows), with_rotors(source, exact)
    if model.gears:
        _check_applied(model, analysis)
        limits = motor_limits(model)
        sizes = drive_sizes(source, limits if analysis.limits else np.full_like(limits, np.inf))
        actuators = actuators[1:]  # without the motors
    drives = [*zip(rows, sizes, strict=True), *loads]
    assembly = MechanismSystem(model, model.joints, drives)
    reported = None if model is exact else MechanismSystem(exact, exact.joints, drives)
    steering = _core.Actuation(actuation_source(source), actuators) if actuators else None
    factors = 1.0 if model is exact else coordinate_factors(exact)
    start = State(moved.q[0] * factors, moved.v[0] * factors)  # bodies and their order are the same
    times = replay_times(source, analysis)
    return drive(
        assembly, analysis, start, progress, reported=reported, times=times, steering=steering, earlier=earlier
    )


def has_raised_masses(source: PlanarOutcome | None) -> bool:
    """Whether a run under the actuation of `source` raises masses: not where that prescribes the shape.

    Its forces, known at any time, hold the masses as they are to the shape, and would not hold others.
    """
    return source is None or source.details.shape_force is None


def _check_applied(model: Model, analysis: Forward) -> None:
    """Raise `InputError` for an actuation that leaves motors behind gears that give without their moments."""
    if analysis.apply not in ("joints", "joints+pzt"):
        raise InputError(
            f'{model.scene.path}: analysis "{analysis.name}": apply: expected "joints" or "joints+pzt" for joints'
            f' with stiffness, found "{analysis.apply}"'
        )


def applied_actuators(
    model: Model, analysis: Forward, source: PlanarOutcome, actuator_set: ActuatorSet
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
    model: Model, analysis: Forward, source: PlanarOutcome, actuator_set: ActuatorSet
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


def is_driven(source: PlanarOutcome, body: str) -> bool:
    """Whether generalized driving forces Q_a can act on a body: a trajectory or prescribed modes are its own."""
    trajectories = (c.measure for c in source.assembly.constraints if c.is_trajectory)
    prescribed = source.details.shape_force is not None and source.assembly.model.body(body).n_modes > 0
    return prescribed or any(body in (row.a.body, row.b.body) for row in trajectories)
