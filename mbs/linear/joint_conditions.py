"""A robot whose motors stand still: natural frequencies, shapes, and static compliance at points. SI units.

With the coordinates of motors fixed, R δs = 0, the linear equations M δs̈ + D δṡ + K δs = F are those of δs = N δz:

    NᵀM N δz̈ + NᵀD N δż + NᵀK N δz = NᵀF,      compliance at a point with δx = J δs:  C = J N (NᵀK N)⁻¹ NᵀJᵀ.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, ComplexArray, Indices, null_space
from ...common.structs import struct
from .linearisation import LinearMechanism

RIGID = 1e-6  # of the highest frequency, below which a mode counts as without stiffness: round-off of a double zero
LOCKED, COMPLIANT = "locked", "compliant"
DEPENDENT = 1e-9  # of the largest singular value: below it a coordinate follows from others


@struct
class RobotModes:
    """The f modes of a robot, slowest first; two real poles that follow each other make one."""

    poles: ComplexArray  # (f, 2) complex, 1/s
    # (f, s) complex, SI, by mode the increments δs of s independent coordinates in the first pole's eigenvector, of
    # unit kinetic amplitude (δsᴴ M δs = 1), the largest free coordinate real
    shape: ComplexArray
    motion: ComplexArray  # (f, coordinates) complex, SI, the same as δq of all bodies
    round_off: float  # 1/s, by which a double pole at 0 may be off

    @property
    def frequency(self) -> Array:
        """Undamped frequencies (f,) √(λ₁ λ₂)/2π, Hz, of pairs of poles; 0 for motion without stiffness, or falling."""
        omega = np.sqrt(self.poles.prod(axis=1).real.clip(min=0.0))
        return np.where(omega < RIGID * omega.max(initial=0.0), 0.0, omega) / (2 * np.pi)

    @property
    def growth(self) -> float:
        """Largest real part of a pole, 1/s, 0 where it is round-off; above 0 the robot falls or vibrates ever more."""
        largest = float(self.poles.real.max(initial=0.0))
        return largest if largest > self.round_off else 0.0

    @property
    def damping_ratio(self) -> Array:
        """Damping ratios (f,) −(λ₁ + λ₂)/2√(λ₁ λ₂), no unit, of pairs of poles; NaN for frequency 0."""
        omega = 2 * np.pi * self.frequency
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.where(omega > 0.0, -self.poles.sum(axis=1).real / (2 * omega), np.nan)


def robot_modes(K: Array, D: Array, back: Array, transformation: Array) -> RobotModes:
    """Poles and shapes of z̈ + D̂ ż + K̂ z = 0, where K̂, 1/s², and D̂, 1/s, are (f, f).

    `back` (s, f) takes z to s independent coordinates, `transformation` (coordinates, s) these to δq of all bodies, SI.
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
    round_off = RIGID * float(np.sqrt(np.linalg.norm(K, 2))) if len(K) else 0.0
    return RobotModes(poles, shape.astype(complex), motion.astype(complex), round_off)


def _pairs(poles: ComplexArray) -> Indices:
    """Numbers (f, 2) of poles that belong together: conjugates, and real ones in the order of their size."""
    complex_ones = np.flatnonzero(poles.imag > 0.0)
    conjugates = [int(np.abs(poles - poles[i].conjugate()).argmin()) for i in complex_ones]
    real = np.flatnonzero(poles.imag == 0.0)
    real = real[np.argsort(np.abs(poles[real]))]
    pairs = np.vstack([np.column_stack([complex_ones, conjugates]), real.reshape(-1, 2)]).astype(np.intp)
    return pairs[np.argsort(np.abs(poles[pairs].prod(axis=1)))]


class FreeCoordinates(NamedTuple):
    """Coordinates z (m,), √kg·m, that joint conditions leave free: δs = N z, N (f, m), SI, of f coordinates s.

    With z the mass matrix is the identity, the stiffness K, 1/s², and the damping D, 1/s, (m, m).
    """

    N: Array
    K: Array
    D: Array


@struct
class JointCondition:
    """Modes and compliance of a robot at one instant, with joints locked, or motors locked behind compliant gears."""

    modes: RobotModes  # of the free coordinates, the lowest first; `modes.frequency` in Hz
    # (k, k) by "BODY.POINT": translations (m) along the axes of the space, of a tool its own, then rotations (rad)
    # about them, by forces (N) and moments (N·m); infinite where a joint without a motor lets the robot move
    compliance: Mapping[str, Array]
    free: FreeCoordinates  # the coordinates that the condition leaves free


class Stiffness(NamedTuple):
    """Stiffness of a point, N/m: `along` each of d axes (d,), and the `least`, with its unit `direction` (d,)."""

    along: Array
    least: float
    direction: Array


def translational_stiffness(compliance: Array) -> Stiffness | None:
    """The stiffness of a point from its compliance (3, 3), planar, or (6, 6), SI units; None if it can move freely.

    Directions whose compliance is round-off have infinite stiffness.
    """
    d = {3: 2, 6: 3}[len(compliance)]
    C = compliance[:d, :d]
    if not np.isfinite(C).all():
        return None
    values, directions = np.linalg.eigh(C)
    diagonal = np.append(np.diag(C), values[-1])
    stiffness = 1 / np.where(diagonal > RIGID**2 * diagonal.max(), diagonal, np.nan)
    *along, least = np.where(np.isnan(stiffness), np.inf, stiffness)
    return Stiffness(np.array(along), float(least), directions[:, -1])


def joint_conditions(mechanism: LinearMechanism) -> dict[str, JointCondition]:
    """The condition "locked" (joints), and with compliant gears "compliant" (motors locked), by name."""
    has_gears = any(name.startswith("motor/") for name in mechanism.outputs)
    largest, conditions = np.sqrt(np.diag(np.linalg.inv(mechanism.M))), {}
    for condition in (LOCKED, COMPLIANT)[: 1 + has_gears]:
        N, K, D = free = free_coordinates(mechanism, condition)
        modes = robot_modes(K, D, N, mechanism.transformation)
        if (shape := modes.shape).size:  # the largest entry of each δs real and positive, whatever columns N has
            largest_entry = np.take_along_axis(shape, np.abs(shape).argmax(axis=1)[:, None], axis=1)
            turn = np.abs(largest_entry) / largest_entry
            modes = replace(modes, shape=shape * turn, motion=modes.motion * turn)
        compliance = {point: _compliance(K, _moved(mechanism.of_tool(point), N, largest)) for point in mechanism.points}
        conditions[condition] = JointCondition(modes, compliance, free)
    return conditions


def free_coordinates(mechanism: LinearMechanism, condition: str) -> FreeCoordinates:
    """Coordinates of joints and modes that are free in the `condition` "locked" (joints) or "compliant" (motors)."""
    joints = [name for name in mechanism.inputs if name.startswith("joint/")]
    if condition == LOCKED:  # motors behind compliant gears stand still, too
        names = [*joints, *(name for name in mechanism.outputs if name.startswith("motor/"))]
    else:
        shafts = (name.replace("joint/", "motor/", 1) for name in joints)
        names = [shaft if shaft in mechanism.outputs else name for name, shaft in zip(joints, shafts, strict=True)]
    back = np.linalg.inv(np.linalg.cholesky(mechanism.M)).T
    R = np.array([mechanism.outputs[name] for name in names]).reshape(len(names), len(back))
    N = back @ free_directions(np.asarray(R @ back, dtype=float))
    return FreeCoordinates(N, N.T @ mechanism.K @ N, N.T @ mechanism.D @ N)


def frequency_response(free: FreeCoordinates, J: Array, omega: Array) -> ComplexArray:
    """(F, k) motion per unit load, m/N or rad/(N·m), along rows of the Jacobian J (k, f), SI; `omega` (F,), rad/s."""
    J = J @ free.N
    return np.einsum("ki,fik->fk", J, vibration(np.eye(len(J.T)), free.K, free.D, J, omega))


def vibration(M: Array, K: Array, D: Array, J: Array, omega: Array) -> ComplexArray:
    """Coordinates (F, f, k) (K + iωD − ω²M)⁻¹ Jᵀ by unit loads along rows of J (k, f), SI; `omega` (F,), rad/s."""
    w = omega[:, None, None]
    return np.linalg.solve(K + 1j * w * D - w**2 * M, np.broadcast_to(J.T, (len(omega), *J.T.shape)))


def free_directions(R: Array) -> Array:
    """Orthonormal directions (f, m) z, no unit, with R z = 0, of R (r, f), any unit, whose rows may be dependent."""
    sizes = np.linalg.norm(R, axis=1, keepdims=True)
    return null_space(R / np.where(sizes > 0.0, sizes, 1.0), DEPENDENT)


def _moved(J: Array, N: Array, largest: Array) -> Array:
    """J N, (k, m); 0 where its terms cancel or N is zero but for round-off, as before the joints that are free.

    `largest` (f,) is what any N of unit kinetic amplitude may have along each coordinate.
    """
    moved, zero = J @ N, 64.0 * np.finfo(float).eps * (np.abs(J) @ largest)
    round_off = np.maximum(RIGID**2 * (np.abs(J) @ np.abs(N)), zero[:, None])
    return np.where(np.abs(moved) > round_off, moved, 0.0)


def _compliance(K: Array, J: Array) -> Array:
    """J K⁻¹ Jᵀ; infinite where K (m, m) is singular."""
    if not len(K):
        return np.zeros((len(J), len(J)))
    values = np.linalg.svd(K, compute_uv=False)
    if not values[-1] > RIGID**2 * values[0]:
        return np.full((len(J), len(J)), np.inf)
    C = J @ np.linalg.solve(K, J.T)
    return (C + C.T) / 2
