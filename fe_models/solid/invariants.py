"""Inertia shape integrals of a solid, and the unit loads whose prestress stiffens it.

With displacements and coordinates in the same space, every integral of docs/theory.md is a product with the scalar mass
matrix: x is its own nodal interpolation, so nothing is lumped and nothing is approximated.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ...common.arrays import Array
from ..modal_body.parts import Invariants
from ..modal_body.unit_loads import inertia_wrenches, interface_load_names
from .elasticity import SolidModel
from .strain_energy import geometric_stiffness, internal_forces
from .supports import Flexibility


def shape_integrals(model: SolidModel, modes: Array) -> Invariants:
    """Return the integrals of the part alone, of modes (3 owned, n), with spin inertia of the volume; collective."""
    n, x = modes.shape[1], model.x
    Phi = modes.reshape(-1, 3, n)
    M_Phi = (model.mass @ modes).reshape(-1, 3, n)
    M_x = (model.mass @ x.reshape(-1, 1)).reshape(-1, 3)
    M_one = (model.mass @ np.ones((x.size, 1))).reshape(-1, 3)[:, 0]
    S_bar_kl = model.total(np.einsum("akm,aln->klmn", Phi, M_Phi, optimize=True))
    second = model.total(x.T @ M_x)
    return Invariants(
        mass=float(model.total(M_one.sum(keepdims=True))[0]),
        first_moment=model.total(M_x.sum(axis=0)),
        second_moment=0.5 * (second + second.T),
        S_bar=model.total(M_Phi.sum(axis=0)),
        I_bar=model.total(np.einsum("ak,aln->kln", x, M_Phi, optimize=True)),
        S_bar_kl=0.5 * (S_bar_kl + S_bar_kl.transpose(1, 0, 3, 2)),
        J_spin=0.0,
        h_spin=np.zeros(n),
        S_spin=np.zeros((n, n)),
    )


def unit_loads(model: SolidModel, interfaces: Mapping[str, Array]) -> dict[str, Array]:
    """Return consistent nodal forces (3 owned,) of each unit load (docs/theory.md, Geometric stiffness); collective.

    D'Alembert forces −ρ(a + α × x + ω × (ω × x)) of unit a, α and products of ω (of xy, the terms of ω_x ω_y and ω_y
    ω_x together), and unit forces and moments at interfaces, which the transpose of their mean motion B (6, 3 owned)
    spreads.
    """
    wrenches = inertia_wrenches(model.x, np.ones(len(model.x)), np.zeros_like(model.x))
    fields = {name: np.ascontiguousarray(wrench[:, :3]) for name, wrench in wrenches.items()}
    forces = model.mass @ np.stack([field.reshape(-1) for field in fields.values()], axis=1)
    loads = dict(zip(fields, forces.T, strict=True))
    for name, B in interfaces.items():
        loads |= dict(zip(interface_load_names([name]), B, strict=True))
    return loads


def static_shapes(flexibility: Flexibility, loads: Mapping[str, Array]) -> dict[str, Array]:
    """Return displacements (3 owned,) under each of the `unit_loads`, under the reference condition; collective."""
    model = flexibility.model
    forces = np.stack(list(loads.values()), axis=1)
    displacements = flexibility @ forces
    # Bending stresses cancel over a section: the round-off errors of an assembled K, small as they are, would show.
    displacements += flexibility @ (forces - internal_forces(model, model.with_ghosts(displacements)))
    return dict(zip(loads, displacements.T, strict=True))


def prestressed(model: SolidModel, modes: Array, shapes: Mapping[str, Array]) -> dict[str, Array]:
    """Return geometric stiffness (n, n) by unit load of `modes` (3 owned, n), by its `static_shapes`; collective."""
    displacements = np.stack(list(shapes.values()), axis=1)
    matrices = geometric_stiffness(model, model.with_ghosts(modes), model.with_ghosts(displacements))
    return dict(zip(shapes, matrices, strict=True))
