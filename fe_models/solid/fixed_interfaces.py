"""A solid held at all its interfaces besides its supports, for the modes that Craig and Bampton put beside others.

With rows B of what is held besides and the flexibility F of the supports, the flexibility under both is

    F − F Bᵀ (B F Bᵀ)⁻¹ B F
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records import Family
from ..modal_body.attachment_modes import COMPONENTS
from ..modal_body.craig_bampton import ROOT, in_order
from .elasticity import SolidModel
from .modes import SolidModes
from .strain_energy import strain_energy
from .supports import Flexibility


class FixedInterfaceFlexibility:
    """Of a body whose interfaces rest, as `Flexibility`; vectors hold this rank's own degrees of freedom.

    Args:
        flexibility: under the supports of the root.
        rows: B (c, 3 owned) of what is held besides.
    """

    def __init__(self, flexibility: Flexibility, rows: Array) -> None:
        self.model = flexibility.model
        self.rank = flexibility.rank - len(rows)
        self._free, self._rows = flexibility, rows
        self._shapes = flexibility @ np.ascontiguousarray(rows.T)
        self._inverse = np.linalg.inv(self.model.total(rows @ self._shapes))

    def __matmul__(self, loads: Array) -> Array:
        """Displacements under loads (3 owned, k); collective."""
        return self._at_rest(self._free @ loads)

    def allowed(self, U: Array) -> Array:
        """U (3 owned, k) less what the supports and the interfaces at rest do not allow; collective."""
        return self._at_rest(self._free.allowed(U))

    def _at_rest(self, U: Array) -> Array:
        return np.asarray(U - self._shapes @ (self._inverse @ self.model.total(self._rows @ U)))


def fixed_interfaces(
    flexibility: Flexibility, families: Sequence[Family], interfaces: Mapping[str, Array]
) -> FixedInterfaceFlexibility:
    """Held at all interfaces but the root, in the directions of `families`; rows B (6, 3 owned) of each interface."""
    moving = sorted({k for family in families for k in COMPONENTS[family]})
    return FixedInterfaceFlexibility(
        flexibility, np.concatenate([B[moving] for name, B in interfaces.items() if name != ROOT])
    )


def ritz_modes(model: SolidModel, both: SolidModes, count: int) -> SolidModes:
    """Modes in the space of `count` fixed-interface modes and static shapes behind them, in that order; collective."""
    K = strain_energy(model, np.ascontiguousarray(model.with_ghosts(both.X)))
    found = in_order(K, both.families, [k >= count for k in range(len(both.families))])
    return SolidModes(found.omega2, list(found.families), both.X @ found.turn)
