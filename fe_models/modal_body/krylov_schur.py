"""The lowest modes of a supported link by SLEPc's Krylov–Schur: shift-and-invert at zero. Loads PETSc and SLEPc.

PETSc sees the flexibility as the preconditioner of an exact solve, and the mass as a matrix that only multiplies. A
search goes on where it ended, with the modes found deflated; whether one of several alike is missing, which no single
Krylov space shows, one for what is left tells (docs/theory.md, Finite elements of a link).
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

from ...common.arrays import Array
from ...common.errors import SolveError
from ..link_records.link import Solver

# Of θ = 1/ω², the residual of a mode that has converged: ω² then has errors of its square.
TOLERANCE = 1e-10
# The same, of the search for what may be missing: θ is then known to 1e-4 of the distance to its neighbors.
LOOSE = 1e-2
# Relative distance of ω² that may be round-off.
ALIKE = 1e-8
# Of the largest θ: less is round-off of F, of motions that the supports do not allow.
ROUND_OFF = 1e-15
CYCLES = 1000  # of Krylov–Schur at most
NOISE = 1e-14  # of the size of a block, of a direction that is round-off
BLOCK = 8  # vectors of block Lanczos: of 4, 6 and 8, the last takes the least time from 110 000 unknowns on


def eigensolver(solver: Solver) -> str:
    """Name, version and method of `modes.solver`."""
    if solver == "block-lanczos":
        return "block Lanczos with shift-and-invert"
    return f"SLEPc {'.'.join(map(str, SLEPc.Sys.getVersion()))}, Krylov–Schur with shift-and-invert"


class Product(Protocol):
    """A matrix, known by its product with vectors."""

    def __matmul__(self, U: Array) -> Array:
        """Product with U (m, k)."""


class KrylovSchur:
    """Search for the lowest eigenpairs of K x = ω² M x, SI units, ω in rad/s; methods are collective.

    `flexibility` F (N, N), K⁻¹ under the supports, is symmetric; its `rank` is the number of modes. `mass` M (N, N) is
    positive definite. Each process of `comm` has its m `rows` of vectors (N,); `total` sums an array over processes.
    `tolerance`: residual, relative to θ = 1/ω², of a converged mode.
    """

    def __init__(
        self,
        flexibility: Product,
        mass: Product,
        rows: int,
        rank: int,
        *,
        comm: MPI.Comm = MPI.COMM_SELF,
        total: Callable[[Array], Array] = np.asarray,
        tolerance: float = TOLERANCE,
        solver: Solver = "slepc",
    ) -> None:
        self._flexibility, self._mass, self._rows, self._rank = flexibility, mass, rows, rank
        self._comm, self._total = comm, total
        self._tolerance, self._by_blocks = tolerance, solver == "block-lanczos"
        self._random = np.random.default_rng(comm.rank)
        self._X, self._theta = np.empty((rows, 0)), np.empty(0)

    def lowest(self, count: int) -> Array:
        """The lowest modes X (m, count), XᵀMX = I to round-off, ω² ascending; errors as of `candidates`."""
        X = self.candidates(count)
        while not self.complete(count):
            X = self.candidates(count)
        return X

    def candidates(self, count: int) -> Array:
        """The lowest modes X (m, count), XᵀMX = I; one of several equal ones may lack: `complete` finds it.

        Raises `SolveError` where fewer modes are above round-off, or too few converge.
        """
        if self._theta.size < min(count, self._rank):
            self._add(count - self._theta.size)
        sound = int(np.sum(self._theta > ROUND_OFF * self._theta.max(initial=0.0)))
        if sound < count:
            raise SolveError(f"eigenproblem: {sound} of {count} modes are above round-off; request fewer modes")
        return self._X[:, :count]

    def complete(self, count: int) -> bool:
        """Whether the lowest `count` modes are all found; if not, one more of them is found now."""
        if self._theta.size >= self._rank or self._blocks(1, LOOSE)[1][0] <= (1 + ALIKE) * self._theta[count - 1]:
            return True
        self._add(1)
        return False

    def _add(self, count: int) -> None:
        """The lowest `count` modes beside those known."""
        search = self._blocks if self._by_blocks else self._krylov_schur
        X, theta = search(min(count, self._rank - self._theta.size), self._tolerance)
        order = np.argsort(np.append(-self._theta, -theta), kind="stable")
        self._theta = np.append(self._theta, theta)[order]
        self._X = self._orthonormal(np.hstack([self._X, X]))[:, order]

    def _blocks(self, count: int, tolerance: float) -> tuple[Array, Array]:
        """X (m, count) and θ (count,) of the lowest modes beside those known, by block Lanczos."""
        left = self._rank - self._theta.size
        W = V = np.empty((self._rows, 0))  # the basis, and what comes next: F M V = V H + W R but for round-off
        H = R = np.empty((0, 0))
        while True:
            theta, Y = (part[..., ::-1] for part in np.linalg.eigh(H))
            if len(H) >= count:
                residual = np.linalg.norm(R @ Y[len(H) - R.shape[1] :, :count], axis=0)
                if len(H) == left or np.all(residual <= tolerance * theta[:count]):
                    return V @ Y[:, :count], theta[:count]
            if not W.shape[1]:  # none yet, or F M V lies in V
                loads = self._random.standard_normal((self._rows, BLOCK))
                W = self._beside(self._flexibility @ (self._mass @ loads), V)[0]
            W = W[:, : left - len(H)]
            V = np.hstack([V, W])
            W, R, C = self._beside(self._flexibility @ (self._mass @ W), V)
            first, last = np.split(C, [len(H)])
            H = np.block([[H, first], [first.T, 0.5 * (last + last.T)]])

    def _beside(self, W: Array, V: Array) -> tuple[Array, Array, Array]:
        """Q, R and C of W = Q R + V C beside the known modes, QᵀMQ = I, without directions that are round-off."""
        R = np.eye(W.shape[1])
        coefficients = []
        for _ in range(2):  # what is small against W is not orthogonal at first
            MW = self._mass @ W
            gram, B, C = (self._total(U.T @ MW) for U in (W, self._X, V))
            W = W - self._X @ B - V @ C
            squares, turn = np.linalg.eigh(0.5 * (gram + gram.T) - B.T @ B - C.T @ C)
            size = np.sqrt(np.maximum(squares, NOISE * np.trace(gram))) + np.finfo(float).tiny
            W, R = W @ (turn / size), size[:, None] * (turn.T @ R)
            coefficients.append(C)
        turn, size, _ = np.linalg.svd(R)
        kept = turn[:, size > NOISE * np.linalg.norm(coefficients[0])]
        return W @ kept, kept.T @ R, coefficients[0]

    def _krylov_schur(self, count: int, tolerance: float) -> tuple[Array, Array]:
        """The same by SLEPc."""
        size = ((self._rows, None), (self._rows, None))
        mass = PETSc.Mat().createPython(size, _Shell(self._mass), comm=self._comm)
        mass.setUp()
        solver = SLEPc.EPS().create(self._comm)
        solver.setOperators(mass, mass)  # the first is never multiplied with: the solve below stands for its inverse
        solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
        solver.setDimensions(count, min(mass.getSize()[0], max(2 * count, count + 15)))
        solver.setTolerances(tolerance, CYCLES)
        solver.setPurify(False)  # a solve for each mode, which M does not need: it is regular
        solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
        solver.setTarget(0.0)
        transform = solver.getST()
        transform.setType(SLEPc.ST.Type.SINVERT)
        transform.getKSP().setType(PETSc.KSP.Type.PREONLY)
        transform.getKSP().getPC().setType(PETSc.PC.Type.PYTHON)
        transform.getKSP().getPC().setPythonContext(_Shell(self._flexibility))
        vector = mass.createVecRight()
        known = [PETSc.Vec().createWithArray(x, comm=self._comm) for x in self._X.T.copy()]
        solver.setDeflationSpace(known)
        X, theta = np.empty((self._rows, count)), np.empty(count)
        try:
            solver.solve()
            if (found := solver.getConverged()) < count:
                raise SolveError(f"eigenproblem: {found} of {count} modes converged to {tolerance:g}: request fewer")
            for k in range(count):
                theta[k] = 1.0 / solver.getEigenpair(k, vector).real
                X[:, k] = vector.array_r
        finally:
            for used in (solver, transform, mass, vector, *known):  # PETSc keeps what Python alone lets go
                used.destroy()
        return X, theta

    def _orthonormal(self, X: Array) -> Array:
        """X made M-orthonormal to round-off, the first changed least."""
        for _ in range(2):  # twice is enough (Kahan; Parlett, The Symmetric Eigenvalue Problem, §6.9)
            gram = self._total(X.T @ (self._mass @ X))
            X = np.linalg.solve(np.linalg.cholesky(0.5 * (gram + gram.T)), X.T).T
        return X


class _Shell:
    """A matrix as PETSc wants matrices and preconditioners."""

    def __init__(self, matrix: Product) -> None:
        self._matrix = matrix

    def mult(self, _: PETSc.Mat | PETSc.PC, x: PETSc.Vec, result: PETSc.Vec) -> None:
        result.array[:] = (self._matrix @ x.array_r[:, None])[:, 0]

    apply = mult
