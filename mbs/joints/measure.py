"""Scalar measures between two markers: what joints, trajectories, motors and loads are made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from ...common.plane import rotated
from .. import _core
from ..fields.field_types import GROUND, split_point

FRAME = ""  # instead of a point's name: the frame of the body itself


@dataclass(frozen=True)
class Marker:
    """A point of a body (or its frame, point = FRAME), or a `position` (m) on the ground (body None)."""

    body: str | None
    point: str = FRAME
    position: tuple[float, float] = (0.0, 0.0)


GROUND_FRAME = Marker(None)


def marker_at(side: str, at: tuple[float, float] = (0.0, 0.0)) -> Marker:
    """The marker of "BODY.POINT", or the one on the ground `at` (m) where the side is "ground"."""
    return Marker(None, FRAME, at) if side == GROUND else Marker(*split_point(side))


@dataclass(frozen=True)
class Measure:
    """value = motion of `b` relative to `a`, in m or rad, less `offset`; `label` names it in messages.

    By `kind`: the difference of x or y in global axes, of the angles, the way of b along `direction`, which is fixed to
    the section at a ("slide"), or n_b α_b − n_a α_a with the angles α and the
    gear ratios (n_b, n_a) ("gear").
    """

    label: str
    kind: _core.MeasureKind
    a: Marker
    b: Marker
    direction: tuple[float, float] = (0.0, 0.0)
    gear_ratios: tuple[float, float] = (0.0, 0.0)
    offset: float = 0.0

    @property
    def carries_moment(self) -> bool:
        """Whether the force along it is a moment (N·m) and not a force (N)."""
        return bool(self.kind in (_core.MeasureKind.angle, _core.MeasureKind.gear))

    @property
    def angle_ratios(self) -> tuple[float, float]:
        """(n_b, n_a) of one that carries a moment: n_b α_b − n_a α_a."""
        return self.gear_ratios if self.kind == _core.MeasureKind.gear else (1.0, 1.0)

    def force_direction(self, section_angle: Array) -> Array:
        """Unit force on b along the measure in global axes (T, 2), for angles (T,) of the section at a, in rad.

        Of measures that carry a force: x, y, slide.
        """
        if self.kind == _core.MeasureKind.slide:
            return rotated(section_angle, np.array(self.direction))
        return np.tile(_AXES[self.kind], (len(section_angle), 1))


_AXES: Mapping[_core.MeasureKind, tuple[float, float]] = {
    _core.MeasureKind.x: (1.0, 0.0),
    _core.MeasureKind.y: (0.0, 1.0),
}


def coincident(label: str, a: Marker, b: Marker) -> tuple[Measure, Measure]:
    """The differences of x and y of two markers: together 0 where they coincide."""
    return Measure(f"{label}, x", _core.MeasureKind.x, a, b), Measure(f"{label}, y", _core.MeasureKind.y, a, b)


def relative_angle(label: str, a: Marker, b: Marker, offset: float = 0.0) -> Measure:
    """The angle of b on a less `offset`, rad."""
    return Measure(f"{label}, angle", _core.MeasureKind.angle, a, b, offset=offset)


def slide(label: str, a: Marker, b: Marker, direction: tuple[float, float]) -> Measure:
    """The way of b along a unit `direction` in the axes of the section at a, m."""
    return Measure(label, _core.MeasureKind.slide, a, b, direction=direction)
