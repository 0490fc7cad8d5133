"""Spherical joints: two points coincide."""

from typing import ClassVar, Literal

from ...common.arrays import Array, as_floats
from ...common.rotations import exponential, quaternions
from ..fields.spelling import SPATIAL
from .joint import POINT, JointRecord


class SphericalJoint(JointRecord):
    """Two points coincide, the second side rotates freely; [initial] has a rotation vector, rad."""

    type: Literal["spherical"]
    only_in = SPATIAL
    motor: bool = False
    """Only `false`: motors need coordinates, which spherical joints do not have."""

    guess_units = ("rad", "rad", "rad")
    q_count = 4
    freedoms = 3
    loop_equations = (POINT,)
    locates: ClassVar[bool] = False  # a loop is best cut here: three rows, no angle

    def state(self, coordinates: Array) -> Array:
        """The quaternion of a rotation vector."""
        return quaternions(exponential(coordinates))

    def velocity(self, rates: Array) -> Array:
        """Angular velocity (3,), rad/s, in axes of the second side."""
        return as_floats(self.orientation @ rates)
