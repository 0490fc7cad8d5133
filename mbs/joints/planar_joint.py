"""Planar joints: the second point moves in a plane of the first side, and the second side turns about its normal."""

from typing import Literal

import numpy as np

from ...common.arrays import Array
from ..fields.spelling import SPATIAL
from .joint import ALIGNED, Along, LoopEquation
from .moving_joint import AxialJoint


class PlanarJoint(AxialJoint):
    """The second point moves in the plane across `axis`, the second side turns about it.

    Coordinates: two displacements (m) and the angle (rad). The displacements are along the axes x and y that the
    smallest rotation of z onto `axis` yields.
    """

    type: Literal["planar"]
    only_in = SPATIAL

    units = ("m", "m", "rad")
    axes = (0, 1, 5)
    loop_equations = (LoopEquation("slide", 2), *ALIGNED)
    along = (Along("slide", 0), Along("slide", 1), Along("turn", 2))

    def turned_around(self, coordinates: Array) -> Array:
        """Coordinates (…, 3), m, m, rad, of the reversed joint: first side in axes of the second."""
        x, y, angle = np.moveaxis(coordinates, -1, 0)
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([-(c * x + s * y), s * x - c * y, -angle], axis=-1)

    def rate_turned_around(self, coordinates: Array, rate: Array) -> Array:
        """Return rates of the reversed joint, as `turned_around`; its axes of displacement rotate, too."""
        X, Y, _ = np.moveaxis(self.turned_around(coordinates), -1, 0)
        turn = rate[..., 2]
        x, y, _ = np.moveaxis(self.turned_around(np.concatenate([rate[..., :2], coordinates[..., 2:]], axis=-1)), -1, 0)
        return np.stack([x + turn * Y, y - turn * X, -turn], axis=-1)
