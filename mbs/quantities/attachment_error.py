"""What too few eigenmodes make of a run, as attachment modes tell it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ..model.body import Body
from ..model.known_motion import mass_matrices
from .motion import RobotMotion

JOLT = 0.01  # of the largest deformation: where more begins to ring at once, modes that are not there would ring, too
DEPENDENT, RIGID = 1e-10, 1e-9  # of the largest singular value of C_q, and of the largest ω²


class ModesInMotion(NamedTuple):
    """Of one flexible body: p and p̈ (T, n)."""

    body: Body
    p: Array
    p_ddot: Array


class Start(NamedTuple):
    """First state of a run: M (n_v, n_v), C_q (rows, n_v), accelerations (n_v,), stiffness of coordinates (n_v,)."""

    M: Array
    C_q: Array
    a: Array
    stiffness: Array
    largest: float  # Σ pᵀ K p over the run, J


def mode_error(links: Iterable[ModesInMotion]) -> float | None:
    """Estimated error of moments and deflections for too few modes, of their peaks; None where nothing is known.

    Attachment modes carry what the eigenmodes left out do statically. What these do besides, by their inertia, is at
    most as if they vibrated at the frequency ω_k of the highest eigenmode kept: δp = (1/ω_k² − 1/ω²) p̈, and no more
    than they do at all: the largest p counts where attachment modes ring at their own ω. The estimate is the largest
    √(δpᵀ K δp) of a link against the largest √(pᵀ K p). It is 0.6 to 5 times the error of the worst moment of two-link
    arms with two to six modes, for errors of 2e-7 to 2e-3 (tests/mbs/test_mode_error.py). Modes that
    ring after a jolt (`start_jolt`) and are not there have no part in it: `run.modal_error` sees those, for the price
    of a solve. Nothing is known of links without attachment modes.
    """
    ratios = []
    for body, p, p_ddot in links:
        if not body.attachment_modes or not body.n_eigenmodes:
            return None
        highest = np.sort(body.stiffness)[body.n_eigenmodes - 1]
        late = np.maximum(1.0 / highest - 1.0 / body.stiffness, 0.0)
        most = np.abs(p).max(axis=0, initial=0.0)
        wrong = np.sqrt((np.minimum(late * np.abs(p_ddot), most) ** 2 * body.stiffness).sum(axis=1).max(initial=0.0))
        whole = np.sqrt((p**2 * body.stiffness).sum(axis=1).max(initial=0.0))
        ratios.append(float(wrong / whole) if whole else 0.0)
    return max(ratios, default=None)


def start_jolt(start: Start) -> float:
    """How much of a motion's deformation begins to ring at its start all at once, of the largest there is in it.

    The vibrations φ_i, ω_i of the robot under the constraints of the run, about its first configuration, have of the
    first accelerations those that bend links, z̈_i = φ_iᵀ K q̈/ω_i², and stand z̈_i/ω_i² from where they vibrate about:
    √(Σ (z̈_i/ω_i)²) is compared with the largest √(Σ pᵀ K p) of all links. It is 0 on smooth paths from equilibrium, 0.1
    to 1 where links start undeformed under gravity, or a path with a jump of its acceleration.
    """
    if not start.largest:
        return 0.0
    sizes, directions = np.linalg.svd(start.C_q)[1:]
    free = directions[np.count_nonzero(sizes > DEPENDENT * sizes.max(initial=0.0)) :].T
    inverse = np.linalg.inv(np.linalg.cholesky(free.T @ start.M @ free))
    squares, shapes = np.linalg.eigh(inverse @ (free.T * start.stiffness) @ free @ inverse.T)
    elastic = squares > RIGID * squares.max(initial=0.0)
    squares, shapes = squares[elastic], free @ inverse.T @ shapes[:, elastic]
    accelerations = shapes.T @ (start.stiffness * start.a) / squares
    return float(np.sqrt((accelerations**2 / squares).sum() / start.largest))


def modes_in_motion(motion: RobotMotion) -> Iterator[ModesInMotion]:
    """Of the flexible bodies of a run."""
    for node in motion.model.tree.nodes:
        if node.body.n_modes:
            yield ModesInMotion(node.body, motion.q[:, node.p_q], motion.a[:, node.p_v])


def start_of_motion(motion: RobotMotion) -> Start:
    """Of a run."""
    tree, stiffness = motion.model.tree, np.zeros(motion.model.tree.n_v)
    energy: Array = np.zeros(len(motion.time))
    for node in tree.nodes:
        stiffness[node.p_v] = node.body.stiffness
        energy += motion.q[:, node.p_q] ** 2 @ node.body.stiffness
    (M,) = mass_matrices(motion.model, motion.q[:1], float(motion.time[0]))
    return Start(M, motion.rows[1][0], motion.a[0], stiffness, float(energy.max(initial=0.0)))
