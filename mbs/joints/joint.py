"""What all types of joints have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import ClassVar, Literal, Self, get_args

from pydantic import model_validator

from ...common.validation import Record
from ..fields.field_types import GROUND, Name, Side, Vector2, split_point
from ..fields.references import Reference, body_of, marker_reference
from .measure import Marker, Measure, marker_at
from .transmission import ElasticGear, Friction, MotorLimits, Rotor

RecordType = type[Record]

MotorSide = Literal["section", "frame"]
"""What motors and joint coordinates turn: the sections at the joint, or the frames of the bodies."""


class JointKeys(Record, ABC):
    """What joints in the plane and in space have in common: a name, a type, two sides."""

    name: Name
    """Name of the joint, unique in the scene."""
    type: str
    """How it moves."""
    between: tuple[Side, Side]
    """Sides of the joint, "BODY.POINT" or "ground"; coordinate, torque and reaction are of the second relative to the
    first."""

    locates: ClassVar[bool] = True
    """Whether it fixes the place of one body on the other; the initial guess goes along such joints first."""

    @model_validator(mode="after")
    def _fits_two_bodies(self) -> Self:
        points = [side for side in self.between if side != GROUND]
        if not points:
            raise ValueError('expected at most one "ground" in between, found two')
        bodies = [split_point(point)[0] for point in points]
        if len(points) == 2 and bodies[0] == bodies[1]:
            raise ValueError(f'expected two bodies in between, found "{bodies[0]}" twice')
        if len(points) == 2 and "at" in self.model_fields_set:
            raise ValueError('expected the key "at" only in joints to "ground", found it between two bodies')
        return self

    @classmethod
    def type_name(cls) -> str:
        """What the key `type` says."""
        return str(get_args(cls.model_fields["type"].annotation)[0])

    @classmethod
    def refuse_key(cls, key: str, others: Sequence[RecordType]) -> str:
        """What to say of a key that only joints of other types have."""
        having = " or ".join(other.type_name() for other in others if issubclass(other, JointKeys))
        return f'expected the key "{key}" only in {having} joints, found it in a {cls.type_name()} joint'

    @property
    def label(self) -> str:
        """What messages call it."""
        return f'joint "{self.name}"'

    @property
    def bodies(self) -> tuple[str, str]:
        """The two bodies it joins; one may be the ground."""
        first, second = self.between
        return body_of(first), body_of(second)

    def references(self) -> Iterator[Reference]:
        """The points it joins."""
        for k, side in enumerate(self.between):
            yield from marker_reference(f"between[{k}]", side, loaded=True)


class JointRecord(JointKeys):
    """A joint between two points, or a point and the ground; `at` (m) is where it sits on the ground.

    A type of joint is a subclass with its own keys, which says what it constrains (`constraints`) and what its
    coordinate is (`coordinate`); `joints.Joint` lists all types.
    """

    at: Vector2 = (0.0, 0.0)
    """Position on the ground, m, global axes."""

    force_unit: ClassVar[str] = "N·m"
    """Unit of the force along its coordinate."""

    @abstractmethod
    def constraints(self, angle: float) -> tuple[Measure, ...]:
        """Measures that it keeps at 0 (C_m); `angle` (rad) of the second body on the first in the initial guess."""

    @abstractmethod
    def coordinate(self, motors: MotorSide) -> Measure | None:
        """The joint's own coordinate, of the second side on the first; None where the joint cannot move."""

    @property
    def markers(self) -> tuple[Marker, Marker]:
        """Where it sits on its two sides."""
        first, second = self.between
        return marker_at(first, self.at), marker_at(second, self.at)

    # What a motor and a gear add; joints that can have them override this.

    def has_motor(self, default: bool) -> bool:
        """Whether a motor drives it; `default` where the scene leaves that open."""
        return False

    @property
    def asks_for_motor(self) -> bool:
        """Whether the scene says in so many words that it has a motor."""
        return False

    @property
    def motor_limits(self) -> MotorLimits:
        """What its motor can do."""
        return MotorLimits()

    @property
    def given_gear_ratio(self) -> float | None:
        """The ratio of its gear where the scene gives one."""
        return None

    def rotor(self, motors: MotorSide) -> Rotor | None:
        """The rotor of its motor, where it has inertia."""
        return None

    @property
    def friction(self) -> Friction | None:
        """Friction along its coordinate."""
        return None

    def elastic_gear(self, motors: MotorSide) -> ElasticGear | None:
        """Its gear, where it is elastic."""
        return None
