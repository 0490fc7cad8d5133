"""What too few eigenmodes make of a run, as attachment modes tell it."""

from __future__ import annotations

import numpy as np

from ..analysis.outcome import Outcome
from ..model.masses import system_mass_matrix

JOLT = 0.01  # of the largest deformation: where more begins to ring at once, modes that are not there would ring, too
DEPENDENT, RIGID = 1e-10, 1e-9  # of the largest singular value of C_q, and of the largest ω²


def mode_error(outcome: Outcome) -> float | None:
    """Estimated error of moments and deflections for too few modes, of their peaks; None where nothing is known.

    Attachment modes carry what the eigenmodes left out do statically. What these do besides, by their inertia, is at
    most as if they vibrated at the frequency ω_k of the highest eigenmode kept: δp = (1/ω_k² − 1/ω²) p̈. The estimate
    is the largest √(δpᵀ K δp) of a link against the largest √(pᵀ K p). It is 0.3 to 3.5 times the error of the worst
    moment of two-link arms with two to six modes, for errors of 2e-7 to 1e-3 (tests/mbs/test_mode_error.py). Modes that
    ring after a jolt (`start_jolt`) and are not there have no part in it: `run.modal_error` sees those, for the price
    of a solve. Nothing is known of links without attachment modes.
    """
    ratios = []
    for body in outcome.assembly.model.links:
        if not body.n_modes:
            continue
        if not body.attachment_modes or not body.n_eigenmodes:
            return None
        highest = np.sort(body.stiffness)[body.n_eigenmodes - 1]
        late = np.maximum(1.0 / highest - 1.0 / body.stiffness, 0.0)
        columns = outcome.coordinates(body.name)
        p, p_ddot = outcome.q[:, columns][:, 3:], outcome.a[:, columns][:, 3:]
        wrong = np.sqrt(((late * p_ddot) ** 2 * body.stiffness).sum(axis=1).max(initial=0.0))
        whole = np.sqrt((p**2 * body.stiffness).sum(axis=1).max(initial=0.0))
        ratios.append(float(wrong / whole) if whole else 0.0)
    return max(ratios, default=None)


def start_jolt(outcome: Outcome) -> float:
    """How much of a motion's deformation begins to ring at its start all at once, of the largest there is in it.

    The vibrations φ_i, ω_i of the robot under the constraints of the run, about its first configuration, have of the
    first accelerations z̈_i = φ_iᵀ M q̈, and stand z̈_i/ω_i² from equilibrium: √(Σ (z̈_i/ω_i)²) is compared with the
    largest √(Σ pᵀ K p) of all links. It is 0 on smooth paths from equilibrium, 0.1 to 1 where links start undeformed
    under gravity, or a path with a jump of its acceleration.
    """
    assembly, bodies = outcome.assembly, outcome.assembly.model.bodies
    stiffness = np.concatenate([np.append(np.zeros(3), body.stiffness) for body in bodies])
    largest = float((outcome.q**2 @ stiffness).max(initial=0.0))
    if not largest:
        return 0.0
    C_q = assembly.system.constraint_jacobians(outcome.q[:1])[0]
    _, sizes, directions = np.linalg.svd(C_q)
    free = directions[np.count_nonzero(sizes > DEPENDENT * sizes.max(initial=0.0)) :].T
    M = system_mass_matrix(assembly, outcome.q[0])
    inverse = np.linalg.inv(np.linalg.cholesky(free.T @ M @ free))
    squares, shapes = np.linalg.eigh(inverse @ (free.T * stiffness) @ free @ inverse.T)
    accelerations = shapes.T @ inverse @ free.T @ M @ outcome.a[0]
    elastic = squares > RIGID * squares.max(initial=0.0)
    return float(np.sqrt((accelerations[elastic] ** 2 / squares[elastic]).sum() / largest))
