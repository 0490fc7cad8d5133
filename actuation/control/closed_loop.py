"""Forward dynamics under a sampled controller: sensors, delay, saturation, feed-forward, disturbances."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Array
from ...mbs import _core
from ...mbs.analysis.analyses import STATUS, Outcome, Progress, as_long_as, in_coordinates_of, initial_state
from ...mbs.analysis.elastic_joints import rotors_like, with_compliance, with_rotors
from ...mbs.analysis.replay import actuation_source, motor_limits
from ...mbs.joints.measure import Measure
from ...mbs.model.model import ZERO, Model, load_measures
from ...mbs.model.raised_mass import coordinate_factors, integrated, mass_factors, modal_factors
from ...mbs.model.system import MechanismSystem
from ...mbs.scene.analysis_records import Analysis
from ...mbs.scene.loop_records import ComputedTorque, Lqr
from ...mbs.solve.integrators import METHODS, choose_integrator
from ...mbs.solve.state import State
from ..patches.patches import PatchArray
from ..patches.voltages import allocation
from .choice import make_controller, needed_sensors
from .controllers import Controller, Setup
from .metrics import Metrics, measure
from .signals import Signal, input_names, merged, sensing, signals

SAMPLES_PER_PERIOD = 10  # of the fastest motion that a controller acts on (Franklin, Powell and Workman ask for 20)


@dataclass(frozen=True)
class LoopRecord:
    """What happened at the samples of a closed loop.

    Attributes:
        inputs, outputs: names of commands and readings.
        time: (K,) s; the last sample is the last that was taken.
        readings: (K, outputs); reference: (K, outputs) what they would be on the reference motion.
        commands: (K, inputs) within limits; wanted: before.
        metrics: how well it went; `tip_error` (T,) m at the outputs of the run.
        warnings: one line each.
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


class Loop:
    """What the core asks at every sample: noise and resolution, controllers, limits."""

    def __init__(
        self, setup: Setup, read: Sequence[Signal], controllers: Sequence[Controller], limit: Array, seed: int
    ) -> None:
        samples = (len(setup.times), len(read))
        noise = np.array([signal.noise for signal in read])
        self._noise = np.random.default_rng(seed).standard_normal(samples) * noise if noise.any() else None
        resolution = np.array([signal.resolution for signal in read])
        self._coarse = np.flatnonzero(resolution)
        self._resolution = resolution[self._coarse]
        self._controllers, self._limit, self._feed_forward = controllers, limit, setup.feed_forward
        self.readings = np.zeros(samples)
        self.commands, self.wanted = np.zeros_like(setup.feed_forward), np.zeros_like(setup.feed_forward)
        self.first: Array = np.clip(setup.feed_forward[0], -limit, limit)
        self.taken = 0

    def __call__(self, k: int, _t: float, y: Array) -> Array:
        """Commands at sample k for what the sensors are exposed to."""
        if self._noise is not None:
            y += self._noise[k]
        if self._coarse.size:
            y[self._coarse] = np.round(y[self._coarse] / self._resolution) * self._resolution
        wanted = self._feed_forward[k].copy()
        for controller in self._controllers:
            wanted += controller(k, y)
        command: Array = np.minimum(np.maximum(wanted, -self._limit), self._limit)
        self.readings[k], self.wanted[k], self.commands[k], self.taken = y, wanted, command, k + 1
        return command


def run_closed_loop(
    model: Model,
    analysis: Analysis,
    source: Outcome,
    patches: Mapping[str, PatchArray],
    progress: Progress,
) -> tuple[Outcome, LoopRecord]:
    """Run the closed loop of `analysis` about the motion of the inverse analysis `source`, from its initial state.

    A run that diverges ends there and is kept. Raises `InputError` for controllers that do not fit the robot,
    `SolveError` where a user's function fails.
    """
    analysis, loads, T = as_long_as(source, analysis), model.loads, analysis.sample_time
    assert T is not None
    if source.inversion is not None:
        loads = source.inversion.servo.loads
    inputs, built = input_names(model, patches), with_compliance(model)
    moved = with_rotors(source, built)
    needed = [s for sensor in needed_sensors(model, analysis, patches) for s in signals(built, patches, sensor)]
    read = merged([s for sensor in analysis.sensor for s in signals(built, patches, sensor)], needed)
    rows = [signal.row for signal in read if signal.row is not None]
    drives = [*((row, ZERO) for row in built.motors.values()), *loads]
    drives += load_measures(model.scene, analysis.disturbance)
    assembly = MechanismSystem(built, built.joints, drives, rows)
    sensor = sensing(assembly, read)

    begin, duration = analysis.times[0], np.ptp(analysis.times)
    times = begin + np.arange(int(np.ceil(duration / T * (1 - 1e-12)))) * T
    reference = _at(times, source.time, sensor.read(*(np.ascontiguousarray(x) for x in (moved.q, moved.v, moved.a))))
    feed_forward = _feed_forward(model, analysis, source, patches, times)
    setup = Setup(
        model, patches, inputs, tuple(s.name for s in read), times, T, analysis.delay, reference, feed_forward, source
    )  # fmt: skip
    acting = [make_controller(record, setup, analysis.controller) for record in analysis.controller]
    limit = np.concatenate([motor_limits(model), *(array.limit for array in patches.values())])
    limit = np.full_like(limit, np.inf) if analysis.unlimited else limit
    loop = Loop(setup, read, acting, limit, analysis.seed)
    outcome = _integrate(assembly, rows, read, analysis, moved, model, patches, loop, times, progress, drives)
    taken = slice(loop.taken)
    held = _held(outcome.time, times[taken] + analysis.delay, loop.commands[taken], loop.first)
    outcome = replace(outcome, tau=held[:, : len(model.motors)])
    tip_error, metrics = measure(outcome, source, setup, loop, held)
    record = LoopRecord(
        inputs, setup.outputs, times[taken], loop.readings[taken], reference[taken], loop.commands[taken],
        loop.wanted[taken], tip_error, metrics, tuple(_warnings(analysis, acting, metrics, bool(built.gears))),
    )  # fmt: skip
    return outcome, record


def _integrate(
    reported: MechanismSystem,
    rows: Sequence[Measure],
    read: Sequence[Signal],
    analysis: Analysis,
    source: Outcome,
    rigid: Model,
    patches: Mapping[str, PatchArray],
    loop: Loop,
    times: Array,
    progress: Progress,
    drives: Sequence[tuple[Measure, _core.TimeFunction]],
) -> Outcome:
    began = time.perf_counter()
    start = State(source.q[0].copy(), source.v[0].copy())
    if analysis.start == "scene":
        start = initial_state(MechanismSystem(rigid, [*rigid.joints, *rigid.trajectories], rigid.loads))
        start = rotors_like(reported.model, start, source)
    model = integrated(reported.model)
    factors = {body.name: np.sqrt(mass_factors(body)) for body in reported.model.bodies}
    if model is not reported.model:
        all_factors = coordinate_factors(reported.model)
        start = State(start.q * all_factors, start.v * all_factors)
        read = [replace(s, vector=s.vector / factors[s.body]) if s.row is None else s for s in read]
    assembly = MechanismSystem(model, model.joints, drives, rows)
    sensor = sensing(assembly, read)
    integrator = choose_integrator(assembly, analysis, start)
    voltages = [(assembly.index[body], array.Phi_V / factors[body][:, None]) for body, array in patches.items()]
    run = _core.run_sampled(
        assembly.system, assembly.groups, assembly.moments, analysis.times.tolist(), start.q, start.v,
        analysis.tolerance, analysis.max_steps, METHODS[integrator.name], analysis.spectral_radius,
        len(assembly.model.motors), voltages, loop.first, sensor, times.tolist(), analysis.delay, loop, progress,
    )  # fmt: skip
    seconds = time.perf_counter() - began
    reached, held = len(run.q), len(assembly.constraints)
    outcome = Outcome(
        analysis, assembly, analysis.times[:reached], run.q, run.v, run.a, run.multipliers[:, :held], None, None,
        run.residual, STATUS[run.status], run.steps, run.rejected, run.evaluations, seconds, integrator,
    )  # fmt: skip
    return in_coordinates_of(outcome, reported)


def _at(times: Array, known: Array, values: Array) -> Array:
    """Values (T, columns), known at some times, at others (K,)."""
    if not values.size:
        return np.zeros((len(times), values.shape[1]))
    from scipy.interpolate import CubicSpline

    result: Array = CubicSpline(known, values)(times)
    return result


def _feed_forward(
    model: Model, analysis: Analysis, source: Outcome, patches: Mapping[str, PatchArray], times: Array
) -> Array:
    """(K, inputs) moments and voltages of the inverse analysis, in the middle of the time for which each is held."""
    assert analysis.sample_time is not None
    voltages = [np.zeros((len(times), len(array.edges))) for array in patches.values()]
    moments = np.zeros((len(times), len(model.motors)))
    middle = np.minimum(times + analysis.delay + analysis.sample_time / 2, source.time[-1])
    if analysis.feed_forward != "none" and source.tau is not None:
        moments, F_p = _found(source, middle)
        if analysis.feed_forward == "joints+pzt" and F_p is not None:
            voltages = [
                allocation(array, limited=not analysis.unlimited).solve(
                    np.ascontiguousarray(F_p[:, source.modal_columns(body)])
                )
                for body, array in patches.items()
            ]
    return np.hstack([moments, *voltages])


def _found(source: Outcome, times: Array) -> tuple[Array, Array | None]:
    """τ and F_p that an inverse analysis found, at any time where it was recorded or is algebraic, else by a spline."""
    moments, F_p = source.motor_moments, source.F_p
    assert moments is not None
    if source.recording is None and source.shape is None:
        return _at(times, source.time, moments), None if F_p is None else _at(times, source.time, F_p)
    tau, F_p = actuation_source(source).sample(times.tolist())
    if source.integrated is not None and F_p is not None:
        F_p = F_p * modal_factors(source.assembly.model)
    return _at(times, source.time, moments) if source.gears else tau, F_p


def _held(times: Array, since: Array, commands: Array, first: Array) -> Array:
    """Commands (T, inputs) that act at `times`; each does from `since` (K,) on, `first` before."""
    which = np.searchsorted(since, times + 1e-9, side="right")
    return np.vstack([first, commands])[which]


def _warnings(analysis: Analysis, controllers: Sequence[Controller], metrics: Metrics, gears: bool) -> list[str]:
    assert analysis.sample_time is not None
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
