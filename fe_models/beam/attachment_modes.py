"""Residual attachment modes of a beam, family by family."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from ...common.arrays import Array
from ..link_records import Family
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ResidualModes, residual_modes
from .beam import R_X, FamilyModel
from .eigen import Flexibility


def attachment_modes(
    models: Mapping[Family, FamilyModel],
    known: Mapping[Family, Array],
    places: Iterable[int],
    length: float,
    twists_along: bool,
) -> list[tuple[float, Family, Array]]:
    """ω², family and degrees of freedom x (m,) of that family's model, xᵀMx = 1, of attachment modes, by family.

    Args:
        models: by family.
        known: of each family (m, n), its eigenmodes in the file.
        places: the stations of the interfaces.
        length: of the link in m: a unit force goes with a moment of force times length.
        twists_along: whether torsion has the shape under a torque along the link, which bent links bear, too.
    """
    found = list[tuple[float, Family, Array]]()
    for family, model in models.items():
        modes = _of_family(family, model, known[family], list(places), length, twists_along)
        found += [(float(square), family, x) for square, x in zip(modes.omega2, modes.X.T, strict=True)]
    return found


def _of_family(
    family: Family, model: FamilyModel, X: Array, places: list[int], length: float, twists_along: bool
) -> ResidualModes:
    rows = [row for row in COMPONENTS[family] if row in model.fields]
    loads = [model.fields[row][place].toarray()[0] * (1.0 if row < R_X else length) for place in places for row in rows]
    if twists_along and family == "torsion":  # along the link as its inertia about the axis
        torque = model.M @ np.ones(model.M.shape[0])
        loads.append(torque * (length / torque.sum()))
    B = np.array(loads).T
    static = Flexibility(model.K, model.strain) @ B

    def energy(U: Array) -> Array:
        strain = model.strain @ U
        return np.asarray(strain.T @ strain)

    highest = float(np.diag(energy(X)).max(initial=0.0)) if X.shape[1] else np.inf
    return residual_modes({family: (static, B)}, X, highest, Inertia(lambda U: model.M @ U, energy, np.asarray))
