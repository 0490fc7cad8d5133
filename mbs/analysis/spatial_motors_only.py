"""Inverse dynamics in space with motors only, by stable inversion: see `motors_only`, whose record and rules it has."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cache, partial

import numpy as np

from ...common.arrays import Array, as_list
from ...common.errors import SolveError
from .. import _core
from ..model.spatial_gears import refuse_held_motors
from ..model.spatial_model import SpatialModel, row_values, without_paths
from ..scene.analysis import output_times
from ..solve.integrators import Choice
from ..solve.internal_dynamics import Stopped
from ..solve.spatial_servo import SpatialServo, make_spatial_servo
from ..solve.stable_inversion import Inversion, invert
from .context import Context
from .inverted_path import AroundPath, MotorsOnlyKeys, cause_of, check_rest, choose_output, durations, rests, where
from .outcome import Forces, Motion, Outcome, Prescription, Statistics
from .samples import path_times

NOTABLE = 1e-9  # m, rad: of a path that is left


def run_spatial_motors_only(context: Context, analysis: MotorsOnlyKeys) -> Outcome:
    """Motion and motor forces for the trajectories, no other force acting; before and after the path it is held.

    Raises `InputError` and `SolveError` as `motors_only.run_motors_only`, and `SolveError` where it is stopped before
    any motion is found.
    """
    model, began, reached = context.model, time.perf_counter(), 0.0
    place = where(model.scene.path, analysis)

    def progress(t: float | None = None) -> bool:
        nonlocal reached
        reached = reached if t is None else t
        return context.progress(reached)

    refuse_held_motors(model, analysis)
    try:
        servo, linear = choose_output(partial(make_spatial_servo, model, analysis.end, place, progress), analysis)
        needs_future = bool(linear.is_future[0].any())
        check_rest(servo, analysis, rests(analysis, needs_future))
        pre, post = durations(analysis, linear, needs_future)
        inversion = invert(servo, linear, pre, post, analysis.tolerance, progress)
    except Stopped:
        raise SolveError(f"{place}: stopped on request before any of its motion was found") from None
    times = output_times(analysis.end, analysis.output_step, pre, post)
    times = times[times <= inversion.curve.x[-1] + 1e-9 * analysis.end]  # what an integration reached
    run = _run(analysis, model, inversion, times)
    if not len(run.time):
        raise SolveError(f"{servo.where}: no motion was found ({inversion.status}): {cause_of(inversion)}")
    seconds = time.perf_counter() - began

    around = AroundPath(pre_actuation=pre, post_actuation=post, inversion=inversion)

    @cache
    def look_closer() -> Outcome:
        between = path_times(run.time, model.scene.trajectory, analysis.end)
        return replace(_run(analysis, model, inversion, between), details=around)

    statistics = replace(run.statistics, wall_seconds=seconds, warnings=_told(inversion, run))
    return replace(run, details=around, statistics=statistics, look_closer=look_closer)


def _run(analysis: MotorsOnlyKeys, model: SpatialModel, inversion: Inversion[SpatialServo], times: Array) -> Outcome:
    curve, servo = inversion.curve, inversion.servo
    modes = curve(times), curve.derivative(1)(times), curve.derivative(2)(times)
    found = servo.motion.motion(as_list(times), *modes, servo.postures(times))
    is_met = np.isfinite(found.q).all(axis=1)
    kept = slice(len(times) if is_met.all() else int(is_met.argmin()))

    def equations() -> _core.SpatialPrescribedMotion:
        return replace(servo).motion

    statistics = Statistics(
        inversion.status, Choice("collocation", ""), steps=len(curve.x) - 1, evaluations=inversion.iterations,
        cause=cause_of(inversion),
    )  # fmt: skip
    return Outcome(
        analysis=analysis,
        model=without_paths(model),
        motion=Motion(times, found.q, found.v, found.a, found.loops).at(kept),
        forces=Forces(required=found.required).at(kept),
        statistics=statistics,
        prescribed=Prescription(equations, inversion.shape, servo.near[0]),
    )


def path_errors(inversion: Inversion[SpatialServo], times: Array, q: Array) -> dict[str, Array]:
    """By trajectory how far (T, m) what follows it is off at `times` (T,) and q (T, n_q), in m or rad."""
    held = inversion.servo.model
    C, owners = row_values(held, q, times)[0], [row.owner if row.is_trajectory else "" for row in held.rows]
    return {path.name: C[:, [owner == path.name for owner in owners]] for path in held.scene.trajectory}


def _told(inversion: Inversion[SpatialServo], run: Outcome) -> tuple[str, ...]:
    """How far a redefined output leaves the path itself."""
    told = []
    if not run.failed and inversion.servo.factor < 1:
        off = max(float(np.abs(of).max(initial=0.0)) for of in path_errors(inversion, run.time, run.q).values())
        if off > NOTABLE:
            told.append(
                f"a point with {inversion.servo.factor:.2g} of the vibration follows the path: that of the trajectory"
                f" is off by up to {off:.3g} (m or rad)"
            )
    return tuple(told)
