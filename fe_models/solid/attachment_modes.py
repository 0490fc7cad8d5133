"""Residual attachment modes of a solid: unit loads at its interfaces, spread as the mean motion there says."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...common.arrays import Array
from ..link_records import Family
from ..modal_body.attachment_modes import COMPONENTS, Inertia, ResidualModes, residual_modes
from ..modal_body.unit_loads import interface_load_names
from .eigen import Mass
from .modes import SolidModes
from .strain_energy import strain_energy


def attachment_modes(
    families: Sequence[Family],
    mass: Mass,
    modes: SolidModes,
    loads: Mapping[str, Array],
    shapes: Mapping[str, Array],
    interfaces: Sequence[str],
    length: float,
    twists_along: bool,
) -> ResidualModes:
    """Those of the loads that belong to `families`; collective.

    Args:
        families: wanted ones.
        mass: with what is attached.
        modes: eigenmodes.
        loads: (3 owned,) as `invariants.unit_loads` finds them.
        shapes: (3 owned,) displacements under them, as `invariants.static_shapes` finds them.
        interfaces: their names.
        length: of the link in m: a unit force goes with a moment of force times length.
        twists_along: whether torsion has the shape under a torque along the link, which bent links bear, too.
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
