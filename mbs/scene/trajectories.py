"""Trajectories of a scene file, key by key: motion that is specified. SI units; angles in rad; planar (x, y)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from typing import Annotated

import numpy as np
from pydantic import model_validator

from ...common.validation import quoted
from .. import _core
from .._core import TimeFunction
from ..fields.field_types import Expression, Name, PointReference, Quantity, WaypointTable, one_of, only, present
from ..fields.piecewise import Piecewise
from ..fields.references import Reference, marker_reference
from ..joints.measure import GROUND_FRAME, Marker, Measure, coincident, marker_at
from .motion_keys import MotionKeys, OfPlaces


class Trajectory(MotionKeys):
    """Prescribed motion (C_s) of a point (m, global axes), a joint coordinate, or an angle (rad).

    `angle` is a body (its frame) or BODY.POINT (the section there).
    """

    via: Annotated[tuple[Quantity | tuple[Quantity, Quantity], ...], OfPlaces] | None = None
    """Waypoints from rest to rest, the first at t = 0: [x, y] (m), or values of the joint or angle."""
    name: Name
    """Name of the trajectory, unique in the scene."""
    point: PointReference | None = None
    """Point that follows the trajectory, "BODY.POINT"."""
    joint: str | None = None
    """Joint whose coordinate follows the trajectory: second side relative to the first."""
    angle: str | None = None
    """Body, or section "BODY.POINT", whose absolute angle against the ground's x axis follows the trajectory."""
    x: Expression | None = None
    """Position along the ground's x axis, m; expression in t (s)."""
    y: Expression | None = None
    """Position along the ground's y axis, m; expression in t (s)."""
    value: Expression | None = None
    """Joint coordinate (rad; prismatic: m) or angle (rad); expression in t (s)."""
    waypoints: WaypointTable | None = None
    """CSV file with the columns t (s) and x, y (m); of a joint value, or a column of the joint's name (rad, m)."""

    @model_validator(mode="after")
    def _consistent(self) -> Trajectory:
        subject = one_of(self, ("point", "joint", "angle"))
        allowed = ("x", "y") if subject == "point" else ("value",)
        found = only(self, subject, (*allowed, "waypoints", "via"), ("x", "y", "value", "waypoints", "via"))
        if len(found) > 1 and {"waypoints", "via"} & set(found):
            raise ValueError(f"expected either waypoints, via or expressions, found {quoted(found)}")
        if self.waypoints is not None and not set(self.waypoints.columns) <= set(allowed):
            columns = ",".join(("t", *self.waypoints.columns))
            raise ValueError(f'expected waypoints with the header t,{",".join(allowed)}, found "{columns}"')
        self.check_motion({2: "places [x, y]"} if subject == "point" else {1: "numbers"}, self.waypoints)
        with np.errstate(all="ignore"):
            path = self.path
        if path is not None and not (np.isfinite(path.coefficients).all() and np.isfinite(path.breaks).all()):
            raise ValueError("expected limits and times that fit each other in size, found infinite derivatives")
        return self

    def references(self) -> Iterator[Reference]:
        """What follows it."""
        yield from marker_reference("point", self.point, loaded=True)
        yield from marker_reference("angle", self.angle, loaded=True)
        if self.joint is not None:
            yield Reference("joint", self.joint, "joint")

    def measures(self, coordinate_of: Callable[[str], Measure]) -> dict[str, Measure]:
        """The constraints C_s by component ("x", "y" or "value"): their values equal those specified.

        `coordinate_of` gives the coordinate of a joint by its name.
        """
        label = f'trajectory "{self.name}"'
        if self.joint is not None:
            return {"value": replace(coordinate_of(self.joint), label=label)}
        if self.angle is not None:
            body, _, point = self.angle.partition(".")
            return {"value": Measure(label, _core.MeasureKind.angle, GROUND_FRAME, Marker(body, point))}
        assert self.point is not None
        x, y = coincident(label, GROUND_FRAME, marker_at(self.point))
        return {component: {"x": x, "y": y}[component] for component in self.components}

    def changed(self, **keys: object) -> Trajectory:
        """The same with some keys replaced."""
        return Trajectory(**({key: getattr(self, key) for key in self.model_fields_set} | keys))

    @cached_property
    def path(self) -> Piecewise | None:
        """The motion where it is made of polynomials; None where expressions give it."""
        return self.motion(self.waypoints)

    @cached_property
    def components(self) -> dict[str, TimeFunction]:
        """The specified functions of time by component: "x" and/or "y", or "value"."""
        if self.path is None:
            return present(x=self.x, y=self.y, value=self.value)
        columns = ("x", "y") if self.point is not None else ("value",)
        names = columns if self.waypoints is None else self.waypoints.columns
        return dict(zip(names, self.path.functions(), strict=True))
