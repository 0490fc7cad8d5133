"""The records of a scene file, key by key. SI units; angles in rad; planar coordinates (x, y)."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, PlainValidator, ValidationInfo, field_validator, model_validator

from ..validation import InputFile, Record, existing_file, quoted
from ._core import TimeFunction
from .time_functions import Waypoints, load_waypoints, parse_expression

GROUND = "ground"
MAX_OUTPUTS = 10_000_000
TIGHTEST_TOLERANCE = 1e-10  # rounding in the forces of stiff links is not far below

T = TypeVar("T")


def split_point(reference: str) -> tuple[str, str]:
    """`"link1.tip"` → `("link1", "tip")`. Raises `ValueError` when it is not of the form BODY.POINT."""
    body, dot, point = reference.partition(".")
    if not (body and dot and point) or "." in point:
        raise ValueError(f'expected a point as "BODY.POINT", found "{reference}"')
    return body, point


def _time_function(value: object) -> TimeFunction:
    if isinstance(value, TimeFunction):
        return value
    if isinstance(value, str):
        return parse_expression(value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return parse_expression(repr(value))
    raise ValueError(f"expected an expression in t, found {value!r}")


def _name(value: str) -> str:
    """Names become groups of the results file and parts of "BODY.POINT"."""
    if not value or value != value.strip() or "/" in value or "." in value:
        raise ValueError(f'expected a name without "/", "." and blanks around it, found "{value}"')
    return value


def _point(value: str) -> str:
    split_point(value)
    return value


def _side(value: str) -> str:
    if value != GROUND:
        split_point(value)
    return value


def _waypoints(value: object, info: ValidationInfo) -> Waypoints:
    if isinstance(value, Waypoints):
        return value
    if not isinstance(value, str):
        raise ValueError(f"expected the name of a CSV file in quotes, found {value!r}")
    return load_waypoints(existing_file(Path(value), info))


def _not_empty(entries: tuple[T, ...]) -> tuple[T, ...]:
    # Not a min_length: pydantic would complain about that, too, whenever an entry is wrong.
    if not entries:
        raise ValueError("expected at least one entry, found none")
    return entries


def _one_of(record: Record, keys: tuple[str, ...], why: str = "") -> str:
    """The one key of `keys` that is set. Raises `ValueError` when there is none or more than one."""
    found = [key for key in keys if getattr(record, key) is not None]
    if len(found) != 1:
        raise ValueError(f"expected exactly one of the keys {quoted(keys)}{why}, found {quoted(found)}")
    return found[0]


def _only(record: Record, subject: str, allowed: tuple[str, ...], optional: tuple[str, ...]) -> list[str]:
    """Which of the `optional` keys are set. Raises `ValueError` unless all are `allowed` and there is at least one."""
    found = [key for key in optional if getattr(record, key) is not None]
    if not found or not set(found) <= set(allowed):
        raise ValueError(f'expected the keys {quoted(allowed)} beside "{subject}", found {quoted(found)}')
    return found


Name = Annotated[str, AfterValidator(_name)]
PointReference = Annotated[str, AfterValidator(_point)]
Side = Annotated[str, AfterValidator(_side)]
Vector2 = tuple[float, float]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Expression = Annotated[TimeFunction, PlainValidator(_time_function, json_schema_input_type=str | float)]
WaypointTable = Annotated[Waypoints, PlainValidator(_waypoints, json_schema_input_type=str)]
NotEmpty = AfterValidator(_not_empty)


class RigidBody(Record):
    """Mass (kg), moment of inertia about the center (kg·m²), center and named points (m) in the body frame."""

    mass: Positive
    inertia: float
    center: Vector2
    points: dict[Name, Vector2] = Field(default_factory=dict)

    @field_validator("inertia")
    @classmethod
    def _inertia_is_positive(cls, inertia: float) -> float:
        if not inertia > 0.0:
            raise ValueError(
                f"expected a moment of inertia greater than 0, found {inertia:g}: without it the body's rotation has no"
                " equation of motion (a point mass is a [[payload]])"
            )
        return inertia


class Body(Record):
    """A link file (stage 1 runs when needed), a modal body file, or a rigid body."""

    name: Name
    link: InputFile | None = None
    modal: InputFile | None = None
    rigid: RigidBody | None = None

    @model_validator(mode="after")
    def _one_source(self) -> Body:
        _one_of(self, ("link", "modal", "rigid"))
        return self


class Joint(Record):
    """A joint between two points, or a point and the ground.

    `at` (m) is where it sits on the ground; `axis` the direction of a prismatic joint in the frame of the first body;
    `motor` None leaves it to the default: driven in open chains. Limits of the motor: N·m, rad/s, W (N, m/s where
    prismatic).
    """

    name: Name
    type: Literal["revolute", "prismatic", "weld"]
    between: tuple[Side, Side]
    at: Vector2 = (0.0, 0.0)
    axis: Vector2 | None = None
    motor: bool | None = None
    moment_limit: Positive | None = None
    speed_limit: Positive | None = None
    power_limit: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Joint:
        points = [side for side in self.between if side != GROUND]
        if not points:
            raise ValueError('expected at most one "ground" in between, found two')
        bodies = [split_point(point)[0] for point in points]
        if len(points) == 2 and bodies[0] == bodies[1]:
            raise ValueError(f'expected two bodies in between, found "{bodies[0]}" twice')
        if len(points) == 2 and "at" in self.model_fields_set:
            raise ValueError('expected the key "at" only in joints to "ground", found it between two bodies')
        if self.type == "prismatic" and (self.axis is None or not any(self.axis)):
            raise ValueError(
                "expected an axis that is not zero in a prismatic joint, found "
                + ("none" if self.axis is None else f"{list(self.axis)}")
            )
        if self.type != "prismatic" and self.axis is not None:
            raise ValueError(f'expected the key "axis" only in prismatic joints, found it in a {self.type} joint')
        if self.type == "weld" and self.motor:
            raise ValueError("expected no motor in a weld, which cannot move, found motor = true")
        return self


class Trajectory(Record):
    """Motion that is specified (C_s): of a point (m, global axes), a joint coordinate, or an angle (rad).

    `angle` is a body (its frame) or BODY.POINT (the section there).
    """

    name: Name
    point: PointReference | None = None
    joint: str | None = None
    angle: str | None = None
    x: Expression | None = None
    y: Expression | None = None
    value: Expression | None = None
    waypoints: WaypointTable | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Trajectory:
        subject = _one_of(self, ("point", "joint", "angle"))
        allowed = ("x", "y") if subject == "point" else ("value",)
        found = _only(self, subject, (*allowed, "waypoints"), ("x", "y", "value", "waypoints"))
        if self.waypoints is None:
            return self
        if len(found) > 1:
            raise ValueError(f"expected either waypoints or expressions, found {quoted(found)}")
        if not set(self.components) <= set(allowed):
            columns = ",".join(("t", *self.components))
            raise ValueError(f'expected waypoints with the header t,{",".join(allowed)}, found "{columns}"')
        return self

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The specified functions of time by component: "x" and/or "y", or "value"."""
        if self.waypoints is not None:
            return self.waypoints.components
        return _present(x=self.x, y=self.y, value=self.value)


def _present(**functions: TimeFunction | None) -> dict[str, TimeFunction]:
    return {name: function for name, function in functions.items() if function is not None}


class PztLayout(Record):
    """Equal piezoelectric patches along one link. Lengths in m, modulus in Pa, d31 in m/V, density kg/m³, limit in V.

    Centers are distances along the link from its root; `count` places them at (k − ½)·(length of link)/count.
    `thickness` is that of one of `layers`, which lie on each other on one `face` or on both, driven against each other.
    Without `face` they bend the link and do nothing else, as in the paper. `limit` is one for all or one for each.
    `allocation = "least-squares"` is content with fewer patches than modes, or modes that no patch reaches.
    Where voltages cannot produce all modal forces, `mode_weights` (of the squares of what is left) or `point_weights`
    (of the squares of the deflections that this causes at points of the link) say what matters.
    `structural` names what of the patches is added to the link: "mass", "stiffness".
    Only for the judgement: `depoling_field` (V/m) and `strain_limit` of the material.
    `coupling`: patches work on the section rotations at their ends, or on the faces of a solid that outlines them.
    """

    body: str
    count: Annotated[int, Field(gt=0)] | None = None
    centers: Annotated[tuple[float, ...], NotEmpty] | None = None
    length: Positive
    width: Positive
    thickness: Positive
    modulus: Positive
    d31: float
    density: Positive | None = None
    limit: Positive | Annotated[tuple[Positive, ...], NotEmpty] | None = None
    layers: Annotated[int, Field(gt=0)] = 1
    face: Literal["+y", "-y", "both"] | None = None
    allocation: Literal["exact", "least-squares"] = "exact"
    mode_weights: Annotated[tuple[NotNegative, ...], NotEmpty] | None = None
    point_weights: dict[Name, NotNegative] | None = None
    structural: tuple[Literal["mass", "stiffness"], ...] = ()
    depoling_field: Positive | None = None
    strain_limit: Positive | None = None
    coupling: Literal["rotation", "surface"] = "rotation"

    @model_validator(mode="after")
    def _consistent(self) -> PztLayout:
        _one_of(self, ("count", "centers"))
        if self.d31 == 0.0:
            raise ValueError("expected a d31 other than 0, found 0: such patches do nothing")
        if isinstance(self.limit, tuple) and len(self.limit) != self.patch_count:
            raise ValueError(f"expected {self.patch_count} limits, one for each patch, found {len(self.limit)}")
        if "mass" in self.structural and self.density is None:
            raise ValueError('expected the key "density" beside structural = ["mass"], found none')
        if self.mode_weights is not None and self.point_weights is not None:
            raise ValueError('expected one of the keys "mode_weights" and "point_weights", found both')
        for weights in (self.mode_weights, self.point_weights and tuple(self.point_weights.values())):
            if weights is not None and not any(weights):
                raise ValueError("expected weights that are not all 0, found only zeros")
        return self

    @property
    def patch_count(self) -> int:
        """Number of patches."""
        return len(self.centers) if self.centers is not None else (self.count or 0)


Place = float | Annotated[str, AfterValidator(_name)]
"""Where on a link: the distance from its root (m), or the name of one of its points."""


class ActuationPoints(Record):
    """Components of force on one body that carry its generalized driving forces (Shaban 2022, sec. 4).

    `axial` and `transverse` say at which places a component along x or y of the body's frame acts. Without either,
    as many as the body has coordinates are chosen.
    """

    body: str
    axial: tuple[Place, ...] = ()
    transverse: tuple[Place, ...] = ()

    @property
    def is_automatic(self) -> bool:
        """Whether the components are left to the program."""
        return not (self.axial or self.transverse)


class Load(Record):
    """A given load: force (N, global axes) and moment (N·m) at a point, moment of a joint, or voltages (V)."""

    point: PointReference | None = None
    joint: str | None = None
    pzt: str | None = None
    x: Expression | None = None
    y: Expression | None = None
    moment: Expression | None = None
    voltage: tuple[Expression, ...] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        subject = _one_of(self, ("point", "joint", "pzt"))
        allowed = {"point": ("x", "y", "moment"), "joint": ("moment",), "pzt": ("voltage",)}[subject]
        _only(self, subject, allowed, ("x", "y", "moment", "voltage"))
        return self

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The given functions of time by component: "x", "y", "moment", or "voltage[k]"."""
        voltages = {f"voltage[{k}]": function for k, function in enumerate(self.voltage or ())}
        return _present(x=self.x, y=self.y, moment=self.moment) | voltages


class Payload(Record):
    """A mass (kg) on a point, with its moment of inertia about that point (kg·m²)."""

    point: PointReference
    mass: Positive
    inertia: Annotated[float, Field(ge=0.0)] = 0.0


class Initial(Record):
    """State at t = 0; `angles` (rad) and `rates` (rad/s) of body frames are guesses that the constraints correct."""

    state: Literal["undeformed", "static"] = "undeformed"
    angles: dict[str, float] = Field(default_factory=dict)
    rates: dict[str, float] = Field(default_factory=dict)


class Analysis(Record):
    """One run, with outputs at 0, output_step, …, end (s).

    Both are 0 where the file does not give them: in static analyses (t = 0 only), and in forward analyses that take
    over the times of their actuation, which `load_scene` fills in. `shape` of FCID says which p(t) is prescribed,
    `modal` gives it: expressions for the first modes of a body, as its modal file numbers them; all others are 0.
    `limits` keeps the actuators of a forward run within their limits.

    `integrator`: see `integrators.choose_integrator` for "auto"; `spectral_radius` is what a step of generalized-alpha
    leaves of vibrations far above one over its size.
    """

    name: Name
    kind: Literal["pcid", "fcid", "forward", "static"]
    end: Positive = 0.0
    output_step: Positive = 0.0
    tolerance: Annotated[float, Field(ge=TIGHTEST_TOLERANCE, lt=1.0)] = 1e-6
    actuation: str | None = None
    apply: Literal["joints", "joints+pzt", "trajectory", "points"] | None = None
    limits: bool = False
    shape: Literal["zero", "static", "given"] | None = None
    modal: dict[Name, tuple[Expression, ...]] | None = None
    integrator: Literal["auto", "dopri5", "dop853", "radau", "generalized-alpha"] = "auto"
    spectral_radius: Annotated[float, Field(ge=0.0, le=1.0)] = 0.8  # of generalized-alpha at infinite frequency
    max_steps: Annotated[int, Field(gt=0)] = 5_000_000

    @model_validator(mode="after")
    def _consistent(self) -> Analysis:
        for key in ("end", "output_step"):
            given = key in self.model_fields_set
            if self.kind == "static" and given:
                raise ValueError(f'expected no key "{key}" in kind = "static", found {getattr(self, key):g}')
            if self.kind != "static" and self.actuation is None and not given:
                raise ValueError(f'expected the key "{key}" in kind = "{self.kind}", found none')
        if self.end and self.output_step:
            check_steps(self.end, self.output_step)
        if (self.actuation is None) != (self.apply is None):
            raise ValueError(
                'expected the keys "actuation" and "apply" together, found only '
                + ('"apply"' if self.actuation is None else '"actuation"')
            )
        if self.actuation is not None and self.kind != "forward":
            raise ValueError(f'expected the key "actuation" only in kind = "forward", found kind = "{self.kind}"')
        if "spectral_radius" in self.model_fields_set and self.integrator != "generalized-alpha":
            raise ValueError(
                'expected the key "spectral_radius" only with integrator = "generalized-alpha", found integrator ='
                f' "{self.integrator}"'
            )
        if self.shape is not None and self.kind != "fcid":
            raise ValueError(f'expected the key "shape" only in kind = "fcid", found kind = "{self.kind}"')
        if self.shape is None and self.kind == "fcid":
            raise ValueError('expected the key "shape" in kind = "fcid", found none')
        if self.modal is not None and self.shape != "given":
            raise ValueError(f'expected the key "modal" only in shape = "given", found shape = "{self.shape}"')
        if self.modal is None and self.shape == "given":
            raise ValueError('expected the key "modal" in shape = "given", found none')
        if self.limits and self.apply not in ("joints", "joints+pzt"):
            raise ValueError(
                f'expected limits = true only beside apply = "joints" or "joints+pzt", found apply = "{self.apply}"'
            )
        return self

    @property
    def times(self) -> NDArray[np.float64]:
        """Output times (T,), in s: exact multiples of the output step, ending exactly at `end`."""
        if not (self.end and self.output_step):
            return np.zeros(1)
        times = np.arange(round(self.end / self.output_step) + 1) * self.output_step
        times[-1] = self.end
        return times


def check_steps(end: float, step: float) -> None:
    """Raise `ValueError` unless the outputs 0, step, 2 step, … end exactly at `end`."""
    ratio = end / step
    if ratio > MAX_OUTPUTS:
        raise ValueError(f"expected at most {MAX_OUTPUTS} outputs, found output_step = {step:g} up to end = {end:g}")
    count = round(ratio)
    # 0.1/0.001 is not whole in binary; anything beyond rounding is meant otherwise.
    if count < 1 or abs(ratio - count) > 1e-9 * ratio:
        near = end / max(1, count)
        raise ValueError(
            f"expected an output_step that divides end = {end:g} into equal steps, found {step:g} (such as {near:.9g})"
        )


class SceneKeys(Record):
    """Everything a scene file may contain; lists of tables keep the singular name they have in the file.

    `geometric_stiffening` "auto": where the loads of a run change the stiffness of a mode by more than 1 %.
    """

    name: Annotated[str, Field(min_length=1)]
    space: Literal["planar", "spatial"] = "planar"
    gravity: Vector2
    motors: Literal["section", "frame"] = "section"
    geometric_stiffening: bool | Literal["auto"] = False
    body: Annotated[tuple[Body, ...], NotEmpty]
    joint: tuple[Joint, ...] = ()
    trajectory: tuple[Trajectory, ...] = ()
    pzt: tuple[PztLayout, ...] = ()
    actuation_points: tuple[ActuationPoints, ...] = ()
    load: tuple[Load, ...] = ()
    payload: tuple[Payload, ...] = ()
    initial: Initial = Initial()
    analysis: Annotated[tuple[Analysis, ...], NotEmpty]


class Scene(SceneKeys):
    """A validated scene, with the absolute `path` of its file and the raw `text` that results files carry."""

    path: Path
    text: str

    def __repr__(self) -> str:
        names = {
            "bodies": [body.name for body in self.body],
            "joints": [joint.name for joint in self.joint],
            "trajectories": [trajectory.name for trajectory in self.trajectory],
            "analyses": [analysis.name for analysis in self.analysis],
        }
        parts = [f"{kind} {', '.join(members)}" for kind, members in names.items() if members]
        return f"Scene({self.name!r}): {'; '.join(parts)}"

    __str__ = __repr__
