"""The lowest modes of a held link by SLEPc's Krylov–Schur, the reference for `BlockLanczos`. Loads PETSc and SLEPc.

Shift-and-invert at zero without any shift: the flexibility F is the inverse of the stiffness under the supports. PETSc
sees it as the preconditioner of an exact solve, and the mass as a matrix that only multiplies.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from ...common.arrays import Array
from ...common.errors import SolveError
from .lanczos import Product

TOLERANCE = 1e-13


class KrylovSchur:
    """The search, anew each time, with F (m, m) symmetric and M (m, m) symmetric positive definite, m `rows` here.

    `comm` are the processes that share the vectors, `total` sums an array over all of them.
    """

    def __init__(
        self,
        flexibility: Product,
        mass: Product,
        rows: int,
        *,
        comm: MPI.Comm = MPI.COMM_SELF,
        total: Callable[[Array], Array] = np.asarray,
    ) -> None:
        self._flexibility, self._mass, self._rows, self._comm, self._total = flexibility, mass, rows, comm, total

    def lowest(self, count: int) -> Array:
        """X (m, count), XᵀMX = I to rounding, ω² ascending. Raises `SolveError` where fewer converge."""
        size = ((self._rows, PETSc.DETERMINE), (self._rows, PETSc.DETERMINE))
        mass = PETSc.Mat().createPython(size, _Shell(self._mass), comm=self._comm)
        mass.setUp()
        solver = SLEPc.EPS().create(self._comm)
        solver.setOperators(mass, mass)  # the first is never multiplied with: the solve below stands for its inverse
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setDimensions(count, min(mass.getSize()[0], max(2 * count, count + 40)))
        solver.setTolerances(TOLERANCE, 1000)
        solver.setPurify(False)  # a solve for each mode, which M does not need: it is regular
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(0.0)
        transform = solver.getST()
        transform.setType(SLEPc.ST.Type.SINVERT)
        transform.getKSP().setType(PETSc.KSP.Type.PREONLY)
        transform.getKSP().getPC().setType(PETSc.PC.Type.PYTHON)
        transform.getKSP().getPC().setPythonContext(_Shell(self._flexibility))
        solver.solve()
        if solver.getConverged() < count:
            raise SolveError(
                f"eigenproblem: {solver.getConverged()} of {count} modes converged to {TOLERANCE:g}: request fewer"
            )
        X, vector = np.empty((self._rows, count)), mass.createVecRight()
        for k in range(count):
            solver.getEigenvector(k, vector)
            X[:, k] = vector.array_r
        solver.destroy()
        return self._orthonormal(X)

    def _orthonormal(self, X: Array) -> Array:
        """X made M-orthonormal to rounding, the lowest changed least."""
        for _ in range(2):  # twice is enough (Kahan; Parlett, The Symmetric Eigenvalue Problem, §6.9)
            gram = self._total(X.T @ (self._mass @ X))
            X = np.linalg.solve(np.linalg.cholesky(0.5 * (gram + gram.T)), X.T).T
        return X


class _Shell:
    """A matrix as PETSc wants matrices and preconditioners."""

    def __init__(self, matrix: Product) -> None:
        self._matrix = matrix

    def mult(self, _: PETSc.Mat, x: PETSc.Vec, result: PETSc.Vec) -> None:
        result.array[:] = (self._matrix @ x.array_r[:, None])[:, 0]

    def apply(self, _: PETSc.PC, load: PETSc.Vec, result: PETSc.Vec) -> None:
        result.array[:] = (self._matrix @ load.array_r[:, None])[:, 0]
