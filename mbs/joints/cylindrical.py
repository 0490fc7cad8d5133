"""Cylindrical joints: the second side turns about an axis of the first and slides along it, each as it likes."""

from typing import Literal

from ...common.arrays import Array
from ..fields.spelling import SPATIAL
from .joint import GUIDED, Along
from .moving_joint import AxialJoint


class CylindricalJoint(AxialJoint):
    """Joint that turns about `axis` and slides along it. Coordinates: angle (rad), displacement (m)."""

    type: Literal["cylindrical"]
    only_in = SPATIAL

    units = ("rad", "m")
    axes = (2, 5)
    loop_equations = GUIDED
    along = (Along("turn", 2), Along("slide", 2))

    def state(self, coordinates: Array) -> Array:
        """Return coordinates in the order of q: displacement, then angle."""
        return coordinates[..., ::-1]

    def coordinates(self, q: Array) -> Array:
        """Return coordinates in the order of the scene: angle, then displacement."""
        return q[..., ::-1]
