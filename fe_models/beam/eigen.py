"""The lowest modes of K x = ω² M x of a beam."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ...common.arrays import Array
from ...common.errors import SolveError
from ..modal_body.krylov_schur import KrylovSchur

# Multipliers amplify relative errors of the model data some 400 times within 0.2 s of the two-link case.
TOLERANCE = 1e-13

# How far round-off errors of K may move ω² before the modes are refused.
ROUND_OFF_LIMIT = 1e-3
# Steps of refinement of a solution, each of which takes out all but that share of its error: 1e-12 is left.
REFINEMENTS = 3


def lowest_modes(K: sp.csr_matrix, M: sp.csr_matrix, strain: sp.csr_matrix, count: int) -> tuple[Array, Array]:
    """The `count` lowest eigenpairs of K x = ω² M x: ω² (count,) ascending in rad²/s², X (m, count) with Xᵀ M X = I.

    Assembly rounds K's large entries, of order EI/h³; against the lowest ω² these errors grow as elements⁴. The
    Rayleigh quotient of the strains, which are differences of x once and not twice over (elements²), gives ω² without
    them, and tells where a mesh is too fine for double precision. K and M (m, m) are symmetric positive definite, and K
    = strainᵀ strain but for round-off. Raises `SolveError` where round-off errors spoil the modes.
    """
    try:
        X = KrylovSchur(BeamFlexibility(K, strain), M, *K.shape, tolerance=TOLERANCE).lowest(count)
    except (RuntimeError, np.linalg.LinAlgError):  # singular, or not finite
        raise SolveError(
            f"eigenproblem of size {K.shape[0]}: stiffness or mass is not positive definite in double precision; "
            "check the units of material and geometry, and the mesh for elements of very different length"
        ) from None
    omega2 = np.einsum("ik,ik->k", strain @ X, strain @ X)
    round_off = np.max(np.abs(np.einsum("ik,ik->k", X, K @ X) / omega2 - 1))
    if not round_off < ROUND_OFF_LIMIT:
        raise SolveError(
            f"eigenproblem of size {K.shape[0]}: round-off errors move ω² by {round_off:.1e}, expected less than "
            f"{ROUND_OFF_LIMIT:g}; use fewer elements, or no very short ones"
        )
    order = np.argsort(omega2, kind="stable")
    return omega2[order], X[:, order]


class BeamFlexibility:
    """K⁻¹ (m, m); factors of K with a unit diagonal, since its entries are in N/m, N and N·m.

    K = strainᵀ strain but for round-off, which refinement by the strains (s, m) takes out.
    """

    def __init__(self, K: sp.csr_matrix, strain: sp.csr_matrix) -> None:
        self._strain, self._scale = strain, 1.0 / np.sqrt(K.diagonal())[:, None]
        self._factors = splu((sp.diags(self._scale[:, 0]) @ K @ sp.diags(self._scale[:, 0])).tocsc())

    def __matmul__(self, loads: Array) -> Array:
        """Displacements under loads f (m, k)."""
        displacements = self._solve(loads)
        for _ in range(REFINEMENTS):
            displacements += self._solve(loads - self._strain.T @ (self._strain @ displacements))
        return displacements

    def _solve(self, loads: Array) -> Array:
        return np.asarray(self._scale * self._factors.solve(self._scale * loads))
