"""The initial state of a scene, key by key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import Quantity
from ..fields.references import Reference
from ..fields.spelling import IN_PLANE, Spelled, as_written

Word = Literal["up", "down", "right", "left", "noflip", "flip", "positive", "negative"]
"""How a joint stands in one of several postures: see `solve.branch_names`."""

Numbers = Annotated[Quantity | tuple[Quantity, ...], Spelled(Quantity, as_written)]


class Initial(Record):
    """State at t = 0; values of bodies and joints are guesses that the constraints correct.

    In planar scenes with `joints` or `joint_rates`, a frame without an own angle or rate follows the coordinate of its
    inboard joint (default 0); without them, its angle and rate are 0.
    """

    state: Literal["undeformed", "static"] = "undeformed"
    """State of the links: undeformed, or static equilibrium under gravity and loads."""
    angles: Annotated[dict[str, Quantity], IN_PLANE] = Field(default_factory=dict)
    """Guess of each body frame's absolute angle, against the global x axis, rad (or such as "60*deg")."""
    rates: Annotated[dict[str, Quantity], IN_PLANE] = Field(default_factory=dict)
    """Guess of their rates, rad/s."""
    joints: dict[str, Numbers] = Field(default_factory=dict)
    """Guess of each joint's coordinates, rad or m (or such as "60*deg"); lists for several; default 0; in planar
    scenes instead of angles of bodies. Spherical joints: a rotation vector; free ones: position and rotation vector, in
    the axes of the first side."""
    joint_rates: dict[str, Numbers] = Field(default_factory=dict)
    """Their rates, rad/s or m/s; spherical and free joints: angular velocity in the axes of the second side, after
    the velocity in those of the first."""

    branch: dict[str, Word] = Field(default_factory=dict)
    """Which of several postures that meet the constraints at t = 0, by joint. Elbow: "up" or "down", its joint is above
    or below the straight line between the joints (or the tool) next to it. Shoulder: "right" or "left", a positive turn
    raises or lowers the end of the arm along the axis of the joint before. Wrist: "noflip" or "flip" (also "positive"
    or "negative"), the sign of the coordinate within ±180°. Of those the nearest to the guess."""

    def references(self) -> Iterator[Reference]:
        """The bodies and joints with guesses."""
        for table, of_bodies in (("angles", self.angles), ("rates", self.rates)):
            for body in of_bodies:
                yield Reference(table, body)
        for table, guesses in (("joints", self.joints), ("joint_rates", self.joint_rates), ("branch", self.branch)):
            for joint in guesses:
                yield Reference(table, joint, "joint")
