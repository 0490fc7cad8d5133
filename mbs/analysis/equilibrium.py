"""Equilibrium under gravity, loads and the trajectories at t = 0."""

from __future__ import annotations

import time

import numpy as np

from ..model.gears import with_prescribed_motors
from ..scene.analysis import Analysis
from ..solve.redundancy import resolved
from ..solve.start import undeformed_posture
from ..solve.statics import holding_multipliers, static_equilibrium, unstable_ways
from .context import Context
from .outcome import Motion, Outcome, Statistics


def run_static(context: Context, analysis: Analysis) -> Outcome:
    """The equilibrium at the one time t = 0: at rest, however fast the trajectories are there.

    Raises `SolveError` where there is none.
    """
    began = time.perf_counter()
    model = with_prescribed_motors(resolved(context.model, analysis.last_time))
    q = static_equilibrium(model, undeformed_posture(model)).q[None]
    at_rest, times = np.zeros((1, model.tree.n_v)), np.zeros(1)
    multipliers = holding_multipliers(model, q[0])
    return Outcome(
        analysis=analysis,
        model=model,
        motion=Motion(times, q, at_rest, at_rest, multipliers[None], is_at_rest=True),
        statistics=Statistics(
            wall_seconds=time.perf_counter() - began, warnings=tuple(unstable_ways(model, q[0], multipliers))
        ),
    )
