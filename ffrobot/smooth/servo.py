"""Position controllers of joints: transfer functions, what motors do under set points, and set points for a motion.

Each axis is taken as θ_r = G θ_cmd, which loads do not disturb. Between two set points the command is a straight line,
as controllers of robots interpolate a stream. G is of a bandwidth, of polynomials, or fitted to a measured response.
"""

from functools import partial, reduce
from pathlib import Path

import numpy as np

from ..common.arrays import Array, ComplexArray
from ..common.errors import InputError
from ..common.libraries import scipy
from ..common.structs import struct
from ..common.toml_files import read_csv
from ..mbs.fields.paths import Piecewise
from ..mbs.fields.waypoints import numbers_of

APART = 1e-4  # of a pole: nearer ones are moved so far apart, which changes G by 1e-8
UNITY = 1e-3  # by which G(0) may be off 1
CLOSE = 0.01  # by which G may be off measured values (RMS) before more poles are tried
PAIRS, FASTEST = (1, 2, 3), 10.0  # of poles, and how many times the largest measured frequency they may be
OVERDAMPED = 1e3  # largest damping ratio of fitted poles, and one over the least
POOR = 0.2  # of a measured response: a fit that is off by more (RMS) is none
FEWEST = 4  # rows of a measured response, at as many frequencies
COLUMNS = ["frequency", "magnitude", "phase"]


@struct
class Axis:
    """Controller of one joint, motor angle by set point: G(s) = e^(−delay·s) numerator/denominator, `delay` in s.

    Coefficients (k,), powers of s, begin with the highest power; the last is 1. `words` describe it in messages.
    """

    numerator: Array
    denominator: Array
    delay: float = 0.0
    words: str = ""

    @property
    def poles(self) -> ComplexArray:
        """Poles (k,) of G, 1/s, none of them double."""
        roots = np.roots(self.denominator)
        is_real = np.abs(roots.imag) < APART * np.abs(roots)
        real, upper = np.sort(roots[is_real].real), np.sort_complex(roots[~is_real & (roots.imag > 0.0)])
        for of in (real, upper):
            for k in np.flatnonzero(np.abs(np.diff(of)) < APART * np.abs(of[1:])):
                of[k : k + 2] *= [1 + APART, 1 - APART]
        return np.concatenate([real, upper, upper.conj()])

    def at(self, s: ComplexArray) -> ComplexArray:
        """Return G (…), a ratio of angles or of displacements, at s (…), 1/s."""
        return np.asarray(np.exp(-self.delay * s) * np.polyval(self.numerator, s) / np.polyval(self.denominator, s))


def axis_of(servo: float | str, ratio: float) -> Axis:
    """Axis of `servo`: a natural frequency (Hz) of damping `ratio`, "NUMERATOR / DENOMINATOR", or a CSV table.

    A frequency stands for ω²/(s² + 2ζω s + ω²). Behind the denominator, whose numbers have blanks between them,
    "/ DELAY" (s) may follow. The table has measured values: frequency (Hz), magnitude, phase (degrees).

    Raises `InputError` for an axis that is not stable, does not come to its command, or follows jumps of its rate.
    """
    try:
        parts = [np.array([float(word) for word in part.split()]) for part in str(servo).split("/")]
    except ValueError:
        return _measured(Path(str(servo)))
    if len(parts) == 1 and parts[0].size == 1:
        (omega,) = 2 * np.pi * parts[0]
        if not (0.0 < omega < np.inf and 0.0 < ratio < np.inf):
            found = f"{omega / 2 / np.pi:g} Hz and {ratio:g}"
            raise InputError("servo: expected a frequency above 0 Hz and a damping ratio above 0", found)
        words = f"{parts[0][0]:.3g} Hz, damping ratio {ratio:.3g}"
        return Axis(np.ones(1), np.array([omega**-2, 2 * ratio / omega, 1.0]), words=words)
    numerator, denominator, delay = (
        (*parts, np.zeros(1), np.zeros(0))[:3] if len(parts) in (2, 3) else [np.zeros(0)] * 3
    )
    numerator, denominator = np.trim_zeros(numerator, "f"), np.trim_zeros(denominator, "f")
    is_axis = numerator.size and len(denominator) >= len(numerator) + 2 and delay.size == 1 and 0.0 <= delay[0] < np.inf
    if not (is_axis and np.isfinite([*numerator, *denominator]).all() and np.roots(denominator).real.max() < 0.0
            and abs(numerator[-1] - denominator[-1]) <= UNITY * abs(denominator[-1])):  # fmt: skip
        raise InputError(
            'servo: expected "NUMERATOR / DENOMINATOR" or "… / … / DELAY", stable, equal to 1 at s = 0, with at least'
            " two poles more than zeros",
            f'"{servo}"',
        )
    return Axis(numerator / numerator[-1], denominator / denominator[-1], float(delay[0]), str(servo))


def _measured(path: Path) -> Axis:
    """Fitted to a CSV table. Raises `InputError` naming file and line."""
    header, rows = read_csv(path, "table of a frequency response")
    if header != COLUMNS or len(rows) < FEWEST:
        expected = f"columns {','.join(COLUMNS)} and at least {FEWEST} rows"
        raise InputError(f"{path}: expected {expected}", f"{','.join(header)!r} and {len(rows)}")
    frequency, magnitude, phase = np.transpose([numbers_of(path, line, row, 3) for line, row in rows])
    if min(frequency.min(), magnitude.min()) <= 0.0 or len(np.unique(frequency)) < FEWEST:
        raise InputError(f"{path}: expected magnitudes above 0 at {FEWEST} or more frequencies above 0", "others")
    response = magnitude * np.exp(1j * np.radians(phase))
    axis = fitted(frequency, response)
    missed, size = (np.sqrt(np.mean(np.abs(of) ** 2)) for of in (axis.at(2j * np.pi * frequency) - response, response))
    off = float(missed / min(size, 1.0))
    if not off <= POOR:
        raise InputError(
            f"{path}: expected magnitudes (1 at low frequencies, not dB) and phases (degrees, negative where motors"
            " lag) of a controller",
            f"ones that {2 * PAIRS[-1]} poles are {100 * off:.0f} % off (RMS)",
        )
    return axis


def fitted(frequency: Array, response: ComplexArray) -> Axis:
    """Fit the axis of fewest poles that is near a complex `response` (F,), a ratio, at frequencies (F,), Hz.

    Least squares of G with pairs of poles ω²/(s² + 2ζω s + ω²), two zeros less, and a delay; the nearest if none is
    near.
    """
    s = 2j * np.pi * frequency
    unit = float(abs(s[int((np.abs(response) < np.sqrt(0.5)).argmax()) or -1]))  # rad/s, where it falls by 3 dB

    def axis(x: Array, pairs: int, words: str = "") -> Axis:
        omega, ratio = unit * np.exp(x[:pairs]), np.exp(x[pairs : 2 * pairs])
        sections = np.column_stack([omega**-2, 2 * ratio / omega, np.ones(pairs)])
        numerator = np.append(x[2 * pairs : -1] / unit ** np.arange(2 * pairs - 2, 0, -1), 1.0)
        return Axis(numerator, reduce(np.polymul, sections), float(x[-1]) / unit, words)

    def off(x: Array, pairs: int) -> Array:
        return (axis(x, pairs).at(s) - response).view(float)

    fits = list[tuple[float, Axis]]()
    for pairs in PAIRS:
        start = np.concatenate([np.log(1.5) * np.arange(pairs), np.full(pairs, np.log(0.7)), np.zeros(2 * pairs - 1)])
        start[-1] = 0.01
        low, high = np.full((2, len(start)), np.inf) * [[-1.0], [1.0]]
        low[-1], high[:pairs] = 0.0, np.log(FASTEST * np.abs(s).max() / unit)
        low[pairs : 2 * pairs], high[pairs : 2 * pairs] = -np.log(OVERDAMPED), np.log(OVERDAMPED)
        fit = scipy.optimize.least_squares(partial(off, pairs=pairs), start, bounds=(low, high), x_scale="jac")
        error = float(np.sqrt(2 * fit.cost / len(s)))
        words = f"measured: {2 * pairs} poles, delay {1e3 * fit.x[-1] / unit:.3g} ms, off by {100 * error:.2g} % (RMS)"
        fits.append((error, axis(fit.x, pairs, words)))
        if error < CLOSE:
            break
    return min(fits, key=lambda one: one[0])[1]


ROUNDED = 9  # digits of times (s) of delayed set points
LEFT = 1e-6  # of a step: what the controller has left to do counts as done
LASTING = 10.0  # s of set points before or after a motion, at most, in which zeros of controllers decay
PART = 0.5  # of 1/|pole| at most between the nodes of a motor's path: its quintics are off by 3e-7 of a step


@struct
class Servo:
    """Position controllers of n joints."""

    axes: tuple[Axis, ...]

    @property
    def settled(self) -> float:
        """Time (s) until the slowest controller has reduced a step to `LEFT` of it."""
        return max(axis.delay + _decay(axis.poles) for axis in self.axes)

    def motors(self, times: Array, command: Array) -> Piecewise:
        """Paths of n motors from rest by set points (T, n), rad or m, at `times` (T,), s, then for `settled` s or more.

        Responses to lines between set points are exact.
        """
        moves = np.diff(command, axis=0).any(axis=1)
        ends = np.append(True, moves) | np.append(moves, True)  # not set points within a pause
        times, command = times[ends], command[ends]
        delays = np.array([axis.delay for axis in self.axes])
        if delays.any():
            given, times = times, np.unique(np.round(np.add.outer(times, [0.0, *delays]), ROUNDED))
            command = np.transpose([np.interp(times - d, given, of) for d, of in zip(delays, command.T, strict=True)])
        poles, shares = np.zeros((2, max(len(axis.denominator) for axis in self.axes) - 1, len(self.axes)), complex)
        for k, axis in enumerate(self.axes):
            own = axis.poles
            slopes = axis.denominator[0] * np.prod(own[:, None] - own + np.eye(len(own)), axis=1)
            poles[: len(own), k], shares[: len(own), k] = own, np.polyval(axis.numerator, own) / (own**2 * slopes)
        steps, lasting = np.append(np.diff(times), self.settled), 4.0 * self.settled  # 1e-24 is left
        slopes = np.vstack([np.diff(command, axis=0) / np.diff(times)[:, None], np.zeros(command.shape[1])])
        left, later = np.zeros_like(poles), shares.sum(axis=0).real
        nodes, states = [times[:1]], [np.array([command[0], 0.0 * command[0], 0.0 * command[0]])[None]]
        for t, step, u, slope, change in zip(
            times, steps, command, slopes, np.diff(slopes, axis=0, prepend=0.0), strict=True
        ):
            brief = lasting if step > 2.0 * lasting else step  # behind that the path is a line
            parts = np.linspace(0.0, brief, int(np.ceil(brief * np.abs(poles).max() / PART)) + 1)
            s = np.unique(np.append(parts, step))[1:, None]
            decaying = (left + change * shares) * np.exp(poles * s[..., None])
            error, rate, bend = ((decaying * poles**k).sum(axis=1).real for k in range(3))
            nodes.append(t + s[:, 0])
            states.append(np.stack([u + slope * (s - later) + error, slope + rate, bend], axis=1))
            left = decaying[-1]
        return quintics(np.concatenate(nodes), np.concatenate(states))

    @property
    def margins(self) -> tuple[float, float]:
        """Times (s) by which set points of `command` begin before motors, and end after them.

        Responses at the zeros of controllers G(s) decay meanwhile.
        """
        zeros = np.concatenate([np.roots(axis.numerator) for axis in self.axes]).astype(complex)
        before, after = _decay(zeros[zeros.real > 0.0]), _decay(zeros[zeros.real <= 0.0])
        return before, after + float(np.ptp([axis.delay for axis in self.axes]))

    @property
    def is_invertible(self) -> bool:
        """Whether inverse controllers settle soon: slowly, if zeros of a controller are near the imaginary axis."""
        return max(self.margins) <= LASTING

    def command(self, step: float, position: Array, rate: Array) -> Array:
        """Set points (T, n) every `step` s for `position` and `rate` (T, n), rad or m, s, of motors from rest to rest.

        By Fourier transforms with inverse controllers. The longest delay of a controller keeps axes together.
        """
        # θ_cmd = θ_r + F θ̇_r, F = (e^(−Δs)/(G sinc²) − 1)/s, sinc² for straight lines between set points.
        frequency, count = np.fft.rfftfreq(len(rate), step), len(rate)
        s, longest = 2j * np.pi * frequency[1:], max(axis.delay for axis in self.axes)
        F = np.empty((len(frequency), len(self.axes)), dtype=complex)
        for k, axis in enumerate(self.axes):
            F[1:, k] = (np.exp(-longest * s) / (axis.at(s) * np.sinc(frequency[1:] * step) ** 2) - 1) / s
            F[0, k] = axis.delay - longest + axis.denominator[-2] - np.append(0.0, axis.numerator)[-2]
        return position + np.fft.irfft(F * np.fft.rfft(rate, axis=0), count, axis=0)


def _decay(poles: ComplexArray) -> float:
    """How long (s) until `LEFT` of the slowest is left; 0 without any, infinite on the imaginary axis."""
    slowest = float(np.abs(poles.real).min(initial=np.inf))
    return float(-np.log(LEFT)) / slowest if slowest else np.inf


def quintics(nodes: Array, states: Array) -> Piecewise:
    """Path of quintics through positions, rates, accelerations `states` (K, 3, n), rad or m, s, at `nodes` (K,), s."""
    h = np.diff(nodes)[:, None]
    (p, v, a), (q, w, b) = states[:-1].transpose(1, 0, 2), states[1:].transpose(1, 0, 2)
    d, v, w, a, b = q - p, v * h, w * h, a * h**2, b * h**2
    fifth, fourth, third = 12 * d - 6 * (v + w) + b - a, 16 * v + 14 * w - 30 * d + 3 * a - 2 * b, 20 * d - 12 * v
    scaled = [fifth / 2, fourth / 2, (third - 8 * w - 3 * a + b) / 2, a / 2, v, p]
    return Piecewise(nodes, np.stack([one / h**k for one, k in zip(scaled, range(5, -1, -1), strict=True)], axis=1))
