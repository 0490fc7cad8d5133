"""What motions in space that are known take, as the core's recursive Newton–Euler algorithm finds it."""

from __future__ import annotations

from ...common.arrays import Array
from .spatial_accelerations import Accelerated
from .spatial_model import SpatialModel
from .spatial_system import SpatialSystem


def required_forces(model: SpatialModel, state: Accelerated, times: Array) -> Array:
    """M v̇ − Q (T, n_v) along v: what gravity, elasticity, friction and given loads leave for others to supply."""
    system = SpatialSystem(model)
    return system.core.required_forces(system.scene, times.tolist(), state.q, state.v, state.a)


def row_accelerations(model: SpatialModel, state: Accelerated, times: Array) -> Array:
    """C̈ (T, rows) at `times` (T,), less what their targets ask for: 0 where the motion keeps to the constraints."""
    system = SpatialSystem(model)
    return system.core.row_accelerations(system.scene, times.tolist(), state.q, state.v, state.a) * system.row_signs
