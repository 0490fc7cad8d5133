"""What the core asks at every sample of a closed loop, and what a run leaves: samples, metrics, margins, advice."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...common.arrays import Array, ComplexArray
from ...common.peaks import largest
from ...common.structs import struct
from ...mbs.run.outcome import Details
from ...mbs.run.samples import in_order
from .amplified_loop import AmplifiedLoop
from .controllers import Controller, Loop, Setup
from .margins import Feedback, Loops, Margins, advice, loop_eigenvalues, margins
from .metrics import CALM, Followed, Metrics, measure, resting, ringing, watched
from .observer import Estimates
from .records import ComputedTorque, JointPid, SampledAnalysis

SAMPLES_PER_PERIOD = 10  # of the fastest motion that a controller acts on (Franklin, Powell and Workman ask for 20)


@struct
class LoopRecord(Details):
    """What happened at the samples of a closed loop."""

    # inputs, outputs: names of commands and readings
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    time: Array  # (K,) s; the last sample is the last that was taken
    readings: Array  # (K, outputs)
    reference: Array  # (K, outputs) what they would be on the reference motion
    commands: Array  # (K, inputs) within limits
    wanted: Array  # before
    tip_error: Array  # (T,) m at the outputs of the run
    tip_error_peak_time: float  # s, of the largest at all times
    metrics: Metrics  # how well it went
    warnings: tuple[str, ...]  # one line each
    margins: Margins | None = None  # by the linear model; None where controllers, or the robot, are not linear
    advice: tuple[str, ...] = ()  # what to try, a text each, where the loop is not stable
    feedback: Feedback | None = None  # from readings to commands at the start, off the reference; None likewise
    poles: ComplexArray | None = None  # of the linear loop there, from sample to sample
    estimate: Estimates | None = None  # of an observer


def sample_times(outputs: Array, T: float) -> Array:
    """(K,) s: every T, from the first output to before the last."""
    return outputs[0] + np.arange(int(np.ceil(np.ptp(outputs) / T * (1 - 1e-12)))) * T


def held_until(times: Array, analysis: SampledAnalysis, end: float) -> Array:
    """The middle of the time for which the command of each sample is held, up to `end`, s."""
    return np.minimum(times + analysis.delay + analysis.sample_time / 2, end)


def between(times: Array, known: Array, values: Array) -> Array:
    """Values (T, columns), known at some times, at others (K,)."""
    if not values.size:
        return np.zeros((len(times), values.shape[1]))
    from scipy.interpolate import CubicSpline

    return CubicSpline(known, values)(times)


def held_commands(times: Array, samples: Array, delay: float, loop: Loop | AmplifiedLoop, after: float = 1e-9) -> Array:
    """Commands (T, inputs) that act at `times`, or `after` (s) them: accelerations are those before a change."""
    taken = slice(loop.taken)
    which = np.searchsorted(samples[taken] + delay, times + after, side="right")
    return np.vstack([loop.first, loop.commands[taken]])[which]


def times_of_run(outputs: Array, place_at: Callable[[Array], Array], lowest: float) -> tuple[Array, list[int]]:
    """Times (T,), s, of a run: its outputs, and those at which vibration about `lowest` (Hz) is measured.

    Beside them the rows of the outputs. `place_at` as in `Followed`.
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
    runs: tuple[Followed, Followed],
    loops: Loops,
    lowest: float,
    *,
    gears: bool,
) -> LoopRecord:
    """Of a run at its outputs, and at these and between; linear `loops` on the reference, none where it has none.

    `lowest`: as in `measure`. `gears`: some give.
    """
    taken, (at_outputs, run) = slice(loop.taken), runs
    T, delay = analysis.sample_time, analysis.delay
    found = margins(loops, T, delay) if loops else None
    metrics = measure(run, setup, loop, lowest, None if found is None else found.is_stable)
    tip_error = np.linalg.norm(at_outputs.error, axis=1)
    warnings = tuple(_warnings(analysis, acting, metrics, found, gears))
    pids = [controller for controller in analysis.controller if isinstance(controller, JointPid)]
    texts: list[str] = []
    if found is not None and metrics.verdict not in CALM:
        texts = advice(loops, pids if len(pids) == len(analysis.controller) else (), T, delay, found)
    return LoopRecord(
        setup.inputs, setup.outputs, setup.times[taken], loop.readings[taken], setup.reference[taken],
        loop.commands[taken], loop.wanted[taken], tip_error,
        largest(run.time, np.linalg.norm(run.error, axis=1))[1], metrics, warnings, found, tuple(texts),
        *((loops[0][1], loop_eigenvalues(*loops[0], T, delay)) if loops else ()),
    )  # fmt: skip


def _warnings(
    analysis: SampledAnalysis, controllers: Sequence[Controller], metrics: Metrics, found: Margins | None, gears: bool
) -> list[str]:
    lines = [line for controller in controllers for line in getattr(controller, "warnings", ())]
    fastest = max((controller.bandwidth for controller in controllers), default=0.0)
    sampling = 2 * np.pi / analysis.sample_time
    if sampling < SAMPLES_PER_PERIOD * fastest:
        lines.append(
            f"sampling at {sampling / (2 * np.pi):.4g} Hz is slow for a controller that acts up to"
            f" {fastest / (2 * np.pi):.4g} Hz: expected at least {SAMPLES_PER_PERIOD} samples a period"
        )
    if gears and any(isinstance(record, ComputedTorque) for record in analysis.controller):
        lines.append("the controller is designed for rigid gears, but some are compliant")
    if metrics.verdict not in CALM:
        by_model = "" if found is None else f" (largest |eigenvalue| of the sampled linear loop: {found.radius:.6g})"
        why = ": gains too high for sampling and delay, or for the links?" if controllers else ""
        lines.append(f"loop {metrics.verdict}{by_model}{why}")
    return lines
