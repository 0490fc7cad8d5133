"""The initial state in a scene in space, key by key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from ....common.validation import Record
from ...fields.field_types import Quantity
from ...fields.references import Reference

Numbers = Quantity | tuple[Quantity, ...]


class SpatialInitial(Record):
    """State at t = 0; joint coordinates and rates are guesses that the constraints correct."""

    state: Literal["undeformed", "static"] = "undeformed"
    """State of the links: undeformed, or static equilibrium under gravity and loads."""
    joints: dict[str, Numbers] = Field(default_factory=dict)
    """Guess of each joint's coordinates, rad or m (or such as "60*deg"); lists for several; default 0. Spherical
    joints: a rotation vector; free ones: position and rotation vector, in the axes of the first side."""
    joint_rates: dict[str, Numbers] = Field(default_factory=dict)
    """Their rates, rad/s or m/s; spherical and free joints: angular velocity in the axes of the second side, after
    the velocity in those of the first."""

    def references(self) -> Iterator[Reference]:
        """The joints with guesses."""
        for table, guesses in (("joints", self.joints), ("joint_rates", self.joint_rates)):
            for joint in guesses:
                yield Reference(table, joint, "joint")
