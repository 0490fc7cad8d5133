"""The initial state in a scene file, key by key."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from pydantic import Field

from ...common.validation import Record
from ..fields.field_types import Quantity
from ..fields.references import Reference


class Initial(Record):
    """State at t = 0; `angles` (rad) and `rates` (rad/s) of body frames are guesses that the constraints correct."""

    state: Literal["undeformed", "static"] = "undeformed"
    """Undeformed links, or the static equilibrium under gravity and loads."""
    angles: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of each body frame's absolute angle, against the global x axis, rad (or such as "60*deg")."""
    rates: dict[str, Quantity] = Field(default_factory=dict)
    """Guess of their rates, rad/s."""

    def references(self) -> Iterator[Reference]:
        """The bodies with guesses."""
        for table, guesses in (("angles", self.angles), ("rates", self.rates)):
            for body in guesses:
                yield Reference(table, body)
