"""Static equilibrium under gravity, given loads and the trajectory constraints at t = 0."""

from __future__ import annotations

import numpy as np

from ..errors import SolveError
from . import _core
from .initial_state import State
from .model import Array, Assembly

MOST_ITERATIONS = 60
TOLERANCE = 1e-12  # residual forces relative to the largest of their terms


def static_equilibrium(assembly: Assembly, start: State) -> State:
    """Solve Q(q) − C_qᵀλ = 0, C(q, 0) = 0 by Newton from `start`; returns the state (v kept on Ċ = 0).

    Raises `SolveError` where the robot has no equilibrium near the start.
    """
    system, n = assembly.system, assembly.system.coordinates
    rest = np.zeros(n)

    def residual(x: Array) -> tuple[Array, float]:
        C, _, C_q = system.constraints(0.0, x[:n], rest)
        Q, constraint_forces = system.force_at_rest(0.0, x[:n]), C_q.T @ x[n:]
        size = max(1e-9, float(np.abs(Q).max()), float(np.abs(constraint_forces).max(initial=0.0)))
        return np.concatenate([Q - constraint_forces, C]), size

    _, _, C_q = system.constraints(0.0, start.q, rest)
    multipliers = np.linalg.lstsq(C_q.T, system.force_at_rest(0.0, start.q), rcond=None)[0]
    x = np.concatenate([start.q, multipliers])
    for _ in range(MOST_ITERATIONS):
        r, size = residual(x)
        if np.abs(r[:n]).max() <= TOLERANCE * size and np.abs(r[n:]).max(initial=0.0) <= TOLERANCE:
            return _with_rates(assembly, x[:n], start.v)
        try:
            step = np.linalg.solve(_jacobian(assembly, x), r)
        except np.linalg.LinAlgError:
            break
        turn = np.abs(step[:n]).max()
        x = x - step * min(1.0, 0.5 / turn if turn else 1.0)
        if not np.all(np.isfinite(x)):
            break
    raise SolveError(
        f"{assembly.model.scene.path}: no static equilibrium was found near the initial angles: a robot without"
        " motors or trajectories may have none there; give angles closer to it"
    )


def _with_rates(assembly: Assembly, q: Array, v: Array) -> State:
    """(Ṙ, θ̇) moved onto Ċ = 0 at the deformed configuration, ṗ kept."""
    _, rate, C_q = assembly.system.constraints(0.0, q, v)
    r = assembly.rigid_coordinates
    v = v.copy()
    v[r] -= np.linalg.lstsq(C_q[:, r], rate, rcond=None)[0]
    return State(q, v)


def _jacobian(assembly: Assembly, x: Array) -> Array:
    """Exact derivative of Q − C_qᵀλ and C with respect to (q, λ), at rest."""
    n, rest = assembly.system.coordinates, np.zeros(assembly.system.coordinates)
    _, _, K, C_q = _core.tangent(assembly.system, 0.0, x[:n], rest, rest, x[n:], [])
    return np.block([[-K, -C_q.T], [C_q, np.zeros((len(C_q), len(C_q)))]])
