"""Bodies and payloads of a scene file, key by key. SI units; planar (x, y)."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, PlainValidator, ValidationInfo, field_validator, model_validator

from ...common.numbers import MOST_MODES, SMALLEST
from ...common.validation import InputFile, Record, existing_file
from ...fe_models.link_file import LinkSource, LinkTable
from ...fe_models.link_records import BeamLink, SolidLink
from ..fields.field_types import Name, NotNegative, PointReference, Positive, Vector2, one_of
from ..fields.references import Reference


class RigidBody(Record):
    """Mass (kg), moment of inertia about the center (kg·m²), center and named points (m) in the body frame."""

    mass: Positive
    """Mass, kg."""
    inertia: float
    """Moment of inertia about the center of mass, kg·m²."""
    center: Vector2
    """Center of mass, m, axes of the body."""
    points: dict[Name, Vector2] = Field(default_factory=dict)
    """Points for joints, loads and trajectories by name: m, axes of the body."""

    @field_validator("inertia")
    @classmethod
    def _inertia_is_positive(cls, inertia: float) -> float:
        if not inertia >= SMALLEST:
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


ModeCount = Literal["auto"] | Annotated[int, Field(ge=0, le=MOST_MODES)]


class BodyKeys(Record):
    """What bodies in the plane and in space have in common; beside it each has the record of a rigid one, `rigid`."""

    name: Name
    """Name of the body, unique in the scene."""
    link: LinkInput | None = None
    """Link file, or a table with its keys; stage 1 runs if needed."""
    modal: InputFile | None = None
    """Modal body file, written by stage 1."""

    modes: ModeCount | None = None
    """Number of the lowest modes; "auto": as many as the tolerances need; default: all. Planar scenes count in-plane
    modes, 3D scenes those of all families."""
    pieces: Literal["auto"] | Annotated[int, Field(ge=1, le=100)] | None = None
    """Number of welded segments of a beam link for large deflections; "auto" chooses it."""

    @property
    def modes_kept(self) -> int | None:
        """How many modes the scene asks for; None where it does not say."""
        return self.modes if isinstance(self.modes, int) else None

    @model_validator(mode="after")
    def _is_one_of_three(self) -> Self:
        one_of(self, ("link", "modal", "rigid"))
        if self.modes is not None and self.link is None and self.modal is None:
            raise ValueError(f'expected the key "modes" only in flexible bodies, found it in a rigid one: {self.modes}')
        if self.pieces is not None and (self.link is None or self.modes is not None):
            beside = "modes" if self.modes is not None else "modal" if self.modal is not None else "rigid"
            raise ValueError(f'expected "pieces" with "link" alone, found "{beside}"')
        return self


class Body(BodyKeys):
    """A link file or a table of its keys (stage 1 runs if needed), a modal body file, or a rigid body.

    The default `name` in a table of a link's keys is that of the body.

    `modes` of a flexible body is the number of its lowest in-plane modes; the others are represented by their static
    flexibility. "auto" takes as many as the tolerances of the analyses need; the default is all.

    `pieces` is the number of segments of a beam link for large deflections; "auto" chooses it. Results are those of the
    whole link, and geometric stiffening is on.
    """

    rigid: RigidBody | None = None
    """Data of a rigid body."""


class Payload(Record):
    """A mass (kg) on a point, with its moment of inertia about that point (kg·m²)."""

    point: PointReference
    """Point of the mass, "BODY.POINT"."""
    mass: NotNegative
    """Mass, kg."""
    inertia: NotNegative = 0.0
    """Moment of inertia about that point, kg·m²."""

    def references(self) -> Iterator[Reference]:
        """The point that carries it."""
        yield Reference("point", self.point)
