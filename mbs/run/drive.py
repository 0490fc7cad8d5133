"""Running the integrators of the core from an initial state to an outcome: all kinds that integrate do it here."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from ...common.arrays import Array, Indices, as_list
from ...common.structs import struct
from .. import _core
from ..fields.waypoints import spline
from ..model.drives import NO_DRIVES, Command, Drives, PointDrive, Replayed
from ..model.known_motion import State
from ..model.model import Model
from ..model.motors import integrated_mechanism
from ..model.system import MultibodySystem, zero_order_hold
from ..posture.limits import left_ranges, watch_limits
from ..posture.posture import (
    NEARLY_SINGULAR,
    SINGULAR,
    describe_branches,
    describe_posture,
    robot_size,
    worst_posture,
)
from ..posture.reach import out_of_reach
from ..posture.start import rank_of_redundant_loops
from ..scene.analysis import Analysis, IntegratedAnalysis
from .diagnosis import find_cause
from .integrator_choice import choose_integrator
from .integrators import beyond_rounding, integration_controls, with_steps_of
from .record import Continuation, Run, Statistics
from .samples import (
    ALL_LOOKED_AT,
    LOOKED_AT,
    MANY,
    PARTS_OF_STEP,
    about_highest,
    in_order,
    new_samples,
    reached_samples,
    some_of,
    stops,
    telling,
)

Progress = Callable[[float], bool]
"""Called now and then with the time reached; False stops the run."""

POSTURES = 2001  # outputs whose postures are looked at where the core does not watch them

STATUS = {
    _core.IntegrationStatus.completed: "completed",
    _core.IntegrationStatus.step_underflow: "step underflow",
    _core.IntegrationStatus.too_many_steps: "too many steps",
    _core.IntegrationStatus.interrupted: "interrupted",
    _core.IntegrationStatus.diverged: "diverged",
}


@struct
class Control:
    """Commands to motors and patches from sample to sample."""

    commands: tuple[Command, ...]  # what a unit of each does
    first: Array  # (inputs,) before those of the first sample act
    times: Array  # (K,) s, of the samples; the commands of each act `delay` (s) later
    delay: float
    # commands (inputs,) from sample number, time and what was read: q (n_q,), v (n_v,), a (n_v,) in one
    controller: Callable[[int, float, Array], Array]
    held: Callable[[Array], Array]  # commands (T, inputs) that have acted up to times (T,), s, after a run
    instant: float  # s, before and after which commands are read where they change


def drive_robot(
    model: Model,
    analysis: IntegratedAnalysis,
    start: State,
    progress: Progress,
    *,
    drives: Drives = NO_DRIVES,
    warnings: tuple[str, ...] = (),
    times: Array | None = None,
    control: Control | None = None,
    earlier: Run | None = None,
    is_recorded: bool = False,
) -> Run:
    """The run of an integration from `start`, with outputs at `times`, those of the analysis where not given.

    Sampled `control` and `drives` act beside the loads of the scene. The rows of `model` hold. It ends early where
    `progress` says so, and in a posture in which the joints cannot follow the path, with a warning. It goes on with an
    `earlier` run of the same analysis. `is_recorded`: with its steps, for a replay.
    """
    times = analysis.times if times is None else times
    commands = control.commands if control is not None else ()
    system, began = MultibodySystem(model, drives, commands), time.perf_counter()
    is_sampled = control is not None
    integrator = with_steps_of(
        analysis,
        float(times[-1]),
        lambda: choose_integrator(system, analysis, start, len(times), is_sampled=is_sampled),
    )
    if earlier is not None:  # with the same candidates, and what they have become since
        known = earlier.statistics.integrator
        integrator = integrator._replace(name=known.name, reason=known.reason)
    controls = integration_controls(analysis, integrator)
    is_followed, is_replay = any(row.is_trajectory for row in model.rows), drives.replayed is not None
    paths = model.scene.trajectory if is_followed or is_replay else ()
    at_points = (size for drive in drives.at_points for size in drive.components.values())
    loads = (*model.scene.load_functions, *at_points)
    is_rigid = not any(node.body.n_modes for node in model.tree.nodes)
    ends = stops(times, paths, loads, is_driven=is_rigid and is_followed, is_replay=is_rigid and is_replay)
    controls.stops = as_list(ends)
    rows = system.integrated.rows
    loop_rank = None if is_rigid or not is_followed else rank_of_redundant_loops(model, rows)
    if loop_rank is None:
        system.integrated.scene.watch_posture([model.rows[k].is_trajectory for k in rows], robot_size(model))
    watch_limits(system.integrated.scene, model.tree)
    continuation = None if earlier is None else earlier.continuation
    if continuation is None:
        recording = _core.Recording() if is_recorded else None
        samples = new_samples(times, analysis, len(start.q) + len(start.v))
        continuation = Continuation(_core.TreeCheckpoint(), recording, samples)
    run = _integrated(system, times, start, controls, control, progress, continuation)
    motion = _motion(system, run, times, analysis)
    motion = motion if earlier is None else motion.after(earlier)
    in_posture = _ends_in_posture(run)
    posture = describe_posture(model, run.least_ratio, run.singular_at, run.singular_posture, is_end=in_posture)
    if loop_rank is not None and len(motion.time):
        some = np.unique(np.linspace(0, len(motion.time) - 1, POSTURES).astype(int))
        ratio, worst = worst_posture(model, motion.time[some], motion.q[some], loop_rank)
        at = motion.time[some[worst]], motion.q[some[worst]]
        posture = describe_posture(model, ratio, float(at[0]), at[1], is_end=False, loop_rank=loop_rank)
        posture = posture or describe_branches(model, motion.time[some], motion.q[some], loop_rank)
    cause = ""
    if in_posture:
        cause = f"{posture}: {out_of_reach(model, times) or 'move the path, or start in another posture'}"
    elif STATUS[run.status] not in ("completed", "interrupted"):
        cause = find_cause(system, analysis, integrator, run)
    scatter = beyond_rounding(analysis.tolerance, run.rounding)
    texts = (*warnings, *(text for text in (posture, scatter) if text))
    texts = (*texts, *left_ranges(model, run.ranges, motion.time, motion.q, motion.v))
    if (samples := continuation.samples) is not None and samples.every > 1:
        texts = (*texts, f"peaks and means are of one in {samples.every} steps: memory holds no more; shorten the run")
    statistics = Statistics(
        "diverged" if in_posture else STATUS[run.status], integrator.changed_in(run), run.steps, run.rejected,
        run.evaluations, time.perf_counter() - began, continuation.checkpoint.time if control is None else None, cause,
        np.array(run.step_ends), texts,
    )  # fmt: skip
    found = replace(
        motion,
        applied=drives.at_points,
        statistics=statistics if earlier is None else statistics.added_to(earlier.statistics),
        continuation=continuation if control is None else None,
    )
    numbers = _numbers(drives.replayed, run, found, 0 if earlier is None else len(earlier.time))
    acting = _under(drives, found, numbers)
    if (reached := reached_samples(continuation.samples, found.time)) is None:
        return acting

    @cache
    def look_closer() -> Run:
        between, more = _between(system, *reached, ends, found, control, progress=progress)
        order = in_order(found.time, between.time)
        return _under(drives, found.with_rows_of(between, order), np.concatenate([numbers, more])[order])

    return replace(acting, look_closer=look_closer)


def _numbers(replayed: Replayed | None, run: _core.TreeRun, found: Run, known: int) -> Array:
    """What a replay does (T, numbers) at outputs of `run`, of which those that were `known` say nothing."""
    if replayed is None:
        return np.zeros((len(found.time), 0))
    before = replayed.source.sample(as_list(found.time[:known]))
    return np.concatenate([before, run.replayed[known:]]) if known else run.replayed


def _under(drives: Drives, run: Run, numbers: Array) -> Run:
    """The run with what a replay does on joints and points at its times."""
    if drives.replayed is None or not len(run.time):
        return run
    acting = spline(run.time, numbers, 1)
    applied = (
        PointDrive(point, {component: acting[number] for component, number in of_point.items()})
        for point, of_point in drives.replayed.at_points.items()
    )
    commanded = {joint: numbers[:, list(columns)] for joint, columns in drives.replayed.moments.items()}
    return replace(run, commanded=commanded, applied=(*drives.at_points, *applied))


def _between(
    system: MultibodySystem,
    times: Array,
    states: Array,
    ends: Array,
    found: Run,
    control: Control | None,
    *,
    progress: Progress,
) -> tuple[Run, Array]:
    """The run at `times` (k,) of it, with `states` (k, n), and what a replay does there (T, numbers).

    `ends` of steps, s, are among what is looked at. Of long loops the rest is left out once `progress` says so.
    """
    core, scene, _ = system.integrated
    if control is not None:
        times, states, both = _with_both_sides(times, states, control.times + control.delay, control.instant)
        ends = np.append(ends, both)

    def at(rows: Indices) -> _core.TreeRun:
        chosen, of_rows = as_list(times[rows]), np.ascontiguousarray(states[rows])
        if control is None:
            return _core.tree_outputs(core, scene, chosen, of_rows, system.replay)
        held = zero_order_hold(system.model, control.commands)
        return _core.tree_outputs_under(core, scene, chosen, of_rows, held, control.held(times[rows]))

    # what rings between samples of a controller has peaks and means of its own there
    joints = system.model.tree.joint_columns
    rates = states[:, -len(joints) :][:, joints]
    is_long = len(times) > ALL_LOOKED_AT and not found.analysis.is_repeated
    if control is not None and is_long:
        motion = _telling_motion(system, at, times, found.analysis, progress)
        return motion, np.zeros((len(motion.time), 0))
    some = some_of(times, rates, ends, LOOKED_AT if control is None else PARTS_OF_STEP * ALL_LOOKED_AT)
    if is_long:
        some = np.union1d(some, telling(times, states, np.abs(states).max(axis=0)))
    run = at(some)
    motion, replayed = _motion(system, run, times[some], found.analysis), run.replayed
    if (more := np.setdiff1d(about_highest(some, np.hstack([motion.multipliers, motion.a[:, joints]])), some)).size:
        others, order = at(more), np.argsort(np.concatenate([some, more]))
        motion = motion.with_rows_of(_motion(system, others, times[more], found.analysis), order)
        replayed = np.concatenate([replayed, others.replayed])[order]
    return motion, replayed


def _telling_motion(
    system: MultibodySystem,
    at: Callable[[Indices], _core.TreeRun],
    times: Array,
    analysis: Analysis,
    progress: Progress,
) -> Run:
    """The motion at those of `times` (k,), s, from which it follows at the others; `at` has it at rows."""
    sizes = np.zeros(1)  # of each column, so far

    def thinned(motion: Run) -> Run:
        nonlocal sizes
        values = np.hstack([motion.q, motion.v, motion.a, motion.multipliers])
        sizes = np.maximum(sizes, np.abs(values).max(axis=0))
        return motion.at(telling(motion.time, values, sizes))

    blocks = (np.arange(first, min(first + MANY, len(times))) for first in range(0, len(times), MANY))
    parts = []
    for rows in blocks:
        parts.append(thinned(_motion(system, at(rows), times[rows], analysis)))
        if not progress(float(times[-1])):
            break
    names = ("time", "q", "v", "a", "multipliers")
    states = {name: np.concatenate([getattr(of, name) for of in parts]) for name in names}
    return thinned(replace(parts[0], **states))


def _with_both_sides(times: Array, states: Array, changes: Array, instant: float) -> tuple[Array, Array, Array]:
    """Times (k,), s, and states (k, n), with the instants before commands change, at `changes` (m,), s, beside these.

    And those on both sides of changes, by which means over time are, where they are not too many.
    """
    near = np.clip(np.searchsorted(times, changes - instant), 0, len(times) - 1)
    near = near[np.abs(times[near] - changes) < instant]
    before = times[near] - 2.0 * instant
    every = np.append(times, before)
    order = np.argsort(every, kind="stable")
    both = np.append(before, times[near]) if len(near) < LOOKED_AT else before[:0]
    return every[order], np.concatenate([states, states[near]])[order], both


def _motion(system: MultibodySystem, run: _core.TreeRun, times: Array, analysis: Analysis) -> Run:
    """The motion of a run of the core, as far as it got."""
    q, v = (np.ascontiguousarray(part) for part in np.split(run.states, [system.model.tree.n_q], axis=1))
    return Run(
        analysis=analysis,
        model=system.model,
        time=times[: len(q)],
        q=q,
        v=v,
        a=run.accelerations,
        multipliers=system.multipliers(run.multipliers),
    )


def _ends_in_posture(run: _core.TreeRun) -> bool:
    """Whether a posture ended the run: joints cannot follow there, or steps vanish next to it as none leads across."""
    if STATUS[run.status] == "step underflow" and run.singular_at == run.time_reached:
        return run.least_ratio < NEARLY_SINGULAR
    return STATUS[run.status] == "diverged" and run.least_ratio < SINGULAR


def _integrated(
    system: MultibodySystem,
    times: Array,
    start: State,
    controls: _core.IntegrationControls,
    control: Control | None,
    progress: Progress,
    continuation: Continuation,
) -> _core.TreeRun:
    core, scene, _ = system.integrated
    if control is None:
        motion: Callable[..., _core.TreeRun] = _core.tree_motion  # core and motors are of one space
        # Where motors take the place of forces on a path their errors count, too
        is_followed = any(row.is_trajectory for row in system.model.rows) and system.model.motors
        return motion(
            core, scene, as_list(times), start.q, start.v, controls, progress, continuation.checkpoint,
            continuation.samples, continuation.recording, system.replay,
            integrated_mechanism(system) if is_followed else None,
        )  # fmt: skip
    return _core.tree_sampled(
        model=core, scene=scene, times=as_list(times), q=start.q, v=start.v, controls=controls,
        carry_on=progress, held=zero_order_hold(system.model, control.commands), first_command=control.first,
        samples=as_list(control.times), delay=control.delay, controller=control.controller,
        between=continuation.samples,
    )  # fmt: skip
