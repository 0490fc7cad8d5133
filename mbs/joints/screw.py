"""Screw joints: the second side turns about an axis of the first and moves along it in proportion."""

from typing import Literal, Self

import numpy as np
from pydantic import model_validator

from ..fields.spelling import SPATIAL
from .moving_joint import AxialJoint


class ScrewJoint(AxialJoint):
    """The second side turns about `axis` by its coordinate, rad, and slides along it by `lead` per turn."""

    type: Literal["screw"]
    only_in = SPATIAL
    lead: float
    """Displacement along the axis per turn, m; positive: right-handed."""

    units = ("rad",)
    axes = (5,)

    @model_validator(mode="after")
    def _has_lead(self) -> Self:
        if self.lead == 0.0:
            raise ValueError("expected a lead that is not 0, found 0: without it the joint is a revolute one")
        return self

    @property
    def rise(self) -> float:
        """Displacement per angle h, m/rad."""
        return self.lead / (2 * np.pi)
