"""Sensors, controllers and placements of a scene file, key by key. SI units."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, PlainValidator, ValidationInfo, model_validator

from ...common.python_files import check_python_file
from ...common.validation import Record, existing_file, quoted
from ...mbs.fields.field_types import (
    ModeCount,
    Name,
    NotEmpty,
    NotNegative,
    PatchCount,
    PointReference,
    Positive,
    one_of,
)
from ...mbs.fields.references import Reference

PERMITTIVITY = 1700 * 8.8541878128e-12  # F/m, of PZT-5A along the field, free


class Sensor(Record):
    """What is measured, and how well: of a joint its coordinate, of a point x, y (z), of patches their voltages.

    `motor` names a joint with stiffness, of which the motor's angle behind its gear is read, on the first body.
    `measure` is the value, its rate, or (points) its acceleration. Readings are whole numbers of `resolution`, after
    Gaussian noise with the standard deviation `noise`, both in the unit of the reading. `modal` names a body whose
    modal coordinates are read as they are, which no sensor can. Patches read the
    charge c [φ'(x2) − φ'(x1)] p over `capacitance` (F; that of the patch itself where it is not given).
    """

    joint: str | None = None
    """Joint whose coordinate is read, rad (m where prismatic)."""
    motor: str | None = None
    """Joint with stiffness whose motor's angle behind its gear is read, rad."""
    point: PointReference | None = None
    """Point "BODY.POINT" whose x and y (in space z) are read, m, global axes."""
    pzt: str | None = None
    """Body whose patches are read, V; in space the layout, by its name."""
    modal: str | None = None
    """Body whose modal coordinates are read as they are, which no sensor can (m·√kg)."""
    measure: Literal["value", "rate", "acceleration"] = "value"
    """The value, its rate, or its acceleration (points)."""
    resolution: NotNegative = 0.0
    """Readings are whole numbers of it, in their unit; 0: any number."""
    noise: NotNegative = 0.0
    """Standard deviation of Gaussian noise, in the unit of the reading."""
    capacitance: Positive | None = None
    """Of each patch, F; by default its own."""

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

    def references(self) -> Iterator[Reference]:
        """What is measured."""
        if self.point is not None:
            yield Reference("", self.point, needs_marker=True)
        if self.modal is not None:
            yield Reference("modal", self.modal)
            yield Reference("modal", self.modal, "flexible body")
        if self.pzt is not None:
            yield Reference("pzt", self.pzt, "patches")
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")
        if self.motor is not None:
            yield Reference("motor", self.motor, "elastic joint")


class ControllerRecord(Record):
    """Base of all controllers."""

    def references(self) -> Iterator[Reference]:
        """Joints and bodies that a controller names."""
        yield from ()


class JointPid(ControllerRecord):
    """u = P e + D ė + I ∫e of each joint named, e from the reference; N·m/rad, N·m·s/rad, N·m/(rad·s) or their like.

    Rates are measured, or `rate = "difference"` of the last two readings.
    """

    kind: Literal["joint-pid"]
    proportional: dict[Name, NotNegative] = Field(default_factory=dict)
    """P by joint, N·m/rad (N/m where prismatic)."""
    derivative: dict[Name, NotNegative] = Field(default_factory=dict)
    """D by joint, N·m·s/rad (N·s/m where prismatic)."""
    integral: dict[Name, NotNegative] = Field(default_factory=dict)
    """I by joint, N·m/(rad·s) (N/(m·s) where prismatic)."""
    rate: Literal["measured", "difference"] = "measured"
    """Rates are measured, or the difference of two readings over the sample time."""
    side: Literal["joint", "motor"] = "joint"
    """Of gears that give, on which the angles are read."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints with any gain."""
        return tuple(dict.fromkeys((*self.proportional, *self.derivative, *self.integral)))

    def references(self) -> Iterator[Reference]:
        """The joints, and the side of their gears."""
        for name in self.joints:
            yield Reference("", name, "joint")
            if self.side == "motor":
                yield Reference("side: motor", name, "elastic joint")


class ComputedTorque(ControllerRecord):
    """Moments of the mechanism with rigid links for γ̈_ref + 2 ζ ω ė + ω² e, instead of a feed-forward of moments."""

    kind: Literal["computed-torque"]
    bandwidth: Positive
    """ω of the error's dynamics, rad/s."""
    damping_ratio: Positive = 1.0
    """ζ of the error's dynamics."""


class ModalVelocity(ControllerRecord):
    """Patches as dampers of the lowest `modes` of their links: modal forces −2 ζ ω ṗ, ζ the `damping_ratio` added.

    p from the voltages of the same patches (least squares over these modes) and ṗ from two samples, or both ideal.
    """

    kind: Literal["modal-velocity"]
    bodies: Annotated[tuple[str, ...], NotEmpty]
    """Links whose patches act."""
    modes: ModeCount = 1
    """How many of the lowest modes of each link."""
    damping_ratio: Positive
    """ζ that is added to each of these modes."""
    sensor: Literal["pzt", "ideal"] = "pzt"
    """Voltages of the same patches, or p and its rate as they are."""

    def references(self) -> Iterator[Reference]:
        """The links."""
        for body in self.bodies:
            yield Reference("bodies", body)
            yield Reference("bodies", body, "patched body")


class Lqr(ControllerRecord):
    """u = −K x for the sampled linear model about the reference at `time`, links with their lowest `modes`.

    Weights are one over the squares of what is acceptable: angles (rad), rates (rad/s), deflections of the links
    relative to their length, moments (N·m), voltages (V). `inputs`: all, or motors or
    patches alone, the latter about joints that a "joint-pid" beside holds. States as in `ModalVelocity`.
    """

    kind: Literal["lqr"]
    inputs: Literal["all", "motors", "patches"] = "all"
    """What acts: motors and patches, or one of them."""
    modes: ModeCount = 1
    """How many of the lowest modes of each link the design knows."""
    time: NotNegative = 0.0
    """Instant of the reference about which it is linear, s."""
    angle: Positive = 0.01
    """Acceptable error of joints, rad."""
    rate: Positive = 0.1
    """Acceptable error of their rates, rad/s."""
    deflection: Positive = 1e-3
    """Acceptable deflection of links, relative to their length."""
    moment: Positive = 10.0
    """Acceptable moment of motors, N·m."""
    voltage: Positive = 100.0
    """Acceptable voltage of patches, V."""
    sensor: Literal["pzt", "ideal"] = "pzt"
    """Voltages of patches, or p and its rate as they are."""


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
    """A function of the user's, "FILE.py:FUNCTION" with the file beside the scene, or itself in scenes made in Python.

    See `actuation.control.python_controller`.
    """

    kind: Literal["python"]
    python: Annotated[Any, PlainValidator(_python_function, json_schema_input_type=str)]
    """Text "FILE.py:FUNCTION" with the file beside the scene; scenes made in Python may have the function itself."""


Controller = Annotated[JointPid | ComputedTorque | ModalVelocity | Lqr | PythonController, Field(discriminator="kind")]


class Placement(Record):
    """Where on one link the patches of its [[pzt]] should be, `count` of them.

    `criterion` "controllability": they reach the `modes` lowest modes of the robot with its motors held; "voltage":
    the largest voltage, relative to its limit, by which they produce the forces of the `modes` lowest modes of the link
    over the inverse analysis `about`. `measure` says which reach counts: of the worst mode, on average, or the product.
    Centers are sought every `spacing`, by trying all sets where that is at most `most_sets`, by evolution otherwise.
    """

    body: str
    """Link with patches; in space with one layout of them."""
    count: PatchCount | None = None
    """Number of patches; by default that of its [[pzt]]."""
    criterion: Literal["controllability", "voltage"] = "controllability"
    """Reach of the robot's lowest modes, or the largest voltage over its limit along the path."""
    measure: Literal["worst", "mean", "product"] = "worst"
    """Which reach counts: that of the worst mode, their mean, or their product."""
    modes: ModeCount | None = None
    """How many of the lowest modes count."""
    spacing: Positive | None = None
    """Between the centres that are tried, m; by default half the length of a patch."""
    most_sets: Annotated[int, Field(gt=0, le=10_000_000)] = 100_000
    """So many sets are tried one by one; with more, evolution seeks."""

    def references(self) -> Iterator[Reference]:
        """The link and its patches."""
        yield Reference("placement.body", self.body)
        yield Reference("placement.body", self.body, "patched body")
