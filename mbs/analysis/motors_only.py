"""Inverse dynamics with motors only: the analysis `kind = "motors-only"`.

`output = "tip"` follows the path exactly, by stable inversion with pre- and post-actuation where zeros lie in the right
half plane. `output = "redefined"` follows it with a point nearer the joints, and reports what that leaves at the tip:
the part of the vibration that the output does not see.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from ...common.arrays import Array, as_list
from .. import _core
from .._core import TimeFunction
from ..joints.measure import Measure
from ..model.model import Model
from ..scene.analysis import output_times
from ..solve.integrators import Choice
from ..solve.servo import Servo, make_servo
from ..solve.stable_inversion import Inversion, invert
from .context import AnyContext, Context
from .drive import Progress, motion_of
from .elastic_joints import add_transmission
from .inverted_path import AroundPath, MotorsOnlyKeys, cause_of, check_rest, choose_output, durations, rests, where
from .outcome import AnyOutcome, Forces, Statistics
from .planar_outcome import PlanarOutcome
from .samples import path_times
from .shapes import sampled
from .spatial_motors_only import run_spatial_motors_only


class MotorsOnly(MotorsOnlyKeys):
    """Motor torques that move the robot along its trajectories without patches (stable inversion).

    With `output` "tip" the points of the trajectories follow them; with "redefined" the points with `factor` times the
    vibration do. The default `factor` is nine tenths of the largest that is minimum phase. `pre_actuation` and
    `post_actuation` (s) are durations of torques before and after the path, which is constant there; by default the
    zero dynamics determines them. `check` as in `Pcid`.
    """

    def run(self, context: AnyContext) -> AnyOutcome:
        """Motion and moments."""
        if isinstance(context, Context):
            return run_spatial_motors_only(context, self)
        return add_transmission(run_motors_only(context.model, self, context.progress))


@dataclass(frozen=True, kw_only=True)
class InvertedPath(AroundPath):
    """How the path was inverted; `loads` are held before and after it."""

    inversion: Inversion[Servo]
    loads: tuple[tuple[Measure, TimeFunction], ...]

    def actuation_source(self, outcome: PlanarOutcome) -> _core.ActuationSource:
        """The motors' forces at any time, from p(t)."""
        return self.inversion.servo.source(self.inversion.shape)


def run_motors_only(model: Model, analysis: MotorsOnly, progress: Progress) -> PlanarOutcome:
    """Motion and motor forces for the trajectories, no other force acting.

    Raises `InputError` for a path that is not at rest where it has to be, motors that do not fit, a path out of reach,
    and a given factor whose output is not minimum phase; `SolveError` where no equilibrium or no motion is
    found.
    """
    began = time.perf_counter()
    servo, linear = choose_output(partial(make_servo, model, analysis.end, where(model.scene.path, analysis)), analysis)
    needs_future = bool(linear.is_future[0].any())
    check_rest(servo, analysis, rests(analysis, needs_future))
    pre, post = durations(analysis, linear, needs_future)
    inversion = invert(servo, linear, pre, post, analysis.tolerance, progress)
    return _outcome(
        analysis,
        InvertedPath(pre_actuation=pre, post_actuation=post, inversion=inversion, loads=servo.loads),
        time.perf_counter() - began,
    )


def path_error(inversion: Inversion[Servo], times: Array, q: Array) -> Array:
    """How far (T, components) the specified points, joints and angles themselves are from their path."""
    path = inversion.servo.path
    rest = np.zeros(q.shape[1])
    rows = [i for i, held in enumerate(path.is_trajectory) if held]
    return np.array([path.system.constraints(t, one, rest)[0][rows] for t, one in zip(times, q, strict=True)])


def _outcome(analysis: MotorsOnly, found: InvertedPath, seconds: float) -> PlanarOutcome:
    times = output_times(analysis.end, analysis.output_step, found.pre_actuation, found.post_actuation)
    outcome = _at(analysis, found, seconds, times)

    @cache
    def look_closer() -> PlanarOutcome:
        between = path_times(outcome.time, outcome.assembly.model.scene.trajectory, analysis.end)
        return _at(analysis, found, seconds, between)

    return replace(outcome, look_closer=look_closer)


def _at(analysis: MotorsOnly, found: InvertedPath, seconds: float, times: Array) -> PlanarOutcome:
    """The outcome at `times` (T,), s."""
    inversion, servo = found.inversion, found.inversion.servo
    inside = times <= inversion.curve.x[-1] + 1e-9 * analysis.end  # what an integration reached
    p, p_dot, p_ddot = sampled(inversion.shape, times[inside])
    run = _core.prescribed_outputs(
        servo.driven_tree.both, servo.motion, as_list(times[inside]), p, p_dot, p_ddot, servo.near[0]
    )
    reached = len(run.q)
    rows = slice(reached)
    how = "two-point problem" if inversion.linearisation.is_future[0].any() else "integrated forward"
    outcome = PlanarOutcome(
        analysis=analysis,
        assembly=servo.driven,
        motion=motion_of(servo.driven, run, times).at(rows),
        forces=Forces(tau=run.tau).at(rows),
        statistics=Statistics(
            status=inversion.status,
            integrator=Choice("collocation", how),
            steps=len(inversion.curve.x) - 1,
            evaluations=inversion.iterations,
            wall_seconds=seconds,
            time_reached=None if reached else float(inversion.curve.x[0]),
            cause=cause_of(inversion),
        ),
        details=found,
    )
    if not reached:  # an iteration that left the numbers: no motion to keep
        outcome.check_completed()
    return outcome
