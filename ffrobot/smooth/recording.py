"""Motions of all joints with motors of a robot, as a program streams or recorded them, and faults of such a stream."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ..common.arrays import Array, Booleans
from ..common.errors import InputError, did_you_mean, quoted
from ..common.libraries import scipy
from ..common.structs import struct
from ..exchange.motion import read_record
from ..mbs.analysis.pcid import Pcid
from ..mbs.fields.waypoints import column_of, difference_quotients, load_record
from ..mbs.joints.joint import JointRecord
from ..mbs.quantities.motion import joint_motion
from ..mbs.run.record import Run
from ..mbs.scene.analysis import TimedAnalysis
from ..run.solve import solve_scene
from ..run.watcher import Watcher
from ..scene.scene import Scene

TURN = 180 / np.pi
LATE, UNEVEN = 2.5, 0.02  # of the usual step: a gap or a pause, and deviations that are jitter
EVEN = 0.5  # of the roughness by stamps: by even times rows are smoother, so that stamps are off, not rows
ABRUPT, BESIDE = 4.0, 6  # times the differences of so many rows on both sides: a jump
NOTABLE = 0.1  # of the largest speed of a joint: a smaller jump of it is none
STILL = 1e-9  # rad or m: joints that move less stand still
TURNS, MANY = 0.4, 20  # of pairs of second differences change their sign, of so many at least; of white noise 0.73 do
BACK = 0.5  # of a jump of the speed: what is left of it a row later, where the position jumps
ABOVE = 0.3  # of the largest acceleration: a smaller jump of it is none
KEPT = 1e-6  # of a limit, beyond it, or rad or m beyond one of positions: round-off


@struct
class Recording:
    """Set points `values` (T, n), rad or m, of n `joints` at `times` (T,), s, from 0 and increasing.

    `stamps` (S,), s, are the times of all rows as they were written; `rates` (T, n), rad/s or m/s, None unless written.
    """

    joints: tuple[str, ...]
    times: Array
    values: Array
    stamps: Array
    rates: Array | None = None
    remarks: tuple[str, ...] = ()

    @property
    def step(self) -> float:
        """Median time (s) between rows."""
        return float(np.median(np.diff(self.times)))

    @property
    def pauses(self) -> Booleans:
        """(T − 1,) whether joints stand still between two rows that are farther apart than others."""
        is_still = np.abs(np.diff(self.values, axis=0)).max(axis=1) <= STILL
        return is_still & (np.diff(self.times) > LATE * self.step)

    def dense(self, step: float) -> tuple[Array, Array]:
        """Return times (N,), s, at most `step` s apart, and set points (N, n), rad or m, by cubics with recorded rates.

        Without rates both are as recorded.
        """
        if self.rates is None:
            return self.times, self.values
        parts = [np.linspace(a, b, int(np.ceil((b - a) / step)) + 1)[1:]
                 for a, b in zip(self.times[:-1], self.times[1:], strict=True)]  # fmt: skip
        times = np.concatenate([self.times[:1], *parts])
        return times, scipy.interpolate.CubicHermiteSpline(self.times, self.values, self.rates)(times)


def read_recording(path: Path, scene: Scene, *, is_in_degrees: bool = False) -> Recording:
    """Read positions of all joints with motors from a CSV table, a JointTrajectory, or a bag of ROS.

    Raises `InputError` for a joint that is missing or has several coordinates, rows that do not move, and angles that
    seem to be degrees; `SolveError` without the library that reads the file.
    """
    record = load_record(path) if path.suffix.lower() == ".csv" else read_record(path)
    joints = scene.motor_joints
    names = [joint.name for joint in joints]
    if several := [joint.name for joint in joints if len(joint.units) != 1]:
        raise InputError(f"{scene.path}: expected joints of one coordinate each", quoted(several))
    try:
        places = [column_of(record.columns, name) for name in names]
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    columns = list(dict.fromkeys(k for k in places if k is not None))
    if len(columns) < len(names):
        missing = [name for name, k in zip(names, places, strict=True) if k is None] or names  # one is no joint's
        raise InputError(
            f"{path}: expected a column of every joint with a motor (constant where it rests)",
            f"none of {quoted(missing)} among {quoted(record.columns)}{did_you_mean(missing[0], record.columns)}",
        )
    if is_in_degrees and record.units:
        raise InputError(f"{path}: --degrees: expected a header without units", quoted(record.units))
    scale = np.array([1 / TURN if is_in_degrees and joint.units[0] == "rad" else 1.0 for joint in joints])
    values = record.values[:, columns] * scale
    if not is_in_degrees:
        _check_unit(path, joints, values)
    others = [name for k, name in enumerate(record.columns) if k not in columns]
    good = record.times > np.append(-np.inf, np.maximum.accumulate(record.times)[:-1])
    times, values = record.times[good], values[good]
    if len(times) < 4:
        raise InputError(f"{path}: expected at least 4 set points with times that increase", len(times))
    if np.ptp(values, axis=0).max() <= STILL:
        raise InputError(f"{path}: expected joints that move", "none")
    rates = None if record.rates is None else record.rates[good][:, columns] * scale
    remarks = (*record.remarks, *([f"columns left out: {quoted(others)}"] if others else []))
    return without_rest(Recording(tuple(names), times - times[0], values, record.times - times[0], rates, remarks))


def without_rest(recording: Recording) -> Recording:
    """Return the recording up to the time at which it reaches its final position."""
    moving = np.flatnonzero(np.abs(recording.values - recording.values[-1]).max(axis=1) > STILL)
    last = min(int(moving[-1]) + 2, len(recording.times))
    rates = None if recording.rates is None else recording.rates[:last]
    return replace(recording, times=recording.times[:last], values=recording.values[:last], rates=rates)


def planned(scene: Scene, step: float, watcher: Watcher) -> Recording:
    """Solve for the motion along the trajectories of the scene, with rigid gears, every `step` s.

    Raises `InputError` where the scene has none, or no analysis through time says for how long.
    """
    timed = [analysis for analysis in scene.analysis if isinstance(analysis, TimedAnalysis)]
    if not scene.trajectory or not timed:
        raise InputError(f"{scene.path}: expected --path, or trajectories and an analysis with an end", "neither")
    paths = tuple(path.changed(joint=path.motor, motor=None) if path.motor else path for path in scene.trajectory)
    outputs = int(np.ceil(timed[0].end / step - STILL))
    analysis = Pcid(name="plan", kind="pcid", end=outputs * step, output_step=step)
    solution = solve_scene(scene.model_copy(update={"trajectory": paths, "analysis": (analysis,)}), watcher)
    run, joints = solution.analyses["plan"].run, tuple(joint.name for joint in scene.motor_joints)
    return without_rest(Recording(joints, run.time, coordinates(run, joints), run.time))


def coordinates(run: Run, joints: Sequence[str]) -> Array:
    """Return coordinates (T, n) of n joints, behind their gears, rad or m."""
    return np.column_stack([motion[0] for joint in joints if (motion := joint_motion(run, joint))])


def _check_unit(path: Path, joints: Sequence[JointRecord], values: Array) -> None:
    """Refuse angles beyond their limits, or several turns, that would lie within them if they were degrees."""
    for joint, column in zip(joints, values.T, strict=True):
        low, high = joint.position_limits[0]
        low, high = max(low, -2 * np.pi), min(high, 2 * np.pi)
        beyond = max(float(column.max()) - high, low - float(column.min()))
        if joint.units[0] == "rad" and beyond > np.pi and low <= column.min() / TURN and column.max() / TURN <= high:
            raise InputError(
                f"{path}: expected angles in rad",
                f'"{joint.name}" from {column.min():.4g} to {column.max():.4g}: --degrees takes angles in degrees',
            )


@struct
class Fault:
    """Fault of a stream of set points: its `kind`, and a line of text."""

    kind: str
    text: str


def faults_of_stamps(recording: Recording) -> Iterator[Fault]:
    """Yield faults of the times of rows: doubled stamps, steps back, gaps and jitter."""
    steps, usual = np.diff(recording.stamps), recording.step
    if doubled := int(np.count_nonzero(steps == 0.0)):
        yield Fault("doubled stamps", f"{doubled} rows have the time of the row before: only the first counts")
    if back := int(np.count_nonzero(steps < 0.0)):
        yield Fault("steps back", f"times step back at {back} rows: rows before the latest time are left out")
    steps = np.diff(recording.times)
    late = (steps > LATE * usual) & ~recording.pauses
    if recording.rates is None and late.any() and late.mean() < 0.2:
        k = int(np.where(late, steps, 0.0).argmax())
        yield Fault(
            "gap", f"{late.sum()} gaps of up to {1e3 * steps[k]:.3g} ms in the motion, the longest at"
            f" t = {recording.times[k]:.4g} s: lines bridge them",
        )  # fmt: skip
    own = steps[steps <= LATE * usual]
    jitter = np.sqrt(np.mean((own - usual * np.maximum(np.round(own / usual), 1.0)) ** 2))  # rows may be left out
    if recording.rates is None and jitter > UNEVEN * usual:
        is_late = evened(recording) is not recording
        evenly = " Rows are smoother at even times: stamps are late, not the motion" if is_late else ""
        yield Fault(
            "jitter", f"steps of {1e3 * usual:.4g} ms jitter by {1e3 * jitter:.3g} ms (RMS), from"
            f" {1e3 * steps.min():.3g} to {1e3 * own.max():.3g} ms.{evenly}",
        )  # fmt: skip


def evened(recording: Recording) -> Recording:
    """Return the recording with rows at even times, if these make a smoother motion than those of their stamps.

    Even times divide the whole duration but pauses: the median step is off with jitter.
    """
    if recording.rates is not None:
        return recording
    steps = np.diff(recording.times)
    rests = np.append(0.0, np.where(recording.pauses, steps - recording.step, 0.0).cumsum())
    even = rests + np.linspace(recording.times[0], recording.times[-1] - rests[-1], len(recording.times))
    rates = (difference_quotients(times, recording.values)[1] for times in (even, recording.times))
    by_even, by_stamps = (np.mean(np.diff(of, axis=0) ** 2) for of in rates)
    return replace(recording, times=even) if by_even < EVEN**2 * by_stamps else recording


def faults_of_motion(recording: Recording, limits: "Limits", torque: Array) -> Iterator[Fault]:
    """Yield jumps, noise, and exceeded limits; of rows at even times where these are the smoother ones.

    `torque` (n,), N·m or N, is the largest of each motor in the motion.
    """
    motion = evened(recording)
    times, values = motion.dense(motion.step / 4)
    for k, name in enumerate(motion.joints):
        yield from _jumps(name, limits.units[k], times, values[:, k])
        for bound, beyond in zip(limits.positions[k], (values[:, k].min(), values[:, k].max()), strict=True):
            if not limits.positions[k, 0] <= beyond <= limits.positions[k, 1]:
                yield Fault("limit", f"{name}: position {beyond:.4g} beyond its limit of {bound:.4g}")
    words, found = ("speed", "acceleration", "jerk", "torque"), (*peaks(times, values), torque)
    for word, sizes, of in zip(words, found, limits.sizes, strict=True):
        for name, peak, limit in zip(motion.joints, sizes, of, strict=True):
            if peak > limit * (1 + KEPT):
                yield Fault("limit", f"{name}: {word} of up to {peak:.4g}, beyond its limit of {limit:.4g}")


@struct
class Limits:
    """Ranges of `positions` (n, 2), rad or m; `sizes` (4, n): speed, acceleration, jerk (rad or m, s), torque (N·m, N).

    They are infinite without a limit. `units` (n,): "rad" or "m", of the n joints.
    """

    positions: Array
    sizes: Array
    units: tuple[str, ...]


def limits_of(scene: Scene, acceleration: float, jerk: float) -> Limits:
    """Return limits of joints with motors; `acceleration` and `jerk` are in rad/s² and rad/s³ (m/s², m/s³)."""
    joints = scene.motor_joints
    sizes = [(motor.speed, acceleration, jerk, motor.moment) for joint in joints for motor in joint.motor_limits[:1]]
    positions = np.array([joint.position_limits[0] for joint in joints])
    return Limits(positions, np.transpose(sizes), tuple(joint.units[0] for joint in joints))


def peaks(times: Array, values: Array) -> Array:
    """Peaks (3, n) of speed, acceleration, jerk, rad or m, s, of `values` (T, n) at `times` (T,), s, rest to rest."""
    largest, usual = [], float(np.median(np.diff(times)))
    times = np.concatenate([[times[0] - usual], times, [times[-1] + usual]])
    values = np.vstack([values[:1], values, values[-1:]])
    for _ in range(3):
        times, values = difference_quotients(times, values)
        largest.append(np.abs(values).max(axis=0))
    return np.array(largest)


def _jumps(name: str, unit: str, times: Array, values: Array) -> Iterator[Fault]:
    """Of the position or the speed, else of the acceleration; or noise, of which each row is a jump."""
    if np.ptp(values) <= STILL:
        return
    steps = np.diff(times)
    usual = float(np.median(steps))
    rates = np.concatenate([[0.0], np.diff(values) / steps, [0.0]])
    bends = np.diff(rates)
    counts = np.abs(bends) > NOTABLE * np.abs(bends).max()
    pairs = counts[1:] & counts[:-1]
    turns = pairs & (bends[1:] * bends[:-1] < 0.0)
    if pairs.sum() > max(len(bends) / 4, MANY) and turns.sum() > TURNS * pairs.sum():
        yield Fault("noise", f"{name}: second differences of rows change their sign: noise, or too few digits")
        return
    late = np.pad(steps > LATE * usual, 1)
    bridged = late[1:] | late[:-1]
    abrupt = _stands_out(bends, NOTABLE * np.abs(rates).max(), bridged)
    if abrupt.any():
        k = int(abrupt.argmax())
        kind, size = "speed", f"{abrupt[k]:.3g} {unit}/s"
        if abs(bends[max(k - 1, 0) : k + 2].sum()) < BACK * abrupt[k]:  # there and back again
            kind, size = "position", f"{usual * abrupt[k]:.3g} {unit}"
        yield Fault(f"jump of {kind}", f"{name}: {kind} jumps by {size} at t = {times[k]:.4g} s")
        return
    thirds = np.diff(bends, prepend=0.0, append=0.0)
    abrupt = _stands_out(thirds, ABOVE * np.abs(bends).max(), np.append(False, bridged) | np.append(bridged, False))
    if abrupt.any():
        k = int(abrupt.argmax())
        others = int(np.count_nonzero(np.diff(abrupt > 0.0, prepend=False) & (abrupt > 0.0))) - 1
        more = f", and {others} times more" if others > 1 else ", and once more" * others
        size = f"{abs(thirds[max(k - 1, 0) : k + 2].sum()) / usual:.3g} {unit}/s²"  # in up to three rows
        at = times[min(k, len(times) - 1)]
        yield Fault("jump of acceleration", f"{name}: acceleration jumps by {size} at t = {at:.4g} s{more}")


def _stands_out(sizes: Array, least: float, bridged: Booleans) -> Array:
    """Sizes above `ABRUPT` times all near them, but for those next to them, and not of lines over gaps; else 0."""
    sizes = np.where(bridged, 0.0, np.abs(sizes))
    near = np.lib.stride_tricks.sliding_window_view(np.pad(sizes, BESIDE), 2 * BESIDE + 1).copy()
    near[:, BESIDE - 1 : BESIDE + 2] = 0.0
    return np.where(sizes > np.maximum(ABRUPT * near.max(axis=1), least), sizes, 0.0)
