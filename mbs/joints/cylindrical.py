"""Cylindrical joints: the second side turns about an axis of the first and slides along it, each as it likes."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ...common.arrays import Array
from ...common.rotations import about
from ..fields.spelling import SPATIAL
from .joint import GUIDED, Along, Place
from .moving_joint import AxialJoint


class CylindricalJoint(AxialJoint):
    """The second side turns about `axis` and slides along it. Coordinates: angle (rad), way (m)."""

    type: Literal["cylindrical"]
    only_in = SPATIAL

    units = ("rad", "m")
    q_count = 2
    freedoms = 2
    loop_equations = GUIDED
    along = (Along("turn", 2), Along("slide", 2))

    def place(self, q: Array) -> Place:
        """By q[0] along z, turned by q[1] about it."""
        return Place(q[..., :1] * np.eye(3)[2], about(2, q[..., 1]))

    def motion(self, q: Array) -> Array:
        """Along z, and about it."""
        return np.broadcast_to(np.eye(6)[:, [2, 5]], (*q.shape[:-1], 6, 2))

    def state(self, coordinates: Array) -> Array:
        """Way first."""
        return coordinates[..., ::-1]

    def coordinates(self, q: Array) -> Array:
        """Angle first."""
        return q[..., ::-1]
