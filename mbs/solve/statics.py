"""Static equilibrium under gravity, given loads and the trajectory constraints at t = 0."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.errors import SolveError
from ..model.system import MechanismSystem
from .absolute_linearisation import ForcesOfMotion
from .position import with_rates
from .state import State

MOST_ITERATIONS = 60
TOLERANCE = 1e-12  # residual forces relative to the largest of their terms, positions to the size of the robot
ROUNDING = 4e-16  # steps this small, relative to the size of the robot, are no steps
LARGEST_STEP = 0.5  # relative likewise: keeps to the branch of the start


def static_equilibrium(assembly: MechanismSystem, start: State) -> State:
    """Solve Q(q) − C_qᵀλ = 0, C(q, 0) = 0 by Newton from `start`; returns the state (v kept on Ċ = 0).

    Raises `SolveError` where the robot has no equilibrium near the start.
    """
    system, n = assembly.system, assembly.system.coordinates
    rest, sizes = np.zeros(n), assembly.scales
    forces: ForcesOfMotion | None = None  # made once, where a step is made

    def residual(q: Array, multipliers: Array) -> tuple[Array, float]:
        C, _, C_q = system.constraints(0.0, q, rest)
        Q, constraint_forces = system.force_at_rest(0.0, q), C_q.T @ multipliers
        size = max(float(np.abs(Q).max()), float(np.abs(constraint_forces).max(initial=0.0)))
        return np.concatenate([Q - constraint_forces, C]), size

    q, largest = start.q, np.inf
    _, _, C_q = system.constraints(0.0, q, rest)
    multipliers = as_floats(np.linalg.lstsq(C_q.T, system.force_at_rest(0.0, q), rcond=None)[0])
    for _ in range(MOST_ITERATIONS):
        r, size = residual(q, multipliers)
        closed = np.abs(r[n:] / assembly.measure_scales).max(initial=0.0) <= TOLERANCE
        if closed and (np.abs(r[:n]).max() <= TOLERANCE * size or largest <= ROUNDING):
            return with_rates(assembly, q, start.v)
        forces = forces or _forces(assembly)
        try:
            step = np.linalg.solve(_jacobian(assembly, forces, q, multipliers), r)
        except np.linalg.LinAlgError:
            break
        largest = float(np.abs(step[:n] / sizes).max())
        change = -step * min(1.0, LARGEST_STEP / largest if largest else 1.0)
        q, multipliers = q + change[:n], multipliers + change[n:]
        if not np.all(np.isfinite(change)):
            break
    raise SolveError(
        f"{assembly.model.scene.path}: no static equilibrium was found near the initial angles: a robot without"
        " motors or trajectories may have none there; give angles closer to it"
    )


def _forces(assembly: MechanismSystem) -> ForcesOfMotion:
    model = replace(assembly.model, loads=assembly.drives)
    return ForcesOfMotion(model, [constraint.measure for constraint in assembly.constraints])


def _jacobian(assembly: MechanismSystem, forces: ForcesOfMotion, q: Array, multipliers: Array) -> Array:
    """Exact derivative of Q − C_qᵀλ and C with respect to (q, λ), at rest."""
    rest = np.zeros_like(q)
    K = forces.at(0.0, q, rest, -multipliers).stiffness(rest)
    C_q = assembly.system.constraints(0.0, q, rest)[2]
    return np.block([[-K, -C_q.T], [C_q, np.zeros((len(C_q), len(C_q)))]])
