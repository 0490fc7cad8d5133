"""The lowest modes of a held link by block Lanczos, on its flexibility F: the largest θ = 1/ω² of F M x = θ x.

That is shift-and-invert at zero: F is the inverse of the stiffness under the supports. Solving for a block of vectors
reads the factors of a large solid once, which is most of its time (G. H. Golub and R. Underwood, The block Lanczos
method for computing eigenvalues, 1977; R. G. Grimes, J. G. Lewis and H. D. Simon, SIAM J. Matrix Anal. Appl. 15, 1994,
228–272). With blocks V_j that are M-orthonormal to each other,

    F M V_j = V_{j−1} B_{j−1}ᵀ + V_j A_j + V_{j+1} B_j

and an eigenvector y of T, block tridiagonal of A and B, gives x = V y with ‖F M x − θ x‖_M = ‖B y_last‖. Each block is
made orthogonal to all before to rounding, so that no mode is found twice.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError

# Vectors in a block: with 110 000 and with 380 000 unknowns, 8 take the least time.
BLOCK = 8
# Of θ, the residual of a mode that has converged: ω² then has errors of its square.
TOLERANCE = 1e-10
# Of a block, the size of a direction that is rounding.
ROUNDING = 1e-14
# Relative distance of θ that may be one repeated value.
ALIKE = 1e-8


class Product(Protocol):
    """A matrix."""

    def __matmul__(self, U: Array) -> Array:
        """Its product with U (m, k)."""


class BlockLanczos:
    """The search, which goes on from where it is when more modes are asked for.

    Of vectors that several processes share each has its own m `rows`; all take part in everything, and `total` sums an
    array over them. F (m, m) is symmetric, of a `rank`; M (m, m) symmetric positive definite. `allowed`: vectors less
    what F brings about in no way but by rounding; without it that grows from block to block. `tolerance`: of θ, the
    residual of a mode that has converged.
    """

    def __init__(
        self,
        flexibility: Product,
        mass: Product,
        rows: int,
        rank: int,
        *,
        total: Callable[[Array], Array] = np.asarray,
        allowed: Callable[[Array], Array] = np.asarray,
        process: int = 0,
        tolerance: float = TOLERANCE,
    ) -> None:
        self._flexibility, self._mass = flexibility, mass
        self._rows, self._rank, self._tolerance = rows, rank, tolerance
        self._total, self._allowed = total, allowed
        self._random = np.random.default_rng(process)
        self._basis: list[Array] = []  # V_1 … V_j, of which T and B tell
        self._T: Array = np.empty((0, 0))
        self._B: Array = np.empty((0, 0))
        self._V: Array = np.empty((self._rows, 0))  # V_{j+1}
        self._MV = self._V
        self._width = self._added = 0  # vectors that began the search, in the basis and in the next block
        self._widen()

    def lowest(self, count: int) -> Array:
        """X (m, count), XᵀMX = I to rounding, ω² ascending.

        A block of p vectors finds p modes of each frequency. Where as many are alike the search goes on with more
        vectors. Raises `SolveError` where there are not as many but for round-off.
        """
        while True:
            theta, Y = (found[..., ::-1] for found in np.linalg.eigh(self._T))
            if not self._V.shape[1]:
                break
            residual = np.linalg.norm(self._B @ Y[len(Y) - self._B.shape[1] :, :count], axis=0)
            if len(theta) >= count and np.all(residual <= self._tolerance * theta[:count]):
                first, last = theta[: max(count - self._width + 1, 0)], theta[self._width - 1 : count]
                if not np.any(last > (1 - ALIKE) * first):
                    break
                if not self._added:
                    self._widen()
            self._step()
        if len(theta) < count:
            raise SolveError(f"eigenproblem: {len(theta)} of {count} modes are above round-off; request fewer modes")
        coefficients = np.split(Y[:, :count], np.cumsum([V.shape[1] for V in self._basis])[:-1])
        X = np.zeros((self._rows, count))
        for V, y in zip(self._basis, coefficients, strict=True):
            X += V @ y
        return X

    def _step(self) -> None:
        """Take the next block into the basis, and find the one after it."""
        V, B = self._V, self._B
        W = self._flexibility @ self._MV
        A = self._total(self._MV.T @ W)
        A = 0.5 * (A + A.T)
        W = W - V @ A
        if self._basis:
            W -= self._basis[-1] @ B.T
        old, last = len(self._T), len(self._T) - B.shape[1]
        T = np.zeros((old + len(A), old + len(A)))
        T[:old, :old], T[old:, old:] = self._T, A
        T[old:, last:old], T[last:old, old:] = B, B.T
        self._basis.append(V)
        self._T, self._V = T, V[:, :0]
        self._width, self._added = self._width + self._added, 0
        self._V, self._MV, self._B = self._orthonormal(W, float(np.linalg.norm(np.hstack([A, B]))))
        if not self._V.shape[1]:
            self._widen()

    def _widen(self) -> None:
        """Add vectors to the next block that nothing before has led to: displacements under random loads."""
        if not self._left():
            return
        loads = self._random.standard_normal((self._rows, min(BLOCK, self._left())))
        V = self._orthonormal(self._flexibility @ (self._mass @ loads))[0]
        V, MV, _ = self._orthonormal(V, 1.0)
        self._V, self._MV = np.hstack([self._V, V]), np.hstack([self._MV, MV])
        self._B = np.vstack([self._B, np.zeros((V.shape[1], self._B.shape[1]))])
        self._added += V.shape[1]

    def _orthonormal(self, W: Array, scale: float = 0.0) -> tuple[Array, Array, Array]:
        """V, MV and R with W = V R beside the basis: VᵀMV = I, and none of its size below rounding of `scale`."""
        V, MV, R = self._normalized(W, self._mass @ W)
        for known in [*self._basis, self._V]:
            V = V - known @ self._total(known.T @ MV)
        V = self._allowed(V)
        V, MV, more = self._normalized(V, self._mass @ V)
        R = more @ R
        turn, size, _ = np.linalg.svd(R)
        kept = turn[:, size > ROUNDING * scale][:, : self._left()]
        return V @ kept, MV @ kept, kept.T @ R

    def _left(self) -> int:
        """How many more vectors there are at most."""
        return self._rank - len(self._T) - self._V.shape[1]

    def _normalized(self, W: Array, MW: Array) -> tuple[Array, Array, Array]:
        """Q, MQ and R with W = Q R, QᵀMQ = I but for what is small in W."""
        gram = self._total(W.T @ MW)
        squares, turn = np.linalg.eigh(0.5 * (gram + gram.T))
        size = np.sqrt(np.maximum(squares, ROUNDING * squares.max(initial=0.0)) + np.finfo(float).tiny)
        return W @ (turn / size), MW @ (turn / size), size[:, None] * turn.T
