"""Keys of a trajectory by places it goes through: law of motion, limits, holds, shaping. SI units; angles in rad."""

from collections.abc import Mapping
from itertools import pairwise
from math import inf
from typing import Annotated, Literal, Self

import numpy as np
from pydantic import Field, ValidationInfo, field_validator, model_validator

from ...common.arrays import Array
from ...common.errors import quoted
from ...common.validation import Record
from ..fields.field_types import NotNegative, Positive, Quantity, Referring
from ..fields.paths import SMOOTHNESS, Legs, PathLimits, Piecewise, impulses, path_of, shaped
from ..fields.waypoints import Waypoints

Place = Quantity | tuple[Quantity, ...]
MOST_PLACES = 1000
OfPlaces = Field(min_length=2, max_length=MOST_PLACES)
LIMITS = ("speed", "acceleration", "jerk")
OF_LEGS = ("hold", "blend", "duration", *LIMITS, "start", "stretch", "fastest")  # a table of waypoints has its times


class Shaper(Record):
    """Input shaping: delayed shares of the motion cancel their vibrations (Singer and Seering 1990).

    The default `frequency` is that of the robot's lowest vibrations on the constrained path, averaged over it.
    """

    kind: Literal["none", "zv", "zvd", "ei"]
    """Shaper: "zv" is shortest, "zvd" and "ei" take twice as long and are robust against a wrong frequency; "none" does
    nothing."""
    frequency: Positive | tuple[Positive, ...] | None = None
    """Frequencies of the vibrations, Hz: one or several; by default those of the robot."""
    damping_ratio: Annotated[float, Field(ge=0.0, lt=1.0)] | None = None
    """Damping ratio of these vibrations; by default that of the robot, and 0 with `frequency`."""
    modes: Annotated[int, Field(gt=0, le=4)] = 1
    """Number of the robot's lowest vibrations."""

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.frequency is not None and "modes" in self.model_fields_set:
            raise ValueError('expected one of the keys "frequency" and "modes", found both')
        return self

    @property
    def asks_robot(self) -> bool:
        """Whether the frequencies of the robot have to be computed first."""
        return self.kind != "none" and self.frequency is None

    def shape(self, motion: Piecewise) -> Piecewise:
        """The motion, shaped for each frequency; unchanged as long as there is none."""
        if self.kind == "none" or self.frequency is None:
            return motion
        for frequency in np.atleast_1d(self.frequency):
            motion = shaped(motion, impulses(self.kind, float(frequency), self.damping_ratio or 0.0))
        return motion


class MotionKeys(Referring):
    """Keys of the motion of a trajectory."""

    via: Annotated[tuple[Place, ...], OfPlaces] | None = None
    """Waypoints from rest to rest, the first at t = 0: of points (m), or values of what turns or slides."""
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

    @field_validator("waypoints", check_fields=False)
    @classmethod
    def _of_its_joint(cls, table: Waypoints | None, info: ValidationInfo) -> Waypoints | None:
        joint = info.data.get("joint") or info.data.get("motor")
        return table if table is None or joint is None else table.of_joint(joint)

    def check_motion(self, places: Mapping[int, str], waypoints: Waypoints | None) -> None:
        """Raise `ValueError` for keys that do not fit each other, or places that are none of these.

        `places` says by their number of components how they are written.
        """
        given = [key for key in (*OF_LEGS, "profile", "smoothness", "shaper") if key in self.model_fields_set]
        if self.via is None and waypoints is None and given:
            raise ValueError(f'expected {quoted(given)} only with "via" or "waypoints", found neither')
        if waypoints is not None:
            self._check_table(given)
        if self.via is not None:
            self._check_via(self.via, places)

    def _check_table(self, given: list[str]) -> None:
        refused = [key for key in given if key in OF_LEGS]
        if refused:
            raise ValueError(f'expected {quoted(refused)} only with "via", found them with "waypoints"')
        if self.profile in (None, "spline") and self.smoothness is not None:
            raise ValueError('expected no key "smoothness" with profile = "spline", found it there')

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
        self._check_limits()
        for key, count in (("duration", len(via) - 1), ("hold", len(via) - 2)):
            value = getattr(self, key)
            if isinstance(value, tuple) and len(value) != count:
                raise ValueError(f'expected {count} numbers in "{key}", found {len(value)}')

    def _check_limits(self) -> None:
        if self.fastest and "stretch" in self.model_fields_set:
            raise ValueError('expected one of the keys "fastest" and "stretch", found both')
        limits = [key for key in LIMITS if getattr(self, key) is not None]
        if bool(limits) == (self.duration is not None):
            given = "both" if limits else "neither"
            raise ValueError(f'expected either limits ({quoted(LIMITS)}) or a "duration" with "via", found {given}')
        if self.profile in ("s-curve", "trapezoid") and limits == ["speed"]:
            raise ValueError(f'expected "acceleration" or "jerk" with profile = "{self.profile}", found only "speed"')
        if self.profile == "trapezoid" and self.jerk is not None:
            raise ValueError('expected no "jerk" with profile = "trapezoid" (its acceleration jumps), found it')

    def along_table(self, waypoints: Waypoints) -> Piecewise:
        """The motion of all columns of a table."""
        if self.profile in (None, "spline"):
            return self._shaped(waypoints.spline)
        return self._shaped(path_of(self._legs_of_table(waypoints)))

    def through(self, places: Array) -> Piecewise:
        """Return the motion through the points of `via` (k + 1, n), m or rad, or some of their components."""
        return self._shaped(path_of(self._legs(places)))

    def _shaped(self, motion: Piecewise) -> Piecewise:
        return motion if self.shaper is None else self.shaper.shape(motion)

    def _legs(self, places: Array) -> Legs:
        profile, count = self.profile or "rest-to-rest", len(places) - 1
        assert profile != "spline"
        limits = PathLimits(*(inf if value is None else value for value in (self.speed, self.acceleration, self.jerk)))
        durations = None if self.duration is None else tuple(np.broadcast_to(self.duration, count).tolist())
        holds = tuple(np.broadcast_to(self.hold, count - 1).tolist())
        smoothness = self.smoothness or SMOOTHNESS[profile]
        more = {"blend": self.blend, "stretch": self.stretch}
        return Legs(places, self.start, profile, smoothness, limits, durations, holds=holds, **more)

    def _legs_of_table(self, waypoints: Waypoints) -> Legs:
        profile, times = self.profile or "rest-to-rest", waypoints.times
        assert profile != "spline"
        smoothness, durations = self.smoothness or SMOOTHNESS[profile], tuple(np.diff(times).tolist())
        holds = (0.0,) * (len(times) - 2)
        return Legs(
            waypoints.values, float(times[0]), profile, smoothness, PathLimits(), durations=durations, holds=holds
        )
