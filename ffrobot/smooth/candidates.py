"""Motions along a recorded path that leave less vibration: averaged, slower, shaped, or inverted; the best is kept.

Averaging over a time with the weights of a smooth bell (a law from rest to rest, differentiated) makes any stream as
smooth as the law, and takes this time longer; all joints are averaged alike. Shapers are those of trajectories.
Durations are found with the linear models of postures along the path; what they find is simulated.
"""

from collections.abc import Callable, Iterator, Sequence
from itertools import product
from typing import TypeVar

import numpy as np

from ..common.arrays import Array
from ..common.libraries import scipy
from ..common.structs import struct
from ..mbs.fields.paths import Kind, Piecewise, impulses, polynomial_law
from ..mbs.fields.waypoints import interpolated
from .diagnosis import Diagnosis, modes_along
from .recording import KEPT, Limits, evened, peaks
from .robot import Modes, Ride, Robot, accelerations

SMOOTHNESS = 5  # of the law that averages: inversion differentiates twice what strains gears
LEAST = 8  # set points over which are averaged at least
LONGER = 1.2  # of one duration to the next one that is tried
MOST = 24  # durations
TRIALS = 5  # durations of inverted motions
SHARE = 0.5  # of the tolerance that the linear models may leave
WRONG = 0.1  # of the stiffness of gears, by which it may be off: so much of the vibration without inversion is left
TINY = 1e-300  # of the square of a line's length, where set points rest
SHAPERS: tuple[Kind, ...] = ("zv", "zvd", "ei")

T = TypeVar("T")


@struct
class Candidate:
    """A stream of T set points for n joints, and the simulated motion of the robot."""

    name: str  # how it was made
    # (T,) s, and (T, n) set points, rad or m
    times: Array
    command: Array
    # (T, n) feed-forward torques of motors, N·m or N, of inverted motions; None of others
    moments: Array | None
    ride: Ride  # the simulated motion
    off_path: float  # largest distance from the recorded path, of all joints together, rad or m
    # largest ratio of speed, acceleration or jerk to its limit; 0 without limits, above 1 also beyond a limit of
    # positions
    excess: float
    torque: float  # largest ratio of a motor's torque to its limit; 0 without limits

    @property
    def settled(self) -> float:
        """Time (s) from which the point stays within the tolerance of its final position; infinite if never."""
        of = self.ride.settling
        return np.inf if of is None or np.isnan(of.time_to) else float(self.times[-1]) + of.time_to

    @property
    def residual(self) -> float:
        """Residual vibration of the point, m, peak to peak."""
        return np.inf if self.ride.settling is None else self.ride.settling.residual


def candidates(robot: Robot, before: Diagnosis, limits: Limits, step: float, kind: str = "") -> list[Candidate]:
    """Simulate a motion of each kind, set points every `step` s; the requested `kind` comes first, then the best.

    Motions within the limits come before others, those that settle first before later ones, then the least vibration.
    """
    search = _Search(robot, before, limits, step)

    def rank(one: Candidate) -> tuple[bool, bool, float, float]:
        return not one.name.startswith(kind), max(one.excess, one.torque) > 1.0, one.settled, one.residual

    return sorted((search.simulated(*motion) for motion in search.motions()), key=rank)


Motion = tuple[str, Array, Array, Array | None]
"""Name, set points (T, n), the smooth motion (T, n) behind them, and torques of motors (T, n) where they are known."""


class _Search:
    def __init__(self, robot: Robot, before: Diagnosis, limits: Limits, step: float) -> None:
        self.robot, self.limits, self.step = robot, limits, step
        self.sag, (self.times, self.values) = before.ride.sag, evened(before.recording).dense(step / 2)
        low, high = limits.positions.T
        self.low, self.high = np.minimum(low, self.values.min(axis=0)), np.maximum(high, self.values.max(axis=0))
        self.modes = before.modes
        self.of_links = modes_along(robot, before.ride, of_links=True) if robot.has_gears and robot.bends else []
        self.periods = [1 / f for f in before.frequencies.mean(axis=0)]

    def motions(self) -> Iterator[Motion]:
        """The shortest of each kind that the linear models find good enough."""
        fast = self._along(max(1.0, self._excess(self._along(1.0), orders=1)))
        durations = self.step * LEAST * LONGER ** np.arange(MOST)
        averaged = [(float(span), self._averaged(fast, span)) for span in durations]
        kept = [(span, values) for span, values in averaged if self._excess(values) <= 1.0] or averaged[-1:]
        span, values = self._first(kept)
        yield f"averaged over {1e3 * span:.3g} ms", values, values, None
        factors = LONGER ** (np.arange(MOST) / 2)
        factor, values = self._first([(float(c), self._averaged(self._along(c), kept[0][0])) for c in factors])
        yield f"slower by {100 * (factor - 1):.3g} %", values, values, None
        name, values = self._first(sorted(self._shaped(kept[0][1]), key=lambda one: len(one[1])))
        yield f"shaped by {name}, averaged over {1e3 * kept[0][0]:.3g} ms", values, values, None
        if self.robot.has_gears and self.robot.servo.is_invertible:
            yield self._inverted(kept)

    def _inverted(self, averaged: Sequence[tuple[float, Array]]) -> Motion:
        """Of the shortest that leaves little, also with wrong stiffness; of a longer one while limits are exceeded.

        Links sag at its ends as they do under its own set points, with which it begins and ends.
        """
        least, _ = self._first(averaged, self._left_inverted)
        for span, values in [motion for motion in averaged if motion[0] >= least][:TRIALS]:
            name, smooth = f"inverted, averaged over {1e3 * span:.3g} ms", np.vstack([values, values[-1:]])
            times = self.step * np.arange(len(smooth))
            blend = polynomial_law(SMOOTHNESS).sample(times / times[-1])
            links = smooth + (1 - blend) * self.sag[0] + blend * self.sag[1]
            command, moments = self.robot.inverted(times, interpolated(times, links))
            command[[0, -1]] = values[[0, -1]]
            if max(self._excess(command), float((np.abs(moments) / self.limits.sizes[3]).max())) <= 1.0:
                break
        return name, command, values, moments

    def simulated(self, name: str, values: Array, smooth: Array, moments: Array | None) -> Candidate:
        times = self.step * np.arange(len(values))
        ride = self.robot.ride(times, values)
        return Candidate(
            name, times, values, moments, ride,
            off_path=float(distances(smooth, self.values).max()),
            excess=self._excess(values),
            torque=float((ride.torque / self.limits.sizes[3]).max()),
        )  # fmt: skip

    def _along(self, factor: float) -> Array:
        """Set points of the record, in `factor` times the time."""
        count = int(np.ceil(factor * self.times[-1] / self.step - 1e-9)) + 1
        return interpolated(self.times, self.values, 1).sample(self.step * np.arange(count) / factor)

    def _averaged(self, values: Array, duration: float) -> Array:
        n = int(np.ceil(duration / self.step - 1e-9))
        weights = np.diff(polynomial_law(SMOOTHNESS).sample(np.arange(n + 1) / n)[:, 0])
        padded = np.vstack([np.repeat(values[:1], n, axis=0), values, np.repeat(values[-1:], n, axis=0)])
        return np.column_stack([np.convolve(column, weights, mode="valid") for column in padded.T])

    def _shaped(self, values: Array) -> Iterator[tuple[str, Array]]:
        """By each kind of shaper, of the lowest frequency, and of the two lowest."""
        ratios = np.mean([one.ratio[: len(self.periods)] for one in self.modes], axis=0).clip(max=0.9).tolist()
        for kind, count in product(SHAPERS, range(1, min(2, len(self.periods)) + 1)):
            shaped = values
            for period, ratio in zip(self.periods[:count], ratios[:count], strict=True):
                sequence = impulses(kind, 1 / period, ratio)
                last = int(np.ceil(sequence[-1].delay / self.step))
                rows = np.arange(len(shaped) + last, dtype=float)
                lines = interpolated(rows[: len(shaped)], shaped, 1)
                before = [lines.sample(rows - one.delay / self.step) for one in sequence]
                shaped = np.tensordot([one.share for one in sequence], before, 1)
            frequencies = ", ".join(f"{1 / period:.3g} Hz" for period in self.periods[:count])
            yield f"{kind} for {frequencies}", shaped

    def _first(
        self, motions: Sequence[tuple[T, Array]], left: Callable[[Array], float] | None = None
    ) -> tuple[T, Array]:
        """The first that the linear models find good enough; else the best of all."""
        residuals = list[float]()
        for motion in motions:
            residuals.append((left or self._left)(motion[1]))
            if residuals[-1] <= SHARE * self.robot.tolerance:
                return motion
        return motions[int(np.argmin(residuals))]

    def _left(self, values: Array) -> float:
        """Residual vibration (m, peak to peak) by the linear models of all postures, the worst of them."""
        return _worst(self.modes, self.robot.servo.motors(self.step * np.arange(len(values)), values))

    def _left_inverted(self, values: Array) -> float:
        """That of gears with another stiffness, and of links, whose joints follow the motion itself."""
        links = interpolated(self.step * np.arange(len(values)), values)
        return max(WRONG * self._left(values), _worst(self.of_links, links))

    def _excess(self, values: Array, orders: int = 3) -> float:
        """The largest part of a limit that the first so many derivatives take; above 1 beyond limits of positions.

        Not where the record is there, too.
        """
        shares = peaks(self.step * np.arange(len(values)), values) / self.limits.sizes[:3]
        beyond = float(np.maximum(values - self.high, self.low - values).max())
        return max(float(shares[:orders].max()), 1.0 + beyond if beyond > KEPT else 0.0)


def _worst(modes: Sequence[Modes], path: Piecewise) -> float:
    """Residual vibration (m, peak to peak) of the worst posture."""
    driving = accelerations(path)
    return max((float(2 * np.abs(one.left(*driving).sum(axis=1)).sum()) for one in modes), default=0.0)


def distances(points: Array, line: Array) -> Array:
    """Return distances (T,), in their unit, of points (T, n) from the polyline through the vertices `line` (m, n)."""
    nearest, last = scipy.spatial.cKDTree(line).query(points)[1], len(line) - 1
    off = []
    for first in (np.maximum(nearest - 1, 0), np.minimum(nearest, last - 1)):
        along, apart = line[first + 1] - line[first], points - line[first]
        part = np.einsum("ij,ij->i", apart, along) / np.maximum(np.einsum("ij,ij->i", along, along), TINY)
        off.append(np.linalg.norm(apart - np.clip(part, 0.0, 1.0)[:, None] * along, axis=1))
    return np.minimum(*off)
