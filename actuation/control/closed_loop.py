"""Forward dynamics under a sampled controller: sensors, delay, saturation, feed-forward, disturbances."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array, as_list
from ...common.errors import SolveError
from ...common.numbers import MOST_OUTPUTS
from ...mbs._core import TimeFunction
from ...mbs.analysis.drive import Progress, SampledControl, drive, initial_state
from ...mbs.analysis.elastic_joints import rotors_like, with_compliance, with_rotors
from ...mbs.analysis.outcome import Details, Forces, Outcome
from ...mbs.analysis.replay import motor_limits, replay_times
from ...mbs.fields.field_types import NotNegative, PointReference, Positive
from ...mbs.fields.references import Reference, under
from ...mbs.model.model import ZERO, Model, load_measures
from ...mbs.model.raised_mass import coordinate_factors, factors_of, integrated, modal_factors
from ...mbs.model.system import MechanismSystem
from ...mbs.scene.analysis import ActuatedAnalysis, Analysis, Need
from ...mbs.scene.loads import Load
from ...mbs.solve.linearisation import Linearisation
from ...mbs.solve.state import State
from ..context import ActuatedContext, WholeLinks, place_of
from ..patches.patches import PatchArray, with_factors
from ..patches.voltages import allocation
from .choice import make_controller, needed_sensors
from .controllers import Controller, Setup
from .linear_model import LinearModel, linear_model
from .loop import Loop
from .margins import Margins, joint_gains, margins
from .metrics import Metrics, measure
from .records import ComputedTorque, JointPid, Lqr, Sensor
from .records import Controller as ControllerKeys
from .signals import Signal, input_names, merged, sensing, signals
from .suggestion import advice

SAMPLES_PER_PERIOD = 10  # of the fastest motion that a controller acts on (Franklin, Powell and Workman ask for 20)


class ClosedLoop(ActuatedAnalysis):
    """Motion under sampled control; the earlier inverse analysis `actuation` gives reference, feed-forward and start.

    Samples are at 0, sample_time, …; the command of each acts `delay` later and is held. Moments and voltages keep
    within the limits of the scene unless `unlimited`. The run starts as the inverse analysis does, or as [initial] of
    the scene says, on the trajectories. `seed` starts the noise. `tip` is the point whose error is reported.
    """

    kind: Literal["closed-loop"]
    sample_time: Positive
    """Time between samples, s."""
    delay: NotNegative = 0.0
    """From a sample to its command, s."""
    start: Literal["actuation", "scene"] = "actuation"
    """Where the run starts: as `actuation` does, or as [initial] says."""
    feed_forward: Literal["none", "joints", "joints+pzt"] = "joints"
    """What of `actuation` is added to the commands: moments, with voltages, or nothing."""
    unlimited: bool = False
    """Moments and voltages beyond the limits of the scene are allowed."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Of the noise of sensors."""
    tip: PointReference | None = None
    """Point "BODY.POINT" whose error is reported."""
    controller: tuple[ControllerKeys, ...] = ()
    """Controllers; their commands add up."""
    sensor: tuple[Sensor, ...] = ()
    """What is measured beside what the controllers need."""
    disturbance: tuple[Load, ...] = ()
    """Loads at points that `actuation` does not know."""

    findings = ("diverged", "step underflow")  # what a controller does is what is to be found out

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.actuation is None:
            raise ValueError(f'expected the key "actuation" in kind = "{self.kind}", found none')
        if any(load.point is None for load in self.disturbance):
            raise ValueError("expected disturbances at points, found one elsewhere")
        for k, load in enumerate(self.disturbance, 1):
            if load.force is not None:
                raise ValueError(
                    f"disturbance no. {k}: force: expected expressions in t, found a function, which only a [[load]]"
                    " may have"
                )
        end = self.end
        if end and self.delay >= end:
            raise ValueError(f"expected a delay shorter than the run ({end:g} s), found {self.delay:g} s")
        if end and end / self.sample_time > MOST_OUTPUTS:
            raise ValueError(f"expected at most {MOST_OUTPUTS} samples, found sample_time = {self.sample_time:g} s")
        if end and self.sample_time > end:
            raise ValueError(f"expected a sample_time of at most the run ({end:g} s), found {self.sample_time:g} s")
        return self

    def needs(self) -> Iterator[Need]:
        """Patches where voltages are fed forward."""
        if self.feed_forward == "joints+pzt":
            yield Need("feed_forward", self.feed_forward, "pzt")

    def references(self) -> Iterator[Reference]:
        """What is measured, disturbed, controlled and reported."""
        for label, records in (
            ("sensor", self.sensor), ("disturbance", self.disturbance), ("controller", self.controller)
        ):  # fmt: skip
            for k, record in enumerate(records, 1):
                yield from under(f"{label} no. {k}", record.references())
        if self.tip is not None:
            yield Reference("tip", self.tip, needs_marker=True)

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """The disturbances."""
        for k, load in enumerate(self.disturbance, 1):
            for component, function in load.components.items():
                yield f"disturbance no. {k}: {component}", function, 0

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Whether `source` found what is to be fed forward."""
        if self.feed_forward == "joints+pzt" and source.applicable and self.feed_forward not in source.applicable:
            yield (
                f'feed_forward: expected "joints" with an analysis of kind "{source.kind}", found "{self.feed_forward}"'
            )

    def run(self, context: ActuatedContext) -> Outcome:
        """Motion and commands."""
        source = context.source(self.actuation)
        assert source is not None
        return run_closed_loop(context.model, self, source, context.patches, context.progress, context.whole)


@dataclass(frozen=True)
class LoopRecord(Details):
    """What happened at the samples of a closed loop.

    Attributes:
        inputs, outputs: names of commands and readings.
        time: (K,) s; the last sample is the last that was taken.
        readings: (K, outputs); reference: (K, outputs) what they would be on the reference motion.
        commands: (K, inputs) within limits; wanted: before.
        metrics: how well it went; `tip_error` (T,) m at the outputs of the run.
        warnings: one line each.
        margins: by the linear model, of loops of joint PID controllers alone; else None.
        advice: what to try, a text each, where the loop is not stable.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    time: Array
    readings: Array
    reference: Array
    commands: Array
    wanted: Array
    tip_error: Array
    metrics: Metrics
    warnings: tuple[str, ...]
    margins: Margins | None = None
    advice: tuple[str, ...] = ()


def run_closed_loop(
    model: Model,
    analysis: ClosedLoop,
    source: Outcome,
    patches: Mapping[str, PatchArray],
    progress: Progress,
    whole: WholeLinks | None = None,
) -> Outcome:
    """The closed loop of `analysis` about the motion of the inverse analysis `source`, from its initial state.

    Controllers know the `whole` links of a robot in which some are in pieces, sensors and patches act on the pieces.

    The outcome's details are a `LoopRecord`. A run that diverges ends there and is kept. Raises `InputError` for
    controllers that do not fit the robot, `SolveError` where a user's function fails.
    """
    built = with_compliance(model)
    moved, read = with_rotors(source, built), _read(model, built, analysis, patches, whole)
    assembly = _assembly(model, built, analysis, source, read, whole)
    sensor, outputs = sensing(assembly, read), replay_times(source, analysis)
    setup = _setup(model, analysis, source, patches, read, outputs, sensor.read(*_states(moved)))
    if whole is not None:
        setup = replace(setup, model=whole.model, patches=whole.patches, source=whole.told(source))
    acting = [make_controller(record, setup, analysis.controller) for record in analysis.controller]
    limit = np.concatenate([motor_limits(model), *(array.limit for array in patches.values())])
    limit = np.full_like(limit, np.inf) if analysis.unlimited else limit
    loop = Loop(setup, read, acting, limit, analysis.seed)
    start, driven = _start(assembly, analysis, moved, model), assembly
    if (raised := integrated(built)) is not built:  # the same in other coordinates
        all_factors = coordinate_factors(built)
        patches = {body: with_factors(array, factors_of(built, array.carriers)) for body, array in patches.items()}
        read = tuple(s if s.row else replace(s, vector=s.vector / factors_of(built, s.bodies)) for s in read)
        start = State(start.q * all_factors, start.v * all_factors)
        driven = _assembly(model, raised, analysis, source, read, whole)
        sensor = sensing(driven, read)
    voltages = [(driven.index[array.carriers[0]], array.Phi_V) for array in patches.values()]
    control = SampledControl(len(model.motors), voltages, loop.first, sensor, setup.times, analysis.delay, loop)
    outcome = drive(driven, analysis, start, progress, reported=assembly, times=outputs, control=control)
    outcome = _recorded(outcome, source, setup, loop, acting, place_of(whole, analysis.tip))
    return _judged(outcome, analysis, loop_models(built, moved))


def loop_models(model: Model, reference: Outcome) -> tuple[LinearModel, ...]:
    """The robot at rest on its reference at start, middle and end; none where it is singular."""
    rows = sorted({0, len(reference.time) // 2, len(reference.time) - 1})
    linearisation, rest = Linearisation(model, reference.q[0]), np.zeros_like(reference.v[0])
    with suppress(SolveError):
        return tuple(
            linear_model(linearisation.at(float(reference.time[k]), reference.q[k], rest, rest), {}) for k in rows
        )
    return ()


def _judged(outcome: Outcome, analysis: ClosedLoop, models: Sequence[LinearModel]) -> Outcome:
    """The outcome with margins of its loop, and advice where it is not stable, by linear models on the reference."""
    records = [record for record in analysis.controller if isinstance(record, JointPid)]
    details = outcome.details
    assert isinstance(details, LoopRecord)
    if not models or not records or len(records) < len(analysis.controller):
        return outcome
    T, delay = analysis.sample_time, analysis.delay
    found = margins(models, joint_gains(models[0], records), T, delay)
    is_stable = details.metrics.verdict == "stable" and found.is_stable
    texts = () if is_stable else tuple(advice(models, records, T, delay, found))
    return replace(outcome, details=replace(details, margins=found, advice=texts))


def _read(
    model: Model, built: Model, analysis: ClosedLoop, patches: Mapping[str, PatchArray], whole: WholeLinks | None
) -> tuple[Signal, ...]:
    """The readings that the scene asks for, and those that its controllers need."""
    needed = needed_sensors(model if whole is None else whole.model, analysis.controller, patches)
    given, more = (
        [s for sensor in sensors for s in signals(built, patches, sensor, whole)]
        for sensors in (analysis.sensor, needed)
    )
    return merged(given, more)


def _assembly(
    model: Model,
    built: Model,
    analysis: ClosedLoop,
    source: Outcome,
    read: Sequence[Signal],
    whole: WholeLinks | None,
) -> MechanismSystem:
    """The robot with its motors, loads and disturbances, and the rows along which sensors read."""
    loads = model.loads if source.details.loads is None else source.details.loads
    drives = [*((row, ZERO) for row in built.motors.values()), *loads]
    placed = [load.model_copy(update={"point": place_of(whole, load.point)}) for load in analysis.disturbance]
    drives += load_measures(built.scene, placed)
    return MechanismSystem(built, built.joints, drives, [signal.row for signal in read if signal.row is not None])


def _setup(
    model: Model,
    analysis: ClosedLoop,
    source: Outcome,
    patches: Mapping[str, PatchArray],
    read: Sequence[Signal],
    outputs: Array,
    readings: Array,
) -> Setup:
    """What controllers may know; `readings` (T, sensors) are those of the motion of `source` at its outputs."""
    T = analysis.sample_time
    times = outputs[0] + np.arange(int(np.ceil(np.ptp(outputs) / T * (1 - 1e-12)))) * T
    return Setup(
        model, patches, input_names(model, patches), tuple(s.name for s in read), times, T, analysis.delay,
        _at(times, source.time, readings), _feed_forward(model, analysis, source, patches, times), source,
    )  # fmt: skip


def _states(outcome: Outcome) -> tuple[Array, ...]:
    return tuple(np.ascontiguousarray(x) for x in (outcome.q, outcome.v, outcome.a))


def _start(assembly: MechanismSystem, analysis: ClosedLoop, source: Outcome, rigid: Model) -> State:
    """As `source` starts, or as the scene says, with the rotors of elastic gears wound as in `source`."""
    if analysis.start == "actuation":
        return State(source.q[0].copy(), source.v[0].copy())
    start = initial_state(MechanismSystem(rigid, [*rigid.joints, *rigid.trajectories], rigid.loads))
    return rotors_like(assembly.model, start, source)


def _recorded(
    outcome: Outcome, source: Outcome, setup: Setup, loop: Loop, acting: Sequence[Controller], tip: str | None
) -> Outcome:
    """`outcome` with the moments that were commanded, and the record of its samples."""
    analysis, taken = outcome.analysis, slice(loop.taken)
    assert isinstance(analysis, ClosedLoop)
    held = _held(outcome.time, setup.times[taken] + setup.delay, loop.commands[taken], loop.first)
    outcome = replace(outcome, forces=Forces(tau=held[:, : len(setup.model.motors)]))
    tip_error, metrics = measure(outcome, source, tip, setup, loop, held, is_disturbed=bool(analysis.disturbance))
    warnings = tuple(_warnings(analysis, acting, metrics, bool(outcome.assembly.model.gears)))
    record = LoopRecord(
        setup.inputs, setup.outputs, setup.times[taken], loop.readings[taken], setup.reference[taken],
        loop.commands[taken], loop.wanted[taken], tip_error, metrics, warnings,
    )  # fmt: skip
    return replace(outcome, details=record)


def _at(times: Array, known: Array, values: Array) -> Array:
    """Values (T, columns), known at some times, at others (K,)."""
    if not values.size:
        return np.zeros((len(times), values.shape[1]))
    from scipy.interpolate import CubicSpline

    result: Array = CubicSpline(known, values)(times)
    return result


def _feed_forward(
    model: Model, analysis: ClosedLoop, source: Outcome, patches: Mapping[str, PatchArray], times: Array
) -> Array:
    """(K, inputs) moments and voltages of the inverse analysis, in the middle of the time for which each is held."""
    voltages: list[Array] = [np.zeros((len(times), len(array.edges))) for array in patches.values()]
    moments: Array = np.zeros((len(times), len(model.motors)))
    middle = np.minimum(times + analysis.delay + analysis.sample_time / 2, source.time[-1])
    if analysis.feed_forward != "none" and source.tau is not None:
        moments, F_p = _found(source, middle)
        if analysis.feed_forward == "joints+pzt" and F_p is not None:
            voltages = [
                allocation(array, limited=not analysis.unlimited).solve(
                    np.ascontiguousarray(F_p[:, source.modal_columns(*array.carriers)])
                )
                for array in patches.values()
            ]
    return np.hstack([moments, *voltages])


def _found(source: Outcome, times: Array) -> tuple[Array, Array | None]:
    """τ and F_p that an inverse analysis found, at any time where it was recorded or is algebraic, else by a spline."""
    moments, F_p = source.motor_moments, source.F_p
    assert moments is not None
    anytime = source.details.actuation_source(source) if F_p is not None else None
    if anytime is None:
        return _at(times, source.time, moments), None if F_p is None else _at(times, source.time, F_p)
    tau, F_p = anytime.sample(as_list(times))
    if source.continuation is not None and source.continuation.assembly is not None and F_p is not None:
        F_p = F_p * modal_factors(source.assembly.model)
    return _at(times, source.time, moments) if source.gears else tau, F_p


def _held(times: Array, since: Array, commands: Array, first: Array) -> Array:
    """Commands (T, inputs) that act at `times`; each does from `since` (K,) on, `first` before."""
    which = np.searchsorted(since, times + 1e-9, side="right")
    return np.vstack([first, commands])[which]


def _warnings(analysis: ClosedLoop, controllers: Sequence[Controller], metrics: Metrics, gears: bool) -> list[str]:
    lines = [line for controller in controllers for line in getattr(controller, "warnings", ())]
    fastest = max((controller.bandwidth for controller in controllers), default=0.0)
    sampling = 2 * np.pi / analysis.sample_time
    if sampling < SAMPLES_PER_PERIOD * fastest:
        lines.append(
            f"sampling at {sampling / (2 * np.pi):.4g} Hz is slow for a controller that acts up to"
            f" {fastest / (2 * np.pi):.4g} Hz: expected at least {SAMPLES_PER_PERIOD} samples a period"
        )
    if gears and any(isinstance(record, Lqr | ComputedTorque) for record in analysis.controller):
        lines.append("the controller is designed for rigid gears, and some give")
    if metrics.verdict != "stable":
        lines.append(f"the loop {metrics.verdict}: gains too high for sampling and delay, or for the links?")
    return lines
