"""Modes and zeros of a linear model of the robot: frequencies, damping, shapes, and what can move or see them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, ComplexArray, as_floats
from ...common.errors import InputError
from ...mbs.solve.joint_conditions import RIGID, RobotModes, free_directions
from ...mbs.solve.joint_conditions import robot_modes as modes_of
from .linear_model import LinearModel, Names

OUT_OF_REACH = 1e-7  # of the largest effect that a unit input can have on a mode


def robot_modes(model: LinearModel) -> RobotModes:
    """Poles and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    return modes_of(K, D, np.linalg.inv(np.linalg.cholesky(model.mass)).T, model.transformation)


def locked_frequencies(model: LinearModel) -> Array:
    """Undamped frequencies, Hz, the lowest first, with the shafts of all motors locked: of NᵀK̂ N, BᵀN = 0."""
    K, _, B, _ = model.second_order
    N = free_directions(B[:, [k for k, name in enumerate(model.input_names) if name.startswith("joint/")]].T)
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return as_floats(omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi))


@dataclass(frozen=True)
class Reach:
    """How well inputs reach, or outputs see, each mode: (f,) between 0 and 1, and names of the modes out of reach.

    1: a unit of the input that fits best drives nothing but this mode, in the mass metric. Modes of equal frequency are
    judged together, by the worst mixture of them: one input cannot reach two such modes.
    """

    measure: Array
    lost: tuple[str, ...]


def controllability(model: LinearModel, inputs: Names) -> Reach:
    """By mode, from [λ² I + λ D̂ + K̂, b̂] (Popov–Belevitch–Hautus, for second-order equations)."""
    _, _, B, _ = model.second_order
    return _reach(model, B[:, model.inputs(inputs)], left=True)


def observability(model: LinearModel, outputs: Names) -> Reach:
    """By mode, as `controllability` with the outputs' rows."""
    _, _, _, C = model.second_order
    return _reach(model, C[model.outputs(outputs)].T, left=False)


def _reach(model: LinearModel, columns: Array, left: bool) -> Reach:
    K, D, _, _ = model.second_order
    modes, unit = robot_modes(model), np.eye(model.freedom)
    size = np.linalg.norm(columns, axis=0)
    columns = columns[:, size > 0.0] / size[size > 0.0]
    scale = np.abs(modes.poles).max(initial=0.0) ** 2
    measure = np.zeros(model.freedom)
    for k, pole in enumerate(modes.poles[:, 0]):
        P = pole**2 * unit + pole * D + K
        U, values, V = np.linalg.svd(P)
        count = max(1, int(np.count_nonzero(values < RIGID**2 * scale)))
        vectors = U[:, -count:] if left else V[-count:].conj().T
        reached = vectors.conj().T @ columns if left else vectors.T @ columns
        padded = np.zeros((count, max(count, reached.shape[1])), dtype=complex)
        padded[:, : reached.shape[1]] = reached
        measure[k] = np.linalg.svd(padded, compute_uv=False)[-1]
    names = [f"mode {k} ({f:.4g} Hz)" for k, f in enumerate(modes.frequency, 1)]
    lost = tuple(name for name, reached in zip(names, measure, strict=True) if reached < OUT_OF_REACH)
    return Reach(measure, lost)


ComplexArray = ComplexArray

INFINITE = 1e3  # times the largest pole: zeros beyond belong to modes that the model has not
MARGIN = 1e-6  # of a zero's size (and MARGIN of the largest pole, for those near 0): real parts below are rounding


@dataclass(frozen=True)
class Zeros:
    """The finite zeros (k,) rad/s from inputs to outputs, slowest first.

    `unstable`: those with positive real part. Without any the transfer is minimum phase (undamped ones on the imaginary
    axis are allowed); with them, an output that is held to a path needs inputs that grow or begin before the path does.
    """

    values: ComplexArray
    unstable: ComplexArray

    @property
    def minimum_phase(self) -> bool:
        """Whether there is no zero with positive real part."""
        return not self.unstable.size

    @property
    def slowest(self) -> float:
        """The size of the slowest zero with positive real part, rad/s; infinite where there is none."""
        return float(np.abs(self.unstable).min(initial=np.inf))

    def describe(self) -> str:
        """In words, for tables."""
        if self.minimum_phase:
            return "minimum phase"
        slowest = self.unstable[np.abs(self.unstable).argmin()]
        number = f"{slowest.real:.4g}" + (f" ± {abs(slowest.imag):.4g}i" if abs(slowest.imag) > 0 else "")
        return f"non-minimum phase: {len(self.unstable)} zeros in the right half plane, the slowest {number} rad/s"


def zeros(model: LinearModel, inputs: Names, outputs: Names) -> Zeros:
    """Zeros of the transfer from as many inputs as outputs (MIMO transmission zeros where more than one).

    While C z = 0 the inputs act as constraint forces: with bases N of C z = 0 and N_B of Bᵀ z = 0, zeros are the
    eigenvalues of N_Bᵀ (λ² I + λ D̂ + K̂) N. Of the square pencil [A − λI, B; C, 0], all but its infinite eigenvalues of
    relative degree two, which QZ would scatter. Raises `InputError` unless both have the same number.
    """
    K, D, B, C = model.second_order
    b, c = B[:, model.inputs(inputs)], C[model.outputs(outputs)]
    if b.shape[1] != len(c):
        raise InputError(f"zeros: expected as many inputs as outputs, found {b.shape[1]} and {len(c)}")
    scale = max(float(np.sqrt(np.abs(np.linalg.eigvals(K)).max(initial=0.0))), 1.0)
    N, N_B = _null_space(c), _null_space(b.T)
    mass, damping, stiffness = N_B.T @ N, N_B.T @ D @ N / scale, N_B.T @ K @ N / scale**2
    values = _eigenvalues(mass, as_floats(damping), as_floats(stiffness))
    values = scale * values[np.argsort(np.abs(values))]
    positive = values.real > np.maximum(MARGIN * np.abs(values), MARGIN * scale)
    return Zeros(values, values[positive])


def _null_space(rows: Array) -> Array:
    """Orthonormal basis (f, f − rows) of what `rows` map to zero."""
    basis: Array = np.linalg.qr(rows.T, mode="complete")[0][:, len(rows) :]
    return basis


def _eigenvalues(M: Array, D: Array, K: Array) -> ComplexArray:
    """The finite λ of λ² M + λ D + K; M may be singular."""
    from scipy.linalg import eigvals

    n, unit = len(M), np.eye(len(M))
    if not n:
        return np.zeros(0, dtype=complex)
    if not np.any(D):
        squares = _finite(eigvals(-K, M, homogeneous_eigvals=True), INFINITE**2)
        roots = np.sqrt(squares.astype(complex))
        return np.concatenate([roots, -roots])
    A = np.block([[np.zeros((n, n)), unit], [-K, -D]])
    E = np.block([[unit, np.zeros((n, n))], [np.zeros((n, n)), M]])
    return _finite(eigvals(A, E, homogeneous_eigvals=True), INFINITE)


def _finite(homogeneous: ComplexArray, largest: float) -> ComplexArray:
    alpha, beta = homogeneous
    finite = np.abs(alpha) < largest * np.abs(beta)
    return np.asarray(alpha[finite] / beta[finite])
