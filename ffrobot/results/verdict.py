"""The answer of a solve in one record, for terminal, report and Python: can it be done, and what to try next."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.structs import struct

if TYPE_CHECKING:
    from ..actuation.motors import MotorFeasibility

ROUND_OFF = 1e-9  # m, N·m, rad/s, W: numbers below it are round-off


def number(value: float) -> str:
    """Text of `value` with four digits; "0" for round-off."""
    return f"{value if value > ROUND_OFF else 0:.4g}"


def millimeters(value: float, digits: int = 4) -> str:
    """A length `value` in m as text in mm."""
    return f"{1e3 * value:.{digits}g} mm" if value >= ROUND_OFF else f"< {1e9 * ROUND_OFF:g} nm"


@struct
class ToolError:
    """Largest distance (m) of a point from its path in an analysis; None where there is no path."""

    # with joints position-controlled on the computed angles, or in a closed loop; of analyses that prescribe the path
    # and have actuators for it, the error of the computation
    controlled: float | None = None
    # with the computed torques open loop; without a replay an estimate for the first vibration
    open_loop: float | None = None
    # 1/s, rate at which deviations grow under these torques; 0 where stable or not known
    growth: float = 0.0


Place = tuple[float, str, float]
"""A largest value, where it is, and when (s)."""


STILL = 0.01  # of the tolerance within which a point has settled: a smaller residual vibration is none


def vibrates(about: Mapping[str, Any]) -> bool:
    """Whether attributes of `settling/POINT` have a settling time other than 0, or residual vibration that matters."""
    return bool(about["residual"] > STILL * about["tolerance"] or about["time_to"] != 0.0)


@struct
class Settled:
    """Residual vibration of the point that vibrates most after all paths are over."""

    point: str
    residual: float  # m, peak to peak
    frequency: float  # Hz, NaN where nothing vibrates
    time_to: float  # s, NaN where it does not settle within `tolerance`, m
    tolerance: float

    @property
    def in_words(self) -> str:
        """Text with amplitude, peak to peak, and settling time."""
        at = "" if np.isnan(self.frequency) else f" (lowest frequency {self.frequency:.3g} Hz)"
        when = "at no time of the run" if np.isnan(self.time_to) else f"{self.time_to:.3g} s after the path"
        within = f"within {millimeters(self.tolerance)} of its final position {when}"
        return f"{self.point} {millimeters(self.residual, 3)} peak to peak{at}, {within}"


@struct
class PatchNeed:
    """Voltages of a body's patches against their limits."""

    factor: float  # largest ratio of required voltage to limit; 0 without limits
    since: float  # s, when the limit is first exceeded; NaN if never
    limit: float  # V, that would suffice


@struct
class AnalysisVerdict:
    """Verdict of one analysis.

    Attributes:
        name, kind, status: of the analysis; `cause` of an early end.
        reached: s, the last output, and the requested end.
        answer: in words, whether motors and patches suffice, the verdict of closed-loop control, or the distance from
            the path under computed inputs; empty without requirement.
        feasible: whether motors and patches suffice; None without a requirement.
        motors: by joint, in the order of the scene: peaks, RMS and limits at the joint.
        units: of the force along each of these joints, "N·m" or "N".
        patches: by body, of an inverse analysis.
        tool_error: distance of a point from its path, m, under control and open loop.
        deflection: largest deflection, m, its point and time.
        stress: largest von Mises stress, Pa, its body and time; None if not requested.
        margins: gain and delay margins of closed-loop runs by their linear model, in words; empty where not known.
        settled: of the point that vibrates most after the paths; None where these move to the end.
        at_rest: natural frequencies and least stiffness with motors at rest, in words; empty if not requested.
        warnings: reasons why results may be wrong or misleading.
        notes: properties of correct results.
        advice: remedies to try.
    """

    name: str
    kind: str
    status: str
    cause: str
    reached: tuple[float, float]
    answer: str
    feasible: bool | None
    motors: "Mapping[str, MotorFeasibility]"
    units: Mapping[str, str]
    patches: Mapping[str, PatchNeed]
    tool_error: ToolError
    deflection: Place | None
    stress: Place | None
    margins: str
    settled: Settled | None
    at_rest: str
    warnings: tuple[str, ...]
    notes: tuple[str, ...]
    advice: tuple[str, ...]

    def lines(self) -> Iterator[str]:
        """Text lines: the answer, then indented details."""
        ended = "" if self.status == "completed" else f"ended early ({self.status})"
        yield f"{self.name}: {'; '.join(text for text in (ended, self.answer) if text) or 'completed'}"
        if self.feasible is not None:  # of closed loops, a table has them
            interval = " over the path" if self.kind == "motors-only" else ""
            for name, motor in self.motors.items():
                peak, rms, speed, power = motor_texts(motor, self.units[name])
                beyond = 100 * motor.share_beyond
                share = f"; above a limit for {beyond:.3g} % of the time" if beyond > 0.0 else ""
                yield f"  motor of {name}: peak {peak}, RMS {rms}{interval}, {speed}, {power}{share}"
        if self.deflection is not None:
            yield f"  largest deflection {_place(millimeters(self.deflection[0]), *self.deflection[1:])}"
        if self.stress is not None:
            yield f"  largest stress {_place(f'{self.stress[0] / 1e6:.4g} MPa', *self.stress[1:])} (von Mises)"
        if self.settled is not None:
            yield f"  residual vibration: {self.settled.in_words}"
        for text in filter(None, (self.margins, self.at_rest)):
            yield f"  {text}"
        yield from (f"  to try: {text}" for text in self.advice)

    @property
    def in_short(self) -> str:
        """Short answer; empty without a requirement."""
        if self.status != "completed":
            return "ended early"
        if self.feasible is None:
            short, colon, _ = self.answer.partition(":")
            return short if colon else ""
        factor = self.worst[1]
        if self.feasible:
            return "within limits" if factor else "no limits given"
        return "limits exceeded" if factor > 1.0 else f"not by motors {'and patches' if self.patches else 'alone'}"

    @property
    def reached_in_words(self) -> str:
        """Time of the last output, s, and the requested end of a stopped run."""
        reached, end = self.reached
        return f"{reached:g}" if self.status == "completed" else f"{reached:g} of {end:g}"

    @property
    def worst(self) -> tuple[str, float]:
        """Actuator with the largest ratio to its limit, and that ratio; "" and 0 without limits."""
        motors = [(f"motor {name}", motor.factor) for name, motor in self.motors.items()]
        patches = [(f"patches of {name}", need.factor) for name, need in self.patches.items()]
        return max((*motors, *patches), key=lambda one: one[1], default=("", 0.0))


@struct
class Verdict:
    """Verdicts of all analyses of a results file, in the order of the scene; `print` shows them as text."""

    analyses: tuple[AnalysisVerdict, ...]

    def __getitem__(self, name: str) -> AnalysisVerdict:
        """Verdict of one analysis. Raises `KeyError` for an unknown name."""
        for one in self.analyses:
            if one.name == name:
                return one
        raise KeyError(name)

    def __str__(self) -> str:
        return "\n".join(self.lines())

    __repr__ = __str__

    def lines(self) -> Iterator[str]:
        """Text of all analyses."""
        for one in self.analyses:
            yield from one.lines()


def motor_texts(motor: "MotorFeasibility", unit: str) -> tuple[str, str, str, str]:
    """Peak and RMS of force or torque in `unit`, speed and power as texts, with limits."""
    return (
        f"{_of_limit(motor.moment, motor.moment_limit)} {unit}",
        f"{number(motor.rms_moment)} {unit}",
        f"{_of_limit(motor.speed, motor.speed_limit)} {'rad/s' if unit == 'N·m' else 'm/s'}",
        f"{_of_limit(motor.power, motor.power_limit)} W",
    )


def _of_limit(peak: float, limit: float) -> str:
    return number(peak) + (f" of {limit:g}" if np.isfinite(limit) else "")


def _place(value: str, where: str, time: float) -> str:
    return f"{value}: {where}, t = {time:.4g} s"
