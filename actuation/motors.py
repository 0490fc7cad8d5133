"""What every motor has to do, over time: peaks, root mean squares, shares of time, against what it can."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ..common.arrays import Array, Booleans, as_floats
from ..mbs._core import TimeFunction
from ..mbs.analysis.motors_only import InvertedPath
from ..mbs.analysis.outcome import Outcome
from ..mbs.joints.joint import JointRecord
from ..mbs.joints.transmission import MotorLimits
from ..mbs.quantities.joint_motion import joint_motions, motor_motion

SHORT = 0.01  # of the time: a peak that lasts less is one of its own
APART = 1.1  # times the moment of the other 99 % of the time: likewise
INSTANT = 1e-4  # of the path's duration: over which one-sided derivatives are taken
JUMP = 0.05  # of the largest acceleration or jerk of the path: less is none


@dataclass(frozen=True)
class MotorFeasibility:
    """What one motor has to do at the joint, against its limits (infinite where none): N·m, rad/s, W; N, m/s of forces.

    Attributes:
        moment, speed, power: largest absolute values.
        saturation_time: when a limit is first exceeded, s; NaN where none is.
        rms_moment: root mean square over the run: losses in the windings go with its square, so that a constant moment
            of this size heats the motor as much (the thermal-equivalent moment).
        usual_moment: that is not exceeded for 99 % of the time.
        moment_time: when the moment is largest, s.
        share_beyond: of the time that any of them is.
        jump: "acceleration" or "jerk" of the path where that jumps at a short peak which follows from it; else "".
    """

    moment: float
    moment_limit: float
    speed: float
    speed_limit: float
    power: float
    power_limit: float
    saturation_time: float
    rms_moment: float = np.nan  # these are not in files of version 0.1
    usual_moment: float = np.nan
    moment_time: float = np.nan
    share_beyond: float = np.nan
    jump: str = ""

    @property
    def factor(self) -> float:
        """The largest ratio of a peak to its limit."""
        return max(self.moment / self.moment_limit, self.speed / self.speed_limit, self.power / self.power_limit)

    @property
    def has_limits(self) -> bool:
        """Whether there is anything that it may not exceed."""
        return bool(np.isfinite((self.moment_limit, self.speed_limit, self.power_limit)).any())

    @property
    def has_spike(self) -> bool:
        """Whether the largest moment is more than a tenth above what is needed for 99 % of the time."""
        return self.moment > APART * self.usual_moment

    def spike_in_words(self, unit: str) -> str:
        """Why a short peak is there and what helps; empty where there is none. `unit` of the moment."""
        if not self.has_spike:
            return ""
        why = f": the {self.jump} of the path jumps there, so take a smoother path" if self.jump else ""
        or_fewer = " or leave out the highest modes" if self.jump else ""
        return (
            f"the peak at t = {self.moment_time:g} s lasts for less than 1 % of the time, and {self.usual_moment:.4g}"
            f" {unit} are enough for the rest{why}{or_fewer}"
        )


def judge_motors(outcome: Outcome, joints: Mapping[str, JointRecord]) -> dict[str, MotorFeasibility]:
    """What every motor has to do against its limits; behind a gear that gives it turns otherwise than its joint."""
    moments = outcome.motor_moments
    assert moments is not None
    motions = joint_motions(outcome)
    return {
        name: _judge(outcome, joints[name], moments[:, k], (motor_motion(outcome, name) or motions[name]).rate)
        for k, name in enumerate(outcome.assembly.model.motors)
    }


def _judge(outcome: Outcome, joint: JointRecord, moment: Array, rate: Array) -> MotorFeasibility:
    judged = judge_motion(outcome.time, moment, rate, joint.motor_limits)
    return replace(judged, jump=path_jump(outcome, int(np.abs(moment).argmax()))) if judged.has_spike else judged


def judge_motion(time: Array, moment: Array, rate: Array, limits: MotorLimits) -> MotorFeasibility:
    """What a motor has to do that gives `moment` (T,) at `rate` (T,) of its joint over `time` (T,); SI units."""
    size, speed, power = np.abs(moment), np.abs(rate), np.abs(moment * rate)
    beyond = (size > limits.moment) | (speed > limits.speed) | (power > limits.power)
    shares, peak, usual = _shares(time), int(size.argmax()), _not_exceeded(time, size, 1.0 - SHORT)
    return MotorFeasibility(
        float(size[peak]), limits.moment, float(speed.max()), limits.speed, float(power.max()), limits.power,
        float(first_time(time, beyond[:, None])[0]),
        rms_moment=float(np.sqrt(shares @ moment**2)),
        usual_moment=usual,
        moment_time=float(time[peak]),
        share_beyond=float(shares @ beyond),
    )  # fmt: skip


def first_time(time: Array, beyond: Booleans) -> Array:
    """The first of the times (T,) at which each column of `beyond` (T, k) holds; NaN where it never does."""
    return np.where(beyond.any(axis=0), time[beyond.argmax(axis=0)], np.nan)


def path_jump(outcome: Outcome, output: int) -> str:
    """Which derivative of a trajectory jumps within one output of the given one, if moments follow from it.

    "acceleration", in motors-only analyses "jerk" too, else "": a path is held before t = 0 and after its end.
    """
    end, time = outcome.analysis.last_time, outcome.time
    if end <= 0.0 or len(time) < 2:
        return ""
    h = INSTANT * end
    near = time[max(0, output - 1) : output + 2]
    for target in (constraint.target for constraint in outcome.assembly.model.trajectories):

        def acceleration(t: Array, target: TimeFunction = target) -> Array:
            return np.where(
                (t >= 0.0) & (t <= end), target.sample(np.clip(t, 0.0, end).ravel())[2].reshape(t.shape), 0.0
            )

        all_over = acceleration(as_floats(np.linspace(0.0, end, 1001)))
        before, after = (acceleration(near + side * h * np.array([[1.0], [2.0]])) for side in (-1, 1))
        limits = [2 * one[0] - one[1] for one in (before, after)]
        if np.any(np.abs(limits[1] - limits[0]) > JUMP * np.abs(all_over).max()):
            return "acceleration"
        jerks = (before[0] - before[1]) / h, (after[1] - after[0]) / h
        largest = np.abs(np.diff(all_over)).max() / (end / 1000)
        if isinstance(outcome.details, InvertedPath) and np.any(np.abs(jerks[1] - jerks[0]) > JUMP * largest):
            return "jerk"
    return ""


def _shares(time: Array) -> Array:
    """What each output stands for of the time (T,), by the trapezoidal rule; 1 of a single one."""
    if len(time) == 1:
        return np.ones(1)
    steps = np.diff(time)
    shares: Array = (np.append(steps, 0.0) + np.append(0.0, steps)) / (2 * (time[-1] - time[0]))
    return shares


def _not_exceeded(time: Array, values: Array, share: float) -> float:
    """The value that is exceeded for no more than the rest of the time."""
    order = np.argsort(values)
    part = np.cumsum(_shares(time)[order])
    return float(values[order][min(int(np.searchsorted(part, share)), len(values) - 1)])
