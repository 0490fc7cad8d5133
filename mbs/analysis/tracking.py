"""Motors and patches carry the robot along its path together, within their limits: `kind = "tracking"`.

The problem, its discretization and its solver are in `mbs.solve.tracking`. First comes the least voltage with which
patches can do it; where that is within their limits, the motion of least effort follows.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from ...common.arrays import Array, as_floats, as_list
from ...common.errors import InputError, SolveError
from ...common.validation import Record
from ..fields.field_types import NotNegative, Positive
from ..model.gears import refuse_held_motors
from ..model.model import Model, modal_directions, without_paths
from ..scene.analysis import Need, TimedAnalysis, output_times
from ..solve.integrators import Choice
from ..solve.internal_dynamics import Stopped, equilibrium
from ..solve.servo import Servo, make_servo
from ..solve.stable_inversion import shape_of
from ..solve.tracking import Limits, Objective, Tracked, Transition, Weights, refined, start_breaks, track
from ..solve.zero_dynamics import linearise
from .context import Context
from .inverted_path import AroundPath, check_rest, decay_times, where, whole_steps
from .outcome import Forces, Motion, Outcome, Prescription, Statistics
from .samples import path_times

RATE = 0.005  # s, T_r where the scene does not say
VOLT = 200.0  # V_ref where patches have no limits
NEAR = 0.97  # times the limits of patches, which a longer time is sought for
MOST_TIMES = 6  # tried
ENOUGH = 1e-6  # of the limits: least voltages beyond them by less are within

Around = NotNegative | Literal["auto"]


class EffortWeights(Record):
    """Sizes that count alike in the effort that is made small."""

    moment: Positive | None = None
    """Torque, N·m or N, by default half the range of quasi-static torques."""
    voltage: Positive | None = None
    """Voltage, V, by default the largest limit of patches."""
    rate: NotNegative = RATE
    """Time, s, in which a voltage may change by its own size: larger values smooth voltages."""


class Tracking(TimedAnalysis):
    """Motor torques and patch voltages that carry the robot along its trajectories from rest to rest, within limits.

    Limits are those of [[pzt]] (`limit`) and [[joint]] (`moment_limit`). Without pre- and post-actuation nothing acts
    before the path begins and after it ends. `least-voltage` finds the smallest share of the limits with which patches
    can do it, `least-moment` the smallest torques, and `effort` makes torques beyond the quasi-static ones, voltages
    and their rates small.
    """

    kind: Literal["tracking"]
    objective: Literal["effort", "least-voltage", "least-moment"] = "effort"
    """What is made small."""
    pre_actuation: Around = 0.0
    """Duration of actuation before the path begins, s; "auto" takes it from the zero dynamics."""
    post_actuation: Around = 0.0
    """Duration of actuation after the path, s; "auto" takes it from the zero dynamics."""
    weights: EffortWeights = EffortWeights()
    """Sizes that count alike in the effort."""
    intervals: Annotated[int, Field(ge=8, le=2000)] = 64
    """Number of intervals to begin with; where they leave more than the tolerance, more follow."""

    is_integrated = True
    applicable = ("joints", "joints+pzt")

    @property
    def times(self) -> Array:
        """Output times (T,), s: from 0 to `end`, and the pre- and post-actuation besides where they are numbers."""
        before, after = (0.0 if value == "auto" else value for value in (self.pre_actuation, self.post_actuation))
        return output_times(self.end, self.output_step, before, after)

    def needs(self) -> Iterator[Need]:
        """Something to follow, and patches."""
        yield Need("kind", self.kind, "trajectory")
        yield Need("kind", self.kind, "pzt")

    def run(self, context: Context) -> Outcome:
        """Motion, torques and voltages."""
        return run_tracking(context, self)


@dataclass(frozen=True, kw_only=True)
class TrackedPath(AroundPath):
    """How a path is carried.

    Attributes:
        least_voltage: V, the largest voltage that is needed at least, of the patch next to its limit.
        least_share: the same as a share of the limits; NaN where no patch has any.
        objective: what was made small, `effort` unless limits do not allow it.
        cost: the effort, without unit.
        held: the robot whose constraint equations hold it on its path.
    """

    least_voltage: float
    least_share: float
    objective: Objective
    cost: float
    held: Model


def run_tracking(context: Context, analysis: Tracking) -> Outcome:
    """Motion and forces of motors and patches for the trajectories, no other force acting.

    Raises `InputError` for patches and motors that do not fit, a path that does not begin and end at rest, or is out of
    reach; `SolveError` where no motion is found.
    """
    began, model = time.perf_counter(), context.model
    place = where(model.scene.path, analysis)

    def progress() -> bool:
        return context.progress(0.0)

    refuse_held_motors(model, analysis)
    try:
        servo = make_servo(model, analysis.end, place, progress, 1.0, analysis.kind)
        check_rest(servo, analysis, (0.0, analysis.end))
        pre, post = _durations(servo, analysis)
        solved = _solve(context, servo, analysis, (pre, post))
    except Stopped:
        raise SolveError(f"{place}: stopped on request before any of its motion was found") from None
    found, least, asked, told = solved
    units = np.where(np.isfinite(asked.limits.voltage), asked.limits.voltage, asked.weights.voltage)
    around = TrackedPath(
        pre_actuation=pre, post_actuation=post, least_voltage=least * float(units.max()),
        least_share=least if np.isfinite(asked.limits.voltage).any() else float("nan"), objective=asked.objective,
        cost=found.cost, held=servo.model,
    )  # fmt: skip
    times = output_times(analysis.end, analysis.output_step, pre, post)

    def at(times: Array) -> Outcome:
        return replace(_outcome(analysis, model, servo, found, context, times), details=around)

    run = at(times)
    run = replace(
        run, statistics=replace(run.statistics, wall_seconds=time.perf_counter() - began, warnings=tuple(told))
    )

    @cache
    def look_closer() -> Outcome:
        return at(path_times(run.time, model.scene.trajectory, analysis.end))

    return replace(run, look_closer=look_closer)


def _durations(servo: Servo, analysis: Tracking) -> tuple[float, float]:
    given = analysis.pre_actuation, analysis.post_actuation
    automatic = (0.0, 0.0)
    if "auto" in given:
        linear = linearise(servo, analysis.end)
        automatic = decay_times(linear, analysis.end, needs_future=bool(linear.is_future[0].any()))
    chosen = [found if value == "auto" else value for value, found in zip(given, automatic, strict=True)]
    return whole_steps(chosen, analysis.output_step)


def _solve(
    context: Context, servo: Servo, analysis: Tracking, around: tuple[float, float]
) -> tuple[Tracked, float, Transition, list[str]]:
    """What carries the path, the least share of limits, what was asked for last, and warnings."""
    place = servo.where
    Phi_V, limits = _patches(context, servo), _limits(context)
    if not np.any(Phi_V):
        raise InputError(f'{place}: expected patches on flexible links for kind = "tracking", found none that bend one')
    start, end = -around[0], analysis.end + around[1]
    breaks = start_breaks(start, analysis.end, end, analysis.intervals)
    rest = equilibrium(servo, start), equilibrium(servo, end)
    weights = _weights(servo, analysis, limits)
    asked = Transition(servo, Phi_V, limits, weights, rest, "least-voltage")
    least = track(asked, breaks)
    if not least.converged and np.isfinite(limits.torque).any():
        free = replace(asked, limits=replace(limits, torque=np.full_like(limits.torque, np.inf)))
        if track(free, breaks).converged:
            raise SolveError(
                f"{place}: no motion follows the path within the motors' limits, whatever the voltages: slow the path"
                " down, or raise moment_limit"
            )
    if not least.converged:
        raise SolveError(
            f"{place}: no motion of motors and patches was found: slow the path down, let it begin and end more"
            " smoothly (35*s**4 - 84*s**5 + 70*s**6 - 20*s**7), or allow pre_actuation and post_actuation"
        )
    told = []
    objective: Objective = "least-torque" if analysis.objective == "least-moment" else analysis.objective
    if least.share > 1.0 + ENOUGH and np.isfinite(limits.voltage).any():
        more = _more_time(asked, analysis, around, least.share)
        longer = f", or {1e3 * more:.3g} ms more of pre_actuation and post_actuation" if np.isfinite(more) else ""
        told.append(
            f"patches cannot do it within their limits: {least.share:.3g} times these would do{longer}."
            " Slow the path down, or add patches"
        )
        objective = "least-voltage"
    asked = replace(asked, objective=objective)
    found = refined(asked, breaks, analysis.tolerance, servo.goes_on, least)
    if not found.converged:
        raise SolveError(f"{place}: the motion of least {analysis.objective} was not found: loosen limits or tolerance")
    return found, least.share, asked, told


def _more_time(asked: Transition, analysis: Tracking, around: tuple[float, float], share: float) -> float:
    """How much earlier (s) actuators must begin, and later end, for voltages within their limits; NaN where not found.

    The least voltage falls about as e^{−s t}, s the slowest zero to the right (Zou and Devasia, 1999): secants in its
    logarithm, from there.
    """
    servo = asked.driven
    assert isinstance(servo, Servo)
    zeros = linearise(servo, analysis.end).zeros.real
    growing = zeros[zeros > 1.0 / analysis.end]
    if not growing.size:
        return float("nan")
    rate, more, tried = float(growing.min()), 0.0, [(0.0, np.log(share))]
    for _ in range(MOST_TIMES):
        more += (tried[-1][1] - np.log(NEAR)) / rate
        start, end = -around[0] - more, analysis.end + around[1] + more
        least = track(asked, start_breaks(start, analysis.end, end, analysis.intervals))
        if not (least.converged and servo.goes_on()):
            break
        if NEAR**2 <= least.share <= 1.0:
            return float(more)
        tried.append((more, np.log(least.share)))
        (t_0, log_0), (t_1, log_1) = tried[-2:]
        rate = max((log_0 - log_1) / (t_1 - t_0), 0.1 * rate)
    return float("nan")


def _patches(context: Context, servo: Servo) -> Array:
    """Φ_V (n, k) on all modes, of all patches of all links."""
    rows = [modal_directions(servo.model, of_link.per_volt) for of_link in context.patches.values()]
    return np.concatenate(rows)[:, servo.of_modes].T


def _limits(context: Context) -> Limits:
    joints = {joint.name: joint for joint in context.model.scene.joint}
    torque = np.array([of.moment for name in context.model.motors for of in joints[name].motor_limits])
    voltage = np.concatenate([of_link.limit for of_link in context.patches.values()] or [np.zeros(0)])
    return Limits(voltage, torque)


def _weights(servo: Servo, analysis: Tracking, limits: Limits) -> Weights:
    given, torque = analysis.weights, analysis.weights.moment
    if torque is None:
        times = as_floats(np.linspace(0.0, analysis.end, len(servo.near_times)))
        rest = np.zeros((len(times), len(servo.scale)))
        tau = servo.forces(times, rest, rest, rest)[1]
        torque = 0.5 * float(np.ptp(tau, axis=0).max()) or 1.0
    known = limits.voltage[np.isfinite(limits.voltage)]
    voltage = given.voltage or (float(known.max()) if known.size else VOLT)
    return Weights(torque, voltage, given.rate)


def _outcome(
    analysis: Tracking, model: Model, servo: Servo, tracked: Tracked, context: Context, times: Array
) -> Outcome:
    curve, voltage = tracked.curve, tracked.voltage
    modes = curve(times), curve.derivative(1)(times), curve.derivative(2)(times)
    found = servo.motion.motion(as_list(times), *modes, servo.postures(times))

    breaks = voltage.x
    return Outcome(
        analysis=analysis,
        model=without_paths(model),
        motion=Motion(times, found.q, found.v, found.a, found.loops),
        forces=Forces(required=found.required, voltages=_by_body(context, voltage(times))),
        statistics=Statistics(
            "completed",
            Choice("collocation", "interior-point method"),
            steps=len(curve.x) - 1,
            evaluations=tracked.iterations,
        ),
        prescribed=Prescription(
            servo.equations, shape_of(curve, servo.mode_counts), servo.near[0],
            {body: (breaks, V) for body, V in _by_body(context, voltage(breaks)).items()},
        ),
    )  # fmt: skip


def _by_body(context: Context, V: Array) -> Mapping[str, Array]:
    """V (T, k) of all patches, by body."""
    counts = [len(of_link.limit) for of_link in context.patches.values()]
    parts: Sequence[Array] = np.split(V, np.cumsum(counts)[:-1], axis=1)
    return dict(zip(context.patches, parts, strict=True))
