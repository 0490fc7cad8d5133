"""The spring of a compliant gear: linear, or stiffer in steps of its torque, as strain-wave gears are."""

from typing import Self

import numpy as np
from pydantic import Field, model_validator

from ...common.arrays import Array
from ...common.structs import struct
from ...common.validation import Record
from ..fields.field_types import Positive


class StiffnessSteps(Record):
    """Stiffness in steps of the torque, as catalogs of strain-wave gears list it: K1, K2, K3 with torques T1, T2."""

    values: tuple[Positive, ...] = Field(min_length=1)
    """Slopes of the torque over the twist, N·m/rad, one more than `torques`."""
    torques: tuple[Positive, ...] = ()
    """Torques at the joint from which on the next value counts, N·m, in rising order."""

    @model_validator(mode="after")
    def _fit(self) -> Self:
        if len(self.values) != len(self.torques) + 1:
            raise ValueError(
                f"expected one value more than torques, found {len(self.values)} values and {len(self.torques)} torques"
            )
        if any(np.diff(self.torques) <= 0.0):
            raise ValueError(f"expected torques in rising order, found {list(self.torques)}")
        return self


def stiffer(stiffness: float | StiffnessSteps, factor: float) -> float | StiffnessSteps:
    """Return the key `stiffness` of a spring with `factor` times the slopes, its steps at the same torques."""
    if not isinstance(stiffness, StiffnessSteps):
        return factor * stiffness
    return stiffness.model_copy(update={"values": tuple(factor * K for K in stiffness.values)})


@struct
class TwistSpring:
    """Torque of a twist, odd and piecewise linear."""

    slopes: tuple[float, ...]  # N·m/rad, from no twist on; one of a linear spring
    knots: tuple[float, ...] = ()  # rad, the twists from which on the next slope counts

    @classmethod
    def of(cls, stiffness: float | StiffnessSteps) -> "TwistSpring":
        """Make the spring from the key `stiffness` of a joint."""
        if not isinstance(stiffness, StiffnessSteps):
            return cls((stiffness,))
        parts = np.diff(stiffness.torques, prepend=0.0) / stiffness.values[:-1]
        return cls(stiffness.values, tuple(np.cumsum(parts).tolist()))

    @property
    def torques(self) -> tuple[float, ...]:
        """Torques at the knots, N·m."""
        steps = np.diff(self.knots, prepend=0.0) * np.array(self.slopes[:-1])
        return tuple(np.cumsum(steps).tolist())

    def moment(self, twist: Array) -> Array:
        """Return torques (…,), N·m, of twists (…,), rad."""
        return _piecewise(twist, self.slopes, self.knots)

    def twist(self, moment: Array) -> Array:
        """Return twists (…,), rad, under torques (…,), N·m."""
        return _piecewise(moment, tuple(1.0 / k for k in self.slopes), self.torques)

    def slope(self, twist: Array) -> Array:
        """Return stiffness (…,), N·m/rad, at twists (…,), rad."""
        return np.array(self.slopes)[np.searchsorted(self.knots, np.abs(twist))]


def _piecewise(x: Array, slopes: tuple[float, ...], knots: tuple[float, ...]) -> Array:
    size = np.abs(x)
    total = slopes[0] * size
    for knot, change in zip(knots, np.diff(slopes), strict=True):
        total = total + change * np.maximum(size - knot, 0.0)
    return np.copysign(total, x)
