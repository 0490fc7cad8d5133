"""The analyses of a scene: partially constrained inverse dynamics, forward dynamics, statics."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from ..errors import SolveError
from . import _core
from .initial_state import State, check_reach, undeformed_state
from .integrators import METHODS, Choice, choose_integrator
from .model import ZERO, Array, Assembly, Model
from .rows import Row
from .scene_records import Analysis
from .statics import static_equilibrium

Progress = Callable[[float], bool]
"""Called now and then with the time reached; False stops the run."""

_STATUS = {
    _core.IntegrationStatus.completed: "completed",
    _core.IntegrationStatus.step_underflow: "step underflow",
    _core.IntegrationStatus.too_many_steps: "too many steps",
    _core.IntegrationStatus.interrupted: "interrupted",
    _core.IntegrationStatus.diverged: "diverged",
}
_ADVICE = {
    "step underflow": "no step is small enough there: the motion turns singular (a stretched arm, a jump in a"
    " trajectory) or the load grows without bound",
    "too many steps": "raise max_steps, loosen the tolerance or leave out high modes",
    "interrupted": "stopped on request",
    "diverged": "a link is bent by as much as it is long, which small deformations do not describe: loads beyond"
    " buckling, a spin that needs geometric_stiffening = true, or an arm without motors that falls apart",
}


@dataclass(frozen=True)
class Outcome:
    """What an analysis computed, one row per output time; bodies side by side in the columns of q, v, a, F_p."""

    analysis: Analysis
    assembly: Assembly
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
    recording: _core.Recording | None = field(default=None, repr=False)

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

    def check_completed(self) -> None:
        """Raise `SolveError` with advice unless the run reached its end."""
        if self.status != "completed":
            raise SolveError(
                f'{self.assembly.model.scene.path}: analysis "{self.analysis.name}" ended at t = {self.time[-1]:g} s'
                f" ({self.status}): {_ADVICE[self.status]}"
            )


def run_pcid(model: Model, analysis: Analysis, keep_recording: bool, progress: Progress) -> Outcome:
    """Partially constrained inverse dynamics (Shaban 2022, sec. 5): C_m and C_s hold, p is free.

    Raises `InputError` where the trajectories cannot be followed.
    """
    assembly = Assembly(model, [*model.joints, *model.trajectories], model.loads, list(model.motors.values()))
    start = initial_state(assembly)
    check_reach(assembly, undeformed_state(assembly), analysis.times)
    recording = _core.Recording() if keep_recording else None
    return _integrate(assembly, analysis, start, None, _resolver(assembly), recording, progress)


def run_forward(
    model: Model,
    analysis: Analysis,
    source: Outcome | None,
    projector: Mapping[str, Array],
    progress: Progress,
) -> Outcome:
    """Forward dynamics under given loads, and the actuation of the earlier analysis `source` where there is one.

    `projector[body]` (n, n) is what the patches of a body make of the modal forces asked of them.
    """
    steered, applied = _steered_rows(model, analysis, source)
    assembly = Assembly(model, model.joints, [*((row, ZERO) for row in steered), *model.loads])
    steering = None
    if source is not None:
        assert source.recording is not None
        inverse = source.assembly
        resolver = _core.ActuationResolver(inverse.system, inverse.is_trajectory, inverse.motor_rows)
        steering = _core.ReplayedActuation(
            inverse.system,
            source.recording,
            resolver,
            inverse.is_trajectory,
            applied,
            [projector.get(body.name, np.zeros((0, 0))) for body in model.bodies],
        )
        start = _transfer(source)
    else:
        start = initial_state(assembly)
    replayed = source.integrator if source else None
    return _integrate(assembly, analysis, start, steering, None, None, progress, replayed)


def run_static(model: Model, analysis: Analysis) -> Outcome:
    """Equilibrium under gravity, loads and the trajectory constraints at t = 0, with the moments that hold it.

    The targets are frozen, so that the multipliers of the state at rest are those of the equilibrium.
    """
    held = [replace(c, target=_core.TimeFunction.constant(c.target(0.0)[0])) for c in model.trajectories]
    assembly = Assembly(model, [*model.joints, *held], model.loads, list(model.motors.values()))
    state = static_equilibrium(assembly, undeformed_state(assembly))
    at_rest = State(state.q, np.zeros_like(state.q))
    return _integrate(assembly, analysis, at_rest, None, _resolver(assembly), None, lambda _: True)


def initial_state(assembly: Assembly) -> State:
    """The initial state the scene asks for."""
    start = undeformed_state(assembly)
    if assembly.model.scene.initial.state == "static":
        start = static_equilibrium(assembly, start)
    return start


def _resolver(assembly: Assembly) -> _core.ActuationResolver | None:
    """What turns trajectory forces into motor and modal forces; None where the motors do not fit the mechanism."""
    model = assembly.model
    if not model.trajectories or len(model.motors) != model.rigid_freedom:
        return None
    return _core.ActuationResolver(assembly.system, assembly.is_trajectory, assembly.motor_rows)


def _steered_rows(model: Model, analysis: Analysis, source: Outcome | None) -> tuple[list[Row], _core.AppliedActuation]:
    """Rows along which the recorded actuation acts, in the order in which the core replays it."""
    match analysis.apply:
        case "trajectory":
            assert source is not None
            rows = [c.row for c in source.assembly.constraints if c.is_trajectory]
            return rows, _core.AppliedActuation.trajectory
        case "joints+pzt":
            return list(model.motors.values()), _core.AppliedActuation.joints_and_patches
        case "joints":
            return list(model.motors.values()), _core.AppliedActuation.joints
    return [], _core.AppliedActuation.joints


def _transfer(source: Outcome) -> State:
    """The first state of an earlier analysis: bodies and their order are the same."""
    return State(source.q[0].copy(), source.v[0].copy())


def _integrate(
    assembly: Assembly,
    analysis: Analysis,
    start: State,
    steering: _core.Steering | None,
    resolver: _core.ActuationResolver | None,
    recording: _core.Recording | None,
    progress: Progress,
    replayed: Choice | None = None,
) -> Outcome:
    began = time.perf_counter()
    integrator = choose_integrator(assembly, analysis, start, replayed)
    run = _core.run(
        assembly.system, assembly.groups, assembly.moments, steering, analysis.times.tolist(), start.q, start.v,
        analysis.tolerance, analysis.max_steps, METHODS[integrator.name], analysis.spectral_radius, resolver, progress,
        recording,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    reached = len(run.q)
    return Outcome(
        analysis, assembly, analysis.times[:reached], run.q, run.v, run.a, run.multipliers,
        run.tau if resolver else None, run.F_p if resolver else None, run.residual,
        _STATUS[run.status], run.steps, run.rejected, run.evaluations, seconds, integrator, recording,
    )  # fmt: skip
