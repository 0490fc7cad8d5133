"""What acts along coordinates that a tree has not: between wrenches on two markers, as at joints that are cut."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..joints.measure import Marker, Measure
from ..joints.transmission import ElasticGear, Friction
from .tree_layout import NotInTreeError

NOTHING = Friction(0.0, 0.0, 1.0)


class TreeCuts:
    """The cut joints of a core `scene`; `wrench` numbers the wrenches of the tree by their markers."""

    def __init__(self, scene: _core.TreeScene, wrench: Callable[[Marker], int]) -> None:
        self._scene, self._wrench, self._count = scene, wrench, 0
        self._known: dict[Measure, int] = {}

    def along(self, measure: Measure) -> int:
        """Number of the one along a measure, for loads and motors: made where there is none.

        Raises `NotInTreeError` for a direction of the ground between two bodies.
        """
        if measure not in self._known:
            self._known[measure] = self.resist(measure, NOTHING)
        return self._known[measure]

    def resist(self, measure: Measure, friction: Friction) -> int:
        """Friction along a measure; the number of its joint. Raises `NotInTreeError` as `along`."""
        sides, axis = (self._wrench(measure.a), self._wrench(measure.b)), axis_of(measure)
        how = friction.viscous, friction.coulomb, friction.speed
        self._scene.add_cut_joint(*sides, measure.carries_moment, axis, *how)
        return self._numbered()

    def add_gear(self, gear: ElasticGear, motor: int) -> None:
        """The spring of a gear between the `motor`'s coordinate, its number in v, and the angle of two markers."""
        a, b = self._wrench(gear.coordinate.a), self._wrench(gear.coordinate.b)
        self._scene.add_cut_gear(a, b, motor, gear.stiffness, gear.damping)
        self._numbered()

    def _numbered(self) -> int:
        self._count += 1
        return self._count - 1


def axis_of(measure: Measure) -> Array:
    """Direction along which a measure goes, or about which it turns, (3,) in axes of its first side.

    Raises `NotInTreeError` for a direction of the ground between two bodies, which would turn with the first one.
    """
    if measure.carries_moment:
        return np.array([0.0, 0.0, 1.0])
    if measure.kind == _core.MeasureKind.slide:
        return np.array([*measure.direction, 0.0])
    if measure.a.body is not None:
        raise NotInTreeError(f"a rotor, a motor or friction along a direction of the ground ({measure.label})")
    return np.array([1.0, 0.0, 0.0] if measure.kind == _core.MeasureKind.x else [0.0, 1.0, 0.0])
