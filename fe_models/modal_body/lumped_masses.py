"""Masses rigidly attached to interfaces (a hub, a motor, a gripper): what they add to a link. NumPy only. SI units.

A lump of mass m sits with its center at the interface x_I and has the inertia tensor J = diag(J_x, J_y, J_z) there. Its
material points x_I + ξ move by Φ0 + φ × ξ, with translation Φ0 and rotation φ (3, n) of the interface, and
∫ρ ξ dV = 0, ∫ρ ξ ξᵀ dV = E = ½ tr(J) I − J. The integrals are those of docs/theory.md, Inertia shape integrals.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.structs import struct
from .body import POSITIVE_TOLERANCE, moving_along
from .parts import LEVI_CIVITA, Interface, Invariants
from .unit_loads import MOTIONS, PAIRS, inertia_wrenches, loads_at

if TYPE_CHECKING:  # stage 2 does without the records of links
    from ..link_records.link import InterfaceRecord

Of = TypeVar("Of", bound=Invariants)


@struct
class Lump:
    """A mass, kg, with its inertia (3,), kg·m², on the interface `name`."""

    name: str
    at: Interface  # mode shapes there
    mass: float
    inertia: Array  # J_x, J_y, J_z about the interface

    @property
    def spread(self) -> Array:
        """E (3, 3) = ½ tr(J) I − J in kg·m²."""
        return np.diag(0.5 * self.inertia.sum() - self.inertia)


def lump_weights(mass: float, inertia: Iterable[float]) -> Array:
    """Weights (6,) m, m, m, J_x, J_y, J_z, kg and kg·m², of an interface with motion B (6, dofs).

    M gains Bᵀ diag(weights) B.
    """
    return np.array([mass, mass, mass, *inertia])


def lumps(records: "Iterable[InterfaceRecord]", interfaces: Mapping[str, Interface]) -> list[Lump]:
    """Collect the lumps of a link: every record with mass or inertia, and the modes at its interface."""
    return [
        Lump(record.name, interfaces[record.name], record.mass, np.array(record.inertia))
        for record in records
        if record.mass or any(record.inertia)
    ]


def with_lumped_masses(integrals: Invariants, attached: Iterable[Lump]) -> Invariants:
    """The integrals (names and shapes of `ModalBody`) of the link with its lumped masses added.

    Raises `InputError` for moments of inertia that no body has, where they outweigh those of the link.
    """
    for lump in attached:
        at = lump.at
        added = attached_integrals(lump.mass, at.position, lump.spread, at.translation, at.rotation)
        integrals = with_added(integrals, added)
        lowest = np.linalg.eigvalsh(moving_along(integrals, integrals.S_spin)).min(initial=0.0)
        if lowest < -POSITIVE_TOLERANCE:
            raise InputError(
                f"interface.inertia of {lump.name}: expected moments of inertia of which none is larger than the sum"
                " of the others",
                lump.inertia.tolist(),
            )
    return integrals


def with_added(integrals: Of, added: Mapping[str, Any]) -> Of:
    """`integrals` with `added` added to the fields of the same names."""
    return replace(integrals, **{key: getattr(integrals, key) + more for key, more in added.items()})


def attached_integrals(m: float, x: Array, E: Array, Phi: Array, phi: Array) -> dict[str, Any]:
    """Return what a rigid mass adds to the fields of `Invariants`, by name.

    It is m (kg) with its center at x (3,), m, and E (3, 3) = ∫ρ ξ ξᵀ dV, kg·m², ξ from there. The center moves by
    Φ p, a point by (φ p) × ξ more; Φ and φ are (3, n), m and rad per unit of modal coordinate p.
    """
    turn = np.einsum("kab,an->kbn", LEVI_CIVITA, phi)  # (φ × ξ)_k = turn[k, b] ξ_b, each (n,)
    return {
        "mass": m,
        "first_moment": m * x,
        "second_moment": m * np.outer(x, x) + E,
        "S_bar": m * Phi,
        "I_bar": m * np.einsum("k,ln->kln", x, Phi) + np.einsum("kb,lbn->kln", E, turn),
        "S_bar_kl": m * np.einsum("km,ln->klmn", Phi, Phi) + np.einsum("kbm,bd,ldn->klmn", turn, E, turn),
    }


def loads_with_lumps(names: Sequence[str], attached: Iterable[Lump]) -> Array:
    """T (l, l), SI: under unit load k of l `names` a link with lumps bears the unit loads T[:, k] of the bare link.

    A lump loads the link by its inertia force and moment at its interface, which are among the loads themselves.
    """
    T = np.eye(len(names))
    for lump in attached:
        wrench = inertia_wrenches(lump.at.position[None], np.array([lump.mass]), lump.inertia[None])[0]
        T[loads_at(names, lump.name), :MOTIONS] += wrench
    return T


def with_lumped_stiffness(matrices: Array, names: Sequence[str], attached: Sequence[Lump]) -> dict[str, Array]:
    """Geometric stiffness (n, n), rad²/s² per unit of load, by unit load, with lumps: their inertia and turning.

    `matrices` (l, n, n), likewise, are those without lumps.
    """
    total = np.tensordot(loads_with_lumps(names, attached).T, matrices, axes=1)
    for lump in attached:
        phi = lump.at.rotation
        total[3:MOTIONS] += of_turning(lump.spread, np.einsum("am,bn->abmn", phi, phi))
    return dict(zip(names, total, strict=True))


def of_turning(E: Array, products: Array) -> Array:
    """Geometric stiffness (9, n, n), rad²/s² per unit of load, r_x … omega_yz: d'Alembert's on a rigid body that turns.

    E (3, 3): ∫ρ d dᵀ dV, kg·m², of d from its center; `products` (3, 3, n, n): φ_a φ_b of its rotation φ, rad per
    unit of n modes.
    """
    # To second order d moves by ½ φ × (φ × d) besides φ × d; of −φ × (φ × d) = pᵀG p are K_x,kl = ∫ρ d_k G_l dV, and
    # from them K_ω = 1 tr K_x − sym K_x and K_r,a = ε_abc K_x,bc (docs/theory.md).
    products = 0.5 * (products + products.transpose(0, 1, 3, 2))
    K_x = np.einsum("kl,aamn->klmn", E, products) - np.einsum("kb,blmn->klmn", E, products)
    K_omega = np.einsum("ij,kkmn->ijmn", np.eye(3), K_x) - 0.5 * (K_x + K_x.transpose(1, 0, 2, 3))
    K_r = np.einsum("abc,bcmn->amn", LEVI_CIVITA, K_x)
    return np.array([*-K_r, *(K_omega[i, j] * (1.0 if i == j else 2.0) for i, j in PAIRS.values())])
