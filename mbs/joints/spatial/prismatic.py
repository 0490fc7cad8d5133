"""Prismatic joints: the second side slides along an axis of the first and does not turn on it."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ....common.arrays import Array
from .joint import GUIDED, NOT_TURNED, Place
from .moving_joint import AxialJoint


class SpatialPrismatic(AxialJoint):
    """The second point slides along `axis` by its coordinate, m; `rpy` is how the second side stands on the first."""

    type: Literal["prismatic"]

    units = ("m",)
    q_count = 1
    freedoms = 1
    held = (*GUIDED, NOT_TURNED)

    def place(self, q: Array) -> Place:
        """By q[0] along z."""
        return Place(q[..., :1] * np.eye(3)[2], np.broadcast_to(np.eye(3), (*q.shape[:-1], 3, 3)))

    def motion(self, q: Array) -> Array:
        """Sliding along z."""
        return np.broadcast_to(np.eye(6)[:, 2:3], (*q.shape[:-1], 6, 1))
