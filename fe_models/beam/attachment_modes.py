"""Modes of a beam by loads on its tip and payloads, and those with fixed interfaces (Craig-Bampton)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ...common.arrays import Array
from ..link_records.families import Family
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ModeSet, residual_modes
from ..modal_body.craig_bampton import in_order
from .beam import FamilyModel
from .eigen import BeamFlexibility
from .line import R_X


def attachment_modes(
    models: Mapping[Family, FamilyModel],
    known: Mapping[Family, Array],
    places: Iterable[int],
    length: float,
    twists_along: bool,
) -> list[tuple[float, Family, Array]]:
    """ω², family and degrees of freedom x (m,) of that family's model, xᵀMx = 1, of attachment modes, by family.

    `known` (m, n) are each family's eigenmodes in the file, `places` the stations of the interfaces, `length` (m) that
    of the link: a unit force goes with a moment of force times length. `twists_along`: whether torsion has the shape
    under a torque along the link, which bent links bear, too.
    """
    static = list[tuple[float, Family, Array]]()
    for family, model in models.items():
        modes = _of_family(family, model, known[family], list(places), length, twists_along)
        static += [(float(square), family, x) for square, x in zip(modes.omega2, modes.X.T, strict=True)]
    return static


def _of_family(
    family: Family, model: FamilyModel, X: Array, places: list[int], length: float, twists_along: bool
) -> ModeSet:
    rows = [row for row in COMPONENTS[family] if row in model.fields]
    loads = [model.fields[row][place].toarray()[0] * (1.0 if row < R_X else length) for place in places for row in rows]
    if twists_along and family == "torsion":  # along the link as its inertia about the axis
        torque = model.M @ np.ones(model.M.shape[0])
        loads.append(torque * (length / torque.sum()))
    B = np.array(loads).T
    static = BeamFlexibility(model.K, model.strain) @ B

    def energy(U: Array) -> Array:
        strain = model.strain @ U
        return np.asarray(strain.T @ strain)

    highest = float(np.diag(energy(X)).max(initial=0.0)) if X.shape[1] else np.inf
    return residual_modes({family: (static, B)}, X, highest, Inertia(lambda U: model.M @ U, energy, np.asarray))


def fixed_interfaces(model: FamilyModel, family: Family, places: Sequence[int]) -> tuple[FamilyModel, sp.csr_matrix]:
    """The eigenproblem of a family fixed at the stations `places`, and Z (m, free): x = Z y, C Z = 0.

    Of each interface coordinate, a row of C, the degree of freedom that it depends on most follows from the others.
    """
    moved = [row for row in COMPONENTS[family] if row in model.fields]
    rows = [model.fields[row][place].toarray()[0] for place in places for row in moved]
    C = np.array([row for row in rows if np.any(row)]).reshape(-1, model.K.shape[0])
    pivots = scipy.linalg.qr(C, mode="r", pivoting=True)[1][: len(C)]
    free = np.setdiff1d(np.arange(C.shape[1]), pivots)
    follow = sp.csr_matrix(-np.linalg.solve(C[:, pivots], C[:, free]))
    Z = sp.csr_matrix((np.ones(free.size), (free, np.arange(free.size))), shape=(C.shape[1], free.size))
    Z += sp.csr_matrix((np.ones(len(C)), (pivots, np.arange(len(C)))), shape=(C.shape[1], len(C))) @ follow
    fixed = replace(
        model,
        K=(Z.T @ model.K @ Z).tocsr(),
        M=(Z.T @ model.M @ Z).tocsr(),
        strain=model.strain @ Z,
        fields={row: values @ Z for row, values in model.fields.items()},
    )
    return fixed, Z.tocsr()


def ritz_modes(
    model: FamilyModel, family: Family, fixed: Array, static: Array
) -> tuple[list[tuple[float, Family, Array]], list[tuple[float, Family, Array]]]:
    """Modes in the space of fixed-interface modes (m, n) and static shapes (m, r), M-orthonormal together.

    Those that stand for eigenmodes, and as many others as static shapes; ω², family and degrees of freedom of each.
    """
    X = np.concatenate([fixed, static], axis=1)
    strain = model.strain @ X
    known = [False] * fixed.shape[1] + [True] * static.shape[1]
    ritz = in_order(strain.T @ strain, [family] * X.shape[1], known)
    modes = [(float(square), family, x) for square, x in zip(ritz.omega2, (X @ ritz.X).T, strict=True)]
    return modes[: fixed.shape[1]], modes[fixed.shape[1] :]
