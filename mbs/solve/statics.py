"""Static equilibrium under gravity, given loads and the constraints at one time."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ...common.arrays import Array, as_floats, null_space
from ...common.errors import SolveError, quoted
from ..model.known_motion import KnownStates, State, required_forces
from ..model.model import Model, row_values
from .posture import joint_scales, robot_size, row_sizes, with_rates
from .start import AWAY, undeformed_posture

MOST_ITERATIONS = 60
TOLERANCE = 1e-12  # residual forces relative to the largest of their terms, positions to the size of the robot
LARGEST_STEP = 0.3  # rad, sizes of the robot, and of p the same in sizes of its own
DIFFERENCE = 6e-6  # of natural sizes: central differences of first derivatives
SLACK = 1e-3  # of the largest force over its natural size: less stiffness is none
DEPENDENT = 1e-12  # of the largest singular value of rows: below it they depend on others
UNSTABLE = -1e-5  # of the stiffness of single coordinates: closer to none is rounding of differences


def forces_at_rest(model: Model, q: Array, t: float = 0.0) -> Array:
    """Generalized forces (T, n_v) at rest, of q (T, n_q): gravity, elasticity, given loads."""
    still = np.zeros((len(q), model.tree.n_v))
    return -required_forces(model, KnownStates(q, still, still), np.full(len(q), t))


def initial_state(model: Model) -> State:
    """The state that the scene starts from: links undeformed, or in equilibrium.

    Raises `InputError` where no posture meets the rows, `SolveError` where there is no equilibrium near it.
    """
    start = undeformed_posture(model)
    return static_equilibrium(model, start) if model.scene.initial.state == "static" else start


def hanging_joints(model: Model, start: State) -> Iterator[str]:
    """Warnings where the equilibrium `start` has joints elsewhere than [initial], as nothing keeps them there.

    And where it is unstable.
    """
    if model.scene.initial.state != "static":
        return
    away, length = np.abs(start.q - undeformed_posture(model).q), robot_size(model)
    moved = []
    for node in model.tree.nodes:
        units = node.joint.units or node.joint.guess_units
        ways = np.array([length if unit == "m" else 1.0 for unit in units])
        scales = (
            node.joint.state(ways) if node.joint.units else np.append(ways, np.ones(node.joint.q_count - len(ways)))
        )
        if (away[node.q] / scales).max(initial=0.0) > AWAY:
            moved.append(node.joint.name)
    if moved:
        yield (
            f"starts in the equilibrium in which joints {quoted(moved)} hang, away from [initial]: nothing holds them"
            ' there; state = "undeformed" starts from [initial]'
        )
    yield from unstable_ways(model, start.q, holding_multipliers(model, start.q))


def holding_multipliers(model: Model, q: Array) -> Array:
    """λ (rows,) with C_vᵀλ = Q at rest at q (n_q,), t = 0; of least size where rows depend on others."""
    C_v = row_values(model, q[None], np.zeros(1))[1][0]
    return _least_multipliers(C_v, forces_at_rest(model, q[None])[0], natural_sizes(model), row_sizes(model))


def static_equilibrium(model: Model, start: State, t: float = 0.0) -> State:
    """Solve Q(q, t) − C_vᵀλ = 0, C(q, t) = 0 by Newton from `start`; v is kept on Ċ = 0.

    Raises `SolveError` where there is no equilibrium near the start.
    """
    tree, n, m = model.tree, model.tree.n_v, len(model.rows)
    sizes, row_scales = natural_sizes(model), row_sizes(model)
    q = start.q
    C_v = row_values(model, q[None], np.array([t]))[1][0]
    multipliers = _least_multipliers(C_v, forces_at_rest(model, q[None], t)[0], sizes, row_scales)
    for _ in range(MOST_ITERATIONS):
        residual, size = _residual(model, q[None], t, multipliers, row_scales)
        if np.abs(residual[0, :n] * sizes).max(initial=0.0) <= TOLERANCE * size and (
            not m or np.abs(residual[0, n:]).max() <= TOLERANCE
        ):
            return with_rates(model, q, start.v, t)
        jacobian = _jacobian(model, q, t, multipliers, sizes, row_scales)
        step = -_equilibrated_solution(jacobian, residual[0] * np.concatenate([sizes, np.ones(m)]))
        if not np.all(np.isfinite(step)):
            break
        step *= min(1.0, LARGEST_STEP / max(float(np.abs(step[:n]).max()), 1e-300))
        q, multipliers = tree.integrate(q, step[:n] * sizes), multipliers + step[n:] * _force_scale(size, row_scales)
    raise SolveError(
        f"{model.scene.path}: no static equilibrium was found near the initial posture. Without motors or trajectories,"
        " or with links too soft for their loads, there may be none; else give joint coordinates closer to it"
    )


def unstable_ways(model: Model, q: Array, multipliers: Array) -> Iterator[str]:
    """A warning where the equilibrium at q (n_q,), t = 0, with λ (rows,) is left at the slightest push.

    There the derivative of the forces that lead back has a negative eigenvalue on what the rows leave free.
    """
    tree, n, row_scales = model.tree, model.tree.n_v, row_sizes(model)
    jacobian = _jacobian(model, q, 0.0, multipliers, natural_sizes(model), row_scales)
    K, size = -jacobian[:n, :n], _residual(model, q[None], 0.0, multipliers, row_scales)[1]
    scale = 1 / np.sqrt(np.maximum(np.abs(np.diag(K)), max(SLACK * size, 1e-300)))
    free = null_space(jacobian[n:, :n] * scale, DEPENDENT) if len(model.rows) else np.eye(n)
    found, shapes = np.linalg.eig(free.T @ (K * scale * scale[:, None]) @ free)
    if not len(found) or found.real.min() > UNSTABLE:
        return
    moved = np.abs(free @ shapes[:, found.real.argmin()])
    node = max(tree.nodes, key=lambda node: float(moved[np.r_[node.v, node.p_v]].max(initial=0.0)))
    bends = moved[node.p_v].max(initial=0.0) > moved[node.v].max(initial=0.0)
    what = f'"{node.body.name}" buckles' if bends else f'joint "{node.joint.name}" leaves it; start near another one'
    yield f"the equilibrium is unstable: at the slightest push {what}"


def natural_sizes(model: Model) -> Array:
    """(n_v,) natural sizes: 1 rad or the robot's size of joints, √J of modes, bent by about their length."""
    sizes = joint_scales(model)
    for node in model.tree.nodes:
        sizes[node.p_v] = np.sqrt(node.body.largest_moment)
    return sizes


def _least_multipliers(C_v: Array, Q: Array, sizes: Array, row_scales: Array) -> Array:
    """λ (rows,) with C_vᵀλ = Q (n_v,), of least work on natural motions where rows depend on others."""
    work = (C_v / row_scales[:, None] * sizes).T
    return np.asarray(np.linalg.lstsq(work, Q * sizes, rcond=1e-12)[0] / row_scales)


def _equilibrated_solution(A: Array, b: Array) -> Array:
    """Solution of A x = b, the least where A is singular; rows and columns scaled to 1, since forces have a unit."""
    rows = np.abs(A).max(axis=1, initial=0.0)
    rows[rows == 0.0] = 1.0
    columns = np.linalg.norm(A / rows[:, None], axis=0)
    columns[columns == 0.0] = 1.0
    scaled = A / rows[:, None] / columns
    return np.asarray(np.linalg.lstsq(scaled, b / rows, rcond=1e-14)[0] / columns)


def _force_scale(size: float, row_scales: Array) -> Array:
    return as_floats(max(size, 1e-300) / row_scales)


def _residual(model: Model, q: Array, t: float, multipliers: Array, row_scales: Array) -> tuple[Array, float]:
    """(T, n_v + rows): forces left, and C over its natural sizes; and the size of the largest force term."""
    C, C_v = row_values(model, q, np.full(len(q), t))
    Q, held, sizes = forces_at_rest(model, q, t), np.einsum("tij,i->tj", C_v, multipliers), natural_sizes(model)
    elastic = np.zeros_like(Q)  # in equilibrium Q is nothing but rounding where no row holds anything
    for node in model.tree.nodes:
        elastic[:, node.p_v] = node.body.stiffness * q[:, node.p_q]
    size = max(float(np.abs(force * sizes).max(initial=0.0)) for force in (Q + elastic, elastic, held))
    if not any(node.body.n_modes for node in model.tree.nodes):  # where rigid bodies hang, all of them are
        weight = float(np.linalg.norm(model.scene.gravity)) * sum(node.body.mass for node in model.tree.nodes)
        size = max(size, weight * robot_size(model))
    return np.concatenate([Q - held, C / row_scales], axis=1), size


def _jacobian(model: Model, q: Array, t: float, multipliers: Array, sizes: Array, row_scales: Array) -> Array:
    """Derivative of the residual, forces times `sizes`, by steps in natural sizes (differences) and multipliers."""
    n, m, tree = model.tree.n_v, len(model.rows), model.tree
    ahead, behind = (
        _residual(model, tree.integrate(q, sign * DIFFERENCE * np.diag(sizes)), t, multipliers, row_scales)[0]
        for sign in (1.0, -1.0)
    )
    by_q = ((ahead - behind) / (2 * DIFFERENCE)).T
    C_v = row_values(model, q[None], np.array([t]))[1][0]
    _, size = _residual(model, q[None], t, multipliers, row_scales)
    by_multipliers = np.concatenate([-C_v.T * _force_scale(size, row_scales), np.zeros((m, m))])
    scaled = np.concatenate([by_q[:n] * sizes[:, None], by_q[n:]])
    return np.hstack([scaled, np.concatenate([by_multipliers[:n] * sizes[:, None], by_multipliers[n:]])])
