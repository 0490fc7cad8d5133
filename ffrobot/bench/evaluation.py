"""The time of one evaluation of all accelerations and multipliers."""

from __future__ import annotations

import time

import numpy as np

from ..common.arrays import Array
from ..mbs import _core
from ..mbs.model.planar_tree import PlanarTree
from ..mbs.model.system import MechanismSystem

State = tuple[MechanismSystem, Array, Array]
"""Equations, q and v."""


def evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations`, in absolute coordinates."""
    assembly, q, v = state
    began = time.perf_counter()
    _core.time_evaluations(assembly.system, t, q, v, evaluations)
    return (time.perf_counter() - began) / evaluations


def tree_evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations` in joint coordinates, without loads.

    Raises `NotInTreeError` for a mechanism that cannot be told in them.
    """
    assembly, q, v = state
    tree = PlanarTree(assembly)
    target = tree.row_signs * [constraint.target(t)[2] for constraint in tree.constraints]
    return float(tree.core.time_evaluations(*tree.state(q, v), np.asarray(target), evaluations))
