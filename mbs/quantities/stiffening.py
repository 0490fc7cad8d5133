"""What the loads of a run do to the stiffness of links."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.plane import rotated
from ..analysis.outcome import Outcome
from ..model.geometric_stiffening import GeometricStiffening

NOTABLE = 0.01  # relative change of a mode's stiffness from which on the summary warns, and "auto" switches it on


def stiffness_changes(outcome: Outcome, stiffening: Mapping[str, GeometricStiffening | None]) -> dict[str, float]:
    """Largest relative change of a mode's stiffness by the loads of a run, by body, whether it was on or not.

    `stiffening` by the names of bodies; those without have no entry. Loads are those of θ̇², of the frame's acceleration
    less gravity, of θ̈, and of the constraints.
    """
    assembly, gravity = outcome.assembly, np.array(outcome.assembly.model.scene.gravity)
    wrenches = assembly.constraint_wrenches(outcome.q, outcome.lambda_)
    changes = {}
    for body in assembly.model.bodies:
        known = stiffening.get(body.name)
        if known is None or not body.n_modes:
            continue
        columns = outcome.coordinates(body.name)
        q, v, a = outcome.q[:, columns], outcome.v[:, columns], outcome.a[:, columns]
        diagonal = np.outer(v[:, 2] ** 2, np.diag(known.K_omega)) - np.outer(a[:, 2], np.diag(known.K_h))
        pull = rotated(-q[:, 2], gravity - a[:, :2])
        diagonal += pull @ np.einsum("kii->ki", known.K_s)
        for point, wrench in wrenches.get(body.name, {}).items():
            if point in known.K_points:
                loads = np.column_stack([rotated(-q[:, 2], wrench[:, :2]), wrench[:, 2]])
                diagonal += loads @ np.einsum("kii->ki", known.K_points[point])
        changes[body.name] = float((np.abs(diagonal) / body.stiffness).max(initial=0.0))
    return changes
