"""The time of one evaluation of all accelerations and multipliers."""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array
from ..mbs.model.planar_tree import PlanarTree
from ..mbs.model.system import MechanismSystem

State = tuple[MechanismSystem, Array, Array]
"""Equations, q and v."""


def tree_evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations` in joint coordinates, without loads."""
    assembly, q, v = state
    tree = PlanarTree(assembly)
    target = tree.row_signs * [constraint.target(t)[2] for constraint in tree.constraints]
    return float(tree.core.time_evaluations(*tree.state(q, v), np.asarray(target), evaluations))
