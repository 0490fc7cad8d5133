"""Modes of a linear model of the robot: frequencies, damping, shapes, and what can move or see them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, ComplexArray, Indices, as_floats
from .linear_model import LinearModel, Names

ComplexArray = ComplexArray

RIGID = 1e-6  # of the highest frequency, below which a mode counts as without stiffness: rounding of a double zero
OUT_OF_REACH = 1e-7  # of the largest effect that a unit input can have on a mode


@dataclass(frozen=True)
class RobotModes:
    """The f modes of a model, slowest first; two real poles that follow each other make one.

    Attributes:
        poles: (f, 2) eigenvalues of A, 1/s.
        shape: (f, f) complex, δs of the first pole's eigenvector in rows, of unit kinetic amplitude (δsᴴ M δs = 1) and
            with its largest entry real.
        motion: (f, coordinates) complex, the same as δq of all bodies.
    """

    poles: ComplexArray
    shape: ComplexArray
    motion: ComplexArray

    @property
    def frequency(self) -> Array:
        """(f,) √(λ₁ λ₂)/2π, Hz: the undamped one; 0 where the robot moves without stiffness, or falls."""
        omega = np.sqrt(self.poles.prod(axis=1).real.clip(min=0.0))
        result: Array = np.where(omega < RIGID * omega.max(initial=0.0), 0.0, omega) / (2 * np.pi)
        return result

    @property
    def growth(self) -> float:
        """The largest real part of a pole, 1/s; 0 where it is rounding: the robot falls or is driven to vibrate."""
        largest = float(self.poles.real.max(initial=0.0))
        return largest if largest > RIGID * np.abs(self.poles).max(initial=0.0) else 0.0

    @property
    def damping_ratio(self) -> Array:
        """(f,) −(λ₁ + λ₂)/2ω; nan where the frequency is 0."""
        omega = 2 * np.pi * self.frequency
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio: Array = np.where(omega > 0.0, -self.poles.sum(axis=1).real / (2 * omega), np.nan)
        return ratio


def robot_modes(model: LinearModel) -> RobotModes:
    """Poles and shapes of a model, about a frozen configuration."""
    K, D, _, _ = model.second_order
    f = model.freedom
    if np.any(D):
        poles, vectors = np.linalg.eig(np.block([[np.zeros((f, f)), np.eye(f)], [-K, -D]]))
        pairs = _pairs(poles)
        poles, Z = poles[pairs], vectors[:f, pairs[:, 0]]
    else:  # s² of the undamped robot: half the size, and a double pole at 0 stays one
        squares, Z = np.linalg.eig(-K)
        roots = np.sqrt(squares.astype(complex))
        order = np.argsort(np.abs(roots))
        poles, Z = np.column_stack([roots, -roots])[order], Z[:, order].astype(complex)
    largest = np.take_along_axis(Z, np.abs(Z).argmax(axis=0)[None], axis=0)
    Z = Z * (np.abs(largest) / largest) / np.linalg.norm(Z, axis=0)
    shape = np.linalg.solve(np.linalg.cholesky(model.mass).T, Z).T
    motion = shape @ model.transformation.T
    return RobotModes(poles, np.asarray(shape, dtype=complex), np.asarray(motion, dtype=complex))


def held_frequencies(model: LinearModel) -> Array:
    """Undamped frequencies, Hz, the lowest first, with the shafts of all motors held: of N_Bᵀ K̂ N_B, Bᵀ N_B = 0."""
    K, _, B, _ = model.second_order
    columns = B[:, [k for k, name in enumerate(model.input_names) if name.startswith("joint/")]]
    N = np.linalg.qr(columns, mode="complete")[0][:, columns.shape[1] :]
    omega = np.sqrt(np.linalg.eigvalsh(N.T @ (K + K.T) @ N / 2).clip(min=0.0))
    return as_floats(omega[omega > RIGID * omega.max(initial=0.0)] / (2 * np.pi))


def _pairs(poles: ComplexArray) -> Indices:
    """Numbers (f, 2) of poles that belong together: conjugates, and real ones in the order of their size."""
    complex_ones = np.flatnonzero(poles.imag > 0.0)
    conjugates = [int(np.abs(poles - poles[i].conjugate()).argmin()) for i in complex_ones]
    real = np.flatnonzero(poles.imag == 0.0)
    real = real[np.argsort(np.abs(poles[real]))]
    pairs = np.vstack([np.column_stack([complex_ones, conjugates]), real.reshape(-1, 2)]).astype(np.intp)
    return pairs[np.argsort(np.abs(poles[pairs].prod(axis=1)))]


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
