"""The sampled loop that the core calls, and the record of a run: samples, metrics, margins, advice. SI units."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

import numpy as np

from ...common.arrays import Array, Booleans, ComplexArray
from ...common.libraries import scipy
from ...common.peaks import largest, root_mean_square
from ...common.structs import struct
from ...mbs.model.amplifiers import Amplifiers, Played
from ...mbs.run.record import Details
from ...mbs.run.samples import in_order
from .controllers import Controller
from .margins import Feedback, Loops, Margins, advice, loop_eigenvalues, margins
from .metrics import (
    CALM,
    RESTING,
    LoopMotion,
    Metrics,
    overshoot,
    resting,
    ringing,
    settling,
    verdict_of,
    vibration,
    watched,
)
from .observer import Estimates
from .records import JointPid, SampledAnalysis
from .robot import Setup
from .signals import Filter, Signal

JITTER = 20.0  # times noise and resolution of a sensor: less motion it may not see
SAMPLES_PER_PERIOD = 10  # of the fastest motion that a controller acts on (Franklin, Powell and Workman ask for 20)


class Loop:
    """Sampled loop, called by the core at every sample: sensor errors, controllers, limits."""

    def __init__(
        self, setup: Setup, read: Sequence[Signal], controllers: Sequence[Controller], range: Array, seed: int
    ) -> None:
        samples, T = (len(setup.times), len(read)), setup.sample_time
        noise = np.array([signal.sensor.deviation(T) for signal in read])
        bias = np.array([signal.sensor.bias for signal in read])
        self._errors = bias + np.random.default_rng(seed).standard_normal(samples) * noise
        resolution = np.array([signal.sensor.resolution for signal in read])
        self._coarse = np.flatnonzero(resolution)
        self._resolution = resolution[self._coarse]
        self._largest = np.array([signal.sensor.range or np.inf for signal in read])
        self._every = np.array([round((signal.sensor.sample_time or T) / T) for signal in read])
        self.is_slow = bool((self._every > 1).any())
        self._filter = Filter(read, T)
        self._controllers, self._range, self._feed_forward = controllers, range, setup.feed_forward
        self.blur = resolution + noise  # (outputs,)
        self.readings = np.zeros(samples)
        self.commands, self.wanted = np.zeros_like(setup.feed_forward), np.zeros_like(setup.feed_forward)
        self.first: Array = np.clip(setup.feed_forward[0], *range)
        self.taken = 0

    @property
    def at_limits(self) -> Booleans:
        """Whether commands (K, inputs) are at limits, also if a controller has cut them itself."""
        lowest, highest = self._range * (1.0 - 1e-9)
        return (self.commands[: self.taken] <= lowest) | (self.commands[: self.taken] >= highest)

    def __call__(self, k: int, _t: float, y: Array) -> Array:
        """The commands (inputs,) at sample k for the true values y (outputs,) of readings."""
        y = np.minimum(np.maximum(self._filter(y) + self._errors[k], -self._largest), self._largest)
        if self._coarse.size:
            y[self._coarse] = np.round(y[self._coarse] / self._resolution) * self._resolution
        if k and self.is_slow:
            y = np.where(k % self._every == 0, y, self.readings[k - 1])
        wanted = self._feed_forward[k].copy()
        for controller in self._controllers:
            wanted += controller(k, y)
        command: Array = np.minimum(np.maximum(wanted, self._range[0]), self._range[1])
        self.readings[k], self.wanted[k], self.commands[k], self.taken = y, wanted, command, k + 1
        return command


class AmplifiedLoop:
    """Sampled loop with amplifiers, called at every step: motor commands, and mean voltages behind the amplifiers.

    `directions` (k, n_v) times v: current, A, by the strain of each of k patches; states end with v and a.
    """

    def __init__(
        self,
        loop: Loop,
        at_sample: Callable[[int, float, Array], Array],
        samples: Array,
        T: float,
        *,
        amplifiers: Amplifiers,
        directions: Array,
    ) -> None:
        # steps of a sample: two in the shortest time constant, four where rates or currents have limits, at most 20,
        # as few as divide delays
        lag = amplifiers.lag[amplifiers.lag > 0.0].min(initial=np.inf)
        parts = np.arange(np.clip(np.ceil(2 * T / lag), 4 if amplifiers.has_rates else 1, 20), 21)
        late = np.outer(parts, amplifiers.delay / T)
        self._parts = int(parts[np.abs(late - np.rint(late)).max(axis=1).round(1).argmin()])
        self._loop, self._at_sample, self._samples, self._amplifiers = loop, at_sample, samples, amplifiers
        self._directions, self._h = directions, T / self._parts
        self.times: Array = (samples[:, None] + self._h * np.arange(self._parts)).ravel()
        self.first, self.taken = loop.first, 0
        self.commands = np.zeros((len(self.times), len(self.first)))
        self._compensated, self._played = Played(amplifiers.compensator), Played(amplifiers.hysteresis)
        motors = len(self.first) - len(directions)
        self._now = self._compensated.at(self.first[motors:])
        self.first = np.append(self.first[:motors], self._played.at(self._now))

    def __call__(self, k: int, t: float, state: Array) -> Array:
        """The commands (inputs,) in step k from t (s) on, for the `state` there."""
        if k % self._parts == 0:
            self._at_sample(k // self._parts, t, state)
        loop, motors = self._loop, len(self.first) - len(self._now)
        last = loop.commands[loop.taken - 1]
        wanted = np.array([self._wanted(t, motors + j, d) for j, d in enumerate(self._amplifiers.delay)])
        wanted = self._compensated.at(wanted)
        v, a = np.split(state[-2 * self._directions.shape[1] :], 2)
        strain = self._directions @ (v + self._h / 2 * a)  # half way
        self._now, mean = self._amplifiers.advance(self._h, self._now, (wanted, wanted), strain)
        command: Array = np.concatenate([last[:motors], self._played.at(mean, self._now)])
        self.commands[k], self.taken = command, k + 1
        return command

    def _wanted(self, t: float, column: int, delay: float) -> float:
        """Mean over a step from `t` (s) on of a command that acts `delay` (s) after its sample, once it changes."""
        loop, h = self._loop, self._h
        k = int(np.searchsorted(self._samples[: loop.taken], t + h * (1.0 - 1e-9) - delay, side="right"))
        known = [loop.first[column]] * 2 + [*loop.commands[max(k - 2, 0) : k, column]]
        late = np.clip((self._samples[k - 1] + delay - t) / h, 0.0, 1.0)
        return float((1.0 - late) * known[-1] + late * known[-2])


def measure(run: LoopMotion, setup: Setup, loop: Loop, lowest: float, is_stable: bool | None) -> Metrics:
    """The metrics of a run; `lowest`: frequency of the robot with joints controlled or locked, Hz, or NaN.

    `is_stable`: whether the sampled linear loop is stable; None if not known.
    """
    t, motors = run.time, len(setup.robot.motors)
    distance = np.linalg.norm(run.error, axis=1)
    taken = slice(loop.taken)
    moments, volts = loop.commands[taken, :motors], loop.commands[taken, motors:]
    work = np.abs(run.held[:, :motors] * run.rates).sum(axis=1)
    cut = np.sign(loop.commands[taken]) * loop.at_limits
    most = float(np.abs(loop.wanted[taken]).max(initial=0.0)) or 1.0
    asked = setup.times[taken], np.abs(loop.wanted - setup.feed_forward)[taken].max(axis=1, initial=0.0) / most
    lowest, window = ringing(*resting(run.place_at, t), lowest)
    end, blurred = slice(loop.taken - max(round(RESTING * loop.taken), 1), loop.taken), loop.blur > 0.0
    moves = np.ptp(loop.readings[end] - setup.reference[end], axis=0)  # by noise and resolution alone?
    is_seen = not blurred.any() or bool((moves > JITTER * loop.blur)[blurred].any())
    return Metrics(
        verdict=verdict_of(run, cut, asked, lowest, is_stable, is_seen=is_seen),
        tip_error_rms=root_mean_square(t, distance),
        tip_error_max=largest(t, distance)[0],
        settling_time=settling(t, distance),
        vibration=vibration(t, run.error, window, lowest),
        residual=float(distance[-1]),
        motor_work=float(((work[1:] + work[:-1]) / 2 * np.diff(t)).sum()),
        voltage_effort=float((volts**2).sum() * setup.sample_time),
        peak_moment=float(np.abs(moments).max(initial=0.0)),
        peak_voltage=float(np.abs(volts).max(initial=0.0)),
        saturated=float(cut.any(axis=1).mean()),
        overshoot=overshoot(t, run.place_at(t), run.error),
        lowest_frequency=lowest,
        vibration_window=window,
    )


@struct
class LoopRecord(Details):
    """Samples, metrics, margins and advice of a closed loop."""

    # names of commands and readings
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    time: Array  # (K,) s, of the samples taken
    readings: Array  # (K, outputs) in units of the sensors: rad, m, V and their rates
    reference: Array  # (K, outputs) readings on the reference motion, in the same units
    commands: Array  # (K, inputs) within limits, N·m, N or V
    wanted: Array  # (K, inputs) before limits, likewise
    tip_error_peak_time: float  # s, when the tip error is largest
    metrics: Metrics
    margins: Margins | None  # by the linear model; None where controllers, or the robot, are not linear
    poles: ComplexArray | None  # eigenvalues (n,), no unit, of the linear loop at the start, from sample to sample
    warnings: tuple[str, ...]
    advice: tuple[str, ...] = ()  # what to try, a text each, where the loop is not stable
    # controllers as a linear law about the reference, by time (s): at the start, or along a schedule
    feedback: Mapping[float, Feedback] = field(default_factory=dict)
    tip_error: Array = field(default_factory=lambda: np.zeros(0))  # (T,) m at the outputs of the run
    estimate: Estimates | None = None  # estimates of an observer; None without one


def between(times: Array, known: Array, values: Array) -> Array:
    """Interpolate `values` (T, columns), of any unit, from times `known` (T,) to `times` (K,), s, by a cubic spline."""
    if not values.size:
        return np.zeros((len(times), values.shape[1]))
    return scipy.interpolate.CubicSpline(known, values)(times)


def held_commands(times: Array, samples: Array, delay: float, loop: Loop | AmplifiedLoop, after: float) -> Array:
    """The commands (T, inputs), N·m, N or V, in effect `after` seconds past `times` (T,), s.

    A command of `samples` (K,), s, acts `delay` (s) later.
    """
    taken = slice(loop.taken)
    which = np.searchsorted(samples[taken], times + (after - delay), side="right")
    return np.where(which[:, None] > 0, loop.commands[which - 1], loop.first)


def times_of_run(outputs: Array, place_at: Callable[[Array], Array], lowest: float) -> tuple[Array, list[int]]:
    """Times (T,), s, of a run: its outputs, and those at which vibration about `lowest` (Hz) is measured.

    The second result has indices of the `outputs` among them. `place_at` returns where the tip should be, m.
    """
    frequency, window = ringing(*resting(place_at, outputs), lowest)
    more = watched(float(outputs[-1]), window, frequency)
    times = np.concatenate([outputs, more])[in_order(outputs, more)]
    return times, [int(k) for k in np.searchsorted(times, outputs)]


def loop_record(
    analysis: SampledAnalysis,
    setup: Setup,
    loop: Loop,
    acting: Sequence[Controller],
    run: LoopMotion,
    *,
    loops: Loops,
    lowest: float,
) -> LoopRecord:
    """The record of a run under the controllers `acting`; margins are of the linear `loops`.

    `lowest`: frequency, Hz, of the robot with joints controlled or locked; NaN if nothing vibrates.
    """
    taken = slice(loop.taken)
    T, delay = analysis.sample_time, analysis.delay
    found = margins(loops, T, delay) if loops else None
    metrics = measure(run, setup, loop, lowest, None if found is None else found.is_stable)
    warnings = tuple(_warnings(analysis, acting, metrics, found))
    pids = [controller for controller in analysis.controller if isinstance(controller, JointPid)]
    texts: list[str] = []
    if found is not None and metrics.verdict not in CALM:
        texts = advice(loops, pids if len(pids) == len(analysis.controller) else (), T, delay, found)
    return LoopRecord(
        inputs=setup.inputs,
        outputs=setup.outputs,
        time=setup.times[taken],
        readings=loop.readings[taken],
        reference=setup.reference[taken],
        commands=loop.commands[taken],
        wanted=loop.wanted[taken],
        tip_error_peak_time=largest(run.time, np.linalg.norm(run.error, axis=1))[1],
        metrics=metrics,
        warnings=warnings,
        margins=found,
        advice=tuple(texts),
        poles=loop_eigenvalues(*loops[0], T, delay) if loops else None,
    )


def _warnings(
    analysis: SampledAnalysis, controllers: Sequence[Controller], metrics: Metrics, found: Margins | None
) -> list[str]:
    lines = [line for controller in controllers for line in getattr(controller, "warnings", ())]
    fastest = max((controller.bandwidth for controller in controllers), default=0.0)
    sampling = 2 * np.pi / analysis.sample_time
    if sampling < SAMPLES_PER_PERIOD * fastest:
        lines.append(
            f"sampling at {sampling / (2 * np.pi):.4g} Hz is slow for a controller that acts up to"
            f" {fastest / (2 * np.pi):.4g} Hz: expected at least {SAMPLES_PER_PERIOD} samples a period"
        )
    if metrics.verdict not in CALM:
        by_model = "" if found is None else f" (largest |eigenvalue| of the sampled linear loop: {found.radius:.6g})"
        why = ": gains too high for sampling and delay, or for the links?" if controllers else ""
        lines.append(f"loop {metrics.verdict}{by_model}{why}")
    return lines
