"""Zeros of a robot's linear model."""

import numpy as np

from ...common.arrays import Array, ComplexArray, Indices
from ...common.errors import InputError
from ...common.libraries import scipy
from ...common.structs import struct
from ...mbs.linear.joint_conditions import RIGID, free_directions
from .linear_model import LinearModel, Names
from .reachability import STILL

INFINITE = 1e3  # times the largest pole: zeros beyond are of modes that the model lacks
MARGIN = 1e-6  # of a zero's size (and MARGIN of the largest pole, for those near 0): real parts below are round-off
ROUND_OFF = 1e-13  # of a pencil, relative: what its entries and QZ leave of double precision
RESOLVED = 1e-3  # relative error of zeros by round-off: with more they count as infinite


@struct
class Zeros:
    """The finite zeros (k,), 1/s, from inputs to outputs: left of the imaginary axis, on it, then right; each by size.

    `unstable`: those with positive real part. Without any the transfer is minimum phase (undamped ones on the imaginary
    axis are allowed).
    """

    values: ComplexArray
    unstable: ComplexArray

    @property
    def minimum_phase(self) -> bool:
        """Whether there is no zero with positive real part."""
        return not self.unstable.size

    def describe(self) -> str:
        """Number and slowest unstable zero as text."""
        if self.minimum_phase:
            return "minimum phase"
        slowest = self.unstable[np.abs(self.unstable).argmin()]
        number = f"{slowest.real:.4g}" + (f" ± {abs(slowest.imag):.4g}i" if abs(slowest.imag) > 0 else "")
        return f"non-minimum phase: {len(self.unstable)} zeros in the right half plane, the slowest {number} rad/s"


def zeros(model: LinearModel, inputs: Names, outputs: Names) -> Zeros:
    """The zeros from as many inputs as outputs, by name (transmission zeros where more than one).

    A transfer that is 0, or singular everywhere, has none. Raises `InputError` unless both have the same number.
    """
    K, D, B, C = model.second_order
    b, c = B[:, model.inputs(inputs)], C[model.outputs(outputs)]
    if b.shape[1] != len(c):
        raise InputError("zeros: expected as many inputs as outputs", f"{b.shape[1]} and {len(c)}")
    scale = 1.0  # rad/s: the highest frequency of z̈ + D̂ ż + K̂ z = 0, or the size of its coefficients
    if len(K):
        scale = float(np.sqrt(np.abs(np.linalg.eigvals(K)).max()))
        size = max(float(np.sqrt(np.linalg.norm(K, 2))), float(np.linalg.norm(D, 2)))
        scale = scale if scale > RIGID * size else size or 1.0
    s = scale * (0.1 + 0.1j)  # any that is no pole
    passed = c @ np.linalg.solve(s**2 * np.eye(len(K)) + s * D + K, b)
    weakest = np.linalg.svd(passed, compute_uv=False).min(initial=np.inf)
    kinds = {model.output_names[k].partition("/")[0] for k in model.outputs(outputs)}
    peers = [k for k, name in enumerate(model.output_names) if name.partition("/")[0] in kinds]
    if weakest * np.abs(s) ** 2 <= STILL * np.linalg.norm(C[peers], axis=1).max(initial=0.0) * np.linalg.norm(b):
        return Zeros(*np.zeros((2, 0), dtype=complex))
    # While C z = 0 the inputs act as constraint forces: zeros are eigenvalues of N_Bᵀ (λ² I + λ D̂ + K̂) N
    N, N_B = free_directions(c), free_directions(b.T)
    mass, damping, stiffness = N_B.T @ N, N_B.T @ D @ N / scale, N_B.T @ K @ N / scale**2
    values, errors = _eigenvalues(mass, damping, stiffness)
    margins = np.maximum(MARGIN * np.maximum(np.abs(values), 1.0), errors)
    side = np.where(np.abs(values.real) > margins, np.sign(values.real), 0.0)
    order = by_side(values, side)
    return Zeros(scale * values[order], scale * values[order][side[order] > 0])


def by_side(values: ComplexArray, side: Array) -> Indices:
    """The order (k,) of `values` (k,), any unit, by `side` of the imaginary axis (±1, 0), size, imaginary part.

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
    See G. W. Stewart and J. Sun, Matrix Perturbation Theory, 1990, VI.2.
    """
    (alpha, beta), left, right = scipy.linalg.eig(A, E, left=True, homogeneous_eigvals=True)
    finite = np.abs(alpha) < largest * np.abs(beta)
    values, left, right = alpha[finite] / beta[finite], left[:, finite].conj(), right[:, finite]
    of_A, of_E = (np.abs((left * (X @ right)).sum(axis=0)) for X in (A, E))
    chordal = ROUND_OFF * np.hypot(np.linalg.norm(A), np.linalg.norm(E)) / np.maximum(np.hypot(of_A, of_E), 1e-300)
    size = np.hypot(1.0, np.abs(values))
    resolved = (chordal * size < RESOLVED) | (np.abs(values) < 1.0)
    return values[resolved].astype(complex), (chordal * size**2)[resolved]
