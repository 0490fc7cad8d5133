"""Running the integrators of the core from an initial state to an outcome: all kinds that integrate do it here.

Joint coordinates are integrated, and outputs evaluated in them (`model.planar_tree`).
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np

from ...common.arrays import Array, Indices, as_list
from .. import _core
from ..model.model import Model
from ..model.planar_tree import PlanarTree, told_in_joints
from ..model.system import MechanismSystem
from ..scene.analysis import IntegratedAnalysis
from ..solve.diagnosis import find_cause
from ..solve.initial_state import undeformed_state
from ..solve.integrators import Choice, beyond_order, choose_integrator, integration_controls, unmet, with_steps_of
from ..solve.state import State
from ..solve.statics import static_equilibrium
from .earlier_check import Datasets, check_earlier, going_on
from .outcome import Continuation, EarlierRun, Forces, Motion, Statistics
from .planar_outcome import PlanarOutcome
from .samples import new_samples, reached_samples, stops, worth_a_look

Progress = Callable[[float], bool]
"""Called now and then with the time reached; False stops the run."""

STATUS = {
    _core.IntegrationStatus.completed: "completed",
    _core.IntegrationStatus.step_underflow: "step underflow",
    _core.IntegrationStatus.too_many_steps: "too many steps",
    _core.IntegrationStatus.interrupted: "interrupted",
    _core.IntegrationStatus.diverged: "diverged",
}


@dataclass(frozen=True)
class SampledControl:
    """What acts on the motors and patches of a system from sample to sample.

    Attributes:
        motors: how many there are; the first loads of the system are theirs.
        voltages: body number and Φ_V (n, k) of its patches; more rows are those of the bodies after it.
        first: (inputs,) commands before those of the first sample act.
        sensing: what is read of the state.
        times: (K,) s, of the samples; the commands of each act `delay` (s) later.
        controller: commands (inputs,) from sample number, time and readings.
        held: commands (T, inputs) that have acted up to times (T,), s, after a run.
    """

    motors: int
    voltages: Sequence[tuple[int, Array]]
    first: Array
    sensing: _core.Sensing
    times: Array
    delay: float
    controller: Callable[[int, float, Array], Array]
    held: Callable[[Array], Array]


def drive(
    assembly: MechanismSystem,
    analysis: IntegratedAnalysis,
    start: State,
    progress: Progress,
    *,
    reported: MechanismSystem | None = None,
    times: Array | None = None,
    steering: _core.ExternalLoads | None = None,
    control: SampledControl | None = None,
    finds_forces: bool = False,
    recording: _core.Recording | None = None,
    earlier: EarlierRun | None = None,
) -> PlanarOutcome:
    """The outcome of an integration with outputs at `times`, those of the analysis where not given.

    It is in the coordinates of `reported`, the same mechanism with masses as they are, where those of `assembly` are
    raised.

    Under `steering` from outside, or sampled `control`. `finds_forces`: of the motors, and on modes, in place of those
    of trajectories. It goes on with an `earlier` run of the same analysis. An integration that ends early is kept with
    its cause. Raises `InputError` for what joint coordinates cannot tell.
    """
    times = analysis.times if times is None else times
    motors = len(assembly.motor_measures) if finds_forces else None
    tree = told_in_joints(assembly, analysis.kind, assembly.model.motors.values() if finds_forces else ())
    if earlier is not None:
        sizes, datasets = (tree.core.n_v, tree.core.n_v), _datasets(assembly, earlier, motors)
        check_earlier(earlier, times, sizes, datasets, is_recorded=recording is not None)
    if earlier is not None and earlier.statistics.status == "completed":
        found = PlanarOutcome(
            analysis=analysis,
            assembly=reported or assembly,
            motion=earlier.motion,
            forces=earlier.forces,
            statistics=earlier.statistics,
            continuation=earlier.continuation,
            integrated=None if reported is None else assembly,
        )
        return _with_samples(found, replace(found, assembly=assembly), tree, earlier.continuation, steering, control)
    began = time.perf_counter()
    integrator = with_steps_of(
        analysis, float(times[-1]), lambda: choose_integrator(assembly, analysis, start, steering, len(times))
    )
    continuation = Continuation(_core.TreeCheckpoint(), recording, new_samples(times, analysis))
    if earlier is not None:  # with the same candidates, and what they have become since
        known, continuation = earlier.statistics.integrator, earlier.continuation
        integrator = replace(integrator, name=known.name, reason=known.reason)
    with going_on(earlier, times):
        controls = integration_controls(analysis, integrator)
        paths = assembly.model.scene.trajectory if any(assembly.is_trajectory) else ()
        controls.stops = as_list(stops(times, paths, (size for _, size in assembly.model.loads)))
        run = _integrated(tree, start, times, controls, steering, control, continuation, progress)
    seconds, integrator = time.perf_counter() - began, integrator.changed_in(run)
    statistics = statistics_of(assembly, run, integrator, seconds)
    if statistics.status == "step underflow" and not statistics.cause:
        statistics = replace(statistics, cause=beyond_order(integrator, analysis) or unmet(integrator, run))
    outcome = PlanarOutcome(
        analysis=analysis,
        assembly=assembly,
        motion=motion_of(assembly, run, times),
        forces=Forces(run.tau, run.F_p) if finds_forces else Forces(),
        statistics=statistics,
        continuation=continuation if control is None else None,
    )
    found = outcome if reported is None else outcome.in_coordinates_of(reported)
    found = found if earlier is None else _joined(earlier, found)
    return _with_samples(found, outcome, tree, continuation, steering, control)


def _with_samples(
    found: PlanarOutcome,
    integrated: PlanarOutcome,
    tree: PlanarTree,
    continuation: Continuation,
    steering: _core.ExternalLoads | None,
    control: SampledControl | None,
) -> PlanarOutcome:
    """`found`, which was `integrated` in its own coordinates, with what it does at samples between outputs."""
    if (reached := reached_samples(continuation.samples, found.time)) is None:
        return found

    @cache
    def look_closer() -> PlanarOutcome:
        return found.among(_between(tree, *reached, integrated, steering, control).in_coordinates_of(found.assembly))

    return replace(found, look_closer=look_closer)


def _datasets(assembly: MechanismSystem, earlier: EarlierRun, motors: int | None) -> Datasets:
    """What `earlier` has to have of `assembly`, with forces of so many motors."""
    motion, forces, n = earlier.motion, earlier.forces, assembly.system.coordinates
    modes = sum(body.n_modes for body in assembly.model.bodies)
    return {
        "q": (motion.q, n),
        "v": (motion.v, n),
        "a": (motion.a, n),
        "lambda_": (motion.multipliers, len(assembly.constraints)),
        "residual": (motion.residual, 3),
        "tau": (forces.tau, motors),
        "F_p": (forces.F_p, None if motors is None else modes),
    }


def _between(
    tree: PlanarTree,
    times: Array,
    states: Array,
    outcome: PlanarOutcome,
    steering: _core.ExternalLoads | None,
    control: SampledControl | None,
) -> PlanarOutcome:
    """The outcome at `times` (k,) of its run, with `states` (k, n)."""

    def at(rows: Indices) -> _core.Run:
        found = as_list(times[rows]), np.ascontiguousarray(states[rows])
        if control is None:
            return tree.both.outputs(*found, steering)
        return tree.both.outputs_under(*found, control.motors, control.voltages, control.held(times[rows]))

    def read(rows: Indices) -> Array:
        run = at(rows)
        return np.hstack([x for x in (run.multipliers, run.tau, run.F_p) if len(x) == len(rows)])

    rows = worth_a_look(len(times), read)
    run, forces = at(rows), outcome.forces
    forces = forces if forces.tau is None else Forces(run.tau, run.F_p)
    return replace(outcome, motion=motion_of(outcome.assembly, run, times[rows]), forces=forces)


def _integrated(
    tree: PlanarTree,
    start: State,
    times: Array,
    controls: _core.IntegrationControls,
    steering: _core.ExternalLoads | None,
    control: SampledControl | None,
    continuation: Continuation,
    progress: Progress,
) -> _core.Run:
    q, v = tree.state(start.q, start.v)
    common: dict[str, Any] = {"times": as_list(times), "q": q, "v": v, "controls": controls, "carry_on": progress}
    if control is None:
        return _core.run_tree(
            tree.both, **common, external_loads=steering, recording=continuation.recording,
            checkpoint=continuation.checkpoint, samples=continuation.samples,
        )  # fmt: skip
    return _core.run_tree_sampled(
        tree.both, **common, motors=control.motors, patches=control.voltages, first_command=control.first,
        sensing=control.sensing, samples=as_list(control.times), delay=control.delay, controller=control.controller,
        between=continuation.samples,
    )  # fmt: skip


def motion_of(assembly: MechanismSystem, run: _core.Run, times: Array) -> Motion:
    """The motion of a run of the core, as far as it got."""
    return Motion(times[: len(run.q)], run.q, run.v, run.a, run.multipliers, run.residual)


def statistics_of(assembly: MechanismSystem, run: _core.Run, integrator: Choice, seconds: float) -> Statistics:
    """How a run of the core went, and why it ended where it failed."""
    status, cause = STATUS[run.status], ""
    if status not in ("completed", "interrupted"):
        cause = find_cause(assembly, run.time_reached, State(*np.split(run.last, [assembly.system.coordinates])))
    return Statistics(
        status, integrator, run.steps, run.rejected, run.evaluations, seconds, run.time_reached, cause,
        np.array(run.step_ends),
    )  # fmt: skip


def _joined(earlier: EarlierRun, later: PlanarOutcome) -> PlanarOutcome:
    """`later`, which went on from the checkpoint of `earlier`: its rows before that mean nothing."""
    return replace(
        later,
        motion=earlier.motion.followed_by(later.motion),
        forces=earlier.forces.followed_by(later.forces),
        statistics=later.statistics.added_to(earlier.statistics),
    )


def initial_state(assembly: MechanismSystem) -> State:
    """The initial state the scene asks for."""
    start = undeformed_state(assembly)
    if assembly.model.scene.initial.state == "static":
        start = static_equilibrium(assembly, start)
    return start


def motors_fit(model: Model) -> bool:
    """Whether there is a path, and its forces can be told as those of the motors and on modes."""
    return bool(model.trajectories) and len(model.motors) == model.degrees_of_freedom
