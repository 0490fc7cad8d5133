"""The lowest modes of K x = ω² M x with SLEPc."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from ...common.arrays import Array, as_floats
from ...common.errors import SolveError

# Multipliers amplify relative errors of the model data some 400 times within 0.2 s of the two-link case.
TOLERANCE = 1e-13

# How far rounding errors of K may move ω² before the modes are refused.
ROUNDING_LIMIT = 1e-6


def lowest_modes(K: sp.csr_matrix, M: sp.csr_matrix, strain: sp.csr_matrix, count: int) -> tuple[Array, Array]:
    """Lowest eigenpairs of K x = ω² M x by Krylov–Schur, shift-inverted at zero, K factorised by Cholesky.

    Assembly rounds K's large entries, of order EI/h³; against the lowest ω² these errors grow as elements⁴. The
    Rayleigh quotient of the strains, which are differences of x once and not twice over (elements²), gives ω² without
    them, and tells where a mesh is too fine for double precision.

    Args:
        K: (m, m) stiffness, symmetric positive definite.
        M: (m, m) mass, symmetric positive definite.
        strain: (s, m) with K = strainᵀ strain but for rounding.
        count: how many, at most m.

    Returns:
        ω² (count,) ascending in rad²/s² and X (m, count) with Xᵀ M X = I to rounding.

    Raises:
        SolveError: fewer than `count` pairs converged, or rounding errors spoil them.
    """
    try:
        X = orthonormalised(M, _krylov_schur(K, M, count))
    except (PETSc.Error, np.linalg.LinAlgError):
        raise SolveError(
            f"eigenproblem of size {K.shape[0]}: stiffness or mass is not positive definite in double precision; "
            "check the units of material and geometry, and the mesh for elements of very different length"
        ) from None
    omega2 = np.einsum("ik,ik->k", strain @ X, strain @ X)
    rounding = np.max(np.abs(np.einsum("ik,ik->k", X, K @ X) / omega2 - 1))
    if not rounding < ROUNDING_LIMIT:
        raise SolveError(
            f"eigenproblem of size {K.shape[0]}: round-off errors move ω² by {rounding:.1e}, expected less than "
            f"{ROUNDING_LIMIT:g}; use fewer elements, or no very short ones"
        )
    order = np.argsort(omega2, kind="stable")
    return omega2[order], X[:, order]


def orthonormalised(M: sp.csr_matrix, X: Array) -> Array:
    """X (m, n), lowest mode first, made orthonormal in M (m, m) to rounding, the lowest changed least."""
    for _ in range(2):  # twice is enough (Kahan; Parlett, The Symmetric Eigenvalue Problem, §6.9)
        gram = X.T @ (M @ X)
        X = as_floats(np.linalg.solve(np.linalg.cholesky(0.5 * (gram + gram.T)), X.T)).T
    return X


def _krylov_schur(K: sp.csr_matrix, M: sp.csr_matrix, count: int) -> Array:
    """Eigenvectors (m, count). PETSc's own Cholesky, ordered to a narrow band, has no fill on the matrices of beams.

    PETSc compares pivots with a bare number: K gets a unit diagonal, for pivots without unit.
    """
    scale = sp.diags(1.0 / np.sqrt(K.diagonal()))
    solver = SLEPc.EPS().create(MPI.COMM_SELF)
    solver.setOperators(_petsc(scale @ K @ scale), _petsc(scale @ M @ scale))
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count, _subspace(count, K.shape[0]))
    solver.setTolerances(TOLERANCE, 1000)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(0.0)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    linear = transform.getKSP()
    linear.setType(PETSc.KSP.Type.PREONLY)
    linear.getPC().setType(PETSc.PC.Type.CHOLESKY)
    linear.getPC().setFactorOrdering(PETSc.Mat.OrderingType.RCM)
    solver.solve()
    converged = solver.getConverged()
    if converged < count:
        raise SolveError(
            f"eigenproblem of size {K.shape[0]}: {converged} of {count} modes converged to {TOLERANCE:g}; "
            "request fewer modes or use fewer elements"
        )
    X = np.empty((K.shape[0], count))
    vector = solver.getOperators()[0].createVecRight()
    for k in range(count):
        solver.getEigenvector(k, vector)
        X[:, k] = vector.array
    solver.destroy()
    return np.asarray(scale @ X)


def _subspace(count: int, size: int) -> int:
    """Dimension of the Krylov space: SLEPc's default, but never a restart where the whole space is as small."""
    return min(size, max(2 * count, count + 40))


def _petsc(matrix: sp.csr_matrix) -> PETSc.Mat:
    matrix = matrix.tocsr()
    converted = PETSc.Mat().createAIJ(
        matrix.shape,
        csr=(matrix.indptr.astype(PETSc.IntType), matrix.indices.astype(PETSc.IntType), matrix.data),
        comm=MPI.COMM_SELF,
    )
    converted.setOption(PETSc.Mat.Option.SPD, True)
    return converted
