"""Static equilibrium under gravity, given loads and the trajectory constraints at t = 0."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..errors import SolveError
from .initial_state import State, with_rates
from .model import Array, Assembly

MOST_ITERATIONS = 60
TOLERANCE = 1e-12  # residual forces relative to the largest of their terms, positions to the size of the robot
ROUNDING = 4e-16  # steps this small, relative to the size of the robot, are no steps
LARGEST_STEP = 0.5  # relative likewise: keeps to the branch of the start


def static_equilibrium(assembly: Assembly, start: State) -> State:
    """Solve Q(q) − C_qᵀλ = 0, C(q, 0) = 0 by Newton from `start`; returns the state (v kept on Ċ = 0).

    The Jacobian is taken by central differences: convergence is to the exact residual, the slope only sets the pace.
    Raises `SolveError` where the robot has no equilibrium near the start.
    """
    system, n = assembly.system, assembly.system.coordinates
    rest, sizes = np.zeros(n), assembly.sizes

    def residual(x: Array) -> tuple[Array, float]:
        C, _, C_q = system.constraints(0.0, x[:n], rest)
        Q, constraint_forces = system.force_at_rest(0.0, x[:n]), C_q.T @ x[n:]
        size = max(float(np.abs(Q).max()), float(np.abs(constraint_forces).max(initial=0.0)))
        return np.concatenate([Q - constraint_forces, C]), size

    _, _, C_q = system.constraints(0.0, start.q, rest)
    multipliers = np.linalg.lstsq(C_q.T, system.force_at_rest(0.0, start.q), rcond=None)[0]
    x, largest = np.concatenate([start.q, multipliers]), np.inf
    for _ in range(MOST_ITERATIONS):
        r, size = residual(x)
        closed = np.abs(r[n:] / assembly.row_sizes).max(initial=0.0) <= TOLERANCE
        if closed and (np.abs(r[:n]).max() <= TOLERANCE * size or largest <= ROUNDING):
            return with_rates(assembly, x[:n], start.v)
        steps = 1e-6 * np.concatenate([np.maximum(sizes, np.abs(x[:n])), np.maximum(np.abs(x[n:]), size)])
        try:
            step = np.linalg.solve(_jacobian(lambda y: residual(y)[0], x, steps), r)
        except np.linalg.LinAlgError:
            break
        largest = float(np.abs(step[:n] / sizes).max())
        x = x - step * min(1.0, LARGEST_STEP / largest if largest else 1.0)
        if not np.all(np.isfinite(x)):
            break
    raise SolveError(
        f"{assembly.model.scene.path}: no static equilibrium was found near the initial angles: a robot without"
        " motors or trajectories may have none there; give angles closer to it"
    )


def _jacobian(function: Callable[[Array], Array], x: Array, steps: Array) -> Array:
    """Central differences, column by column."""
    columns = []
    for i, h in enumerate(steps):
        up, down = x.copy(), x.copy()
        up[i] += h
        down[i] -= h
        columns.append((function(up) - function(down)) / (2 * h))
    return np.column_stack(columns)
