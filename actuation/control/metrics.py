"""Metrics of a closed loop: error of the tip, settling, overshoot, vibration, effort: see `DEFINITIONS`.

They are continuous in the motion, so that they do not depend on the steps of an integrator, which round-off decides:
they are read at times independent of the steps (`watched`), and all fits count, weighted by their residuals.
"""

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array
from ...common.libraries import scipy
from ...common.peaks import largest, shares
from ...common.structs import struct

SETTLED = 0.05  # of the largest error
PERIODS = 3.0  # of the lowest frequency, over which what is slower is found
LEAST_PERIODS = 1.5  # likewise, where the tip rests at its last place for no longer
RESTING = 0.1  # of a run, for which it rests at least
CUBIC = 3
NEARBY = np.geomspace(0.6, 1.6, 41)  # times the frequency of the linear model: that of the loop is sought there
EXPLAINED = 0.25  # of what the cubic leaves: what is left beside a vibration, if there is one
PICKY = 8  # power of what fits leave, by which they count
WATCHED = 400  # times of the last period, and of what is before it
FINE = 4000  # intervals of a run, at which its place is read
WINDOW = 100  # samples at least, over which motion that a cubic follows is no vibration, for the verdict
GROWTH = 4.0  # of the vibration's peak, from the second quarter of a run to its last
AT_REST = 1e-6  # of the way to the last place
AT_LIMITS = 0.05  # of the samples
KEPT = 0.5  # of the vibration of a quarter, in its second half
NEGLIGIBLE = 1e-3  # of the largest motion, or of the way
ROUND_OFF = 1e-9  # of the robot's size, and of the largest command
CALM = ("stable", "not settled")

DEFINITIONS = (
    "settling time: the tip error stays below 5 % of its largest value; overshoot: beyond the final position along"
    " the path. Vibration: peak to peak in the last period of the lowest frequency with controlled or locked joints,"
    " without slower motion; final: tip error at the end"
)


@struct
class Metrics:
    """Metrics of one closed-loop run; see `DEFINITIONS`."""

    verdict: str  # see `verdict_of`
    # tip_error_rms, tip_error_max: distance of the tip from its place, m
    tip_error_rms: float
    tip_error_max: float
    # s, after which this distance stays below 5 % of its largest value; NaN where it does not before the end
    settling_time: float
    vibration: float  # of the tip at the end of the run, peak to peak, m
    residual: float  # distance of the tip from its place at the end of the run, m
    motor_work: float  # ∫ Σ |τ γ̇| dt, J
    voltage_effort: float  # ∫ Σ V² dt, V² s
    peak_moment: float  # N·m
    peak_voltage: float  # V
    saturated: float  # part of the samples at which a command is at its limit
    # way of the tip beyond its final place along the line from the first place to it, m
    overshoot: float = np.nan  # from here on not in files of version 0.1
    # about which vibration is measured, Hz, see `ringing`; NaN where the linear model has none
    lowest_frequency: float = np.nan
    vibration_window: float = np.nan  # time before the end of the run from which slower motion is fitted, s


@struct
class LoopMotion:
    """Motion of a closed loop, at outputs and between; SI units."""

    time: Array  # (T,) s
    error: Array  # (T, d) m, of the tip from its place along d axes
    place_at: Callable[[Array], Array]  # function from times (T,), s, to where the tip should be (T, d), m
    rates: Array  # (T, motors) of the joints, rad/s, m/s
    held: Array  # (T, inputs) commands in effect, N·m, N or V
    completed: bool  # whether the run reached its end
    is_disturbed: bool  # whether loads act that the reference does not know
    quiet: float  # time from which the reference rests and loads stay constant, s
    length: float  # size of the robot, m


def ringing(time: Array, place: Array, lowest: float) -> tuple[float, float]:
    """Return about which frequency (Hz) vibration is measured, and how long (s) before the end of `time` (T,), s.

    The frequency is `lowest`, Hz, the time `PERIODS` of its periods, at most that for which the `place` (T, d), m, of
    the tip rests, or half of a run without rest. Where fewer periods fit (at rest: than `LEAST_PERIODS`), the frequency
    is higher.
    """
    whole = float(time[-1] - time[0])
    way = np.linalg.norm(place - place[-1], axis=1)
    rest = float(time[-1]) - _last_crossing(time, way, AT_REST * float(way.max(initial=0.0)))
    room, periods = (rest, LEAST_PERIODS) if rest >= RESTING * whole else (0.5 * whole, PERIODS)
    if not lowest > 0.0 or not room > 0.0:
        return lowest, whole
    frequency = max(lowest, periods / room)
    return frequency, min(room, PERIODS / frequency)


def resting(place_at: Callable[[Array], Array], time: Array) -> tuple[Array, Array]:
    """Evenly spaced times (T,), s, over `time`, and the place (T, d), m, of the tip there, for `ringing`."""
    even = np.linspace(time[0], time[-1], FINE + 1)
    return even, place_at(even)


def watched(end: float, window: float, lowest: float) -> Array:
    """Times (2 `WATCHED` + 1,), s, in the `window` (s) before `end`, half of them in a period of `lowest` Hz."""
    begin = end - (min(window, 1.0 / lowest) if lowest > 0.0 else window)
    before = np.linspace(end - window, begin, WATCHED, endpoint=False)
    return np.concatenate([before, np.linspace(begin, end, WATCHED + 1)])


def vibration(time: Array, error: Array, window: float, lowest: float) -> float:
    """The peak-to-peak vibration (m) of `error` (T, d), m, in the last period of `lowest` (Hz).

    Its slow part over the last `window` (s) of `time` (T,), s, is removed; `time` should have the times `watched`. The
    slow part is the mean of least-squares cubics, each with one vibration near `lowest` or none, weighted by a power of
    their residuals, so that the best decides (G. L. Bretthorst, Bayesian Spectrum Analysis, 1988, ch. 2).
    """
    if not window > 0.0:
        return 0.0
    t = watched(float(time[-1]), window, lowest)
    values = _interpolated(t, time, error)
    weights = np.sqrt(shares(t))[:, None]
    slow = np.vander(2.0 * (t - t[0]) / (t[-1] - t[0]) - 1.0, CUBIC + 1)
    phases = 2.0 * np.pi * lowest * NEARBY[:, None] * t if lowest > 0.0 else ()
    cubics, lefts = [], []
    for shape in (slow, *(np.column_stack([slow, np.cos(phase), np.sin(phase)]) for phase in phases)):
        parts = np.linalg.lstsq(weights * shape, weights * values, rcond=None)[0]
        cubics.append(slow @ parts[: CUBIC + 1])
        lefts.append(float(((weights * (values - shape @ parts)) ** 2).sum()))
    least = np.array([EXPLAINED * lefts[0], *lefts[1:]]) + np.finfo(float).eps * float(((weights * values) ** 2).sum())
    if least.any():
        values = values - np.average(cubics, axis=0, weights=(least.min() / least) ** PICKY)
    last = values[t >= t[-WATCHED - 1]]
    return float(np.sqrt(max(((last - one) ** 2).sum(axis=1).max() for one in last)))


def overshoot(time: Array, place: Array, error: Array) -> float:
    """Return how far (m) the tip, at `place` + `error` (T, d), m, over `time` (T,), s, passes its final position.

    This is along the line from its first place.
    """
    way = place[-1] - place[0]
    length = float(np.linalg.norm(way))
    beyond = np.maximum((place + error - place[-1]) @ way, 0.0)
    return largest(time, beyond)[0] / length if length > 0.0 else 0.0


def _interpolated(times: Array, known: Array, values: Array) -> Array:
    return np.column_stack([np.interp(times, known, column) for column in values.T])


def slow_part(t: Array, values: Array, window: float) -> Array:
    """The part of `values` (T, columns), of any unit, at even times t (T,), s, that is no vibration.

    Cubics over a `window` (s) (Savitzky and Golay 1964). By FFT: SciPy's filter takes a time that grows with T².
    """
    count = 2 * round(window / (2 * (t[1] - t[0]))) + 1 if len(t) > 1 else 1
    if not CUBIC < count <= len(t):
        return np.broadcast_to(values.mean(axis=0), values.shape)
    slow: Array = scipy.signal.oaconvolve(
        values, scipy.signal.savgol_coeffs(count, CUBIC)[:, None], mode="same", axes=0
    )
    x, half = np.linspace(-1.0, 1.0, count), count // 2
    for window_of, ends in ((slice(count), slice(half)), (slice(-count, None), slice(-half, None))):
        slow[ends] = np.vander(x[ends], CUBIC + 1) @ np.polyfit(x, values[window_of], CUBIC)
    return slow


def settling(t: Array, distance: Array) -> float:
    """The time (s) from which `distance` (T,), m, at t (T,), s, stays below 5 % of its maximum; NaN if never."""
    largest_error = float(distance.max())
    return _last_crossing(t, distance, SETTLED * largest_error) if largest_error > 0.0 else 0.0


def _last_crossing(t: Array, values: Array, level: float) -> float:
    """When (s) `values` (T,) last come down to `level`, by a cubic; NaN if they end above it, `t[0]` if never."""
    above = np.flatnonzero(values > level)
    if not above.size:
        return float(t[0])
    k = int(above[-1])
    if k + 1 == len(t):
        return np.nan
    near, step = slice(max(k - 1, 0), k + 3), t[k + 1] - t[k]
    x, y = (t[near] - t[k]) / step, values[near] - level
    roots = np.roots(np.polyfit(x, y, len(x) - 1))
    inside = roots.real[(roots.imag == 0.0) & (roots.real >= 0.0) & (roots.real <= 1.0)]
    share = inside.max(initial=0.0) or (values[k] - level) / (values[k] - values[k + 1])
    return float(t[k] + share * step)


def last_change(values_at: Callable[[Array], Array], time: Array) -> float:
    """The time (s) at which `values_at` (times (T,), s) reaches its value at the end of `time` (T,), s."""
    even, values = resting(values_at, time)
    way = np.linalg.norm(values - values[-1], axis=1)
    changing = np.flatnonzero(way > AT_REST * way.max(initial=0.0))
    return float(even[min(changing[-1] + 1, FINE)]) if changing.size else float(time[0])


def verdict_of(
    run: LoopMotion, cut: Array, asked: tuple[Array, Array], lowest: float, is_stable: bool | None, *, is_seen: bool
) -> str:
    """The verdict on linear loop and run; in the quiet time, from `run.quiet` on, nothing changes.

    "diverges"; "oscillates at its limits": in the last quarter, in which commands are at limits, vibration does not
    decay, or a command goes from one limit to the other; "grows": vibration from quarter to quarter (of path and rest
    without disturbance, or of the quiet time), or commands in the quiet time; "unstable (linear)", by `is_stable`; "not
    settled": the tip does not come to rest in the quiet time; else "stable".

    `cut` (K, inputs) is ±1 where commands are at limits, else 0. `asked`: times (K,), s, of samples and their largest
    command (K,), relative to the largest of all. `lowest` is the frequency, Hz, about which vibration is measured.
    `is_seen`: the motion exceeds noise and resolution of the sensors, else it counts as settled.
    """
    if not run.completed:
        return "diverges"
    even = np.linspace(run.time[0], run.time[-1], len(run.time))
    error, whole = _interpolated(even, run.time, run.error) / run.length, float(np.ptp(even))
    window = min(max(WINDOW * whole / len(cut), PERIODS / lowest if lowest > 0.0 else 0.0), whole / 4)
    still = even >= run.quiet
    parts = [part for part in (~still, still) if part.any()]  # the place of the tip may jump in between
    windows = [min(window, float(np.ptp(even[part])) / 4) for part in parts]
    shaking = np.concatenate(
        [
            np.linalg.norm(error[part] - slow_part(even[part], error[part], of), axis=1)
            for part, of in zip(parts, windows, strict=True)
        ]
    )
    off = np.linalg.norm(error - error[-1], axis=1)
    is_quiet = even[-1] - run.quiet >= RESTING * whole
    third, fourth = (shaking[even >= even[-1] - part * whole].max(initial=0.0) for part in (1 / 4, 1 / 8))
    last = cut[3 * len(cut) // 4 :]
    is_cut = last.any(axis=1).mean() > AT_LIMITS and (is_stable is False or is_quiet)
    alternates = all((half.min(axis=0) * half.max(axis=0) < 0.0).any() for half in np.array_split(last, 2) if len(half))
    if is_cut and (alternates or fourth > max(KEPT * third, NEGLIGIBLE * off.max(initial=0.0))):
        return "oscillates at its limits"
    long = [part for part in parts if part.mean() >= RESTING]
    if (not run.is_disturbed and all(_grows(shaking[part], GROWTH ** part.mean()) for part in long)) or (
        is_quiet and (_grows(shaking[still]) or _grows(asked[1][asked[0] >= run.quiet]))
    ):
        return "grows"
    if is_stable is False:
        return "unstable (linear)"
    period = 1.0 / lowest if lowest > 0.0 else 0.0
    tail = min(max(RESTING * whole, period), (even[-1] - run.quiet) / 2)
    moves, least = off[even >= even[-1] - tail].max(initial=0.0), np.linalg.norm(np.ptp(run.place_at(even), axis=0))
    is_settled = moves <= max(SETTLED * off.max(initial=0.0), NEGLIGIBLE * least / run.length, ROUND_OFF)
    return "stable" if is_settled or not is_quiet or not is_seen else "not settled"


def _grows(shaking: Array, growth: float = GROWTH) -> bool:
    quarters = [part.max(initial=0.0) for part in np.array_split(shaking, 4)]
    return bool(quarters[1] < quarters[2] < quarters[3] and quarters[3] > max(growth * quarters[1], ROUND_OFF))
