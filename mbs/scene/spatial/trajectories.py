"""Trajectories of a scene in space, key by key: motion that is specified. SI units; angles in rad."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from pydantic import model_validator

from ....common.arrays import as_rows
from ....common.errors import InputError
from ....common.rotations import smallest_turn
from ....common.validation import Record, quoted
from ..._core import TimeFunction
from ...fields.field_types import Expression, Name, PointReference, Vector3, WaypointTable, one_of, present
from ...fields.orientations import QUATERNION, OrientationLaw, orientation_of
from ...fields.references import Reference, marker_reference

PLACES = ("x", "y", "z")
ORIENTATIONS = ("rotation_vector", "rpy", "direction")
Triple = tuple[Expression, Expression, Expression]


class SpatialTrajectory(Record):
    """Motion that is specified: of a point (m, global axes), of the section there, or a joint coordinate.

    The section's orientation is that of its axes in global axes: by a rotation vector, by roll, pitch and yaw about
    fixed axes, or by one direction of the section, about which it then turns as it likes.
    """

    name: Name
    """Of the trajectory, unique in the scene."""
    point: PointReference | None = None
    """What moves along it, "BODY.POINT"."""
    joint: str | None = None
    """The joint whose coordinate follows it: relative, of the second side on the first."""
    x: Expression | None = None
    """Along the ground's x axis, m; expression in t (s)."""
    y: Expression | None = None
    """Along the ground's y axis, m; expression in t (s)."""
    z: Expression | None = None
    """Along the ground's z axis, m; expression in t (s)."""
    rotation_vector: Triple | None = None
    """Orientation of the section: axis times angle, rad, global axes; expressions in t."""
    reference_rotation_vector: Vector3 | None = None
    """Beside rotation_vector: the orientation that it turns, rad; by default the global axes."""
    rpy: Triple | None = None
    """Orientation of the section: roll, pitch, yaw about the ground's x, y, z in this order, rad; expressions in t."""
    tool_axis: Vector3 | None = None
    """A direction of the section, in its axes, that stays along `direction`."""
    direction: Triple | None = None
    """Where tool_axis points, global axes, of any length; expressions in t."""
    value: Expression | None = None
    """Of the joint's coordinate, rad, or m where it slides; expression in t (s)."""
    waypoints: WaypointTable | None = None
    """CSV file with the columns t (s) and x, y, z (m), and qw, qx, qy, qz for the orientation; or value (rad, m)."""

    @model_validator(mode="after")
    def _consistent(self) -> SpatialTrajectory:
        subject = one_of(self, ("point", "joint"))
        allowed = (*PLACES, *ORIENTATIONS) if subject == "point" else ("value",)
        given = [key for key in (*PLACES, *ORIENTATIONS, "value", "waypoints") if getattr(self, key) is not None]
        if not given or not set(given) <= {*allowed, "waypoints"}:
            raise ValueError(
                f'expected the keys {quoted((*allowed, "waypoints"))} beside "{subject}", found {quoted(given)}'
            )
        if self.waypoints is not None:
            self._check_table(given, allowed)
        self._check_orientation()
        return self

    def _check_table(self, given: list[str], allowed: tuple[str, ...]) -> None:
        assert self.waypoints is not None
        if given != ["waypoints"]:
            raise ValueError(f"expected either waypoints or expressions, found {quoted(given)}")
        columns = self.waypoints.columns
        wanted = ("value",) if allowed == ("value",) else (*PLACES, *QUATERNION)
        turned = set(columns) & set(QUATERNION)
        if not set(columns) <= set(wanted) or (turned and turned != set(QUATERNION)):
            header = "t,value" if allowed == ("value",) else "t,x,y,z or t,x,y,z,qw,qx,qy,qz"
            raise ValueError(f'expected waypoints with the header {header}, found "{",".join(("t", *columns))}"')
        if turned:
            try:
                orientation_of(self.waypoints)
            except InputError as error:
                raise ValueError(f"waypoints: {error}") from None

    def _check_orientation(self) -> None:
        found = [key for key in ORIENTATIONS if getattr(self, key) is not None]
        if len(found) > 1:
            raise ValueError(f"expected one orientation at most ({quoted(ORIENTATIONS)}), found {quoted(found)}")
        for key, beside in (("reference_rotation_vector", "rotation_vector"), ("tool_axis", "direction")):
            if getattr(self, key) is not None and getattr(self, beside) is None:
                raise ValueError(f'expected the key "{key}" only beside {beside}, found it alone')
        if self.direction is not None and self.tool_axis is None:
            raise ValueError(
                'expected the key "tool_axis" beside direction: which direction of the section, found none'
            )
        if self.tool_axis is not None and not any(self.tool_axis):
            raise ValueError(f"expected tool_axis with a direction, found {list(self.tool_axis)}")

    def references(self) -> Iterator[Reference]:
        """What follows it."""
        yield from marker_reference("point", self.point, loaded=True)
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")

    @cached_property
    def components(self) -> dict[str, TimeFunction]:
        """The specified functions of time by component: "x", "y", "z", or "value"."""
        if self.waypoints is None:
            return present(x=self.x, y=self.y, z=self.z, value=self.value)
        functions = dict(zip(self.waypoints.columns, self.waypoints.spline().functions(), strict=True))
        return {name: function for name, function in functions.items() if name not in QUATERNION}

    @cached_property
    def orientation(self) -> OrientationLaw | None:
        """How the section turns; None where that is left open."""
        if self.waypoints is not None and QUATERNION[0] in self.waypoints.columns:
            table, reference = orientation_of(self.waypoints)
            return OrientationLaw("rotation_vector", tuple(table.spline().functions()), reference)
        if self.rotation_vector is not None:
            return OrientationLaw(
                "rotation_vector", self.rotation_vector, self.reference_rotation_vector or (0.0, 0.0, 0.0)
            )
        if self.rpy is not None:
            return OrientationLaw("rpy", self.rpy)
        return None if self.direction is None else OrientationLaw("direction", self.direction)

    @property
    def tool_triad(self) -> tuple[tuple[float, ...], ...]:
        """Of a tool axis: rows of the triad of the section whose z is along it."""
        assert self.tool_axis is not None
        return tuple(map(tuple, as_rows(smallest_turn(np.array(self.tool_axis)))))

    @property
    def row_count(self) -> int:
        """How many constraints it is: three of a full orientation, two of a direction."""
        turning = 0 if self.orientation is None else 2 if self.direction is not None else 3
        return len(self.components) + turning
