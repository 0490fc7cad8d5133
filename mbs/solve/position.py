"""Positions and rates that meet the constraints: Newton's method on the frames, deformations kept."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, as_floats
from ..model.system import MechanismSystem
from .state import State

TOLERANCE = 1e-13  # of constraints, relative to the size of the robot
SINGULAR = 1e-6  # ratio of singular values below which a configuration counts as singular
MOST_ITERATIONS = 50
LARGEST_TURN = 0.5  # rad (and sizes of the robot) a Newton step may move: keeps to the branch of the guess


def solve_positions(assembly: MechanismSystem, t: float, q: Array) -> Array | None:
    """Q (coordinates,) with (R, θ) moved onto C(q, t) = 0 by steps of least size, p kept.

    None where that does not converge.
    """
    system, r, scales, measure_scales = (
        assembly.system,
        assembly.frame_coordinates,
        assembly.scales,
        assembly.measure_scales,
    )
    rest = np.zeros(system.coordinates)
    for _ in range(MOST_ITERATIONS):
        C, _, C_q = system.constraints(t, q, rest)
        size = 1.0 + np.abs(q / scales).max(initial=0.0)
        left = np.abs(C / measure_scales).max(initial=0.0)
        if left <= TOLERANCE * size:
            return q
        if not np.isfinite(left):
            return None
        step = _least_step(assembly, C_q, C)
        largest = np.abs(step / scales[r]).max()
        change = np.zeros(system.coordinates)
        change[r] = -step * min(1.0, LARGEST_TURN * size / largest) if largest else -step
        q = q + change
    return q if left <= 1e3 * TOLERANCE * size else None


def with_rates(assembly: MechanismSystem, q: Array, v: Array) -> State:
    """The state at q with (Ṙ, θ̇) moved onto Ċ = 0 by the least change, ṗ kept."""
    _, rate, C_q = assembly.system.constraints(0.0, q, v)
    v = v.copy()
    v[assembly.frame_coordinates] -= _least_step(assembly, C_q, rate)
    return State(q, v)


def frame_gradients(assembly: MechanismSystem, t: float, q: Array) -> Array:
    """∂C/∂(R, θ), (constraints, 3 bodies), relative to the natural sizes of both: the same in all units."""
    _, _, C_q = assembly.system.constraints(t, q, np.zeros_like(q))
    return _on_frames(assembly, C_q)


def _on_frames(assembly: MechanismSystem, C_q: Array) -> Array:
    r = assembly.frame_coordinates
    J: Array = C_q[:, r] * assembly.scales[r] / assembly.measure_scales[:, None]
    return J


def rank_ratio(assembly: MechanismSystem, t: float, q: Array) -> float:
    """Ratio of singular values of C_q: 0 where the mechanism has lost a direction that its constraints need.

    Of the mechanism with rigid links where it follows trajectories: that modes could give way does not count. A loop
    that only closes may well need them.
    """
    _, _, C_q = assembly.system.constraints(t, q, np.zeros_like(q))
    if not len(C_q):
        return 1.0
    J = C_q * assembly.scales / assembly.measure_scales[:, None]
    if any(assembly.is_trajectory) and len(J) <= len(assembly.frame_coordinates):
        J = J[:, assembly.frame_coordinates]
    values = np.linalg.svd(J, compute_uv=False)
    return float(values[-1] / values[0])


def _least_step(assembly: MechanismSystem, C_q: Array, residual: Array) -> Array:
    """The smallest change of (R, θ), (3 bodies,), that takes `residual` off C (or, as a rate, off Ċ)."""
    J = _on_frames(assembly, C_q)
    step = as_floats(np.linalg.lstsq(J, residual / assembly.measure_scales, rcond=None)[0])
    return step * assembly.scales[assembly.frame_coordinates]
