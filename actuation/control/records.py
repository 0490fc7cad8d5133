"""Controllers and closed loops of a scene file, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, ValidationInfo, model_validator

from ...common.deferred import ReadBy
from ...common.keys import MOST_OUTPUTS
from ...common.python_files import check_python_file
from ...common.validation import existing_file
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
    under,
)
from ...mbs.scene.analysis import ActuatedAnalysis, Analysis, Need
from ...mbs.scene.loads import Load
from .observer_records import GainsObserver, KalmanObserver, KalmanRecord, Matrix, Observer
from .sensor_records import Sensor, check_sampling


class ControllerRecord(Referring):
    """Base of all controllers."""


class JointPid(ControllerRecord):
    """u = P e + D ė + I ∫e of each joint named, e from the reference; N·m/rad, N·m·s/rad, N·m/(rad·s) or their like."""

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
    """Number of the lowest modes per link."""
    damping_ratio: Positive
    """Damping ratio ζ that is added to each of these modes."""
    sensor: Literal["pzt", "ideal"] = "pzt"
    """Measured signals: voltages of the same patches, or modal coordinates and velocities directly."""

    refers_to = (("bodies", "body"), ("bodies", "patched body"))


class Lqr(ControllerRecord):
    """u = −K x for the sampled linear model about the reference.

    Weights are inverse squares of acceptable errors. With patches alone as `inputs`, a "joint-pid" controls the joints.
    States as in `ModalVelocity`.
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
    """A user's function: "FILE.py:FUNCTION" next to the scene, or the function itself in scenes made in Python."""

    kind: Literal["python"]
    python: Annotated[Any, ReadBy(_python_function, str)]
    """Function as "FILE.py:FUNCTION" with the file next to the scene, or the function itself in scenes made in Python.
    """


class StateFeedback(ControllerRecord):
    """u = −K x̂ with the states of an observer of kind "gains"."""

    kind: Literal["state-feedback"]
    inputs: Annotated[tuple[str, ...], NotEmpty]
    """Commands, as `control/` in the results names them, such as "joint/NAME" or "pzt/LAYOUT/1"."""
    gain: Matrix
    """K (inputs, states), in the unit of each command per unit of each state."""


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
        """Patches where voltages are fed forward."""
        if self.feed_forward == "joints+pzt":
            yield Need("feed_forward", self.feed_forward, "pzt")

    def references(self) -> Iterator[Reference]:
        """Yield references of sensors, disturbances, controllers and tip."""
        for label, records in (
            ("sensor", self.sensor), ("disturbance", self.disturbance), ("controller", self.controller)
        ):  # fmt: skip
            for k, record in enumerate(records, 1):
                yield from under(f"{label} no. {k}", record.references())
        if isinstance(self.observer, KalmanRecord):
            yield from under("observer", self.observer.references())
        if self.tip is not None:
            yield Reference("tip", self.tip)

    def prescribed(self) -> Iterator[tuple[str, TimeFunction, int]]:
        """Yield the disturbances with their labels."""
        for k, load in enumerate(self.disturbance, 1):
            for component, function in load.components.items():
                yield f"disturbance no. {k}: {component}", function, 0

    def replay_problems(self, source: Analysis) -> Iterator[str]:
        """Check that `source` has the inputs to feed forward, and exists before a controller is designed."""
        for k, record in enumerate(self.controller, 1):
            if isinstance(record, Lqr) and record.time > source.last_time * (1 + 1e-9):
                yield (
                    f'controller no. {k}: time: expected at most {source.last_time!r}, where "{source.name}" ends,'
                    f" found {record.time!r}"
                )
        observer = self.observer
        if isinstance(observer, KalmanObserver) and observer.time > source.last_time * (1 + 1e-9):
            yield (
                f'observer: time: expected at most {source.last_time!r}, where "{source.name}" ends, found'
                f" {observer.time!r}"
            )
        if self.feed_forward == "joints+pzt" and source.applicable and self.feed_forward not in source.applicable:
            yield (
                f'feed_forward: expected "joints" with an analysis of kind "{source.kind}", found "{self.feed_forward}"'
            )
