"""Sampled control of an analysis of kind "closed-loop", key by key: sensors, controllers, disturbances. SI units."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, ValidationInfo, model_validator

from ...common.validation import Record, existing_file, quoted
from ..fields.field_types import Name, NotEmpty, NotNegative, PointReference, Positive, one_of
from .loads import Load

PERMITTIVITY = 1700 * 8.8541878128e-12  # F/m, of PZT-5A along the field, free


class Sensor(Record):
    """What is measured, and how well: of a joint its coordinate, of a point x and y, of patches their voltages.

    `motor` names a joint with stiffness, of which the motor's angle behind its gear is read, on the first body.
    `measure` is the value, its rate, or (points) its acceleration. Readings are whole numbers of `resolution`, after
    Gaussian noise with the standard deviation `noise`, both in the unit of the reading. `modal` names a body whose
    modal coordinates are read as they are, which no sensor can. Patches read the
    charge c [φ'(x2) − φ'(x1)] p over `capacitance` (F; that of the patch itself where it is not given).
    """

    joint: str | None = None
    motor: str | None = None
    point: PointReference | None = None
    pzt: str | None = None
    modal: str | None = None
    measure: Literal["value", "rate", "acceleration"] = "value"
    resolution: NotNegative = 0.0
    noise: NotNegative = 0.0
    capacitance: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Sensor:
        subject = one_of(self, ("joint", "motor", "point", "pzt", "modal"))
        allowed = {"pzt": ("value",), "modal": ("value", "rate"), "joint": ("value", "rate")}
        allowed["motor"] = allowed["joint"]
        known = allowed.get(subject, ("value", "rate", "acceleration"))
        if self.measure not in known:
            raise ValueError(f'expected one of {quoted(known)} as measure beside "{subject}", found "{self.measure}"')
        if self.capacitance is not None and subject != "pzt":
            raise ValueError(f'expected the key "capacitance" only beside "pzt", found it beside "{subject}"')
        return self


class JointPid(Record):
    """u = P e + D ė + I ∫e of each joint named, e from the reference; N·m/rad, N·m·s/rad, N·m/(rad·s) or their like.

    Rates are measured, or `rate = "difference"` of the last two readings.
    """

    kind: Literal["joint-pid"]
    proportional: dict[Name, NotNegative] = Field(default_factory=dict)
    derivative: dict[Name, NotNegative] = Field(default_factory=dict)
    integral: dict[Name, NotNegative] = Field(default_factory=dict)
    rate: Literal["measured", "difference"] = "measured"
    side: Literal["joint", "motor"] = "joint"  # of gears that give, on which the angles are read

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints with any gain."""
        return tuple(dict.fromkeys((*self.proportional, *self.derivative, *self.integral)))


class ComputedTorque(Record):
    """Moments of the mechanism with rigid links for γ̈_ref + 2 ζ ω ė + ω² e, instead of a feed-forward of moments."""

    kind: Literal["computed-torque"]
    bandwidth: Positive  # ω, rad/s
    damping_ratio: Positive = 1.0


class ModalVelocity(Record):
    """Patches as dampers of the lowest `modes` of their links: modal forces −2 ζ ω ṗ, ζ the `damping_ratio` added.

    p from the voltages of the same patches (least squares over these modes) and ṗ from two samples, or both ideal.
    """

    kind: Literal["modal-velocity"]
    bodies: Annotated[tuple[str, ...], NotEmpty]
    modes: Annotated[int, Field(gt=0)] = 1
    damping_ratio: Positive
    sensor: Literal["pzt", "ideal"] = "pzt"


class Lqr(Record):
    """u = −K x for the sampled linear model about the reference at `time`, links with their lowest `modes`.

    Weights are one over the squares of what is acceptable: angles (rad), rates (rad/s), deflections of the links
    relative to their length, moments (N·m), voltages (V). `inputs`: all, or motors or
    patches alone, the latter about joints that a "joint-pid" beside holds. States as in `ModalVelocity`.
    """

    kind: Literal["lqr"]
    inputs: Literal["all", "motors", "patches"] = "all"
    modes: Annotated[int, Field(gt=0)] = 1
    time: NotNegative = 0.0
    angle: Positive = 0.01
    rate: Positive = 0.1
    deflection: Positive = 1e-3
    moment: Positive = 10.0
    voltage: Positive = 100.0
    sensor: Literal["pzt", "ideal"] = "pzt"


def _python_function(value: object, info: ValidationInfo) -> object:
    """A function that a scene made in Python carries, or "FILE.py:FUNCTION" with the file where it is."""
    objects = (info.context or {}).get("objects", {})
    if callable(value) or (isinstance(value, str) and value in objects):
        return objects.get(value, value)
    path, colon, function = value.rpartition(":") if isinstance(value, str) else ("", "", "")
    if not colon or not path or not function.isidentifier():
        raise ValueError(f'expected "FILE.py:FUNCTION", found "{value}"')
    return f"{existing_file(Path(path), info)}:{function}"


class PythonController(Record):
    """A function of the user's, "FILE.py:FUNCTION" with the file beside the scene, or itself in scenes made in Python.

    See `actuation.control.python_controller`.
    """

    kind: Literal["python"]
    python: Annotated[Any, PlainValidator(_python_function, json_schema_input_type=str)]


Controller = Annotated[JointPid | ComputedTorque | ModalVelocity | Lqr | PythonController, Field(discriminator="kind")]


class ClosedLoopKeys(Record):
    """What an analysis of kind "closed-loop" takes besides; its `actuation` gives reference, feed-forward and start.

    Samples are at 0, sample_time, …; the command of each acts `delay` later and is held. Moments and voltages keep
    within the limits of the scene unless `unlimited`. The run starts as the inverse analysis does, or as [initial] of
    the scene says, on the trajectories. `seed` starts the noise. `tip` is the point whose error is reported.
    """

    sample_time: Positive | None = None
    delay: NotNegative = 0.0
    start: Literal["actuation", "scene"] = "actuation"
    feed_forward: Literal["none", "joints", "joints+pzt"] = "joints"
    unlimited: bool = False
    seed: Annotated[int, Field(ge=0)] = 0
    tip: PointReference | None = None
    controller: tuple[Controller, ...] = ()
    sensor: tuple[Sensor, ...] = ()
    disturbance: tuple[Load, ...] = ()

    @model_validator(mode="after")
    def _loop_consistent(self) -> ClosedLoopKeys:
        kind = getattr(self, "kind", "")
        found = [key for key in ClosedLoopKeys.model_fields if key in self.model_fields_set]
        if kind != "closed-loop" and found:
            raise ValueError(f'expected the key "{found[0]}" only in kind = "closed-loop", found kind = "{kind}"')
        if kind != "closed-loop":
            return self
        for key in ("sample_time", "actuation"):
            if getattr(self, key, None) is None:
                raise ValueError(f'expected the key "{key}" in kind = "closed-loop", found none')
        if any(load.point is None for load in self.disturbance):
            raise ValueError("expected disturbances at points, found one elsewhere")
        end = getattr(self, "end", 0.0)
        if end and self.delay >= end:
            raise ValueError(f"expected a delay shorter than the run ({end:g} s), found {self.delay:g} s")
        if end and self.sample_time is not None and self.sample_time > end:
            raise ValueError(f"expected a sample_time of at most the run ({end:g} s), found {self.sample_time:g} s")
        return self
