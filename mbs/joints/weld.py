"""Welds: the second side is fixed to the first."""

from typing import Literal, Self

from pydantic import model_validator

from .joint import ALIGNED, NOT_TURNED, POINT, JointRecord


class WeldJoint(JointRecord):
    """The second side is fixed to the first with orientation `rpy`; in planar scenes with the angle of the guess."""

    type: Literal["weld"]
    motor: bool | None = None
    """Only `false`: a weld cannot be driven."""

    @model_validator(mode="after")
    def _has_no_motor(self) -> Self:
        if self.motor:
            raise ValueError("expected no motor in a weld, which cannot move, found motor = true")
        return self

    loop_equations = (POINT, *ALIGNED, NOT_TURNED)
