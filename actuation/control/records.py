"""Sensors, observers, controllers and closed loops of a scene file, key by key. SI units."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from ...common.deferred import ReadBy
from ...common.errors import quoted
from ...common.keys import MOST_OUTPUTS
from ...common.python_files import check_python_file
from ...common.validation import InputFile, Record, existing_file
from ...mbs._core import TimeFunction
from ...mbs.fields.field_types import (
    ModeCount,
    Name,
    NotEmpty,
    NotNegative,
    PointReference,
    Positive,
    Reference,
    Referring,
    one_of,
    under,
)
from ...mbs.scene.analysis import ActuatedAnalysis, Analysis, Need
from ...mbs.scene.loads import Load

Measure = Literal["value", "rate", "acceleration", "accelerometer", "gyro"]
SUBJECTS = "joint", "motor", "point", "pzt", "modal", "strain"


class Sensor(Referring):
    """A sensor of a joint coordinate, of a point, of the strain at a point, or of patch voltages.

    Accelerations are in global axes; "accelerometer" is r̈ − g and "gyro" the angular velocity, in the axes of the
    section. Patches read the charge of strain over `capacitance`; none with a `shunt`.

    A reading is filtered by `high_pass`, known `delay` later, gets `bias` and Gaussian noise, is cut at ±`range`,
    rounded to `resolution`, and kept for `sample_time`.
    """

    joint: str | None = None
    """Measured joint coordinate, rad (prismatic: m)."""
    motor: str | None = None
    """Joint with stiffness: measured motor angle after the gear, rad."""
    point: PointReference | None = None
    """Point "BODY.POINT" with measured x, y (in 3D z), m, global axes."""
    pzt: str | None = None
    """Layout of patches with measured voltages, V: its name, or that of its body."""
    modal: str | None = None
    """Body with directly read modal coordinates (m·√kg) of its modes with point masses and patches; no sensor can."""
    strain: PointReference | None = None
    """Point "BODY.POINT" among the `stress` points of a link, with measured strain along the link."""
    measure: Measure = "value"
    """Measured quantity: value or rate; of points also acceleration, accelerometer (m/s²) or gyro (rad/s)."""
    resolution: NotNegative = 0.0
    """Resolution: readings are multiples of it, in their unit; 0: continuous."""
    noise: NotNegative = 0.0
    """Standard deviation of Gaussian noise, in the unit of the reading."""
    noise_density: NotNegative = 0.0
    """Density of white noise, unit of the reading per √Hz (one-sided), up to half the sampling frequency."""
    bias: float = 0.0
    """Constant error of the reading, in its unit."""
    range: Positive | None = None
    """Largest reading of either sign, in its unit."""
    high_pass: Positive | None = None
    """Corner frequency of a first-order high-pass filter, as of charge amplifiers, Hz."""
    delay: NotNegative = 0.0
    """Age of readings, a multiple of the sample time of the loop, s."""
    sample_time: Positive | None = None
    """Time between readings, a multiple of the sample time of the loop, s; by default that."""
    capacitance: Positive | None = None
    """Capacitance of each patch, F; by default computed."""

    refers_to = (
        ("point", "body"), ("modal", "body"), ("modal", "flexible body"), ("pzt", "patches"), ("joint", "joint"),
        ("motor", "elastic joint"),
    )  # fmt: skip

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        subject = one_of(self, SUBJECTS)
        every = get_args(Measure)
        known = {"pzt": every[:1], "strain": every[:1], "point": every}.get(subject, every[:2])
        if self.measure not in known:
            raise ValueError(f'expected one of {quoted(known)} as measure with "{subject}", found "{self.measure}"')
        if self.capacitance is not None and subject != "pzt":
            raise ValueError(f'expected the key "capacitance" only with "pzt", found it with "{subject}"')
        return self

    def deviation(self, T: float) -> float:
        """Standard deviation of the noise of readings, in their unit; T (s) is the sample time of the loop."""
        return float(np.hypot(self.noise, self.noise_density / np.sqrt(2 * (self.sample_time or T))))

    def references(self) -> Iterator[Reference]:
        """Yield references to the measured joint, point, layout or body; points of strain belong to the link file."""
        yield from super().references()
        if self.strain is not None:
            link = self.strain.partition(".")[0]
            yield from (Reference("strain", link), Reference("strain", link, "flexible body"))


def check_sampling(sensors: Sequence[Sensor], T: float, whose: str, *, at_every_sample: bool) -> None:
    """Raise `ValueError` for sensors twice, and delays and sample times that are no multiples of the sample time T, s.

    `at_every_sample`: also for sample times that are not T. `whose` names T in the message.
    """
    read = [[getattr(sensor, key) for key in (*SUBJECTS, "measure")] for sensor in sensors]
    for k, sensor in enumerate(sensors, 1):
        if read[k - 1] in read[: k - 1]:
            raise ValueError(f"expected each sensor once, found no. {k} again")
        for key in ("delay", "sample_time"):
            samples = (value := getattr(sensor, key) or 0.0) / T
            if abs(samples - round(samples)) > 1e-6 or (key == "sample_time" and 0.0 < samples < 0.5):
                rule = f"expected a multiple of {whose} ({T:g} s) as {key} of sensor no. {k}"
                raise ValueError(f"{rule}, found {value:g} s")
            if round(samples) > 1 and key == "sample_time" and at_every_sample:
                raise ValueError(f"expected sensors that read at every sample, found no. {k} slower")


def _even(rows: Any) -> Any:
    if len({*map(len, rows)}) > 1:
        raise ValueError("expected lists of equal length, found others")
    return rows


def _different(names: tuple[str, ...]) -> tuple[str, ...]:
    if len({*names}) < len(names):
        raise ValueError(f"expected each name once, found {quoted(names)}")
    return names


Matrix = Annotated[tuple[tuple[float, ...], ...], AfterValidator(_even)]
Names = Annotated[tuple[str, ...], AfterValidator(_different)]


class ObserverRecord(Record):
    """Base of all observers."""

    settle: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    """Samples for which observer and controllers see the first readings before the run; 0: start on the reference."""
    about: Literal["reference", "zero"] = "reference"
    """Origin of commands, readings and estimates: what they are on the reference, or zero."""


class FilterRecord(Record):
    """Keys of the model of Kalman filters.

    They estimate coordinates and rates of joints, motors and the lowest `modes` of links, and constant loads on
    request. `process` and `disturbance` name inputs of the linear model: "joint/NAME", "pzt/LAYOUT/k" or
    "force/BODY.POINT/x".
    """

    modes: ModeCount = 2
    """Number of the lowest modes per link in the model."""
    process: dict[str, Positive] = Field(min_length=1)
    """Standard deviation, by input, of white noise that is constant over a sample; N·m, V or N."""
    disturbance: dict[str, Positive] = Field(default_factory=dict)
    """Constant loads to be estimated, by input, with their drift; N·m, V or N per √s."""

    @property
    def points(self) -> dict[str, str]:
        """Points "BODY.POINT" at which forces are inputs, as keys and values."""
        return {of.name: of.name for of in FilterRecord.references(self) if of.kind == "body"}

    def references(self) -> Iterator[Reference]:
        """Yield references to inputs, and to points at which forces are."""
        for key in ("process", "disturbance"):
            for name in getattr(self, key):
                yield Reference(key, name, "input")
                point = name.removeprefix("force/").rpartition("/")[0]
                if name.startswith("force/") and "." in point:
                    yield Reference(key, point)


class KalmanRecord(ObserverRecord, FilterRecord):
    """Keys of Kalman filters of a loop."""

    reject: bool = False
    """Permission for motors and patches to act against estimated disturbances of theirs."""


class KalmanObserver(KalmanRecord):
    """Steady-state Kalman filter of the sampled linear model about the reference at `time`."""

    kind: Literal["kalman"]
    time: NotNegative = 0.0
    """Instant of the reference about which the model is linear, s."""


class ScheduledObserver(KalmanRecord):
    """Kalman filters at `count` instants of the path; between them all matrices are straight lines.

    Each is checked to be stable, half way between as well.
    """

    kind: Literal["scheduled"]
    count: Annotated[int, Field(ge=2, le=1000)] = 5
    """Number of instants, from start to end of the reference."""


class GainsObserver(ObserverRecord):
    """x̂⁺ = A x̂ + B u + gain (y − C x̂) with given numbers, for the controller "state-feedback".

    States are "state/1", …, in any units; y is in units of the readings times `scale`.
    """

    kind: Literal["gains"]
    inputs: Names
    """Commands u, as `control/` in the results names them."""
    outputs: Annotated[Names, NotEmpty]
    """Readings y, as `control/` in the results names them."""
    A: Matrix | None = None
    """(states, states), from sample to sample."""
    B: Matrix | None = None
    """(states, inputs)."""
    C: Matrix | None = None
    """(outputs, states)."""
    gain: Matrix | None = None
    """(states, outputs)."""
    file: InputFile | None = None
    """File .npz or .mat with A, B, C and gain."""
    scale: tuple[float, ...] | None = None
    """Factor of each reading, such as 1000 for y in mm; by default 1."""

    @model_validator(mode="after")
    def _complete(self) -> Self:
        missing = [name for name in ("A", "B", "C", "gain") if getattr(self, name) is None]
        if (self.file is None) == bool(missing):
            found = "both" if not missing else f"neither ({quoted(missing)} missing)"
            raise ValueError(f"expected A, B, C and gain, or a file with them, found {found}")
        return self

    @property
    def matrices(self) -> tuple[Any, Any, Any, Any]:
        """A (n, n), B (n, inputs), C (outputs, n), gain (n, outputs), any unit; `InputError` if the file lacks one."""
        if self.file is None:
            return self.A, self.B, self.C, self.gain
        from .linear_model import read_arrays

        A, B, C, gain = read_arrays(self.file, ("A", "B", "C", "gain"))
        return A, B, C, gain


Observer = Annotated[KalmanObserver | ScheduledObserver | GainsObserver, Field(discriminator="kind")]


class ControllerRecord(Referring):
    """Base of all controllers."""


class JointPid(ControllerRecord):
    """u = P e + D ė + I ∫e for each joint, with the error e from the reference."""

    kind: Literal["joint-pid"]
    proportional: dict[Name, NotNegative] = Field(default_factory=dict)
    """P by joint, N·m/rad (prismatic: N/m)."""
    derivative: dict[Name, NotNegative] = Field(default_factory=dict)
    """D by joint, N·m·s/rad (prismatic: N·s/m)."""
    integral: dict[Name, NotNegative] = Field(default_factory=dict)
    """I by joint, N·m/(rad·s) (prismatic: N/(m·s))."""
    rate: Literal["measured", "difference"] = "measured"
    """Source of rates: measured, or the difference of two readings over the sample time."""
    side: Literal["joint", "motor"] = "joint"
    """Side of compliant gears on which angles are measured."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints with any gain."""
        return tuple(dict.fromkeys((*self.proportional, *self.derivative, *self.integral)))

    def references(self) -> Iterator[Reference]:
        """Yield references to the joints and to the side of their gears."""
        for name in self.joints:
            yield Reference("", name, "joint")
            if self.side == "motor":
                yield Reference("side: motor", name, "elastic joint")


class ComputedTorque(ControllerRecord):
    """Computed torque of the rigid mechanism for γ̈_ref + 2 ζ ω ė + ω² e, instead of a feed-forward of torques."""

    kind: Literal["computed-torque"]
    bandwidth: Positive
    """Bandwidth ω of the error's dynamics, rad/s."""
    damping_ratio: Positive = 1.0
    """Damping ratio ζ of the error's dynamics."""


class ModalVelocity(ControllerRecord):
    """Patches as dampers of the lowest `modes` of their links: modal forces −2 ζ ω ṗ, ζ the `damping_ratio` added.

    p is estimated from the voltages of the same patches (least squares over these modes) and ṗ from two samples, or
    both are ideal.
    """

    kind: Literal["modal-velocity"]
    bodies: Annotated[tuple[str, ...], NotEmpty]
    """Links with the driven patches."""
    modes: ModeCount = 1
    """Number of the lowest modes per link; with sensor = "pzt" at most that of its patches."""
    damping_ratio: Positive
    """Damping ratio ζ that is added to each of these modes."""
    sensor: Literal["pzt", "ideal"] = "pzt"
    """Measured signals: voltages of the same patches by strain of modes, or modal coordinates and rates directly."""

    refers_to = (("bodies", "body"), ("bodies", "patched body"))


class Lqr(ControllerRecord):
    """u = −K x for the sampled linear model about the reference.

    Weights are inverse squares of acceptable errors. With patches alone as `inputs`, a "joint-pid" controls the joints.
    Modal coordinates are estimated from voltages as in `ModalVelocity`, or ideal.
    """

    kind: Literal["lqr"]
    inputs: Literal["all", "motors", "patches"] = "all"
    """Inputs: motors and patches, or one of them."""
    pzt: tuple[Name, ...] | None = None
    """Layouts of patches that act; by default all."""
    modes: ModeCount = 1
    """Number of the lowest modes per link in the design model."""
    time: NotNegative = 0.0
    """Instant of the reference at which the model is linearized, s."""
    angle: Positive = 0.01
    """Acceptable error of joints, rad."""
    rate: Positive = 0.1
    """Acceptable error of their rates, rad/s."""
    deflection: Positive = 1e-3
    """Acceptable deflection of links, relative to their length."""
    moment: Positive = 10.0
    """Acceptable motor torque, N·m."""
    voltage: Positive = 100.0
    """Acceptable voltage of patches, V."""
    sensor: Literal["pzt", "ideal"] = "pzt"
    """Measured signals: voltages of patches, or modal coordinates and velocities directly."""

    refers_to = (("pzt", "patches"),)


def _python_function(value: object, info: ValidationInfo) -> object:
    """A function that a scene made in Python carries, or "FILE.py:FUNCTION" with the file where it is."""
    objects = (info.context or {}).get("objects", {})
    if callable(value) or (isinstance(value, str) and value in objects):
        return objects.get(value, value)
    path, colon, function = value.rpartition(":") if isinstance(value, str) else ("", "", "")
    if not colon or not path or not function.isidentifier():
        raise ValueError(f'expected "FILE.py:FUNCTION", found "{value}"')
    file = existing_file(Path(path), info)
    check_python_file(file, (info.context or {}).get("folder", Path()))
    return f"{file}:{function}"


class PythonController(ControllerRecord):
    """A user's function as controller."""

    kind: Literal["python"]
    python: Annotated[Any, ReadBy(_python_function, str)]
    """Function as "FILE.py:FUNCTION" with the file next to the scene, or the function itself in scenes made in Python.
    """


class StateFeedback(ControllerRecord):
    """u = −K x̂ with the states of an observer of kind "gains"."""

    kind: Literal["state-feedback"]
    inputs: Annotated[Names, NotEmpty]
    """Commands, as `control/` in the results names them, such as "joint/NAME" or "pzt/LAYOUT/1"."""
    gain: Matrix
    """K (inputs, states), in the unit of each command per unit of each state."""

    refers_to = (("inputs", "command"),)


Controller = Annotated[
    JointPid | ComputedTorque | ModalVelocity | Lqr | StateFeedback | PythonController, Field(discriminator="kind")
]


class SampledAnalysis(ActuatedAnalysis):
    """Keys of closed loops: see `ClosedLoop`."""

    kind: Literal["closed-loop"]
    sample_time: Positive
    """Time between samples, s."""
    delay: NotNegative = 0.0
    """Delay from a sample to its command, s."""
    start: Literal["actuation", "scene"] = "actuation"
    """Initial state: that of `actuation`, or [initial]."""
    feed_forward: Literal["none", "joints", "joints+pzt"] = "joints"
    """Part of `actuation` that is added to the commands: torques, torques and voltages, or nothing."""
    unlimited: bool = False
    """Permission to exceed the limits of the scene."""
    seed: Annotated[int, Field(ge=0)] = 0
    """Seed of the sensor noise."""
    tip: PointReference | None = None
    """Point "BODY.POINT" whose position error is computed."""
    controller: tuple[Controller, ...] = ()
    """Controllers; their commands add up."""
    sensor: tuple[Sensor, ...] = ()
    """Sensors in addition to those of the controllers; with an observer, all sensors."""
    observer: Observer | None = None
    """Observer; controllers take estimates of what no sensor reads, "lqr" of all."""
    disturbance: tuple[Load, ...] = ()
    """Loads at points, unknown to `actuation`."""

    findings = ("diverged", "step underflow")  # what a controller does is what is to be found out

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.actuation is None:
            raise ValueError(f'expected the key "actuation" in kind = "{self.kind}", found none')
        if any(load.point is None for load in self.disturbance):
            raise ValueError("expected disturbances at points, found one elsewhere")
        for k, load in enumerate(self.disturbance, 1):
            if load.force is not None:
                raise ValueError(
                    f"disturbance no. {k}: force: expected expressions in t, found a function, which only a [[load]]"
                    " may have"
                )
        end = self.end
        if end and self.delay >= end:
            raise ValueError(f"expected a delay shorter than the run ({end:g} s), found {self.delay:g} s")
        if end and end / self.sample_time > MOST_OUTPUTS:
            raise ValueError(f"expected at most {MOST_OUTPUTS} samples, found sample_time = {self.sample_time:g} s")
        is_filtered = isinstance(self.observer, KalmanRecord)
        check_sampling(self.sensor, self.sample_time, "the loop's sample_time", at_every_sample=is_filtered)
        feeds = [isinstance(one, StateFeedback) for one in self.controller]
        if any(feeds) and not isinstance(self.observer, GainsObserver):
            raise ValueError('expected an observer of kind = "gains" with "state-feedback", found none')
        if end and self.sample_time > end:
            raise ValueError(f"expected a sample_time of at most the run ({end:g} s), found {self.sample_time:g} s")
        return self

    def needs(self) -> Iterator[Need]:
        """Yield the need of a table [[pzt]] where voltages are fed forward."""
        if self.feed_forward == "joints+pzt":
            yield Need("feed_forward", self.feed_forward, "pzt")

    def references(self) -> Iterator[Reference]:
        """Yield references of sensors, disturbances, controllers and tip."""
        for label, records in (
            ("sensor", self.sensor), ("disturbance", self.disturbance), ("controller", self.controller)
        ):  # fmt: skip
            for k, record in enumerate(records, 1):
                yield from under(f"{label} no. {k}", record.references())
        if isinstance(self.observer, GainsObserver):
            yield from (Reference("observer: inputs", name, "command") for name in self.observer.inputs)
        elif self.observer is not None:
            yield from under("observer", self.observer.references())
        if self.tip is not None:
            yield Reference("tip", self.tip)

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """Yield label, function of time and number of derivatives needed, 0, of each component of disturbances."""
        for k, load in enumerate(self.disturbance, 1):
            for component, function in load.components.items():
                yield f"disturbance no. {k}: {component}", function, 0

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Yield a message if `source` lacks inputs to feed forward, or ends before the instant of a design."""
        designed = [(f"controller no. {k}", record) for k, record in enumerate(self.controller, 1)]
        for label, record in (*designed, ("observer", self.observer)):
            if isinstance(record, Lqr | KalmanObserver) and record.time > source.last_time * (1 + 1e-9):
                yield (
                    f'{label}: time: expected at most {source.last_time!r}, where "{source.name}" ends, found'
                    f" {record.time!r}"
                )
        if self.feed_forward == "joints+pzt" and source.applicable and self.feed_forward not in source.applicable:
            yield (
                f'feed_forward: expected "joints" with an analysis of kind "{source.kind}", found "{self.feed_forward}"'
            )
