"""Universal joints: two points coincide, the second side turns about an axis of the first and one of its own."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ...common.arrays import Array
from ...common.rotations import unit
from ..fields.field_types import Vector3
from ..fields.spelling import SPATIAL
from .joint import NOT_TURNED, POINT, Along
from .moving_joint import AxialJoint, check_direction

SQUARE = 1e-6  # largest cosine between the two axes at zero coordinates
EXCHANGED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # x and y change places


class UniversalJoint(AxialJoint):
    """Two points coincide; the second side turns about `axis` of the first, then about its `second_axis`.

    Coordinates: the two angles, rad. The axes are at right angles at zero coordinates, and stay so.
    """

    type: Literal["universal"]
    only_in = SPATIAL
    second_axis: Vector3
    """Second axis in the axes of the second of `between`, of any length."""

    units = ("rad", "rad")
    q_count = 2
    freedoms = 2
    loop_equations = (POINT, NOT_TURNED)
    along = (Along("turn", 0, 1), Along("turn", 1, 0, of_outer=True))

    @model_validator(mode="after")
    def _axes_are_square(self) -> Self:
        check_direction("second_axis", self.second_axis)
        x, y = unit(np.array(self.axis)), unit(self.orientation @ self.second_axis)
        cosine = float(x @ y)
        if abs(cosine) > SQUARE:
            angle = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
            raise ValueError(
                "expected axis and second_axis at right angles where the coordinates are 0 (rpy turns the second side),"
                f" found {angle:.4g} degrees"
            )
        return self

    def triads(self) -> tuple[Array, Array]:
        """Their x is along the first axis, y along the second."""
        x, y = unit(np.array(self.axis)), unit(self.orientation @ self.second_axis)
        z = unit(np.cross(x, y))
        first = np.stack([x, np.cross(z, x), z], axis=1)
        return first, self.orientation.T @ first

    def outward_triads(self, backwards: bool) -> tuple[Array, Array]:
        """Triads of both sides from root to tip; if `backwards` its axes change places: x is the inner side's."""
        inner, outer = super().outward_triads(backwards)
        return (inner @ EXCHANGED, outer @ EXCHANGED) if backwards else (inner, outer)

    def turned_around(self, coordinates: Array) -> Array:
        """Return coordinates of the reversed joint: both negative, the second first."""
        return -coordinates[..., ::-1]
