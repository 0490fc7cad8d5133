"""The time of one evaluation of all accelerations and multipliers."""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array
from ..mbs.model.spatial_model import SpatialModel
from ..mbs.model.spatial_system import SpatialSystem
from ..mbs.solve.spatial_start import undeformed_posture

State = tuple[SpatialSystem, Array, Array]
"""Equations, q (n_q,) and v (n_v,)."""


def start_at_rest(model: SpatialModel) -> State:
    """Where a mechanism starts: on its path with undeformed links, at rest."""
    return SpatialSystem(model), undeformed_posture(model).q, np.zeros(model.tree.n_v)


def evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations` as integrators make them, without loads."""
    system, q, v = state
    core, _, rows = system.integrated
    return core.time_evaluations(q, v, system.target(t)[rows], evaluations)
