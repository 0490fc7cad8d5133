"""Motors and patches carry the robot along its path together, within their limits: `kind = "tracking"`. SI units.

The problem and its solver are in `mbs.tracking.problem`. First comes the least voltage with which patches can do it;
where that is within their limits, the motion of least effort follows. A simulation under torques alone shows whether
patches are needed.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import KW_ONLY, replace
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ...common.errors import InputError, SolveError
from ...common.structs import struct
from ...common.validation import Record
from ..analysis.forward import Forward, largest_moments
from ..fields.field_types import NotNegative, Positive
from ..inversion.collocation import between
from ..inversion.motors_only import AroundPath, check_rest, durations, outcome_along
from ..inversion.servo import Servo, Stopped, make_servo
from ..inversion.stable_inversion import with_corners
from ..inversion.zero_dynamics import equilibrium, linearise
from ..model.model import Model
from ..run.context import Context, PatchedLink, amplifiers_on, strain_directions
from ..run.integrators import Choice
from ..run.record import Run, Statistics
from ..run.stops import with_others
from ..scene.analysis import Check, Need, Robustness, TimedAnalysis, output_times
from .advice import (
    Bounds,
    Posed,
    causes,
    check_ends_for_gears,
    check_found,
    check_motors,
    check_reach,
    is_beyond,
    needs_none,
    price_of_tolerance,
    raised,
    slowest,
    warnings_of,
)
from .gear_motion import MANY, largest_shares, torques_beyond, within_limits
from .geared import GearedServo, with_gears
from .problem import refined, settled, start_breaks
from .transition import (
    RATE,
    RATE_BEHIND_GEARS,
    TIME,
    Limits,
    Objective,
    Tolerance,
    Tracked,
    Transition,
    Weights,
    displaced_along,
    rows_of_points,
)

VOLT = 200.0  # V_ref where patches have no limits
SNAP = 4.5  # power of time with which a path begins whose fourth derivative is zero there, at least
AMPLE = 0.9  # share of the limits: below it the mesh of least effort need not be that of the least voltage
RESERVE = 1e-9  # of the limits of voltages
AT_REST = 1e-9  # of the path's time: so much before it begins, and after it ends, it has no acceleration
ALLOWED = 1.01  # of the path tolerance: what a replay may use of it
REPLAYED = 1e-5  # tolerance of torques alone, at most

Around = NotNegative | Literal["auto"]


class EffortWeights(Record):
    """Sizes of moments, voltages and voltage rates that weigh equally in the effort to minimize."""

    moment: Positive | None = None
    """Torque, N·m or N, by default half the range of quasi-static torques."""
    voltage: Positive | None = None
    """Voltage, V, by default the largest limit of patches."""
    rate: NotNegative | None = None
    """Time, s, in which a voltage may change by its own size: larger values smooth voltages. Default: 5 ms; 2 ms with
    compliant gears."""


class Tracking(TimedAnalysis):
    """Motor torques and patch voltages that carry the robot along its trajectories from rest to rest, within limits.

    Limits are those of [[pzt]] (`limit`, `amplifier`) and [[joint]] (`moment_limit`). Without pre- and post-actuation
    nothing acts before the path begins and after it ends. `least-voltage` finds the smallest share of the limits with
    which patches can do it. `least-current` finds the smallest currents, and `least-torque` (`least-moment` is another
    spelling) the smallest torques. `effort` makes torques beyond the quasi-static ones, voltages and their rates small.
    """

    kind: Literal["tracking"]
    objective: Literal["effort", "least-voltage", "least-current", "least-torque", "least-moment"] = "effort"
    """Objective of the optimal control problem."""
    pre_actuation: Around = 0.0
    """Duration of actuation before the path begins, s; "auto" takes it from the zero dynamics."""
    post_actuation: Around = 0.0
    """Duration of actuation after the path, s; "auto" takes it from the zero dynamics."""
    path_tolerance: Positive | None = None
    """Largest error of each coordinate of a point on its path, m; by default the path is followed exactly."""
    tolerance_time: Positive | None = None
    """Time T_e, s, that limits the error's acceleration to path_tolerance/T_e². Default: 5 ms."""
    weights: EffortWeights = EffortWeights.model_construct()
    """Sizes that count alike in the effort."""
    intervals: Annotated[int, Field(ge=8, le=2000)] = 64
    """Number of intervals to begin with; where they leave more than the tolerance, more follow."""
    check: Check = None
    """Forward simulation under the result with twice the modes ("finer"), and the least voltage with these."""
    robustness: Robustness | None = None
    """Simulations under the result where the robot is not its model."""

    is_integrated = True
    applicable = ("joints", "joints+pzt")
    supplies_all = True

    @property
    def times(self) -> Array:
        """Output times (T,), s: from 0 to `end`, extended by pre- and post-actuation where these are numbers."""
        before, after = (0.0 if value == "auto" else value for value in (self.pre_actuation, self.post_actuation))
        return output_times(self.end, self.output_step, before, after)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.tolerance_time is not None and self.path_tolerance is None:
            raise ValueError('expected the key "tolerance_time" only with path_tolerance, found it alone')
        return self

    def needs(self) -> Iterator[Need]:
        """The trajectories and patches that the analysis requires."""
        yield Need("kind", self.kind, "trajectory")
        yield Need("kind", self.kind, "pzt")

    def run(self, context: Context) -> Run:
        """Motion and forces of motors and patches for the trajectories, no other force acting.

        Raises `InputError` for patches and motors that do not fit, a path that does not begin and end at rest, or is
        out of reach; `SolveError` where no motion is found.
        """
        began, model = time.perf_counter(), context.model
        try:
            posed = _pose(model, context.patches, self, lambda: context.progress(0.0))
            check_reach(posed, None)
            check_motors(posed)
            least = settled(posed.asked, posed.coarse)
            check_found(context, posed, least)
            check_reach(posed, least)
            tracked, objective = _solve(context, posed, self, least)
            if objective == "least-voltage":  # without the effort's share
                smoothed = 1.0 - least.surely / tracked.share if tracked.gears else 0.0
                least = replace(tracked, doubt=max(least.doubt, smoothed))
            texts = list(warnings_of(context, posed, self.intervals, least))
            if tracked.gears:
                texts += torques_beyond(model, largest_shares(posed.asked, tracked))
            if tracked.unmet > self.tolerance:
                texts.append(
                    f"between Gauss points modal forces up to {tracked.unmet:.2g} of the largest elastic one are left"
                    f" over, more than the tolerance, {self.tolerance:g}: raise intervals, or loosen the tolerance"
                )
        except Stopped:
            raise SolveError("stopped on request before any of its motion was found") from None
        around = _around(context, posed, tracked, least, objective)
        times = output_times(self.end, self.output_step, around.pre_actuation, around.post_actuation)

        def at(times: Array) -> Run:
            run = _outcome(self, posed.asked.driven, tracked, context, times)
            return replace(run, details=around, twists=tracked.gears)

        run = at(times)
        around = _with_torques_alone(context, self, run, around)
        statistics = replace(run.statistics, wall_seconds=time.perf_counter() - began, warnings=tuple(texts))
        run, inside = replace(run, details=around, statistics=statistics), between(tracked.curve.x, MANY)
        return run.with_look(lambda times: at(with_others(times, inside)))  # torques may have pulses there


@struct
class TrackedPath(AroundPath):
    """Actuation with which a path is tracked."""

    _: KW_ONLY
    least_voltage: float  # V, the least possible peak voltage, of the patch that is nearest to its limit
    least_voltage_doubt: float  # V, estimated change by a finer mesh; infinite where it did not converge
    least_share: float  # least voltage as a share of the limits; NaN where no patch has any
    objective: Objective  # "least-voltage" in place of that of the scene beyond limits, and if no voltage is needed
    cost: float  # the effort, no unit
    unmet: float  # largest residual modal force between Gauss points, relative to the largest elastic one
    bounds: Bounds | None  # V, by each zero of the zero dynamics; None where motors alone have no bounded motion
    # decrease of the objective per unit of a limit, by kind of limit, then by body or (torques) joint: `Tracked.prices`
    prices: Mapping[str, Mapping[str, Array]]
    path_tolerance: float | None  # m, by which coordinates of points may be off their path
    tolerance_price: float | None  # V/m, decrease of the least voltage per path tolerance
    # largest deviation from the path with the same torques but no voltages, m or rad; NaN where not found
    without_patches: float = np.nan
    is_needed: bool = True  # whether `without_patches` exceeds `path_tolerance`, and tolerance times its range


def least_voltage(model: Model, patches: Mapping[str, PatchedLink], analysis: Tracking) -> tuple[float, float]:
    """Least voltage, V, and its uncertainty, V, for another model of the robot; NaN if not found."""
    posed = _pose(model, patches, analysis, lambda: True)
    least = settled(posed.asked, posed.coarse)
    voltage = least.share * float(posed.asked.units.max()) if least.converged else np.nan
    return voltage, least.doubt * voltage


def _pose(model: Model, patches: Mapping[str, PatchedLink], analysis: Tracking, progress: Callable[[], bool]) -> Posed:
    """The problem of a path: its robot, limits, ends, and the first breaks."""
    end = analysis.end
    servo = with_gears(make_servo(model, end, progress, analysis.kind))
    check_rest(servo, analysis, (0.0, end))
    gears = servo.gears if isinstance(servo, GearedServo) else None
    Phi_V = strain_directions(servo.model, patches)[:, servo.of_modes].T  # (n, k) on all modes
    limits = Limits(amplifiers_on(model, patches), largest_moments(model, limits=True))
    if not np.any(Phi_V):
        raise InputError('expected patches on flexible links for kind = "tracking"', "none that bend one")
    linear = linearise(servo, end)
    given = (None if value == "auto" else value for value in (analysis.pre_actuation, analysis.post_actuation))
    around = durations(linear, given, analysis.output_step)
    first, last = -around[0], end + around[1]
    rest = equilibrium(servo, first - AT_REST * end), equilibrium(servo, last + AT_REST * end)
    asked = Transition(
        servo,
        Phi_V,
        limits,
        _weights(servo, analysis, limits),
        rest,
        objective="least-voltage",
        is_free=gears is not None and check_ends_for_gears(servo) < SNAP,
        rate=slowest(linear),
        gears=gears,
        tolerance=_tolerance(servo, analysis),
    )
    meshes = (
        with_corners(start_breaks(first, end, last, analysis.intervals // k), servo.model.scene.load_functions)
        for k in (1, 2)
    )
    return Posed(asked, linear, around, *meshes)


def _tolerance(servo: Servo, analysis: Tracking) -> Tolerance | None:
    if (error := analysis.path_tolerance) is None:
        return None
    if isinstance(servo, GearedServo):
        raise InputError(
            'expected either rigid gears or no "path_tolerance"',
            "compliant gears with one: their motors would need torques that jump with its acceleration. Remove it, or"
            " stiffness and damping of joints",
        )
    rows = [servo.model.rows[k] for k in rows_of_points(servo)]
    way = max((float(np.ptp(row.target.sample(servo.near_times)[0])) for row in rows if row.target), default=0.0)
    if error >= way:
        found = f"{error:g} m for a path of {way:.3g} m" if rows else "trajectories of joints or angles only"
        raise InputError("path_tolerance: expected a point whose path is longer", found)
    return Tolerance(error, analysis.tolerance_time or TIME)


def _solve(context: Context, posed: Posed, analysis: Tracking, least: Tracked) -> tuple[Tracked, Objective]:
    """The motion of least effort or what else is wanted; of the least voltage beyond limits, or if none is needed."""
    objective: Objective = "least-torque" if analysis.objective == "least-moment" else analysis.objective
    if is_beyond(posed, least) or needs_none(posed, least):
        objective = "least-voltage"
    limits = posed.asked.limits  # torques are beyond between Gauss points, V by rounding
    within = replace(limits.patches, range=limits.patches.range * (1.0 - RESERVE))
    kept = Limits(within, limits.torque * (1.0 - analysis.tolerance))
    asked = replace(posed.asked, objective=objective, limits=kept)
    breaks = posed.breaks if objective == "effort" and least.share < AMPLE else least.voltage.x
    if asked.gears is None:
        tracked = refined(asked, breaks, analysis.tolerance, least)
    else:
        meshes = breaks, posed.coarse
        tracked = within_limits(asked, limits, meshes, least, tolerance=analysis.tolerance, step=analysis.output_step)
    if not tracked.converged:
        what = analysis.objective.removeprefix("least-")
        cure = causes(context, posed) or f"{raised(posed)}, intervals or the tolerance"
        raise SolveError(f"the motion of least {what} was not found: {cure}")
    return tracked, objective


def _with_torques_alone(context: Context, analysis: Tracking, run: Run, around: TrackedPath) -> TrackedPath:
    """With the distance from the path under the same torques without voltages, by forward simulation."""
    alone = Forward(
        name="torques alone",
        kind="forward",
        actuation=analysis.name,
        apply="joints",
        end=analysis.end,
        output_step=analysis.output_step,
        tolerance=min(analysis.tolerance, REPLAYED),
    )
    replay = alone.run(replace(context, outcomes={analysis.name: run}, earlier=None))
    if replay.failed:
        return around
    of_links = replay.q[:, : around.held.tree.n_q]  # motors behind gears come after them
    off = max(float(np.abs(of).max(initial=0.0)) for of in around.held.path_errors(replay.time, of_links).values())
    inside = run.time[(run.time >= 0.0) & (run.time <= analysis.end)]
    way = max(float(np.ptp(target.sample(inside)[0])) for row in around.held.rows if (target := row.target))
    permitted = max(analysis.tolerance * way, ALLOWED * (around.path_tolerance or 0.0))
    return replace(around, without_patches=off, is_needed=off > permitted)


def _weights(servo: Servo, analysis: Tracking, limits: Limits) -> Weights:
    given, torque = analysis.weights, analysis.weights.moment
    if torque is None:
        straight = np.zeros((len(servo.near_times), len(servo.scale)))
        tau = servo.quasi_static(servo.near_times, straight)
        torque = 0.5 * float(np.ptp(tau, axis=0).max()) or 1.0
    known = np.abs(limits.patches.range)[np.isfinite(limits.patches.range)]
    voltage = given.voltage or (float(known.max()) if known.size else VOLT)
    rate = RATE_BEHIND_GEARS if isinstance(servo, GearedServo) else RATE
    return Weights(torque, voltage, rate if given.rate is None else given.rate)


def _around(context: Context, posed: Posed, tracked: Tracked, least: Tracked, objective: Objective) -> TrackedPath:
    """The actuation of a path by the motion `tracked`."""
    if needs_none(posed, least):
        least = replace(least, share=0.0)
    most = float(posed.asked.units.max())
    return TrackedPath(
        pre_actuation=posed.around[0],
        post_actuation=float(tracked.curve.x[-1]) - posed.asked.driven.end,
        least_voltage=least.share * most,
        least_voltage_doubt=least.doubt * least.share * most,
        least_share=least.share if posed.asked.is_limited else np.nan,
        objective=objective,
        cost=tracked.cost,
        held=posed.asked.driven.model,
        unmet=tracked.unmet,
        bounds=posed.bounds,
        path_tolerance=posed.asked.allowed or None,
        tolerance_price=price_of_tolerance(posed.asked, least),
        prices={
            kind: context.model.by_motor(of) if kind == "torque" else _by_body(context, of)
            for kind, of in tracked.prices.items()
            if kind not in ("error", "curving")  # of points: tolerance_price
        },
    )


def _outcome(analysis: Tracking, servo: Servo, tracked: Tracked, context: Context, times: Array) -> Run:
    curve, voltage = tracked.curve, tracked.voltage
    how = Choice("collocation", "interior-point method")
    statistics = Statistics("completed", how, steps=len(curve.x) - 1, evaluations=tracked.iterations)
    times = times.clip(voltage.x[0], voltage.x[-1])
    servo = servo if tracked.error is None else displaced_along(servo, tracked.error)
    run = outcome_along(curve, servo, analysis, context.model, statistics, times)
    assert run.prescribed is not None
    between = {body: type(voltage)(c, voltage.x) for body, c in _by_body(context, voltage.c).items()}
    prescribed = run.prescribed._replace(voltages=between)
    return replace(run, voltages=_by_body(context, voltage(times)), prescribed=prescribed)


def _by_body(context: Context, V: Array) -> Mapping[str, Array]:
    ends = np.cumsum([len(of_link.edges) for of_link in context.patches.values()])
    return dict(zip(context.patches, np.split(V, ends[:-1], axis=-1), strict=True))
