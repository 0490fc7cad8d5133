"""Trajectories of a scene, key by key: motion that is specified. SI units; angles in rad."""

from collections.abc import Mapping
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from ...common.arrays import Array
from ...common.errors import InputError, did_you_mean, quoted
from ...common.rotations import of_rpy
from ...common.validation import Record
from .._core import TimeFunction
from ..fields.field_types import (
    Direction,
    Expression,
    Name,
    NotNegative,
    PointReference,
    Positive,
    Quantity,
    Referring,
    Vector3,
    WaypointTable,
    given_in,
    one_of,
    only,
)
from ..fields.orientations import QUATERNION, OrientationLaw, Reference, about_their_middle, orientation_of
from ..fields.paths import SMOOTHNESS, Legs, PathLimits, Piecewise, impulses, path_of, shaped
from ..fields.spelling import IN_SPACE, Spelled, is_planar, keys_here
from ..fields.waypoints import Waypoints

Place = Quantity | tuple[Quantity, ...]
MOST_PLACES = 1000
OfPlaces = Field(min_length=2, max_length=MOST_PLACES)
LIMITS = ("speed", "acceleration", "jerk")
OF_LEGS = ("hold", "blend", "duration", *LIMITS, "start", "stretch", "fastest")  # a table of waypoints has its times


Ratio = Annotated[float, Field(ge=0.0, lt=1.0)]


class Shaper(Record):
    """Input shaping: delayed shares of the motion cancel their vibrations (Singer and Seering 1990).

    The default `frequency` is that of the robot's lowest vibrations on the constrained path, averaged over it.
    """

    kind: Literal["none", "zv", "zvd", "ei"]
    """Shaper: "zv" is shortest, "zvd" and "ei" take twice as long and are robust against a wrong frequency; "none" does
    nothing."""
    frequency: Positive | Annotated[tuple[Positive, ...], Field(min_length=1)] | None = None
    """Frequencies of the vibrations, Hz: one or several; by default those of the robot."""
    damping_ratio: Ratio | tuple[Ratio, ...] | None = None
    """Damping ratio of these vibrations: one for all, or one each; by default the robot's, and 0 with `frequency`."""
    modes: Annotated[int, Field(gt=0, le=4)] = 1
    """Number of the robot's lowest vibrations."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.frequency is not None and "modes" in self.model_fields_set:
            raise ValueError('expected one of the keys "frequency" and "modes", found both')
        number = self.modes if self.frequency is None else np.size(self.frequency)
        if isinstance(self.damping_ratio, tuple) and len(self.damping_ratio) != number:
            raise ValueError(f"damping_ratio: expected one value, or {number}, found {len(self.damping_ratio)}")
        return self

    def shape(self, motion: Piecewise) -> Piecewise:
        """The motion shaped for each frequency; unchanged without `frequency`."""
        if self.kind == "none" or self.frequency is None:
            return motion
        for frequency, ratio in np.broadcast(self.frequency, self.damping_ratio or 0.0):
            motion = shaped(motion, impulses(self.kind, frequency, ratio))
        return motion


PLACES = ("x", "y", "z")
SUBJECTS = ("point", "joint", "angle", "motor")
ORIENTATIONS = ("rotation_vector", "rpy", "direction")
POSE = 6
OF_POINT = {2: "places [x, y]", 3: "[x, y, z]", POSE: "[x, y, z, roll, pitch, yaw]"}
"""How `via` of a point is written, by the number of components."""
OfPlane = Annotated[Place, Spelled(Quantity | tuple[Quantity, Quantity])]
Triple = tuple[Expression, Expression, Expression]


class Trajectory(Referring):
    """Prescribed motion of a point (m, global axes), of the section there, of an absolute angle, a joint or a motor.

    The section's axes in global axes are prescribed by a rotation vector, by roll, pitch and yaw about
    fixed axes, or by one direction of the section. The rotation about this direction is then unconstrained.
    """

    via: Annotated[tuple[OfPlane, ...], OfPlaces] | None = None
    """Waypoints from rest to rest, the first at t = 0: [x, y] (m), or values of the joint or angle (rad, m). In 3D
    scenes also [x, y, z], and [x, y, z, roll, pitch, yaw] (m, rad); [x, y] does not prescribe z."""
    profile: Literal["rest-to-rest", "s-curve", "trapezoid", "spline"] | None = None
    """Law of motion between waypoints: a polynomial (default of `via`), limited jerk, limited acceleration, or a spline
    through the rows of `waypoints` (their default)."""
    smoothness: Annotated[int, Field(ge=1, le=6)] | None = None
    """Number of continuous derivatives; by default 4 of rest-to-rest, 2 of s-curve, 1 of trapezoid."""
    speed: Positive | None = None
    """Largest speed along the path, m/s or rad/s."""
    acceleration: Positive | None = None
    """Largest acceleration along the path, m/s² or rad/s²."""
    jerk: Positive | None = None
    """Largest jerk along the path, m/s³ or rad/s³."""
    duration: Positive | tuple[Positive, ...] | None = None
    """Duration of each path segment, s, instead of limits: one for all, or one each."""
    start: NotNegative = 0.0
    """Start of the first path segment, s."""
    hold: NotNegative | tuple[NotNegative, ...] = 0.0
    """Rest at each intermediate waypoint, s: one for all, or one each."""
    blend: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    """Overlap of path segments at waypoints without hold, as a share of the shorter one; 0: a stop at each waypoint."""
    stretch: Annotated[float, Field(ge=1e-3, le=1e3)] = 1.0
    """Time-scaling factor of all path segments."""
    fastest: bool = False
    """Search for the smallest `stretch` at which motors and patches satisfy their limits in the first inverse analysis.
    """
    shaper: Shaper | None = None
    """Input shaper that does not excite vibrations of certain frequencies."""
    name: Name
    """Name of the trajectory, unique in the scene."""
    point: PointReference | None = None
    """Point that follows the trajectory, "BODY.POINT"."""
    joint: str | None = None
    """Joint whose coordinate follows the trajectory: second side relative to the first."""
    angle: str | None = None
    """Body, or section "BODY.POINT", whose absolute angle about `axis` follows the trajectory: one component of its
    orientation, the others are free; in planar scenes about z. Of the section's direction that is across `axis` where
    its axes are global ones, the projection on the plane across `axis` has this angle."""
    axis: Annotated[Direction | None, IN_SPACE] = None
    """Axis of `angle`, global axes; by default z."""
    motor: str | None = None
    """Joint whose motor follows the trajectory; a compliant gear (`stiffness`) lets the joint coordinate differ from
    that of the motor."""
    x: Expression | None = None
    """Position along global x, m; expression in t (s)."""
    y: Expression | None = None
    """Position along global y, m; expression in t (s)."""
    z: Annotated[Expression | None, IN_SPACE] = None
    """Position along global z, m; expression in t (s)."""
    rotation_vector: Annotated[Triple | None, IN_SPACE] = None
    """Orientation of the section: axis times angle, rad, global axes; expressions in t."""
    reference_rotation_vector: Annotated[Vector3 | None, IN_SPACE] = None
    """Orientation that `rotation_vector` rotates, rad; by default the global axes."""
    rpy: Annotated[Triple | None, IN_SPACE] = None
    """Orientation of the section: roll, pitch, yaw about the ground's x, y, z in this order, rad; expressions in t."""
    tool_axis: Annotated[Direction | None, IN_SPACE] = None
    """Direction of the section, in its axes, that stays along `direction`."""
    direction: Annotated[Triple | None, IN_SPACE] = None
    """Direction of `tool_axis` in global axes, of any length; expressions in t."""
    value: Expression | None = None
    """Joint coordinate (rad; sliding: m) or angle (rad); expression in t (s)."""
    waypoints: WaypointTable | None = None
    """CSV file with the columns t (s) and x, y (m), in 3D scenes also z, and qw, qx, qy, qz for the orientation. Of a
    joint: with the column value, or one of the joint's name (rad, m)."""

    refers_to = (("point", "loaded"), ("angle", "loaded"), ("joint", "joint"), ("motor", "joint"))

    @field_validator("waypoints")
    @classmethod
    def _of_its_joint(cls, table: Waypoints | None, info: ValidationInfo) -> Waypoints | None:
        joint = info.data.get("joint") or info.data.get("motor")
        return table if table is None or joint is None else table.of_joint(joint)

    @model_validator(mode="after")
    def _consistent(self, info: ValidationInfo) -> Self:
        subject = one_of(self, keys_here(self, SUBJECTS, info))
        allowed = keys_here(self, (*PLACES, *ORIENTATIONS), info) if subject == "point" else ("value",)
        tables = ("waypoints", "via")
        given = only(self, subject, (*allowed, *tables), (*PLACES, *ORIENTATIONS, "value", *tables))
        table = next((key for key in tables if key in given), None)
        if table is not None and set(given) - {table, *(() if table == "waypoints" else ORIENTATIONS)}:
            raise ValueError(f"expected either waypoints, via or expressions, found {quoted(given)}")
        if self.waypoints is not None:
            self._check_columns(self.waypoints, allowed)
        of_point = {2: OF_POINT[2]} if is_planar(info) else OF_POINT
        self._check_motion(of_point if subject == "point" else {1: "numbers"})
        self._check_orientation()
        with np.errstate(all="ignore"):
            paths = [path for path in (self.path, self._turning) if path is not None]
        if any(not (np.isfinite(path.coefficients).all() and np.isfinite(path.breaks).all()) for path in paths):
            raise ValueError("expected limits and times that fit each other in size, found infinite derivatives")
        return self

    def _check_motion(self, places: Mapping[int, str]) -> None:
        """`places` says by their number of components how they are written."""
        given = [key for key in (*OF_LEGS, "profile", "smoothness", "shaper") if key in self.model_fields_set]
        if self.via is None and self.waypoints is None and given:
            raise ValueError(f'expected {quoted(given)} only with "via" or "waypoints", found neither')
        if self.waypoints is not None:
            if refused := [key for key in given if key in OF_LEGS]:
                raise ValueError(f'expected {quoted(refused)} only with "via", found them with "waypoints"')
            if self.profile in (None, "spline") and self.smoothness is not None:
                raise ValueError('expected no key "smoothness" with profile = "spline", found it there')
        if self.via is not None:
            self._check_via(self.via, places)

    def _check_via(self, via: tuple[Place, ...], places: Mapping[int, str]) -> None:
        sizes = {int(np.size(place)) for place in via}
        if not sizes <= set(places) or len(sizes) > 1:
            wanted = " or ".join(places.values()) + (", all alike," if len(places) > 1 else "")
            raise ValueError(f"expected {wanted} in via, found {[list(p) if isinstance(p, tuple) else p for p in via]}")
        if self.profile == "spline":
            raise ValueError('expected profile = "spline" only with "waypoints", found it with "via"')
        for k, (place, following) in enumerate(pairwise(via), 1):
            if place == following:
                raise ValueError(f"expected places in via that differ (a rest is a hold), found no. {k} twice")
        for key, count in (("duration", len(via) - 1), ("hold", len(via) - 2)):
            value = getattr(self, key)
            if isinstance(value, tuple) and len(value) != count:
                raise ValueError(f'expected {count} numbers in "{key}", found {len(value)}')
        if self.fastest and "stretch" in self.model_fields_set:
            raise ValueError('expected one of the keys "fastest" and "stretch", found both')
        limits = given_in(self, LIMITS)
        if bool(limits) == (self.duration is not None):
            given = "both" if limits else "neither"
            raise ValueError(f'expected either limits ({quoted(LIMITS)}) or a "duration" with "via", found {given}')
        if self.profile in ("s-curve", "trapezoid") and [*limits] == ["speed"]:
            raise ValueError(f'expected "acceleration" or "jerk" with profile = "{self.profile}", found only "speed"')
        if self.profile == "trapezoid" and self.jerk is not None:
            raise ValueError('expected no "jerk" with profile = "trapezoid" (its acceleration jumps), found it')

    def _check_columns(self, waypoints: Waypoints, allowed: tuple[str, ...]) -> None:
        columns = waypoints.columns
        places = tuple(key for key in allowed if key not in ORIENTATIONS)
        wanted = (*places, *QUATERNION) if "z" in allowed else places
        turned = set(columns) & set(QUATERNION)
        if not set(columns) <= set(wanted) or (turned and turned != set(QUATERNION)):
            header = ",".join(("t", *places))
            header += " or t,JOINT" if allowed == ("value",) else " or t,x,y,z,qw,qx,qy,qz" if "z" in allowed else ""
            of = self.joint or self.motor
            missing = f': no column of "{of}"{did_you_mean(of, columns)}' if allowed == ("value",) and of else ""
            expected = ",".join(("t", *columns))
            raise ValueError(f'expected waypoints with the header {header}, found "{expected}"{missing}')
        if turned:
            self._check_turns("waypoints")

    def _check_orientation(self) -> None:
        keys = given_in(self, ORIENTATIONS)
        if len(keys) > 1:
            raise ValueError(f"expected one orientation at most ({quoted(ORIENTATIONS)}), found {quoted(keys)}")
        beside_of = {"reference_rotation_vector": "rotation_vector", "tool_axis": "direction", "axis": "angle"}
        for key, beside in beside_of.items():
            if getattr(self, key) is not None and getattr(self, beside) is None:
                raise ValueError(f'expected the key "{key}" only with {beside}, found it alone')
        if self.direction is not None and self.tool_axis is None:
            raise ValueError('expected the key "tool_axis" with direction: which direction of the section, found none')
        if not self._has_poses:
            return
        if keys:
            raise ValueError(f"expected an orientation either in via or by {quoted(keys)}, found both")
        if self.duration is None:
            raise ValueError(
                f'expected a "duration" with poses in via (limits in m/s say nothing of turning), found'
                f" {quoted(given_in(self, LIMITS))}"
            )
        self._check_turns("via")

    def _check_turns(self, key: str) -> None:
        try:
            self._turns  # noqa: B018 (looked at for what it raises)
        except InputError as error:
            raise ValueError(f"{key}: {error}") from None

    def _along_table(self, waypoints: Waypoints) -> Piecewise:
        if self.profile in (None, "spline"):
            return self._shaped(waypoints.spline)
        return self._through(waypoints.values, waypoints.times)

    def _shaped(self, motion: Piecewise) -> Piecewise:
        return motion if self.shaper is None else self.shaper.shape(motion)

    def _through(self, places: Array, times: Array | None = None) -> Piecewise:
        """The motion through places (k + 1, n), m or rad, at `times` (k + 1,), s, or as `start` and limits say."""
        profile, count = self.profile or "rest-to-rest", len(places) - 1
        start, duration = (self.start, self.duration) if times is None else (float(times[0]), np.diff(times))
        assert profile != "spline"
        limits = PathLimits(**given_in(self, LIMITS))
        durations = None if duration is None else tuple(np.broadcast_to(duration, count).tolist())
        holds = tuple(np.broadcast_to(self.hold, count - 1).tolist())
        smoothness = self.smoothness or SMOOTHNESS[profile]
        more = {"blend": self.blend, "stretch": self.stretch}
        return self._shaped(path_of(Legs(places, start, profile, smoothness, limits, durations, holds=holds, **more)))

    def changed(self, **keys: object) -> Self:
        """The trajectory with some keys replaced."""
        return type(self)(**({key: getattr(self, key) for key in self.model_fields_set} | keys))

    @property
    def coordinate_of(self) -> str | None:
        """Name of the joint whose coordinate, or whose motor, follows the trajectory; None if neither does."""
        return self.joint if self.motor is None else self.motor

    @property
    def force_components(self) -> tuple[str, ...]:
        """Components of the path force by name: `components`, then moments about global axes, or two of a tool axis."""
        if self.orientation is None:
            return tuple(self.components)
        return (*self.components, *(("mx", "my", "mz") if self.tool_axis is None else ("tool 1", "tool 2")))

    @cached_property
    def path(self) -> Piecewise | None:
        """Polynomial motion of the point (m), joint or angle (rad, m); None for expressions."""
        if self.via is not None:
            return self._through(self._places[:, :3])
        if self.waypoints is None:
            return None
        places = [k for k, name in enumerate(self.waypoints.columns) if name not in QUATERNION]
        whole = self._along_table(self.waypoints)
        return Piecewise(whole.breaks, whole.coefficients[:, :, places])

    @cached_property
    def stopping(self) -> Piecewise | None:
        """`path` with a stop at each waypoint; None if it already stops there."""
        return self.model_copy(update={"blend": 0.0})._through(self._places[:, :3]) if self.blend else None

    @cached_property
    def components(self) -> dict[str, TimeFunction]:
        """Specified functions of time by component: "x", "y", "z" (m), or "value" (rad, m)."""
        if self.path is None:
            return given_in(self, (*PLACES, "value"))
        if self.waypoints is not None:
            names = tuple(name for name in self.waypoints.columns if name not in QUATERNION)
        else:
            names = ("value",) if self.point is None else PLACES[: self._places.shape[1]]
        return dict(zip(names, self.path.functions(), strict=True)) if names else {}

    @property
    def targets(self) -> list[tuple[str, TimeFunction]]:
        """All specified functions of time, by component; those of an orientation by the name of its key."""
        law = self.orientation
        turning = [] if law is None else [(law.kind, function) for function in law.functions]
        return [*self.components.items(), *turning]

    @cached_property
    def orientation(self) -> OrientationLaw | None:
        """Prescribed orientation of the section; None if it is free."""
        if self._turning is not None:
            assert self._turns is not None
            return OrientationLaw("rotation_vector", tuple(self._turning.functions()), self._turns[1])
        if self.rotation_vector is not None:
            return OrientationLaw(
                "rotation_vector", self.rotation_vector, self.reference_rotation_vector or (0.0, 0.0, 0.0)
            )
        if self.rpy is not None:
            return OrientationLaw("rpy", self.rpy)
        return None if self.direction is None else OrientationLaw("direction", self.direction)

    @property
    def largest_turn_of_poses(self) -> float:
        """Largest change of roll, pitch or yaw from one pose in `via` to the next, rad; 0 without poses."""
        return float(np.abs(np.diff(self._places[:, 3:], axis=0)).max()) if self._has_poses else 0.0

    @property
    def _has_poses(self) -> bool:
        return self.via is not None and self._places.shape[1] == POSE

    @property
    def _places(self) -> Array:
        assert self.via is not None
        return np.array(self.via, dtype=float).reshape(len(self.via), -1)

    @cached_property
    def _turns(self) -> tuple[Array, Reference] | None:
        """Rotation vectors (k, 3), rad, of a table or poses from their mean orientation, and that of the mean."""
        if self.waypoints is not None and QUATERNION[0] in self.waypoints.columns:
            return orientation_of(self.waypoints)
        if not self._has_poses:
            return None
        return about_their_middle(np.array([of_rpy(*place[3:]) for place in self._places]), "place no.")

    @cached_property
    def _turning(self) -> Piecewise | None:
        if self._turns is None:
            return None
        vectors = self._turns[0]
        if self.waypoints is not None:
            return self._along_table(Waypoints(("rx", "ry", "rz"), self.waypoints.times, vectors))
        return self._through(vectors)
