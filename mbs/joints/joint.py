"""Base of all joints: two triads, and the coordinates between them as the scene has them. SI units.

Triads coincide where the coordinates are zero. Motion is along and about z, of universal joints about x of the inner
triad and y of the outer one. `q` (…, q_count) and `v` (…, freedoms) are the core's (mbs/core/recursion/joint): of
single coordinates these themselves, of free orientations a quaternion, and the angular velocity in outer axes.
"""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal, NamedTuple, Self, get_args

import numpy as np
from pydantic import Field, field_validator, model_validator

from ...common.arrays import Array
from ...common.rotations import of_rpy, smallest_turn
from ...common.structs import struct
from ...common.validation import Record
from .. import _core
from ..fields.field_types import (
    GROUND,
    Direction,
    Name,
    NotNegative,
    Positive,
    Quantity,
    Reference,
    Side,
    body_of,
    loaded_reference,
    split_point,
)
from ..fields.spelling import IN_SPACE, SPATIAL, NormalInPlane, Vector


class StiffnessSteps(Record):
    """Stiffness in steps of the torque, as catalogs of strain-wave gears list it: K1, K2, K3 with torques T1, T2."""

    values: tuple[Positive, ...] = Field(min_length=1)
    """Slopes of the torque over the twist, N·m/rad, one more than `torques`."""
    torques: tuple[Positive, ...] = ()
    """Torques at the joint from which on the next value counts, N·m, in rising order."""

    @model_validator(mode="after")
    def _fit(self) -> Self:
        if len(self.values) != len(self.torques) + 1:
            raise ValueError(
                f"expected one value more than torques, found {len(self.values)} values and {len(self.torques)} torques"
            )
        if any(np.diff(self.torques) <= 0.0):
            raise ValueError(f"expected torques in rising order, found {list(self.torques)}")
        return self


def stiffer(stiffness: float | StiffnessSteps, factor: float) -> float | StiffnessSteps:
    """The key `stiffness` of a spring with `factor` times the slopes, its steps at the same torques."""
    if not isinstance(stiffness, StiffnessSteps):
        return factor * stiffness
    return stiffness.model_copy(update={"values": tuple(factor * K for K in stiffness.values)})


@struct
class TwistSpring:
    """Torque of a twist, odd and piecewise linear; in sliding joints force, N, and displacement, m."""

    slopes: tuple[float, ...]  # N·m/rad, of intervals of the twist from 0 on; one of a linear spring
    knots: tuple[float, ...] = ()  # rad, twists from which on the next slope counts

    @classmethod
    def of(cls, stiffness: float | StiffnessSteps) -> "TwistSpring":
        """Make the spring from the key `stiffness` of a joint."""
        if not isinstance(stiffness, StiffnessSteps):
            return cls((stiffness,))
        parts = np.diff(stiffness.torques, prepend=0.0) / stiffness.values[:-1]
        return cls(stiffness.values, tuple(np.cumsum(parts).tolist()))

    @property
    def torques(self) -> tuple[float, ...]:
        """Torques at the knots, N·m."""
        steps = np.diff(self.knots, prepend=0.0) * np.array(self.slopes[:-1])
        return tuple(np.cumsum(steps).tolist())

    def moment(self, twist: Array) -> Array:
        """Torques (…,), N·m, of twists (…,), rad."""
        return _piecewise(twist, self.slopes, self.knots)

    def twist(self, moment: Array) -> Array:
        """Twists (…,), rad, under torques (…,), N·m."""
        return _piecewise(moment, tuple(1.0 / k for k in self.slopes), self.torques)

    def slope(self, twist: Array) -> Array:
        """Stiffness (…,), N·m/rad, at twists (…,), rad."""
        return np.array(self.slopes)[np.searchsorted(self.knots, np.abs(twist))]


def _piecewise(x: Array, slopes: tuple[float, ...], knots: tuple[float, ...]) -> Array:
    size = np.abs(x)
    total = slopes[0] * size
    for knot, change in zip(knots, np.diff(slopes), strict=True):
        total = total + change * np.maximum(size - knot, 0.0)
    return np.copysign(total, x)


class MotorLimits(NamedTuple):
    """Limits of torque (N·m), speed (rad/s) and power (W) of a motor at the joint; sliding: N, m/s, W."""

    moment: float = np.inf
    speed: float = np.inf
    power: float = np.inf


@struct
class Friction:
    """Friction −(c γ̇ + τ_c tanh(γ̇/γ̇_s)) along the coordinate γ of a joint."""

    viscous: float  # c, N·m·s/rad or N·s/m
    coulomb: float  # τ_c, N·m or N
    speed: float  # γ̇_s, rad/s or m/s

    def resistance(self, rate: Array) -> Array:
        """Return c γ̇ + τ_c tanh(γ̇/γ̇_s), N·m or N, at rates γ̇ (…,), rad/s or m/s."""
        return self.viscous * rate + self.coulomb * np.tanh(rate / self.speed)

    def damping(self, *, is_at_rest: bool) -> float:
        """c, at rest c + τ_c/γ̇_s, N·m·s/rad or N·s/m."""
        return self.viscous + is_at_rest * self.coulomb / self.speed


RecordType = type[Record]  # `type` is a key below
Angles = tuple[Quantity, Quantity, Quantity]


class LoopEquation(NamedTuple):
    """One equation of a loop-closing joint, between axes 0, 1, 2 of its inner triad (`f`) and outer triad (`g`).

    "point": no displacement (three equations); "slide": none along f; "dot": f and g are perpendicular.
    """

    kind: Literal["point", "slide", "dot"]
    f: int = 0
    g: int = 0


def coordinate_names(joint: str, count: int) -> list[str]:
    """Names of the `count` coordinates of a joint: "joint/NAME", or "joint/NAME 1", … of several."""
    return [f"joint/{joint}" + (f" {number}" if count > 1 else "") for number in range(1, count + 1)]


class Along(NamedTuple):
    """A coordinate of a joint that closes a loop; axes 0, 1, 2 of the inner triad, or of the outer one if `of_outer`.

    "slide": displacement along f, m; "turn": angle, rad, about f from the inner triad's axis g to the outer one's.
    """

    kind: Literal["slide", "turn"]
    f: int
    g: int = 0
    of_outer: bool = False


POINT = LoopEquation("point")
ALIGNED = (LoopEquation("dot", 0, 2), LoopEquation("dot", 1, 2))  # the axes z
GUIDED = (LoopEquation("slide", 0), LoopEquation("slide", 1), *ALIGNED)
NOT_TURNED = LoopEquation("dot", 0, 1)  # beside ALIGNED


class JointRecord(Record):
    """A joint between two points, or a point and the ground: two sides, and how it moves."""

    name: Name
    """Name of the joint, unique in the scene."""
    type: str
    """How it moves."""
    between: tuple[Side, Side]
    """Sides of the joint, "BODY.POINT" or "ground"; coordinate, torque and reaction are of the second relative to the
    first."""
    at: Vector = (0.0, 0.0, 0.0)
    """Position on the ground, m, global axes."""
    rpy: Annotated[Angles, IN_SPACE] = (0.0, 0.0, 0.0)
    """Orientation of the second side's axes in the first's at coordinate zero: roll, pitch, yaw about fixed axes, rad
    (or such as "90*deg")."""

    units: ClassVar[tuple[str, ...]] = ()  # of its coordinates, "rad" or "m"
    guess_units: ClassVar[tuple[str, ...]] = ()  # of its numbers in [initial], where these are no coordinates
    # by the core: axes along which (0, 1, 2) or about which (3, 4, 5) v moves it; lengths of q and v
    axes: ClassVar[tuple[int, ...]] = ()
    q_count: ClassVar[int] = 0
    freedoms: ClassVar[int] = 0
    loop_equations: ClassVar[tuple[LoopEquation, ...] | None] = None  # None where it cannot close a loop
    along: ClassVar[tuple[Along, ...]] = ()  # its coordinates where it closes one, in the scene's order
    exchanged: ClassVar[Array] = np.eye(3)  # axes of the joint with exchanged sides, columns, in its axes
    locates: ClassVar[bool] = True
    """Whether it determines where one body is on the other; the initial guess follows such joints first."""

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
    def __pydantic_init_subclass__(cls, **_: object) -> None:
        kind = getattr(_core.JointKind, "".join(get_args(cls.model_fields["type"].annotation)), None)
        if kind is not None:
            cls.axes, cls.q_count, cls.freedoms = tuple(kind.axes), kind.q_count, len(kind.axes)

    @classmethod
    def type_name(cls) -> str:
        """Value of the key `type`."""
        return str(get_args(cls.model_fields["type"].annotation)[0])

    @classmethod
    def refuse_key(cls, key: str, others: Sequence[RecordType]) -> str:
        """The message for a `key` that only joints of types `others` have; empty without any."""
        if not others:
            return ""
        having = " or ".join(other.type_name() for other in others if issubclass(other, JointRecord))
        return f'expected the key "{key}" only in {having} joints, found it in a {cls.type_name()} joint'

    @property
    def label(self) -> str:
        """Name of the joint in messages."""
        return f'joint "{self.name}"'

    @property
    def bodies(self) -> tuple[str, str]:
        """The two bodies it joins; one may be the ground."""
        first, second = self.between
        return body_of(first), body_of(second)

    def references(self) -> Iterator[Reference]:
        """Yield references to the points that it joins."""
        for k, side in enumerate(self.between):
            yield from loaded_reference(f"between[{k}]", side)

    @field_validator("motor", check_fields=False)
    @classmethod
    def _motor_has_coordinates(cls, motor: bool | None) -> bool | None:
        if motor and cls.guess_units:
            raise ValueError(
                f"expected false of a {cls.type_name()} joint, which has no coordinates for motors, found true:"
                " revolute and prismatic joints in series have them"
            )
        return motor

    @property
    def orientation(self) -> Array:
        """R (3, 3): the second side's axes in those of the first where the coordinate is zero."""
        return of_rpy(*self.rpy)

    def triads(self) -> tuple[Array, Array]:
        """The joint's axes (3, 3), unit columns, on its first and its second side, in axes of the sections."""
        return np.eye(3), self.orientation.T

    def turned_around(self, coordinates: Array) -> Array:
        """Coordinates (…, k), rad or m, of the first side relative to the second, from those of the joint."""
        return -coordinates

    def rate_turned_around(self, coordinates: Array, rate: Array) -> Array:
        """Rates (…, k), rad/s or m/s, of coordinates of the first side in the second, by those of the joint."""
        return self.turned_around(rate)

    def state(self, coordinates: Array) -> Array:
        """Return q (q_count,) of the core from `coordinates` (k,) as the scene has them, both rad or m."""
        return coordinates

    def velocity(self, rates: Array) -> Array:
        """Return v (freedoms,) of the core from `rates` (k,) as the scene has them, both rad/s or m/s."""
        return self.state(rates)

    def coordinates(self, q: Array) -> Array:
        """Coordinates (…, k) in the scene's order from the core's q (…, q_count), rad or m; or rates from v."""
        return q

    # Joints that can have motors or gears override these.

    def has_motor(self, default: bool) -> bool:
        """Whether a motor drives the joint; `default` if the scene does not specify it."""
        return False

    @property
    def motor_limits(self) -> tuple[MotorLimits, ...]:
        """Limits of the motor along each coordinate, N·m, rad/s, W or N, m/s, W."""
        return ()

    @property
    def given_gear_ratio(self) -> float | None:
        """Gear ratio; None if the scene specifies none."""
        return getattr(self, "gear_ratio", None) if "gear_ratio" in self.model_fields_set else None

    @property
    def position_limits(self) -> tuple[tuple[float, float], ...]:
        """Least and largest value of each coordinate (rad or m); infinite where not given."""
        return ((-np.inf, np.inf),) * len(self.units)

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """Friction along each coordinate; empty where there is none."""
        return ()

    @property
    def asks_for_coordinate(self) -> tuple[str, ...]:
        """Keys that need a coordinate, so that no loop is cut here: motor without rotor, spring with rotor."""
        keys = ("stiffness",) if getattr(self, "rotor_inertia", 0.0) else ("motor",)
        return tuple(key for key in keys if getattr(self, key, None))


Limit = Positive | tuple[Positive, ...]
Range = tuple[Quantity, Quantity]


class MovingJoint(JointRecord):
    """A joint with coordinates, which motors may drive. Joints with several take lists of limits, one for each."""

    motor: bool | None = None
    """Presence of motors; by default in open chains only, and not in spherical and free joints."""
    position_limit: Range | tuple[Range, ...] | None = None
    """Range of the coordinate, [lo, hi], rad (sliding: m). No contact force acts beyond it; a warning has
    time and size of the excess."""
    moment_limit: Limit | None = None
    """Largest torque, N·m (sliding: force, N), at the joint: after the gear."""
    speed_limit: Limit | None = None
    """Largest rate of the joint, rad/s (sliding: m/s)."""
    power_limit: Limit | None = None
    """Largest mechanical power, W."""
    viscous_friction: NotNegative = 0.0
    """Viscous coefficient c, N·m·s/rad (sliding: N·s/m)."""
    coulomb_friction: NotNegative = 0.0
    """Coulomb torque τ_c, N·m (sliding: N)."""
    friction_speed: Positive = 0.01
    """Rate at which dry friction has 76 % of its size, tanh 1, rad/s (sliding: m/s)."""

    @model_validator(mode="after")
    def _has_friction(self) -> Self:
        if "friction_speed" in self.model_fields_set and not self.coulomb_friction:
            raise ValueError('expected the key "friction_speed" only with coulomb_friction, found it alone')
        return self

    @model_validator(mode="after")
    def _limits_fit(self) -> Self:
        count = len(self.units)
        for key in ("moment_limit", "speed_limit", "power_limit"):
            value = getattr(self, key)
            if value is not None and np.size(value) != count:
                wanted = "a number" if count == 1 else f"{count} numbers, one for each coordinate"
                raise ValueError(f"expected {wanted} in {key}, found {np.size(value)}")
        for lowest, highest in self.position_limits:
            if not lowest < highest:
                raise ValueError(f"expected position_limit = [least, largest], found [{lowest:g}, {highest:g}]")
        return self

    @property
    def position_limits(self) -> tuple[tuple[float, float], ...]:
        """Least and largest value of each coordinate (rad or m); infinite where not given."""
        value, count = self.position_limit, len(self.units)
        if value is None:
            return super().position_limits
        ranges = tuple((lo, hi) for lo, hi in np.reshape(value, (-1, 2)).tolist())
        if len(ranges) != count:
            wanted = "one pair [least, largest]" if count == 1 else f"{count} pairs [least, largest]"
            raise ValueError(f"expected {wanted} in position_limit, found {len(ranges)}")
        return ranges

    def has_motor(self, default: bool) -> bool:
        """Whether motors drive the joint; `default` if the scene does not specify it."""
        return default if self.motor is None else self.motor

    @property
    def motor_limits(self) -> tuple[MotorLimits, ...]:
        """Limits of the motors for each coordinate, N·m, rad/s, W or N, m/s, W; infinite if not given."""
        count = len(self.units)
        limits = (self.moment_limit, self.speed_limit, self.power_limit)
        rows = [np.broadcast_to(np.inf if limit is None else limit, count).tolist() for limit in limits]
        return tuple(MotorLimits(*of_one) for of_one in zip(*rows, strict=True))

    @property
    def frictions(self) -> tuple[Friction, ...]:
        """Friction along each coordinate; empty where there is none."""
        if not (self.viscous_friction or self.coulomb_friction):
            return ()
        return (Friction(self.viscous_friction, self.coulomb_friction, self.friction_speed),) * len(self.units)


class AxialJoint(MovingJoint):
    """A joint whose motion is along or about an axis, z of its triads."""

    axis: Annotated[Direction, NormalInPlane(SPATIAL)] = Field(default=None, validate_default=True)
    """Axis of motion in the axes of the first of `between` (ground: global), of any length."""

    def triads(self) -> tuple[Array, Array]:
        """Triads (3, 3) of first and second side with z along the axis, unit columns, in axes of the sections."""
        first = smallest_turn(np.array(self.axis))
        return first, self.orientation.T @ first


class GearedJoint(AxialJoint):
    """A joint with one coordinate, whose motor may drive it by a rotor and a gear, rigid or compliant."""

    gear_ratio: Positive = 1.0
    """Rotor turns per turn of the joint (sliding: rotor rotation per joint displacement, rad/m)."""
    rotor_inertia: NotNegative = 0.0
    """Moment of inertia of the rotor about its axis, kg·m², before the gear."""
    stiffness: Positive | StiffnessSteps | None = None
    """Stiffness of a compliant gear, N·m/rad (sliding: N/m), or { values = [K1, K2, …], torques = [T1, …] } in steps of
    its torque (force); default: rigid."""
    damping: NotNegative = 0.0
    """Damping of that gear, N·m·s/rad (sliding: N·s/m)."""

    @model_validator(mode="after")
    def _has_rotor_behind_spring(self) -> Self:
        if self.stiffness is None and self.damping:
            raise ValueError('expected the key "damping" only with stiffness, found it alone')
        if self.stiffness is not None and not self.rotor_inertia:
            raise ValueError("expected a rotor_inertia above 0 with stiffness, found none: the rotor turns freely")
        return self
