"""Position controllers of joints: what motors do under a stream of set points, and the set points for a motion.

Each axis is taken as θ_r = G θ_cmd, which loads do not disturb. Between two set points the command is a straight line,
as controllers of robots interpolate a stream.
"""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array, ComplexArray, as_floats
from ..common.structs import struct
from ..mbs.fields.paths import Piecewise
from .axes import Axis

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
        """Paths of n motors from rest, under set points (T, n) at `times` (T,), s; on to `settled` after the last one.

        Each line of the command is exact: a change of its slope by Δ adds Δ (t − Σρ + Σρ e^(λt)), with the residues ρ
        of G/s² at the poles λ of G.
        """
        delays = np.array([axis.delay for axis in self.axes])
        if delays.any():
            given, times = times, np.unique(np.round(np.add.outer(times, [0.0, *delays]), ROUNDED))
            command = np.transpose([np.interp(times - d, given, of) for d, of in zip(delays, command.T, strict=True)])
        poles, shares = np.zeros((2, max(len(axis.denominator) for axis in self.axes) - 1, len(self.axes)), complex)
        for k, axis in enumerate(self.axes):
            own = axis.poles
            slopes = axis.denominator[0] * np.prod(own[:, None] - own + np.eye(len(own)), axis=1)
            poles[: len(own), k], shares[: len(own), k] = own, np.polyval(axis.numerator, own) / (own**2 * slopes)
        steps = np.append(np.diff(times), self.settled)
        slopes = np.vstack([np.diff(command, axis=0) / np.diff(times)[:, None], np.zeros(command.shape[1])])
        left, later = np.zeros_like(poles), shares.sum(axis=0).real
        nodes, states = [times[:1]], [np.array([command[0], 0.0 * command[0], 0.0 * command[0]])[None]]
        for t, step, u, slope, change in zip(
            times, steps, command, slopes, np.diff(slopes, axis=0, prepend=0.0), strict=True
        ):
            s = step * np.linspace(0.0, 1.0, int(np.ceil(step * np.abs(poles).max() / PART)) + 1)[1:, None]
            decaying = (left + change * shares) * np.exp(poles * s[..., None])
            error, rate, bend = ((decaying * poles**k).sum(axis=1).real for k in range(3))
            nodes.append(t + s[:, 0])
            states.append(np.stack([u + slope * (s - later) + error, slope + rate, bend], axis=1))
            left = decaying[-1]
        return quintics(np.concatenate(nodes), np.concatenate(states))

    @property
    def margins(self) -> tuple[float, float]:
        """By how long (s) set points of `command` begin before motors, and end after them: zeros of G decay."""
        zeros = np.concatenate([np.roots(axis.numerator) for axis in self.axes]).astype(complex)
        before, after = _decay(zeros[zeros.real > 0.0]), _decay(zeros[zeros.real <= 0.0])
        return before, after + float(np.ptp([axis.delay for axis in self.axes]))

    @property
    def is_invertible(self) -> bool:
        """Whether `margins` are short: not of zeros near the imaginary axis, which decay slowly or never."""
        return max(self.margins) <= LASTING

    def command(self, step: float, position: Array, rate: Array) -> Array:
        """Set points (T, n) every `step` s for motors' positions and rates (T, n) that rest at both ends.

        By Fourier transforms: θ_cmd = θ_r + F θ̇_r, F = (e^(−Δs)/(G sinc²) − 1)/s. The longest delay Δ keeps axes
        together; sinc² is what lines between set points leave of a frequency.
        """
        frequency, count = np.fft.rfftfreq(len(rate), step), len(rate)
        s, longest = 2j * np.pi * frequency[1:], max(axis.delay for axis in self.axes)
        F = np.empty((len(frequency), len(self.axes)), dtype=complex)
        for k, axis in enumerate(self.axes):
            F[1:, k] = (np.exp(-longest * s) / (axis.at(s) * np.sinc(frequency[1:] * step) ** 2) - 1) / s
            F[0, k] = axis.delay - longest + axis.denominator[-2] - np.append(0.0, axis.numerator)[-2]
        return as_floats(position + np.fft.irfft(F * np.fft.rfft(rate, axis=0), count, axis=0))


def _decay(poles: ComplexArray) -> float:
    """How long (s) until `LEFT` of the slowest is left; 0 without any, infinite on the imaginary axis."""
    slowest = float(np.abs(poles.real).min(initial=np.inf))
    return float(-np.log(LEFT)) / slowest if slowest else np.inf


def quintics(nodes: Array, states: Array) -> Piecewise:
    """Through positions, rates and accelerations (K, 3, n) at `nodes` (K,), s."""
    h = np.diff(nodes)[:, None]
    (p, v, a), (q, w, b) = states[:-1].transpose(1, 0, 2), states[1:].transpose(1, 0, 2)
    d, v, w, a, b = q - p, v * h, w * h, a * h**2, b * h**2
    fifth, fourth, third = 12 * d - 6 * (v + w) + b - a, 16 * v + 14 * w - 30 * d + 3 * a - 2 * b, 20 * d - 12 * v
    scaled = [fifth / 2, fourth / 2, (third - 8 * w - 3 * a + b) / 2, a / 2, v, p]
    return Piecewise(nodes, np.stack([one / h**k for one, k in zip(scaled, range(5, -1, -1), strict=True)], axis=1))
