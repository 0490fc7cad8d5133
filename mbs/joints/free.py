"""Free joints: they constrain nothing and say where a body is."""

from typing import ClassVar, Literal

import numpy as np

from ...common.arrays import Array
from ...common.rotations import exponential, quaternions
from ..fields.spelling import SPATIAL
from .joint import JointRecord


class FreeJoint(JointRecord):
    """The second side moves freely; [initial] has its position (m) and rotation vector (rad), in axes of the first.

    A body without any joint is free, too, from the origin on.
    """

    type: Literal["free"]
    only_in = SPATIAL
    motor: bool = False
    """Only `false`: motors need coordinates, which free joints do not have."""

    guess_units = ("m", "m", "m", "rad", "rad", "rad")
    q_count = 7
    freedoms = 6
    loop_equations = ()
    locates: ClassVar[bool] = False

    def state(self, coordinates: Array) -> Array:
        """Place, and the quaternion of a rotation vector."""
        return np.concatenate([coordinates[..., :3], quaternions(exponential(coordinates[..., 3:]))], axis=-1)

    def velocity(self, rates: Array) -> Array:
        """The velocity in axes of the first side, and the angular velocity, given in those of the second one."""
        return np.concatenate([rates[:3], self.orientation @ rates[3:]])

    def turned_around(self, coordinates: Array) -> Array:
        """The place of the first side, and its rotation vector, in the axes of the second."""
        C = exponential(coordinates[..., 3:])
        back = -np.einsum("...ij,...i->...j", C, coordinates[..., :3])
        return np.concatenate([back, -coordinates[..., 3:]], axis=-1)
