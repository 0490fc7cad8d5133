"""Welds: the second side is fixed to the first."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array
from .joint import ALIGNED, NOT_TURNED, POINT, JointRecord, Place


class WeldJoint(JointRecord):
    """The second side is fixed to the first with orientation `rpy`; in planar scenes with the angle of the guess."""

    type: Literal["weld"]
    motor: bool | None = None
    """Only `false`: a weld cannot be driven."""

    @model_validator(mode="after")
    def _has_no_motor(self) -> WeldJoint:
        if self.motor:
            raise ValueError("expected no motor in a weld, which cannot move, found motor = true")
        return self

    loop_equations = (POINT, *ALIGNED, NOT_TURNED)

    def place(self, q: Array) -> Place:
        """At rest."""
        shape = q.shape[:-1]
        return Place(np.zeros((*shape, 3)), np.broadcast_to(np.eye(3), (*shape, 3, 3)))

    def motion(self, q: Array) -> Array:
        """None."""
        return np.zeros((*q.shape[:-1], 6, 0))
