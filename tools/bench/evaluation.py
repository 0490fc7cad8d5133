"""The time of one evaluation of all accelerations and multipliers, and ratios of times that were taken in turn."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

import numpy as np

from ffrobot.common.arrays import Array
from ffrobot.mbs.model.model import Model
from ffrobot.mbs.model.system import MultibodySystem
from ffrobot.mbs.solve.start import undeformed_posture

State = tuple[MultibodySystem, Array, Array]
"""Equations, q (n_q,) and v (n_v,)."""


def start_at_rest(model: Model) -> State:
    """Where a mechanism starts: on its path with undeformed links, at rest."""
    return MultibodySystem(model), undeformed_posture(model).q, np.zeros(model.tree.n_v)


def evaluation_seconds(state: State, t: float, evaluations: int) -> float:
    """Seconds of one of so many `evaluations` as integrators make them, without loads."""
    system, q, v = state
    core, _, rows = system.integrated
    return core.time_evaluations(q, v, system.target(t)[rows], evaluations)


def ratios(seconds: Sequence[float], beside: Sequence[float]) -> tuple[float, float]:
    """Ratio of the minima, and median of the ratios of neighbours: when they disagree, the machine was busy."""
    return min(seconds) / min(beside), median(a / b for a, b in zip(seconds, beside, strict=True))
