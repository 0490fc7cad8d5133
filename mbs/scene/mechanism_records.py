"""Bodies, joints, trajectories and loads of a scene file, key by key. SI units; angles in rad; planar (x, y)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, PlainValidator, ValidationInfo, field_validator, model_validator

from ...common.validation import InputFile, Record, existing_file, quoted
from ...fe_models.link_file import LinkSource, LinkTable
from ...fe_models.link_records import BeamLink, SolidLink
from .._core import StateFunction, TimeFunction
from ..fields.field_types import (
    GROUND,
    Expression,
    Name,
    NotNegative,
    PointReference,
    Positive,
    Side,
    Vector2,
    WaypointTable,
    one_of,
    only,
    present,
    split_point,
)
from ..fields.references import Reference, marker_reference
from ..fields.state_forces import state_function


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


def _link(value: object, info: ValidationInfo) -> LinkSource:
    if isinstance(value, str):
        return existing_file(Path(value), info)
    if not isinstance(value, dict):
        raise ValueError(f"expected the name of a link file in quotes or a table of its keys, found {value!r}")
    name, path = info.data.get("name", "?"), info.context["path"] if info.context else Path("scene")
    return LinkTable({"name": name, **value}, path.with_name(f'{path.name}: body "{name}": link'))


LinkInput = Annotated[LinkSource, PlainValidator(_link, json_schema_input_type=str | BeamLink | SolidLink)]


class Body(Record):
    """A link file or a table of its keys (stage 1 runs when needed), a modal body file, or a rigid body.

    The `name` in a table of a link's keys is the body's where it is left out.

    `modes` of a flexible body: how many of the lowest that move in the plane; the others are represented by their
    static flexibility. "auto" takes as many as the tolerances of the analyses need; the default is all.
    """

    name: Name
    link: LinkInput | None = None
    modal: InputFile | None = None
    rigid: RigidBody | None = None
    modes: Literal["auto"] | Annotated[int, Field(ge=0)] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Body:
        one_of(self, ("link", "modal", "rigid"))
        if self.rigid is not None and self.modes is not None:
            raise ValueError(f'expected the key "modes" only in flexible bodies, found it in a rigid one: {self.modes}')
        return self


AS_BUILT = (
    "gear_ratio", "rotor_inertia", "viscous_friction", "coulomb_friction", "friction_speed", "stiffness", "damping"
)  # fmt: skip


class Joint(Record):
    """A joint between two points, or a point and the ground.

    `at` (m) is where it sits on the ground; `axis` the direction of a prismatic joint in the frame of the first body;
    `motor` None leaves it to the default: driven in open chains. Limits of the motor: N·m, rad/s, W (N, m/s where
    prismatic).

    As it is built: `rotor_inertia` J (kg·m²) of a rotor that sits on the first body and turns `gear_ratio` N times as
    fast as the second does on the first (rad/m where prismatic); friction on the joint's coordinate γ,
    −(c γ̇ + τ_c tanh(γ̇/γ̇_s)): `viscous_friction` c (N·m·s), `coulomb_friction` τ_c (N·m), `friction_speed` γ̇_s (rad/s).
    Between the gear of a motor and the second body a spring `stiffness` (N·m/rad; rigid where it is not given) and a
    damper `damping` (N·m·s/rad): see `compliant_joints`.
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
    gear_ratio: Positive = 1.0
    rotor_inertia: NotNegative = 0.0
    viscous_friction: NotNegative = 0.0
    coulomb_friction: NotNegative = 0.0
    friction_speed: Positive = 0.01
    stiffness: Positive | None = None
    damping: NotNegative = 0.0

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
        built = [key for key in AS_BUILT if key in self.model_fields_set]
        if self.type == "weld" and built:
            raise ValueError(
                f"expected none of the keys {quoted(AS_BUILT)} in a weld, which cannot move, found {built[0]}"
            )
        if "friction_speed" in built and not self.coulomb_friction:
            raise ValueError('expected the key "friction_speed" only beside coulomb_friction, found it alone')
        self._check_compliance()
        return self

    def _check_compliance(self) -> None:
        if self.stiffness is None:
            if self.damping:
                raise ValueError('expected the key "damping" only beside stiffness, found it alone')
            return
        if self.type != "revolute":
            raise ValueError(f'expected the key "stiffness" only in revolute joints, found it in a {self.type} joint')
        if not self.rotor_inertia:
            raise ValueError("expected a rotor_inertia above 0 beside stiffness, found none: the rotor turns by itself")


class Payload(Record):
    """A mass (kg) on a point, with its moment of inertia about that point (kg·m²)."""

    point: PointReference
    mass: Positive
    inertia: Annotated[float, Field(ge=0.0)] = 0.0


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
        subject = one_of(self, ("point", "joint", "angle"))
        allowed = ("x", "y") if subject == "point" else ("value",)
        found = only(self, subject, (*allowed, "waypoints"), ("x", "y", "value", "waypoints"))
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
        return present(x=self.x, y=self.y, value=self.value)


def _state_force(value: object, info: ValidationInfo) -> StateFunction:
    if isinstance(value, StateFunction):
        return value
    objects = (info.context or {}).get("objects", {})
    if not isinstance(value, str) or value not in objects:
        raise ValueError(f"expected a function of t, position and velocity, in scenes made in Python, found {value!r}")
    return state_function(objects[value])


StateForce = Annotated[StateFunction, PlainValidator(_state_force, json_schema_input_type=str)]


class Load(Record):
    """A given load: force (N, global axes) and moment (N·m) at a point, moment of a joint, or voltages (V).

    `force` on a point, in scenes made in Python: a function of its motion, see `state_forces.state_function`.
    """

    point: PointReference | None = None
    joint: str | None = None
    pzt: str | None = None
    x: Expression | None = None
    y: Expression | None = None
    moment: Expression | None = None
    force: StateForce | None = None
    voltage: tuple[Expression, ...] | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        subject = one_of(self, ("point", "joint", "pzt"))
        allowed = {"point": ("x", "y", "moment", "force"), "joint": ("moment",), "pzt": ("voltage",)}[subject]
        found = only(self, subject, allowed, ("x", "y", "moment", "force", "voltage"))
        if self.force is not None and len(found) > 1:
            raise ValueError(f'expected "force" alone beside "point", found {quoted(found)}')
        return self

    def references(self) -> Iterator[Reference]:
        """Where it acts."""
        yield from marker_reference("point", self.point, loaded=True)
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")

    @property
    def components(self) -> dict[str, TimeFunction]:
        """The given functions of time by component: "x", "y", "moment", or "voltage[k]"."""
        voltages = {f"voltage[{k}]": function for k, function in enumerate(self.voltage or ())}
        return present(x=self.x, y=self.y, moment=self.moment) | voltages


class Initial(Record):
    """State at t = 0; `angles` (rad) and `rates` (rad/s) of body frames are guesses that the constraints correct."""

    state: Literal["undeformed", "static"] = "undeformed"
    angles: dict[str, float] = Field(default_factory=dict)
    rates: dict[str, float] = Field(default_factory=dict)
