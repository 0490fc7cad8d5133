"""Small vibrations of an assembly about a state, under its constraints: frequencies, shapes, forces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..model.masses import block_diagonal, system_mass_matrix
from ..model.planar_tree import PlanarTree
from ..model.system import MechanismSystem
from .state import State

RIGID = 1e-9  # of the largest strain of a unit motion, each in units of its spring: below it there is none


@dataclass(frozen=True)
class Vibrations:
    """Modes of M q̈ + D q̇ + K q + C_qᵀ λ = 0, C_q q = 0; frame motions without stiffness are left out.

    frequency ω (n,) rad/s ascending; damping_ratio (n,); shape (coordinates, n), M-orthonormal; force (constraints, n),
    the λ per unit of each mode's coordinate; mass M (coordinates, coordinates).
    """

    frequency: Array
    damping_ratio: Array
    shape: Array
    force: Array
    mass: Array


def vibrations(assembly: MechanismSystem, state: State) -> Vibrations:
    """The constrained vibrations about `state`, with the stiffness of the links alone (no loads, no rotation)."""
    bodies = assembly.model.bodies
    M = system_mass_matrix(assembly, state.q)
    K = _stiffness(assembly)
    D = block_diagonal([block for body in bodies for block in (np.zeros((3, 3)), body.damping)])
    _, _, C_q = assembly.system.constraints(0.0, state.q, np.zeros_like(state.q))
    free = np.linalg.svd(C_q)[2][len(C_q) :].T if len(C_q) else np.eye(len(K))
    L_inverse = np.linalg.inv(np.linalg.cholesky(free.T @ M @ free))
    squares, vectors = np.linalg.eigh(L_inverse @ (free.T @ (K[:, None] * free)) @ L_inverse.T)
    shape = L_inverse.T @ vectors
    stiff = slice(len(squares) - strained(np.diag(K), free), None)
    omega, shape = np.sqrt(squares[stiff]), free @ shape[:, stiff]
    unbalanced = M @ shape * omega**2 - K[:, None] * shape  # = C_qᵀ λ
    force = np.linalg.lstsq(C_q.T, unbalanced, rcond=None)[0] if len(C_q) else np.zeros((0, len(omega)))
    return Vibrations(omega, np.einsum("in,ij,jn->n", shape, D, shape) / (2 * omega), shape, force, M)


def strained(K: Array, free: Array) -> int:
    """How many independent motions of those in the columns of `free` (n, m) strain springs K (n, n).

    Each spring counts by its own size: a soft link beside a stiff one vibrates, however slowly.
    """
    own = np.sqrt(K.diagonal())
    unit = np.divide(1.0, own, out=np.zeros_like(own), where=own > 0.0)
    sizes = np.linalg.svd((unit[:, None] * K * unit) @ free, compute_uv=False)
    return int(np.count_nonzero(sizes > RIGID * sizes.max(initial=0.0)))


def _stiffness(assembly: MechanismSystem) -> Array:
    """Diagonal of K over all coordinates."""
    return np.concatenate([np.concatenate([np.zeros(3), body.stiffness]) for body in assembly.model.bodies])


def modal_excitation(
    assembly: MechanismSystem, state: State, modes: Vibrations, steering: _core.ExternalLoads | None = None
) -> Array:
    """Amplitude (n,) with which each mode rings from `state` on, in the force it moves most, relative to that force.

    A mode at rest follows its load and the links' static deflection under the prescribed motion; the velocity v, the
    acceleration a or the jerk j about that with which it starts is the vibration v/ω, a/ω², j/ω³. What the robot does
    beside following statically is what changes its elastic forces: φᵀ K q̇ = ω² v, and so on.
    """
    q, v = state.q, state.v
    tree = PlanarTree(assembly)
    a, lambda_ = tree.evaluate(0.0, q, v, steering)
    dt = 1e-3 / modes.frequency.max(initial=1.0)
    jerk = (tree.evaluate(dt, q + dt * v, v + dt * a, steering)[0] - a) / dt
    omega, project = modes.frequency, (modes.shape * _stiffness(assembly)[:, None]).T / modes.frequency[:, None] ** 2
    amplitude = np.abs(project @ v) / omega + np.abs(project @ a) / omega**2 + np.abs(project @ jerk) / omega**3
    if not len(lambda_):
        stroke = np.abs(modes.shape).max(axis=0) * amplitude
        result: Array = stroke / max(stroke.max(initial=0.0), 1e-300)
        return result
    forces = np.abs(modes.force) * amplitude
    group = np.array(assembly.groups)
    sizes = np.array([np.abs(lambda_[group == g]).max() + forces[group == g].sum() for g in group])
    sizes = np.maximum(sizes, max(1e-3 * float(sizes.max()), 1e-300))
    result = (forces / sizes[:, None]).max(axis=0)
    return result
