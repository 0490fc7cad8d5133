"""Modes of a solid by loads on its interfaces, and those with fixed interfaces (Craig-Bampton).

A solid fixed at all its interfaces, beyond its supports, for the modes that Craig and Bampton put beside others.

With rows B that are fixed, too, and the flexibility F of the supports, the flexibility under both is

    F − F Bᵀ (B F Bᵀ)⁻¹ B F
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records.families import Family
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ModeSet, residual_modes
from ..modal_body.craig_bampton import ROOT, in_order
from ..modal_body.unit_loads import interface_load_names
from .elasticity import MassMatrix, SolidModel
from .strain_energy import strain_energy
from .supports import Flexibility


def attachment_modes(
    families: Sequence[Family],
    mass: MassMatrix,
    modes: ModeSet,
    loads: Mapping[str, Array],
    shapes: Mapping[str, Array],
    interfaces: Sequence[str],
    length: float,
    twists_along: bool,
) -> ModeSet:
    """Return attachment modes of the loads that belong to `families`; collective.

    `loads` and `shapes` (3 owned,) are as `invariants.unit_loads` and `static_shapes` find them, `mass` has what is
    attached; `length` and `twists_along` as of `beam.attachment_modes`.
    """
    model, scale = mass.model, np.repeat([1.0, length], 3)
    static = {}
    for family in families:
        wanted = [
            (name, scale[row])
            for interface in interfaces
            for row, name in enumerate(interface_load_names([interface]))
            if row in COMPONENTS[family]
        ]
        if twists_along and family == "torsion":  # along the link as its inertia about the axis
            turn = np.cross([1.0, 0.0, 0.0], model.x).ravel()
            wanted.append(("r_x", length / float(model.total(np.array([turn @ loads["r_x"]]))[0])))
        static[family] = tuple(np.stack([size * of[name] for name, size in wanted], axis=1) for of in (shapes, loads))
    inertia = Inertia(
        lambda U: mass @ U, lambda U: strain_energy(model, np.ascontiguousarray(model.with_ghosts(U))), model.total
    )
    return residual_modes(static, modes.X, float(modes.omega2.max()), inertia)


class FixedInterfaceFlexibility:
    """`Flexibility` of a body with fixed interfaces; vectors contain this rank's own degrees of freedom.

    `flexibility` is that under the supports of the root, B (c, 3 owned) are the `rows` that are fixed, too.
    """

    def __init__(self, flexibility: Flexibility, rows: Array) -> None:
        self.model = flexibility.model
        self.rank = flexibility.rank - len(rows)
        self._free, self._rows = flexibility, rows
        self._shapes = flexibility @ np.ascontiguousarray(rows.T)
        self._inverse = np.linalg.inv(self.model.total(rows @ self._shapes))

    def __matmul__(self, loads: Array) -> Array:
        """Displacements under loads (3 owned, k); collective."""
        U = self._free @ loads
        return np.asarray(U - self._shapes @ (self._inverse @ self.model.total(self._rows @ U)))


def fixed_interfaces(
    flexibility: Flexibility, families: Sequence[Family], interfaces: Mapping[str, Array]
) -> FixedInterfaceFlexibility:
    """Fix all interfaces but the root in the directions of `families`; rows B (6, 3 owned) of each interface."""
    moving = sorted({k for family in families for k in COMPONENTS[family]})
    return FixedInterfaceFlexibility(
        flexibility, np.concatenate([B[moving] for name, B in interfaces.items() if name != ROOT])
    )


def ritz_modes(model: SolidModel, both: ModeSet, count: int) -> ModeSet:
    """Modes in the space of `count` fixed-interface modes and static shapes behind them, in that order; collective."""
    K = strain_energy(model, np.ascontiguousarray(model.with_ghosts(both.X)))
    ritz = in_order(K, both.families, [k >= count for k in range(len(both.families))])
    return ModeSet(ritz.omega2, ritz.families, both.X @ ritz.X)
