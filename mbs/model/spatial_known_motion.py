"""What motions in space that are known take, as the core's recursive Newton–Euler algorithm finds it."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, as_floats
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


def mass_matrix(model: SpatialModel, q: Array, t: float) -> Array:
    """M (n_v, n_v) at q (n_q,): what unit accelerations take more than none."""
    count = model.tree.n_v
    system, a = SpatialSystem(model), np.vstack([np.zeros(count), np.eye(count)])
    states = np.tile(q, (count + 1, 1)), np.zeros((count + 1, count)), a
    found = system.core.required_forces(system.scene, [t] * (count + 1), *states)
    return as_floats((found[1:] - found[0]).T)
