"""The initial state in a scene file, key by key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import Quantity
from ..fields.references import Reference


class Initial(Record):
    """State at t = 0; values of bodies and joints are guesses that the constraints correct.

    With `joints` or `joint_rates`, a frame without an own angle or rate follows the coordinate of its inboard joint
    (default 0); without them, its angle and rate are 0.
    """

    state: Literal["undeformed", "static"] = "undeformed"
    """State of the links: undeformed, or static equilibrium under gravity and loads."""
    angles: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of each body frame's absolute angle, against the global x axis, rad (or such as "60*deg")."""
    rates: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of their rates, rad/s."""
    joints: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of joint coordinates, rad or m (or such as "60*deg"), instead of angles of bodies."""
    joint_rates: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of their rates, rad/s or m/s."""

    def references(self) -> Iterator[Reference]:
        """The bodies and joints with guesses."""
        for table, guesses in (("angles", self.angles), ("rates", self.rates)):
            for body in guesses:
                yield Reference(table, body)
        for table, guesses in (("joints", self.joints), ("joint_rates", self.joint_rates)):
            for joint in guesses:
                yield Reference(table, joint, "joint")
