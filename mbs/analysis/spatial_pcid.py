"""Partially constrained inverse dynamics in space: joints and trajectories hold, p is free (Shaban 2022, sec. 5)."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, as_list
from ...common.errors import SolveError
from .. import _core
from ..model.spatial_model import SpatialModel, row_values, target_rates
from ..model.spatial_system import SpatialSystem
from ..scene.analysis import IntegratedAnalysis
from ..solve.integrators import METHODS
from ..solve.spatial_posture import check_path, undeformed_posture
from ..solve.spatial_statics import static_equilibrium
from .drive import STATUS


@dataclass(frozen=True)
class SpatialRun:
    """What an integration in space found, at outputs as far as it got.

    Attributes:
        analysis: that asked for it.
        time: (T,) s.
        q, v, a: (T, n_q), (T, n_v), (T, n_v) of the model's tree.
        multipliers: (T, rows).
        frames: by body in the order of the tree, R̈ and α (T, 3) of its frame, global axes.
        energy: (T, 3) kinetic, strain, gravitational, J.
        violation: (T, 2) of positions (m, rad) and their rates, the largest of all rows.
        status: how it ended.
        integrator: its name.
        steps, evaluations: how many.
        wall_seconds: of integration and outputs.
        warnings: on what is left open.
    """

    analysis: IntegratedAnalysis
    time: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    frames: Sequence[tuple[Array, Array]]
    energy: Array
    violation: Array
    status: str
    integrator: str
    steps: int
    evaluations: int
    wall_seconds: float
    warnings: tuple[str, ...]

    def check_completed(self, path: object) -> None:
        """Raise `SolveError` where it ended early."""
        if self.status != "completed":
            reached = self.time[-1] if len(self.time) else 0.0
            raise SolveError(
                f'{path}: analysis "{self.analysis.name}": ended at t = {reached:g} s: {self.status}; outputs up to'
                " there are kept"
            )


def run_spatial_pcid(model: SpatialModel, analysis: IntegratedAnalysis) -> SpatialRun:
    """C_m and C_s hold, p is free.

    Raises `InputError` where the trajectories cannot be followed, `SolveError` where there is no equilibrium to start
    from.
    """
    start = undeformed_posture(model)
    warnings = tuple(check_path(model, start.q))
    if model.scene.initial.state == "static":
        start = static_equilibrium(model, start)
    system, began = SpatialSystem(model), time.perf_counter()
    integrator = INTEGRATORS[analysis.integrator]
    controls = _core.IntegrationControls(
        tolerance=analysis.tolerance,
        max_steps=analysis.max_steps,
        methods=[(METHODS[integrator], 1.0, 0.0)],
        spectral_radius=analysis.spectral_radius,
    )
    (status, steps, evaluations), states, a, multipliers = _core.tree_motion(
        system.core, system.scene, as_list(analysis.times), start.q, start.v, controls
    )
    q, v = (np.ascontiguousarray(part) for part in np.split(states, [model.tree.n_q], axis=1))
    times = analysis.times[: len(q)]
    frames, energy = _observed(system, times, q, v)
    return SpatialRun(
        analysis, times, q, v, a, multipliers, frames, energy, _violation(model, times, q, v),
        STATUS[status], integrator, steps, evaluations, time.perf_counter() - began, warnings,
    )  # fmt: skip


INTEGRATORS = {"auto": "dop853", **{name: name for name in METHODS}}
"""The method that stands behind each name in scenes."""


def _observed(system: SpatialSystem, times: Array, q: Array, v: Array) -> tuple[list[tuple[Array, Array]], Array]:
    """R̈ and α (T, 3) of each body's frame, and energies (T, 3)."""
    bodies = len(system.model.tree.nodes)
    R_2dot, alpha, energy = (
        np.zeros((bodies, len(times), 3)),
        np.zeros((bodies, len(times), 3)),
        np.zeros((len(times), 3)),
    )
    for k, t in enumerate(times):
        system.core.evaluate(q[k], v[k], system.target(float(t)), system.force(float(t)), None)
        for number, frame in enumerate(system.core.frames(q[k], v[k])):
            R_2dot[number, k], alpha[number, k] = frame.a, frame.alpha
        totals = system.core.totals(q[k], v[k])
        energy[k] = totals.kinetic, totals.strain, totals.gravitational
    return [(R_2dot[number], alpha[number]) for number in range(bodies)], energy


def _violation(model: SpatialModel, times: Array, q: Array, v: Array) -> Array:
    """(T, 2) largest of |C| and |Ċ|."""
    if not model.rows:
        return np.zeros((len(times), 2))
    C, C_v = row_values(model, q, times)
    rate = np.einsum("tij,tj->ti", C_v, v) - target_rates(model, q, times)
    return np.stack([np.abs(C).max(axis=1), np.abs(rate).max(axis=1)], axis=1)
