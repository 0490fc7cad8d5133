"""Modes of a robot linear about a posture, poles and shapes of z̈ + D̂ ż + K̂ z = 0, and damping of links by them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ...common.arrays import Array, ComplexArray, Indices, as_floats
from ..model.body import Body
from ..model.model import Model, without_paths
from .start import undeformed_posture
from .vibration import vibrations_of, without_rows

RIGID = 1e-6  # of the highest frequency, below which a mode counts as without stiffness: round-off of a double zero


@dataclass(frozen=True)
class RobotModes:
    """The f modes of a robot, slowest first; two real poles that follow each other make one.

    Attributes:
        poles: (f, 2) complex, 1/s.
        shape: (f, f) complex, δs of the first pole's eigenvector by mode, of unit kinetic amplitude (δsᴴ M δs = 1) and
            with its largest entry real.
        motion: (f, coordinates) complex, the same as δq of all bodies.
        rounding: 1/s, by which a double pole at 0 may be off: `RIGID` √max(‖K̂‖, ‖D̂‖).
    """

    poles: ComplexArray
    shape: ComplexArray
    motion: ComplexArray
    rounding: float

    @property
    def frequency(self) -> Array:
        """(f,) √(λ₁ λ₂)/2π, Hz: the undamped one; 0 where the robot moves without stiffness, or falls."""
        omega = np.sqrt(self.poles.prod(axis=1).real.clip(min=0.0))
        result: Array = np.where(omega < RIGID * omega.max(initial=0.0), 0.0, omega) / (2 * np.pi)
        return result

    @property
    def growth(self) -> float:
        """The largest real part of a pole, 1/s; 0 where it is round-off: the robot falls or is driven to vibrate."""
        largest = float(self.poles.real.max(initial=0.0))
        return largest if largest > self.rounding else 0.0

    @property
    def damping_ratio(self) -> Array:
        """(f,) −(λ₁ + λ₂)/2ω; nan where the frequency is 0."""
        omega = 2 * np.pi * self.frequency
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio: Array = np.where(omega > 0.0, -self.poles.sum(axis=1).real / (2 * omega), np.nan)
        return ratio


def robot_modes(K: Array, D: Array, back: Array, transformation: Array) -> RobotModes:
    """Poles and shapes of z̈ + D̂ ż + K̂ z = 0.

    K̂ and D̂ are (f, f); `back` (s, f) takes z to δs, and `transformation` (coordinates, s) takes δs to δq.
    """
    f = len(K)
    if np.any(D):
        poles, vectors = np.linalg.eig(np.block([[np.zeros((f, f)), np.eye(f)], [-K, -D]]))
        pairs = _pairs(poles)
        poles, Z = poles[pairs], vectors[:f, pairs[:, 0]]
    else:  # s² of the undamped robot: half the size, and a double pole at 0 stays one
        squares, Z = np.linalg.eig(-K)
        roots = np.sqrt(squares.astype(complex))
        order = np.argsort(np.abs(roots))
        poles, Z = np.column_stack([roots, -roots])[order], Z[:, order].astype(complex)
    largest = np.take_along_axis(Z, np.abs(Z).argmax(axis=0)[None], axis=0) if f else Z[:0]
    Z = Z * (np.abs(largest) / largest) / np.linalg.norm(Z, axis=0)
    shape = (back @ Z).T
    motion = shape @ transformation.T
    rounding = RIGID * float(np.sqrt(max(np.abs(K).max(initial=0.0), np.abs(D).max(initial=0.0))))
    return RobotModes(poles, np.asarray(shape, dtype=complex), np.asarray(motion, dtype=complex), rounding)


def _pairs(poles: ComplexArray) -> Indices:
    """Numbers (f, 2) of poles that belong together: conjugates, and real ones in the order of their size."""
    complex_ones = np.flatnonzero(poles.imag > 0.0)
    conjugates = [int(np.abs(poles - poles[i].conjugate()).argmin()) for i in complex_ones]
    real = np.flatnonzero(poles.imag == 0.0)
    real = real[np.argsort(np.abs(poles[real]))]
    pairs = np.vstack([np.column_stack([complex_ones, conjugates]), real.reshape(-1, 2)]).astype(np.intp)
    return pairs[np.argsort(np.abs(poles[pairs].prod(axis=1)))]


def with_robot_damping(model: Model, ratios: Mapping[str, float]) -> Model:
    """The robot with links so damped that its vibrations have the damping ratios ζ, given by body, where all agree.

    At the initial posture, motors free, gears rigid. Bodies not named keep the damping that they have.
    """
    if not ratios:
        return model
    start, tree = undeformed_posture(model), model.tree
    modes = vibrations_of(without_paths(model), without_rows(model), 0.0, start.q)
    wanted = unit_damping(modes.frequency, modes.shape[~tree.joint_columns])
    bodies = _damped([node.body for node in tree.nodes], wanted, ratios)
    return replace(model, tree=tree.with_bodies(bodies))


def unit_damping(frequency: Array, shape: Array) -> Array:
    """D (modes of all bodies)², 1/s, under which all vibrations have the damping ratio 1: ΦᵀDΦ = diag(2ω).

    Rigid motion is free of it; motion of p that the joints do not allow, too.

    Args:
        frequency: ω (n,) rad/s of the vibrations.
        shape: Φ (modes of all bodies, n), the rows p of their M-orthonormal shapes, body by body.
    """
    inverse = np.linalg.pinv(shape)
    return as_floats(inverse.T @ (2 * frequency[:, None] * inverse))


def _damped(bodies: Sequence[Body], wanted: Array, ratios: Mapping[str, float]) -> tuple[Body, ...]:
    """With their blocks on the diagonal of `wanted` (modes of all bodies)², ζ times; bodies not named as they are."""
    ends = np.cumsum([0, *(body.n_modes for body in bodies)])
    return tuple(
        replace(body, damping=ratios[body.name] * wanted[first:last, first:last]) if body.name in ratios else body
        for body, (first, last) in zip(bodies, pairwise(ends), strict=True)
    )
