"""The time of one evaluation of all accelerations and multipliers."""

from __future__ import annotations

import time

from ..common.arrays import Array
from ..mbs import _core
from ..mbs.model.system import MechanismSystem

State = tuple[MechanismSystem, Array, Array]
"""Equations, q and v."""


def evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations`."""
    assembly, q, v = state
    began = time.perf_counter()
    _core.time_evaluations(assembly.system, t, q, v, evaluations)
    return (time.perf_counter() - began) / evaluations
