"""Modes of a beam: the lowest of K x = ω² M x, attachment modes, and those with fixed interfaces (Craig–Bampton)."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ...common.arrays import Array
from ...common.errors import SolveError
from ..link_records.families import Family
from ..modal_body.attachment_modes import Inertia, residual_modes
from ..modal_body.craig_bampton import FixedInterfaceFlexibility, in_order
from ..modal_body.krylov_schur import KrylovSchur
from .beam import FamilyModel
from .line import R_X

# Multipliers amplify relative errors of the model data some 400 times within 0.2 s of the two-link case.
TOLERANCE = 1e-13
# How far round-off errors of K may move ω² before the modes are refused.
ROUND_OFF_LIMIT = 1e-3
# Steps of refinement of a solution, each of which takes out all but that share of its error: 1e-12 is left.
REFINEMENTS = 3


class Mode(NamedTuple):
    """One mode: ω² in rad²/s², its family, and x (m,), SI, xᵀMx = 1, the degrees of freedom of that family's model."""

    omega2: float
    family: Family
    x: Array


def modes_of(family: Family, omega2: Array, X: Array) -> list[Mode]:
    """Modes of a family, one by one, from ω² (n,) in rad²/s² and degrees of freedom X (m, n), XᵀMX = I."""
    return [Mode(float(square), family, x) for square, x in zip(omega2, X.T, strict=True)]


class BeamFlexibility:
    """K⁻¹ (m, m) of a family, by factors of K scaled to a unit diagonal, since its entries are in N/m, N and N·m.

    K = strainᵀ strain but for round-off, which refinement by the strains takes out.
    """

    def __init__(self, model: FamilyModel) -> None:
        self._strain, self._scale = model.strain, 1.0 / np.sqrt(model.K.diagonal())[:, None]
        self.rank = model.K.shape[0]
        self._factors = splu((sp.diags(self._scale[:, 0]) @ model.K @ sp.diags(self._scale[:, 0])).tocsc())

    def __matmul__(self, loads: Array) -> Array:
        """Displacements under loads f (m, k)."""
        displacements = self._solve(loads)
        for _ in range(REFINEMENTS):
            displacements += self._solve(loads - self._strain.T @ (self._strain @ displacements))
        return displacements

    def _solve(self, loads: Array) -> Array:
        return self._scale * self._factors.solve(self._scale * loads)


def attachment_modes(
    model: FamilyModel, family: Family, X: Array, places: Sequence[int], length: float, twists_along: bool
) -> list[Mode]:
    """Attachment modes of a family, M-orthogonal to its eigenmodes X (m, n), SI, in the modal body.

    `places` are the stations of the interfaces, `length` (m) is that of the link: loads are unit forces, and moments
    of 1 N times it. `twists_along`: whether to add a torque distributed along the link, as on bent links.
    """
    units = [1.0 if row < R_X else length for row in model.fields] * len(places)
    loads = [size * load for size, load in zip(units, model.motion(places), strict=True)]
    if twists_along and family == "torsion":  # along the link as its inertia about the axis
        torque = model.M @ np.ones(model.M.shape[0])
        loads.append(torque * (length / torque.sum()))
    B = np.array(loads).T
    static = BeamFlexibility(model) @ B

    def energy(U: Array) -> Array:
        strain = model.strain @ U
        return strain.T @ strain

    highest = float(np.diag(energy(X)).max(initial=0.0)) if X.shape[1] else np.inf
    inertia = Inertia(lambda U: model.M @ U, energy, np.asarray)
    residual = residual_modes({family: (static, B)}, X, highest, inertia)
    return modes_of(family, residual.omega2, residual.X)


def ritz_modes(model: FamilyModel, family: Family, fixed: Array, static: Array) -> tuple[list[Mode], list[Mode]]:
    """Ritz modes in the space of fixed-interface modes (m, n) and static shapes (m, r), XᵀMX = I of all.

    Returns the n that count as eigenmodes, and the r others, of the highest frequencies.
    """
    X, count = np.concatenate([fixed, static], axis=1), fixed.shape[1]
    strain = model.strain @ X
    ritz = in_order(strain.T @ strain, [family] * X.shape[1], [k >= count for k in range(X.shape[1])])
    modes = modes_of(family, ritz.omega2, X @ ritz.X)
    return modes[:count], modes[count:]


def lowest_modes(
    model: FamilyModel, count: int, flexibility: FixedInterfaceFlexibility | BeamFlexibility | None = None
) -> tuple[Array, Array]:
    """The `count` lowest eigenpairs of K x = ω² M x: ω² (count,) ascending, rad²/s², X (m, count), SI, Xᵀ M X = I.

    `flexibility`: K⁻¹, or that with fixed interfaces. Raises `SolveError` where round-off errors spoil the modes.
    """
    # Round-off of K, of order EI/h³, grows as elements⁴ against the lowest ω²; that of strains, by which Rayleigh
    # quotients yield ω², as elements².
    K, M, strain = model.K, model.M, model.strain
    try:
        F = flexibility or BeamFlexibility(model)
        X = KrylovSchur(F, M, K.shape[0], F.rank, tolerance=TOLERANCE).lowest(count)
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
