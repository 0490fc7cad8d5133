"""The lowest modes of a solid with SLEPc: Krylov–Schur on its flexibility, (F M) x = x / ω².

Shift-and-invert at zero without any shift: F, which the supports give, is already the inverse. PETSc sees it as the
preconditioner of an exact solve, and the mass as a matrix that only multiplies.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from petsc4py import PETSc
from slepc4py import SLEPc

from ...common.arrays import Array
from ...common.errors import SolveError
from .elasticity import SolidModel

TOLERANCE = 1e-13


class Mass:
    """M, with what is attached to interfaces: M u + Σ Bᵀ diag(w) B u. Acts as the context of a PETSc matrix too.

    Args:
        model: has the mass of the part itself.
        attached: for each attached mass B (6, 3 owned), the mean motion of its interface, and w (6,), its weights.
    """

    def __init__(self, model: SolidModel, attached: Sequence[tuple[Array, Array]] = ()) -> None:
        self.model, self.attached = model, attached

    def __matmul__(self, U: Array) -> Array:
        """M U of U (3 owned, n); collective."""
        return self._with_attached(self.model.mass @ U, U)

    def motion_of_attached(self, U: Array) -> list[tuple[Array, Array]]:
        """For each attached mass its motion (6, n) and weights (6,); collective."""
        return [(self.model.total(B @ U), weights) for B, weights in self.attached]

    def mult(self, _: PETSc.Mat, u: PETSc.Vec, result: PETSc.Vec) -> None:
        """As above, of one PETSc vector."""
        product = self.model.mass.apply(u).reshape(-1, 1)
        result.array[:] = self._with_attached(product, u.array_r[:, None])[:, 0]

    def _with_attached(self, product: Array, U: Array) -> Array:
        for B, weights in self.attached:
            product = product + B.T @ (weights[:, None] * self.model.total(B @ U))
        return product


class Inverse(Protocol):
    """The flexibility of a held body: `supports.Flexibility`, or held at interfaces besides."""

    model: SolidModel

    @property
    def rank(self) -> int:
        """Number of independent displacements."""

    def apply(self, load: PETSc.Vec, result: PETSc.Vec) -> None:
        """Displacements under loads, of this rank's own degrees of freedom."""


class _Inverse:
    """F as PETSc wants a preconditioner."""

    def __init__(self, flexibility: Inverse) -> None:
        self.flexibility = flexibility

    def apply(self, _: PETSc.PC, load: PETSc.Vec, result: PETSc.Vec) -> None:
        self.flexibility.apply(load, result)


def lowest_modes(flexibility: Inverse, mass: Mass, count: int, known: Array) -> Array:
    """The `count` lowest modes besides those `known` (3 owned, m), M-orthonormal with them to rounding; collective.

    Returns:
        (3 owned, m + count): the known ones and the new ones behind, these by frequency.

    Raises:
        SolveError: fewer converged.
    """
    model = flexibility.model
    size = 3 * model.V.dofmap.index_map.size_global
    operator = PETSc.Mat().createPython(((3 * model.owned, size), (3 * model.owned, size)), mass, comm=model.comm)
    operator.setUp()
    solver = SLEPc.EPS().create(model.comm)
    # The first operator is never multiplied with: the solve below stands for its inverse.
    solver.setOperators(operator, operator)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    # Measured: twice the wanted number of basis vectors, SLEPc's default, needs fewest solves.
    solver.setDimensions(count, min(size, max(2 * count, count + 15)))
    solver.setTolerances(TOLERANCE, 1000)
    solver.setPurify(False)  # a solve for each mode; M is regular, and a Ritz step on the strain energies follows
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(0.0)
    if known.shape[1]:
        solver.setDeflationSpace([_petsc(model, x) for x in known.T])
    solve: Any = solver.getST()
    solve.setType(SLEPc.ST.Type.SINVERT)
    solve.getKSP().setType(PETSc.KSP.Type.PREONLY)
    solve.getKSP().getPC().setType(PETSc.PC.Type.PYTHON)
    solve.getKSP().getPC().setPythonContext(_Inverse(flexibility))
    solver.solve()
    if solver.getConverged() < count:
        raise SolveError(
            f"eigenproblem of size {size}: {solver.getConverged()} of {count} modes converged to {TOLERANCE:g}; "
            "request fewer modes"
        )
    found = np.empty((3 * model.owned, count))
    vector = model.vector()
    for k in range(count):
        solver.getEigenvector(k, vector)
        found[:, k] = vector.array_r
    solver.destroy()
    return orthonormalised(mass, np.concatenate([known, found], axis=1))


def orthonormalised(mass: Mass, X: Array) -> Array:
    """X (3 owned, n) made orthonormal in M to rounding, the first columns changed least; collective."""
    for _ in range(2):  # twice is enough (Kahan; Parlett, The Symmetric Eigenvalue Problem, §6.9)
        gram = mass.model.total(X.T @ (mass @ X))
        X = np.linalg.solve(np.linalg.cholesky(0.5 * (gram + gram.T)), X.T).T
    return X


def _petsc(model: SolidModel, x: Array) -> PETSc.Vec:
    vector = model.vector()
    vector.array[:] = x
    return vector
