"""Gradients of measures in the coordinates of a system, read off their rates and accelerations, in which they are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.system import MechanismSystem


def gradients(assembly: MechanismSystem, measures: Sequence[_core.Measure], q: Array) -> Array:
    """G (measures, coordinates) at q (coordinates,): rates of unit velocities."""
    return _read(assembly, measures, 1, q, np.eye(len(q)))


def gradient_rates(assembly: MechanismSystem, measures: Sequence[_core.Measure], q: Array, v: Array) -> Array:
    """Ġ (measures, coordinates) in a motion through q with v (coordinates,).

    Accelerations b(v) of a motion without those of coordinates are quadratic, vᵀ∇²v; Ġ u = (b(v + u) − b(v − u))/4.
    """
    speed = np.abs(v / assembly.scales).max(initial=0.0)
    if not speed:
        return np.zeros((len(measures), len(q)))
    u = speed * np.diag(assembly.scales)
    ahead, behind = (_read(assembly, measures, 2, q, v + sign * u) for sign in (1.0, -1.0))
    found: Array = (ahead - behind) / (4 * np.diag(u))
    return found


def _read(assembly: MechanismSystem, measures: Sequence[_core.Measure], order: int, q: Array, v: Array) -> Array:
    """Rates (order 1) or accelerations (2) of measures at q with each row of v (n, coordinates); (measures, n)."""
    sensing = _core.Sensing(assembly.system, [(measure, order) for measure in measures], [])
    found: Array = sensing.read(np.tile(q, (len(v), 1)), v, np.zeros_like(v)).T
    return found
