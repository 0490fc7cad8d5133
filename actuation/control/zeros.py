"""Zeros of a robot from inputs to outputs, which tell whether an output can be made to follow a path."""

from __future__ import annotations

import numpy as np

from ...common.arrays import Array, ComplexArray, NDArray, as_floats
from ...common.errors import InputError
from ...common.libraries import scipy
from ...common.structs import struct
from ...mbs.linear.joint_conditions import RIGID, free_directions
from .linear_model import STILL, LinearModel, Names

INFINITE = 1e3  # times the largest pole: zeros beyond belong to modes that the model has not
MARGIN = 1e-6  # of a zero's size (and MARGIN of the largest pole, for those near 0): real parts below are round-off
ROUND_OFF = 1e-13  # of a pencil, relative: what its entries and QZ leave of double precision
RESOLVED = 1e-3  # relative error of zeros: those that round-off moves by more may as well be infinite


@struct
class Zeros:
    """The finite zeros (k,) rad/s from inputs to outputs: those on the left first, the slowest of each side.

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
        """Return number and slowest unstable zero as text."""
        if self.minimum_phase:
            return "minimum phase"
        slowest = self.unstable[np.abs(self.unstable).argmin()]
        number = f"{slowest.real:.4g}" + (f" ± {abs(slowest.imag):.4g}i" if abs(slowest.imag) > 0 else "")
        return f"non-minimum phase: {len(self.unstable)} zeros in the right half plane, the slowest {number} rad/s"


def zeros(model: LinearModel, inputs: Names, outputs: Names) -> Zeros:
    """Zeros of the transfer from as many inputs as outputs (MIMO transmission zeros where more than one).

    While C z = 0 the inputs act as constraint forces: with bases N of C z = 0 and N_B of Bᵀ z = 0, zeros are the
    eigenvalues of N_Bᵀ (λ² I + λ D̂ + K̂) N. Of the square pencil [A − λI, B; C, 0], all but its infinite eigenvalues of
    relative degree two. QZ scatters those of higher degree: an eigenvalue whose distance from infinity is within the
    error that round-off makes of it (G. W. Stewart and J. Sun, Matrix Perturbation Theory, 1990, VI.2) is infinite.
    A transfer that is nothing, or singular at all s, has none. Raises `InputError` unless both have the same number.
    """
    K, D, B, C = model.second_order
    b, c = B[:, model.inputs(inputs)], C[model.outputs(outputs)]
    if b.shape[1] != len(c):
        raise InputError("zeros: expected as many inputs as outputs", f"{b.shape[1]} and {len(c)}")
    scale = _pace(K, D)
    s = scale * (0.1 + 0.1j)  # any that is no pole
    passed = c @ np.linalg.solve(s**2 * np.eye(len(K)) + s * D + K, b)
    weakest = np.linalg.svd(passed, compute_uv=False).min(initial=np.inf)
    kinds = {model.output_names[k].partition("/")[0] for k in model.outputs(outputs)}
    peers = [k for k, name in enumerate(model.output_names) if name.partition("/")[0] in kinds]
    if weakest * np.abs(s) ** 2 <= STILL * np.linalg.norm(C[peers], axis=1).max(initial=0.0) * np.linalg.norm(b):
        return Zeros(np.zeros(0, dtype=complex), np.zeros(0, dtype=complex))
    N, N_B = free_directions(c), free_directions(b.T)
    mass, damping, stiffness = N_B.T @ N, N_B.T @ D @ N / scale, N_B.T @ K @ N / scale**2
    values, errors = _eigenvalues(mass, as_floats(damping), as_floats(stiffness))
    margins = np.maximum(MARGIN * np.maximum(np.abs(values), 1.0), errors)
    side = np.where(np.abs(values.real) > margins, np.sign(values.real), 0.0)
    order = by_side(values, side)
    return Zeros(scale * values[order], scale * values[order][side[order] > 0])


def _pace(K: Array, D: Array) -> float:
    """The highest frequency of z̈ + D̂ ż + K̂ z = 0, rad/s; the size of its coefficients where none is elastic."""
    if not len(K):
        return 1.0
    fastest = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))
    size = max(float(np.sqrt(np.linalg.norm(K, 2))), float(np.linalg.norm(D, 2)))
    return fastest if fastest > RIGID * size else size or 1.0


def by_side(values: ComplexArray, side: Array) -> NDArray[np.int_]:
    """The order (k,) of `values` by their `side` of the imaginary axis, by size, and by imaginary part.

    Sizes within `MARGIN` of each other count as one: those of conjugates, and of ± s, differ by round-off alone.
    """
    size = np.abs(values)
    order = np.lexsort((size, side))
    apart = np.diff(size[order]) > MARGIN * np.maximum(size[order][1:], 1.0)
    group = np.zeros(len(values))
    group[order[1:]] = np.cumsum(apart | (np.diff(side[order]) > 0))
    return np.lexsort((values.imag, group))


def _eigenvalues(M: Array, D: Array, K: Array) -> tuple[ComplexArray, Array]:
    """The finite λ of λ² M + λ D + K, and their errors by round-off; M may be singular."""
    n, unit = len(M), np.eye(len(M))
    if not n:
        return np.zeros(0, dtype=complex), np.zeros(0)
    if not np.any(D):
        squares, errors = _finite(-K, M, INFINITE**2)
        roots = np.sqrt(squares)
        errors /= np.maximum(np.abs(roots), np.sqrt(errors))
        return np.concatenate([roots, -roots]), np.tile(errors, 2)
    A = np.block([[np.zeros((n, n)), unit], [-K, -D]])
    E = np.block([[unit, np.zeros((n, n))], [np.zeros((n, n)), M]])
    return _finite(A, E, INFINITE)


def _finite(A: Array, E: Array, largest: float) -> tuple[ComplexArray, Array]:
    """Eigenvalues of A − λ E that round-off tells from infinity, and their errors: chordal ones, times 1 + |λ|².

    Those below 1 are far from infinity, though errors of double ones (a free body's, at 0) are estimated without bound.
    """
    (alpha, beta), left, right = scipy.linalg.eig(A, E, left=True, homogeneous_eigvals=True)
    finite = np.abs(alpha) < largest * np.abs(beta)
    values, left, right = alpha[finite] / beta[finite], left[:, finite].conj(), right[:, finite]
    of_A, of_E = (np.abs((left * (X @ right)).sum(axis=0)) for X in (A, E))
    chordal = ROUND_OFF * np.hypot(np.linalg.norm(A), np.linalg.norm(E)) / np.maximum(np.hypot(of_A, of_E), 1e-300)
    size = np.hypot(1.0, np.abs(values))
    resolved = (chordal * size < RESOLVED) | (np.abs(values) < 1.0)
    return values[resolved].astype(complex), (chordal * size**2)[resolved]
