"""Position controllers of joints: what motors do under a stream of set points, and the set points for a motion.

Each axis is taken as θ_r = G θ_cmd with G = ω²/(s² + 2ζω s + ω²), which loads do not disturb. Between two set points
the command is a straight line, as controllers of robots interpolate a stream.
"""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.structs import struct
from ..mbs.fields.paths import Piecewise

LEFT = 1e-6  # of a step: what the controller has left to do counts as done
PART = 0.5  # of 1/ω at most between the nodes of a motor's path: its quintics are off by 3e-7 of a step


@struct
class Servo:
    """Position controllers of n joints: natural frequencies ω (n,), rad/s, and damping ratio ζ, 0 < ζ < 1."""

    omega: Array
    ratio: float

    @property
    def settled(self) -> float:
        """Time (s) until the slowest controller has reduced a step to `LEFT` of it."""
        return float(-np.log(LEFT) / (self.ratio * self.omega.min()))

    def motors(self, times: Array, command: Array) -> Piecewise:
        """Paths of n motors from rest, under set points (T, n) at `times` (T,), s; on to `settled` after the last one.

        Each line of the command is exact: θ_r follows the line 2ζ/ω later, and what is off decays.
        """
        steps = np.append(np.diff(times), self.settled)
        slopes = np.vstack([np.diff(command, axis=0) / np.diff(times)[:, None], np.zeros(command.shape[1])])
        sigma, damped = self.ratio * self.omega, self.omega * np.sqrt(1.0 - self.ratio**2)
        off = np.array([np.zeros(len(sigma)), np.zeros(len(sigma))])  # of the line that it follows, and its rate
        nodes, states = [times[:1]], [np.array([command[0], 0.0 * command[0], 0.0 * command[0]])[None]]
        before = np.zeros(len(sigma))
        for t, step, u, slope in zip(times, steps, command, slopes, strict=True):
            off = off + np.array([2 * self.ratio / self.omega * (slope - before), before - slope])
            before = slope
            s = step * np.linspace(0.0, 1.0, int(np.ceil(step * self.omega.max() / PART)) + 1)[1:, None]
            amplitude = (off[1] + sigma * off[0]) / damped
            e, c, d = np.exp(-sigma * s), np.cos(damped * s), np.sin(damped * s)
            error = e * (off[0] * c + amplitude * d)
            rate = e * ((amplitude * damped - sigma * off[0]) * c - (off[0] * damped + sigma * amplitude) * d)
            off = np.array([error[-1], rate[-1]])
            value = u + slope * (s - 2 * self.ratio / self.omega) + error
            bend = -(self.omega**2) * error - 2 * sigma * rate
            nodes.append(t + s[:, 0])
            states.append(np.stack([value, slope + rate, bend], axis=1))
        return quintics(np.concatenate(nodes), np.concatenate(states))

    def command(self, motion: Array) -> Array:
        """Set points (T, n) for positions, rates and accelerations (3, T, n) of motors."""
        position, rate, acceleration = motion
        return as_floats(position + 2 * self.ratio / self.omega * rate + acceleration / self.omega**2)


def quintics(nodes: Array, states: Array) -> Piecewise:
    """Through positions, rates and accelerations (K, 3, n) at `nodes` (K,), s."""
    h = np.diff(nodes)[:, None]
    (p, v, a), (q, w, b) = states[:-1].transpose(1, 0, 2), states[1:].transpose(1, 0, 2)
    d, v, w, a, b = q - p, v * h, w * h, a * h**2, b * h**2
    fifth, fourth, third = 12 * d - 6 * (v + w) + b - a, 16 * v + 14 * w - 30 * d + 3 * a - 2 * b, 20 * d - 12 * v
    scaled = [fifth / 2, fourth / 2, (third - 8 * w - 3 * a + b) / 2, a / 2, v, p]
    return Piecewise(nodes, np.stack([one / h**k for one, k in zip(scaled, range(5, -1, -1), strict=True)], axis=1))
