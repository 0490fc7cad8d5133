"""Inverse dynamics with motors only: the analysis `kind = "motors-only"`. SI units.

`output = "tip"` follows the path exactly, by stable inversion with pre- and post-actuation where zeros lie in the right
half plane. `output = "redefined"` follows it with a point nearer the joints; the rest of the vibration is at the tip.
"""

import math
import time
from collections.abc import Iterable
from dataclasses import KW_ONLY, replace
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array, PPoly
from ...common.errors import InputError, SolveError
from ...common.keys import MOST_OUTPUTS
from ...common.structs import struct
from .._core import TimeFunction
from ..fields.field_types import NotNegative
from ..fields.functions import check_domain
from ..fields.waypoints import spline
from ..model.gears import refuse_prescribed_motors
from ..model.model import Model
from ..run.context import Context
from ..run.integrators import Choice
from ..run.record import ADVICE, Details, Prescription, Run, Statistics
from ..scene.analysis import Analysis, Check, Robustness, TimedAnalysis, output_times
from .servo import Servo, Stopped, make_servo
from .stable_inversion import Inversion, invert
from .zero_dynamics import GROWTH, SAMPLES, Linearisation, is_unstable, linearise, shape_along

DECAY = 23.0  # times the slowest time constant of zeros: what is left is 1e-10
INFINITE = (
    "where a zero of the modes passes through infinity: take another number of modes in the link files, or output ="
    ' "redefined"'
)
REST = 1e-9  # speed of a path at rest, relative to its values over the time of the path


@struct
class AroundPath(Details):
    """Pre- and post-actuation times of motors, s, the robot `held` on its path, and the inversion of that."""

    _: KW_ONLY
    pre_actuation: float
    post_actuation: float
    held: Model
    inversion: Inversion | None = None


def is_minimum_phase(linear: Linearisation) -> bool:
    """Whether no zero is in the right half plane at rest, and none grows more than e-fold along the path."""
    at_rest = linear.zeros[[0, -1]]
    grows = linear.zeros.real.max() * linear.times[-1] > GROWTH
    return not (is_unstable(at_rest).any() or grows)


def describe_zeros(linear: Linearisation) -> str:
    """The zeros in the right half plane, 1/s, where one grows fastest; of many the slowest four."""
    row = max(linear.zeros, key=lambda s: float(s.real.max()))
    unstable = row[is_unstable(row)]
    shown = ", ".join(f"{s.real:.4g}{f' ± {s.imag:.4g}i' if s.imag > 0 else ''}" for s in unstable if s.imag >= 0)
    return shown if len(shown) < 120 else ", ".join(shown.split(", ")[:4]) + f" … ({len(unstable)} in all)"


def check_rest(servo: Servo, analysis: TimedAnalysis, ends: Iterable[float]) -> None:
    """Raise `InputError` for a path that moves at one of the `ends` (s), where the robot has to be at rest."""
    targets = ((path.name, *target) for path in servo.model.scene.trajectory for target in path.targets)
    for name, component, function in targets:
        largest = np.abs(function.sample(np.linspace(0.0, analysis.end, 101))[0]).max()
        for t in ends:
            rate = function(t)[1]
            if abs(rate) * analysis.end > REST * largest:
                raise InputError(
                    f'trajectory "{name}": {component}: expected a path at rest at t ='
                    f' {t:g} s, before or after which "{analysis.name}" holds it',
                    f"the rate {rate:.4g}: start and end with zero speed, as 10*s**3 - 15*s**4 + 6*s**5 does",
                )


def decay_times(linear: Linearisation, *, needs_future: bool) -> tuple[float, float]:
    """Times (s) of the zero dynamics around the path: growing parts begin before it, decaying ones end after it.

    The latter counts if the input `needs_future` values of the path; else it is 0.
    """
    first, last, light, end = linear.zeros[0].real, linear.zeros[-1].real, linear.is_light[0], float(linear.times[-1])
    is_ahead = linear.is_future[0] & (first > 0)
    grow, growing_vibrations, decay = first[is_ahead & ~light], first[is_ahead & light], -last[last < 0]
    pre = max(DECAY / grow.min(initial=np.inf), min(DECAY / growing_vibrations.min(initial=np.inf), end))
    return pre, min(DECAY / decay.min(initial=np.inf), end) if needs_future else 0.0


def durations(linear: Linearisation, given: Iterable[float | None], step: float) -> tuple[float, float]:
    """Pre- and post-actuation (s): as `given`, or as long as the zero dynamics lasts; multiples of `step` (s)."""
    automatic = decay_times(linear, needs_future=bool(linear.is_future[0].any()))
    chosen = (duration if value is None else value for value, duration in zip(given, automatic, strict=True))
    before, after = (math.ceil(time / step - 1e-9) * step for time in chosen)
    return before, after


def cause_of(inversion: Inversion) -> str:
    """Why no motion was found, and when: zeros change sides or pass infinity, no convergence; else ""."""
    linear, is_coarse = inversion.linearisation, inversion.status == "mesh too coarse"
    if not is_coarse and inversion.status != "inversion not converged":
        return ""
    count = (linear.is_future if linear.is_light.any() else is_unstable(linear.zeros)).sum(axis=1)
    changed = np.flatnonzero(count != count[0])
    if not is_coarse and linear.singular_after:
        k = linear.singular_after[0]
        return f"singular coupling between t = {linear.times[k]:.4g} and {linear.times[k + 1]:.4g} s, {INFINITE}"
    if is_coarse or not len(changed):
        texts = *inversion.servo.model.sticking, ADVICE[inversion.status]
        return f"{'; '.join(texts)} (worst at t = {inversion.worst:.4g} s)"
    k = int(changed[0])
    return (
        f"zeros change sides along the path: {count[0]} of them are in the right half plane at t = 0, {count[k]} at t"
        f" = {linear.times[k]:.4g} s, so a bounded motion may not exist. Leave out axial and high modes (modes.family"
        ' = "in-plane-bending" and fewer of them in the link files), or use output = "redefined"'
    )


FACTOR_STEP = 0.02  # of the search for the largest factor
MARGIN = 0.9  # of it that is taken: at the limit hardly damped motions are excited most
SINGULAR = 1e-13  # of M of the internal dynamics, scaled
PATH_TOLERANCE = 1e-9  # rad, or sizes of the robot: of a path that is left


class MotorsOnly(TimedAnalysis):
    """Motor torques that move the robot along its trajectories without patches (stable inversion)."""

    kind: Literal["motors-only"]
    output: Literal["tip", "redefined"] = "tip"
    """Tracked output: points of the trajectories, or their positions with `factor` times the vibration."""
    factor: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    """Share of the vibration in the "redefined" output; by default nine tenths of the largest that is minimum phase."""
    pre_actuation: NotNegative | None = None
    """Duration of torques before the path begins, s; by default from the zero dynamics."""
    post_actuation: NotNegative | None = None
    """Duration of torques after the path, s; by default from the zero dynamics."""
    check: Check = None
    """Forward simulation under the result with twice the modes ("finer")."""
    robustness: Robustness | None = None
    """Simulations under the result where the robot is not its model."""

    is_integrated = True
    applicable = ("joints",)
    supplies_all = True
    follows_jerk = True

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.factor is not None and self.output != "redefined":
            raise ValueError(f'expected the key "factor" only with output = "redefined", found "{self.output}"')
        more = (self.pre_actuation or 0.0) + (self.post_actuation or 0.0)
        if self.output_step and (self.end + more) / self.output_step > MOST_OUTPUTS:
            raise ValueError(f"expected at most {MOST_OUTPUTS} outputs, found {more:g} s of pre- and post-actuation")
        return self

    @property
    def times(self) -> Array:
        """Output times (T,), s: from 0 to `end`, extended by pre- and post-actuation where these are given."""
        return output_times(self.end, self.output_step, self.pre_actuation or 0.0, self.post_actuation or 0.0)

    def run(self, context: Context) -> Run:
        """Motion and motor forces for the trajectories, which rest before and after the path; no other force acts.

        Raises `InputError` for a path that is not at rest where it has to be, motors that do not fit, a path out of
        reach, and a given factor whose output is not minimum phase; `SolveError` where no equilibrium or no motion is
        found.
        """
        model, began, reached = context.model, time.perf_counter(), 0.0

        def progress(t: float | None = None) -> bool:
            nonlocal reached
            reached = reached if t is None else t
            return context.progress(reached)

        refuse_prescribed_motors(model, self)
        try:
            servo, linear = _choose_output(make_servo(model, self.end, progress), self)
            is_at_rest_later = linear.is_future[0].any() or self.post_actuation
            check_rest(servo, self, [0.0, self.end] if is_at_rest_later else [0.0])
            pre, post = durations(linear, (self.pre_actuation, self.post_actuation), self.output_step)
            times = output_times(self.end, self.output_step, pre, post)
            for k, load in enumerate(model.scene.load, 1):  # a scene does not know its pre-actuation
                for component, function in load.components.items():
                    check_domain(function, times, f"{model.scene.path}: load no. {k}: {component}", 0)
            inversion = invert(servo, linear, pre, post, self.tolerance, progress)
        except Stopped:
            raise SolveError("stopped on request before any of its motion was found") from None
        times = times[times <= inversion.curve.x[-1] + 1e-9 * self.end]  # what an integration reached
        run = _run(self, model, inversion, times)
        if not len(run.time):
            raise SolveError(f"no motion was found ({inversion.status}): {cause_of(inversion)}")
        around = AroundPath(pre_actuation=pre, post_actuation=post, inversion=inversion, held=inversion.servo.model)
        warnings = _warnings(inversion, run)
        statistics = replace(run.statistics, wall_seconds=time.perf_counter() - began, warnings=warnings)
        run = replace(run, details=around, statistics=statistics)
        return run.with_look(lambda between: replace(_run(self, model, inversion, between), details=around))


def _run(analysis: MotorsOnly, model: Model, inversion: Inversion, times: Array) -> Run:
    how = "two-point problem" if inversion.linearisation.is_future[0].any() else "integrated forward"
    statistics = Statistics(
        inversion.status,
        Choice("collocation", how),
        steps=len(inversion.curve.x) - 1,
        evaluations=inversion.iterations,
        cause=cause_of(inversion),
    )
    return outcome_along(inversion.curve, inversion.servo, analysis, model, statistics, times)


def outcome_along(
    curve: PPoly, servo: Servo, analysis: Analysis, model: Model, statistics: Statistics, times: Array
) -> Run:
    """The motion whose modes follow `curve` (n,), m·√kg, at `times` (T,), s, up to the first without a posture."""
    modes = curve(times), curve(times, 1), curve(times, 2)
    states = servo.motion.motion(times.tolist(), *modes, servo.postures(times))
    is_met = np.isfinite(states.q).all(axis=1)
    kept = slice(len(times) if is_met.all() else int(is_met.argmin()))
    columns = iter(curve.c.transpose(2, 1, 0))
    shape = [
        [TimeFunction.polynomial(curve.x, np.ascontiguousarray(next(columns))) for _ in range(node.body.n_modes)]
        for node in servo.model.tree.nodes
    ]
    return Run(
        analysis=analysis,
        model=model.without_paths(),
        time=times,
        q=states.q,
        v=states.v,
        a=states.a,
        multipliers=states.loops,
        required=states.required,
        statistics=statistics,
        prescribed=Prescription(servo.equations, shape, servo.near[0], breaks=curve.x),
    ).at(kept)


def _warnings(inversion: Inversion, run: Run) -> tuple[str, ...]:
    """How far a redefined output leaves the path itself."""
    if run.failed or inversion.servo.factor == 1:
        return ()
    held = inversion.servo.model
    errors = {name: float(np.abs(off).max(initial=0.0)) for name, off in held.path_errors(run.time, run.q).items()}
    farthest = max(held.scene.trajectory, key=lambda path: errors[path.name])
    off, joint = errors[farthest.name], next((one for one in held.scene.joint if one.name == farthest.joint), None)
    turns = farthest.angle is not None if joint is None else joint.units == ("rad",)
    if off <= PATH_TOLERANCE * (1.0 if turns else held.size):
        return ()
    unit, scale = ("m or rad", 1) if farthest.orientation is not None else ("rad", 1) if turns else ("mm", 1e3)
    return (
        f"a point with {inversion.servo.factor:.2g} of the vibration follows the path: that of trajectory"
        f' "{farthest.name}" is off by up to {scale * off:.3g} {unit}',
    )


def _choose_output(servo: Servo, analysis: MotorsOnly) -> tuple[Servo, Linearisation]:
    """Choose the output to follow the path: the scene's, or the minimum-phase one nearest to the point itself."""
    end = analysis.end
    if analysis.output == "tip" or analysis.factor is not None:
        if analysis.factor is not None:
            servo = replace(servo, factor=analysis.factor)
        linear = linearise(servo, end)
        values = np.linalg.svd(linear.dynamics.M, compute_uv=False)
        ratios = values[:, -1] / values[:, 0]
        worst = int(ratios.argmin())
        if ratios[worst] < SINGULAR:
            raise InputError(
                "expected motors that accelerate every component of the path",
                f"at t = {linear.times[worst]:.4g} s a singular coupling, {INFINITE}",
            )
        if analysis.output == "redefined" and not is_minimum_phase(linear):
            raise InputError(
                "factor: expected one whose output is minimum phase, since it is integrated forward",
                f"{analysis.factor:g} with zeros in the right half plane: {describe_zeros(linear)}; use a smaller"
                ' factor, leave it out, or use output = "tip"',
            )
        return (servo, linear) if analysis.output == "tip" else _with_expected_deflections(servo, end)
    for k in range(round(1 / FACTOR_STEP) + 1):
        servo = replace(servo, factor=max(0.0, 1.0 - k * FACTOR_STEP))
        linear = linearise(servo, end, samples=2)
        if not is_unstable(linear.zeros).any() and is_minimum_phase(linearise(servo, end)):
            return _with_expected_deflections(replace(servo, factor=MARGIN * servo.factor), end)
    raise InputError(
        'output: expected a robot whose joint motion is minimum phase for "redefined"',
        f"zeros in the right half plane even then: {describe_zeros(linear)}",
    )


def _with_expected_deflections(servo: Servo, end: float) -> tuple[Servo, Linearisation]:
    """The robot with `offset`: a function of time alone, it changes the output's target, not its zeros."""
    times = np.linspace(0.0, end, SAMPLES)
    sag = shape_along(replace(servo, factor=1.0), times)
    offset = [f.held(0.0, end) for f in spline(times, (1 - servo.factor) * sag, at_rest=True)]
    servo = replace(servo, offset=tuple(offset))
    return servo, linearise(servo, end)
