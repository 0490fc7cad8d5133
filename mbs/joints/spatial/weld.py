"""Welds: the second side is fixed to the first."""

from __future__ import annotations

from typing import Literal

import numpy as np

from ....common.arrays import Array
from .joint import ALIGNED, NOT_TURNED, POINT, Place, SpatialJoint


class SpatialWeld(SpatialJoint):
    """The second side is fixed to the first with orientation `rpy`."""

    type: Literal["weld"]

    held = (POINT, *ALIGNED, NOT_TURNED)

    def place(self, q: Array) -> Place:
        """At rest."""
        shape = q.shape[:-1]
        return Place(np.zeros((*shape, 3)), np.broadcast_to(np.eye(3), (*shape, 3, 3)))

    def motion(self, q: Array) -> Array:
        """None."""
        return np.zeros((*q.shape[:-1], 6, 0))
