"""Residual attachment modes of a solid: unit loads at its interfaces, spread as the mean motion there says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records import Family
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ResidualModes, residual_modes
from .eigen import Mass
from .elasticity import SolidModel
from .strain_energy import internal_forces, strain_energy
from .supports import Flexibility


def attachment_modes(
    families: Sequence[Family],
    flexibility: Flexibility,
    mass: Mass,
    X: Array,
    interfaces: Mapping[str, Array],
    length: float,
    twists_along: bool,
) -> ResidualModes:
    """Those of the loads that belong to `families`; collective.

    Args:
        families: wanted ones.
        flexibility: of the held body.
        mass: with what is attached.
        X: (3 owned, n) eigenmodes.
        interfaces: B (6, 3 owned), mean motion of each; its transpose spreads a force.
        length: of the link in m: a unit force goes with a moment of force times length.
        twists_along: whether torsion has the shape under a torque along the link, which bent links bear, too.
    """
    model = flexibility.model
    scale = np.repeat([1.0, length], 3)
    rows = [(family, row) for family in families for _ in interfaces for row in COMPONENTS[family]]
    B = np.array(
        [scale[row] * at[row] for family in families for at in interfaces.values() for row in COMPONENTS[family]]
    ).T
    if twists_along and "torsion" in families:
        rows.append(("torsion", 3))
        B = np.column_stack([B, _torque_along(model) * length])
    shapes = flexibility @ B
    # As for prestress: without the rounding errors of an assembled K.
    shapes += flexibility @ (B - internal_forces(model, model.with_ghosts(shapes)))
    columns = {family: [k for k, (of, _) in enumerate(rows) if of == family] for family in families}
    static = {family: (shapes[:, own], B[:, own]) for family, own in columns.items()}
    inertia = Inertia(
        lambda U: mass @ U, lambda U: strain_energy(model, np.ascontiguousarray(model.with_ghosts(U))), model.total
    )
    return residual_modes(static, X, inertia)


def _torque_along(model: SolidModel) -> Array:
    """(3 owned,) of the part's inertia about the axis, in all 1 N·m; collective."""
    turn = np.cross([1.0, 0.0, 0.0], model.x).reshape(-1, 1)
    torque = model.mass @ turn
    return np.asarray((torque / model.total(turn.T @ torque))[:, 0])
