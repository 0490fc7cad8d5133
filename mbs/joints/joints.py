"""The types of joints that a scene may have: their keys, constraints and coordinates."""

from typing import Annotated, ClassVar, Literal, Self, get_args

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array
from ...common.deferred import Deferred
from ...common.keys import DirectionInPlane
from ...common.rotations import exponential, quaternions, unit
from ..fields.field_types import Direction
from ..fields.spelling import SPATIAL, Spelled, TaggedInPlane, place
from .joint import (
    ALIGNED,
    GUIDED,
    NOT_TURNED,
    POINT,
    Along,
    AxialJoint,
    GearedJoint,
    JointRecord,
    LoopEquation,
)


class RevoluteJoint(GearedJoint):
    """Two points coincide, the second side turns about `axis` by its coordinate, rad; in planar scenes about z.

    Drivetrain: a rotor on the first body, with the axis of the joint, turns `gear_ratio` times as fast as the second
    side does on the first. Spring `stiffness` and damper `damping` are between gear and second body.
    """

    type: Literal["revolute"]
    units = ("rad",)
    loop_equations = (POINT, *ALIGNED)
    along = (Along("turn", 2),)


class PrismaticJoint(GearedJoint):
    """The second point slides along `axis` by its coordinate, m; `rpy` is the orientation of the second side.

    In planar scenes the second side keeps the angle of the initial guess.

    Drivetrain: a rotor of inertia J turns by `gear_ratio` N (rad/m) times the coordinate, as a mass J N² along it; its
    turning by the first side is omitted. Spring `stiffness` and damper `damping` are between gear and second body.
    """

    type: Literal["prismatic"]
    axis: Annotated[Direction, Spelled(DirectionInPlane, place)]
    """Axis of motion in the axes of the first of `between` (ground: global), of any length."""

    @classmethod
    def demand_key(cls, key: str) -> str:
        """The message for a missing axis; empty for other keys."""
        return "expected an axis with a direction in a prismatic joint, found none" if key == "axis" else ""

    units = ("m",)
    loop_equations = (*GUIDED, NOT_TURNED)
    along = (Along("slide", 2),)


class ScrewJoint(AxialJoint):
    """The second side turns about `axis` by its coordinate, rad, and slides along it by `lead`, m, per turn."""

    type: Literal["screw"]
    only_in = SPATIAL
    lead: float
    """Displacement along the axis per turn, m; positive: right-handed."""

    units = ("rad",)

    @model_validator(mode="after")
    def _has_lead(self) -> Self:
        if self.lead == 0.0:
            raise ValueError("expected a lead that is not 0, found 0: without it the joint is a revolute one")
        return self

    @property
    def rise(self) -> float:
        """Displacement per angle h, m/rad."""
        return self.lead / (2 * np.pi)


class CylindricalJoint(AxialJoint):
    """Joint that turns about `axis` and slides along it. Coordinates: angle (rad), displacement (m)."""

    type: Literal["cylindrical"]
    only_in = SPATIAL

    units = ("rad", "m")
    loop_equations = GUIDED
    along = (Along("turn", 2), Along("slide", 2))

    def state(self, coordinates: Array) -> Array:
        """Return q (…, 2), m and rad: displacement, angle, of `coordinates` (…, 2), rad and m: angle, displacement."""
        return coordinates[..., ::-1]

    def coordinates(self, q: Array) -> Array:
        """Coordinates (…, 2) of the scene, rad and m: angle, displacement, from q (…, 2), m and rad."""
        return q[..., ::-1]


SQUARE = 1e-6  # largest cosine between the two axes at zero coordinates


class UniversalJoint(AxialJoint):
    """Two points coincide; the second side turns about `axis` of the first, then about its `second_axis`.

    Coordinates: the two angles, rad. The axes are at right angles at zero coordinates, and stay so.
    """

    type: Literal["universal"]
    only_in = SPATIAL
    second_axis: Direction
    """Second axis in the axes of the second of `between`, of any length."""

    units = ("rad", "rad")
    loop_equations = (POINT, NOT_TURNED)
    along = (Along("turn", 0, 1), Along("turn", 1, 0, of_outer=True))
    exchanged = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # x and y change places

    @model_validator(mode="after")
    def _axes_are_square(self) -> Self:
        x, y = unit(np.array(self.axis)), unit(self.orientation @ self.second_axis)
        cosine = float(x @ y)
        if abs(cosine) > SQUARE:
            angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
            raise ValueError(
                "expected axis and second_axis at right angles where the coordinates are 0 (rpy turns the second side),"
                f" found {angle:.4g} degrees"
            )
        return self

    def triads(self) -> tuple[Array, Array]:
        """Triads (3, 3) of first and second side, unit columns: x along the first axis, y along the second."""
        x, y = unit(np.array(self.axis)), unit(self.orientation @ self.second_axis)
        z = unit(np.cross(x, y))
        first = np.stack([x, np.cross(z, x), z], axis=1)
        return first, self.orientation.T @ first

    def turned_around(self, coordinates: Array) -> Array:
        """Coordinates (…, 2), rad, of the reversed joint: both negative, the second first."""
        return -coordinates[..., ::-1]


class SphericalJoint(JointRecord):
    """Two points coincide, the second side rotates freely; [initial] has a rotation vector, rad."""

    type: Literal["spherical"]
    only_in = SPATIAL
    motor: bool = False
    """Only `false`: motors need coordinates, which spherical joints do not have."""

    guess_units = ("rad", "rad", "rad")
    loop_equations = (POINT,)
    locates: ClassVar[bool] = False  # a loop is best cut here: three equations, no angle

    def state(self, coordinates: Array) -> Array:
        """The quaternion (…, 4) of a rotation vector (…, 3), rad."""
        return quaternions(exponential(coordinates))

    def velocity(self, rates: Array) -> Array:
        """The angular velocity (3,), rad/s, in axes of the second body, by `rates` in those of the joint."""
        return self.orientation @ rates


class PlanarJoint(AxialJoint):
    """The second point moves in the plane across `axis`, the second side turns about it.

    Coordinates: two displacements (m) and the angle (rad). The displacements are along the axes x and y that the
    smallest rotation of z onto `axis` yields.
    """

    type: Literal["planar"]
    only_in = SPATIAL

    units = ("m", "m", "rad")
    loop_equations = (LoopEquation("slide", 2), *ALIGNED)
    along = (Along("slide", 0), Along("slide", 1), Along("turn", 2))

    def turned_around(self, coordinates: Array) -> Array:
        """Coordinates (…, 3), m, m, rad, of the reversed joint: first side in axes of the second."""
        x, y, angle = np.moveaxis(coordinates, -1, 0)
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([-(c * x + s * y), s * x - c * y, -angle], axis=-1)

    def rate_turned_around(self, coordinates: Array, rate: Array) -> Array:
        """Rates (…, 3), m/s, m/s, rad/s, of the reversed joint; its axes of displacement rotate, too."""
        X, Y, _ = np.moveaxis(self.turned_around(coordinates), -1, 0)
        turn = rate[..., 2]
        x, y, _ = np.moveaxis(self.turned_around(np.concatenate([rate[..., :2], coordinates[..., 2:]], axis=-1)), -1, 0)
        return np.stack([x + turn * Y, y - turn * X, -turn], axis=-1)


class WeldJoint(JointRecord):
    """The second side is fixed to the first with orientation `rpy`; in planar scenes with the angle of the guess."""

    type: Literal["weld"]
    motor: bool | None = None
    """Only `false`: a weld cannot be driven."""

    @model_validator(mode="after")
    def _has_no_motor(self) -> Self:
        if self.motor:
            raise ValueError("expected no motor in a weld, which cannot move, found motor = true")
        return self

    loop_equations = (POINT, *ALIGNED, NOT_TURNED)


class FreeJoint(JointRecord):
    """The second side moves freely; [initial] has its position (m) and rotation vector (rad), in axes of the first.

    A body without any joint is free, too, from the origin on.
    """

    type: Literal["free"]
    only_in = SPATIAL
    motor: bool = False
    """Only `false`: motors need coordinates, which free joints do not have."""

    guess_units = ("m", "m", "m", "rad", "rad", "rad")
    loop_equations = ()
    locates: ClassVar[bool] = False

    def state(self, coordinates: Array) -> Array:
        """Position (m) and quaternion, (…, 7), from position (m) and rotation vector (rad), (…, 6)."""
        return np.concatenate([coordinates[..., :3], quaternions(exponential(coordinates[..., 3:]))], axis=-1)

    def velocity(self, rates: Array) -> Array:
        """Velocity (m/s) in axes of the first side, angular velocity (rad/s) in those of the second, (6,)."""
        return np.concatenate([rates[:3], self.orientation @ rates[3:]])

    def turned_around(self, coordinates: Array) -> Array:
        """Position (m) and rotation vector (rad) of the first side, (…, 6), in axes of the second."""
        C = exponential(coordinates[..., 3:])
        back = -np.einsum("...ij,...i->...j", C, coordinates[..., :3])
        return np.concatenate([back, -coordinates[..., 3:]], axis=-1)


AnyJoint = Annotated[
    RevoluteJoint
    | PrismaticJoint
    | ScrewJoint
    | CylindricalJoint
    | UniversalJoint
    | SphericalJoint
    | PlanarJoint
    | WeldJoint
    | FreeJoint,
    Deferred("type"),
    TaggedInPlane(),
]
"""All types, by the key `type`: a new one is a record above and an entry here."""

JOINT_TYPES: dict[str, type[JointRecord]] = {record.type_name(): record for record in get_args(get_args(AnyJoint)[0])}
"""Records by the key `type`."""
