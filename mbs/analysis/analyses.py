"""The analyses of a scene: partially constrained inverse dynamics, forward dynamics, statics."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from .. import _core
from ..model.model import ZERO, Model
from ..model.raised_mass import coordinate_factors, integrated, modal_factors
from ..model.system import MechanismSystem
from ..scene.analysis_records import Analysis
from ..solve.diagnosis import find_cause, lost_inertia
from ..solve.initial_state import undeformed_state
from ..solve.integrators import METHODS, Choice, beyond_order, choose_integrator
from ..solve.path_checks import check_smooth
from ..solve.reach import check_reach
from ..solve.state import State
from ..solve.statics import static_equilibrium
from .earlier_run import EarlierRun
from .elastic_joints import GearMotion, check_applied, drive_sizes, with_compliance, with_rotors
from .replay import ActuatorSet, actuation_source, applied_actuators, motor_limits

if TYPE_CHECKING:
    from ..solve.stable_inversion import Inversion

Progress = Callable[[float], bool]
"""Called now and then with the time reached; False stops the run."""

STATUS = {
    _core.IntegrationStatus.completed: "completed",
    _core.IntegrationStatus.step_underflow: "step underflow",
    _core.IntegrationStatus.too_many_steps: "too many steps",
    _core.IntegrationStatus.interrupted: "interrupted",
    _core.IntegrationStatus.diverged: "diverged",
}
_ADVICE = {
    "step underflow": "no step is small enough there: the motion turns singular (a stretched arm, a jump in a load) or"
    " the load grows without bound",
    "too many steps": "raise max_steps, loosen the tolerance or leave out high modes",
    "interrupted": "stopped on request",
    "mesh too coarse": "motors do not get close enough to the path: vibrations of the zero dynamics that are hardly"
    " damped take too fine a mesh; add damping, leave out high modes, smooth the path or loosen the tolerance",
    "inversion not converged": "no motion was found that motors alone carry along the path: slow the path down, add"
    ' damping, leave out high modes, or use output = "redefined"',
    "diverged": "a link is bent by as much as it is long, which small deformations do not describe: loads beyond"
    " buckling, a spin that needs geometric_stiffening = true, or an arm without motors that falls apart",
}


@dataclass(frozen=True)
class Outcome:
    """What an analysis computed, one row per output time; bodies side by side in the columns of q, v, a, F_p."""

    analysis: Analysis
    assembly: MechanismSystem
    time: Array  # (T,)
    q: Array  # (T, coordinates)
    v: Array
    a: Array
    lambda_: Array  # (T, constraints)
    tau: Array | None  # (T, motors) N·m (N for prismatic joints); None where motors do not fit the mechanism
    F_p: Array | None  # (T, modes of all bodies)
    residual: Array  # (T, 3) of C, Ċ, C̈, relative to their terms
    status: str
    steps: int
    rejected: int
    evaluations: int
    wall_seconds: float
    integrator: Choice
    time_reached: float | None = None  # s, the last step's, where the run ended before its end
    cause: str = ""  # what was found wrong there
    recording: _core.Recording | None = field(default=None, repr=False)
    shape: list[list[_core.TimeFunction]] | None = field(default=None, repr=False)  # prescribed p(t), FCID only
    shape_force: Array | None = None  # (T, modes of all bodies) −λ_p, the forces that hold the shape; FCID only
    inversion: Inversion | None = field(default=None, repr=False)  # motors-only alone
    checkpoint: _core.Checkpoint | None = field(default=None, repr=False)  # where an integration can be gone on with
    gears: Mapping[str, GearMotion] = field(default_factory=dict)  # by joint: inverse analyses with gears that give
    integrated: MechanismSystem | None = field(default=None, repr=False)  # that of `recording`, with raised masses

    def coordinates(self, body: str) -> slice:
        """Columns of (R, θ, p) of a body in q, v and a."""
        i = self.assembly.index[body]
        first = int(self.assembly.first[i])
        return slice(first, first + 3 + self.assembly.model.bodies[i].n_modes)

    def modal_columns(self, body: str) -> slice:
        """Columns of a body in `F_p`."""
        i = self.assembly.index[body]
        first = int(self.assembly.first[i]) - 3 * i
        return slice(first, first + self.assembly.model.bodies[i].n_modes)

    @property
    def motor_moments(self) -> Array | None:
        """`tau`, but where gears give what their motors must do: (T, motors) N·m."""
        if self.tau is None or not self.gears:
            return self.tau
        motors = enumerate(self.assembly.model.motors)
        columns = [self.gears[joint].moment if joint in self.gears else self.tau[:, k] for k, joint in motors]
        return np.column_stack(columns)

    @property
    def failed(self) -> bool:
        """Whether the run did not do what it was for; that a closed loop diverges is a finding."""
        found = self.analysis.kind == "closed-loop" and self.status in ("diverged", "step underflow")
        return self.status != "completed" and not found

    def check_completed(self, how_to_go_on: str = "") -> None:
        """Raise `SolveError` with advice where the run failed."""
        if self.failed:
            reached = self.time[-1] if self.time_reached is None else self.time_reached
            raise SolveError(
                f'{self.assembly.model.scene.path}: analysis "{self.analysis.name}" ended at t = {reached:.9g} s'
                f" ({self.status}): {self.cause or _ADVICE[self.status]}{how_to_go_on}"
            )


def run_pcid(
    model: Model, analysis: Analysis, keep_recording: bool, progress: Progress, earlier: EarlierRun | None = None
) -> Outcome:
    """Partially constrained inverse dynamics (Shaban 2022, sec. 5): C_m and C_s hold, p is free.

    It goes on with an `earlier` run of the same analysis.

    Raises `InputError` where the trajectories cannot be followed.
    """

    def system(of: Model) -> MechanismSystem:
        return MechanismSystem(of, [*of.joints, *of.trajectories], of.loads, list(of.motors.values()))

    assembly = system(integrated(model))
    start = initial_state(assembly)
    check_smooth(assembly, analysis.end)
    check_reach(assembly, undeformed_state(assembly), analysis.times)
    recording = _core.Recording() if keep_recording else None
    resolver = resolver_of(assembly)
    return _integrate(assembly, system(model), analysis, start, None, resolver, recording, progress, earlier=earlier)


def run_forward(
    model: Model,
    analysis: Analysis,
    source: Outcome | None,
    actuator_set: ActuatorSet,
    progress: Progress,
    earlier: EarlierRun | None = None,
) -> Outcome:
    """Forward dynamics under given loads, and the actuation of the earlier analysis `source` where there is one.

    Where gears give, motors turn them, with the moments at the outputs of `source` and splines between these.
    It goes on with an `earlier` run of the same analysis.
    """
    exact = with_compliance(model)
    # The shape that FCID prescribes goes with the masses as they are.
    model = exact if source is not None and source.shape is not None else integrated(exact)
    if source is None:
        assembly, reported = (MechanismSystem(of, of.joints, of.loads) for of in (model, exact))
        start = initial_state(assembly)
        return _integrate(assembly, reported, analysis, start, None, None, None, progress, earlier=earlier)
    analysis, loads = as_long_as(source, analysis), model.loads
    if source.inversion is not None:
        loads = source.inversion.servo.loads
    rows, actuators = applied_actuators(model, analysis, source, actuator_set)
    sizes, moved = [ZERO] * len(rows), with_rotors(source, exact)
    if model.gears:
        check_applied(model, analysis)
        limits = motor_limits(model)
        sizes = drive_sizes(source, limits if analysis.limits else np.full_like(limits, np.inf))
        actuators = actuators[1:]  # without the motors
    drives = [*zip(rows, sizes, strict=True), *loads]
    assembly, reported = (MechanismSystem(of, of.joints, drives) for of in (model, exact))
    steering = _core.Actuation(actuation_source(source), actuators) if actuators else None
    factors = coordinate_factors(exact) if model is not exact else 1.0
    start = State(moved.q[0] * factors, moved.v[0] * factors)  # bodies and their order are the same
    return _integrate(assembly, reported, analysis, start, steering, None, None, progress, earlier)


def as_long_as(source: Outcome, analysis: Analysis) -> Analysis:
    """`analysis` with the pre- and, where it runs to the end of the path, the post-actuation of its source."""
    pre, post = source.analysis.pre_actuation, source.analysis.post_actuation
    post = post if analysis.end == source.analysis.end else None
    return analysis.model_copy(update={"pre_actuation": pre, "post_actuation": post})


def run_static(model: Model, analysis: Analysis) -> Outcome:
    """Equilibrium under gravity, loads and the trajectory constraints at t = 0, with the moments that hold it.

    The targets are frozen, so that the multipliers of the state at rest are those of the equilibrium.
    """
    held = [replace(c, target=_core.TimeFunction.constant(c.target(0.0)[0])) for c in model.trajectories]
    assembly = MechanismSystem(model, [*model.joints, *held], model.loads, list(model.motors.values()))
    state = static_equilibrium(assembly, undeformed_state(assembly))
    at_rest = State(state.q, np.zeros_like(state.q))
    return _integrate(assembly, assembly, analysis, at_rest, None, resolver_of(assembly), None, lambda _: True)


def initial_state(assembly: MechanismSystem) -> State:
    """The initial state the scene asks for."""
    start = undeformed_state(assembly)
    if assembly.model.scene.initial.state == "static":
        start = static_equilibrium(assembly, start)
    return start


def resolver_of(assembly: MechanismSystem) -> _core.ActuatorForces | None:
    """What turns trajectory forces into motor and modal forces; None where the motors do not fit the mechanism."""
    model = assembly.model
    if not model.trajectories or len(model.motors) != model.degrees_of_freedom:
        return None
    return _core.ActuatorForces(assembly.system, assembly.is_trajectory, assembly.motor_measures)


def _integrate(
    assembly: MechanismSystem,
    reported: MechanismSystem,
    analysis: Analysis,
    start: State,
    steering: _core.ExternalLoads | None,
    resolver: _core.ActuatorForces | None,
    recording: _core.Recording | None,
    progress: Progress,
    earlier: EarlierRun | None = None,
) -> Outcome:
    """Integrate `assembly`; the outcome is in the coordinates of `reported`, the same with masses as they are."""
    if earlier is not None and earlier.status == "completed":
        return replace(_taken_over(reported, analysis, earlier), integrated=assembly)
    if len(analysis.times) > 1 and (cause := lost_inertia(assembly, start.q)):
        raise SolveError(f'{assembly.model.scene.path}: analysis "{analysis.name}": at the start {cause}')
    began = time.perf_counter()
    if earlier is None:
        integrator, checkpoint = choose_integrator(assembly, analysis, start, steering), _core.Checkpoint()
    else:
        integrator, checkpoint, recording = earlier.integrator, earlier.checkpoint, earlier.recording
    run = _core.run(
        assembly.system, assembly.groups, assembly.moments, steering, analysis.times.tolist(), start.q, start.v,
        analysis.tolerance, analysis.max_steps, METHODS[integrator.name], analysis.spectral_radius, resolver, progress,
        recording, checkpoint,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    reached, held, status = len(run.q), len(assembly.constraints), STATUS[run.status]
    failed = status not in ("completed", "interrupted")
    cause = find_cause(assembly, run.time_reached, State(*np.split(run.last, 2))) if failed else ""
    if status == "step underflow" and not cause:
        cause = beyond_order(integrator, analysis)
    outcome = Outcome(
        analysis, assembly, analysis.times[:reached], run.q, run.v, run.a, run.multipliers[:, :held],
        run.tau if resolver else None, run.F_p if resolver else None, run.residual,
        status, run.steps, run.rejected, run.evaluations, seconds, integrator, run.time_reached, cause, recording,
        checkpoint=checkpoint, integrated=assembly,
    )  # fmt: skip
    outcome = in_coordinates_of(outcome, reported)
    return outcome if earlier is None else earlier.followed_by(outcome)


def in_coordinates_of(outcome: Outcome, reported: MechanismSystem) -> Outcome:
    """A motion with raised masses as one of `reported`, the same mechanism without."""
    if all(a is b for a, b in zip(outcome.assembly.model.bodies, reported.model.bodies, strict=True)):
        return outcome
    factors, F_p = coordinate_factors(reported.model), outcome.F_p
    return replace(
        outcome, assembly=reported, q=outcome.q / factors, v=outcome.v / factors, a=outcome.a / factors,
        F_p=None if F_p is None else F_p * modal_factors(reported.model),
    )  # fmt: skip


def _taken_over(assembly: MechanismSystem, analysis: Analysis, earlier: EarlierRun) -> Outcome:
    """The outcome of a run that had reached its end."""
    rows: dict[str, Any] = {"tau": None, "F_p": None} | dict(earlier.rows)
    return Outcome(
        analysis, assembly, **rows, **earlier.counts, status=earlier.status, integrator=earlier.integrator,
        recording=earlier.recording, checkpoint=earlier.checkpoint,
    )  # fmt: skip
