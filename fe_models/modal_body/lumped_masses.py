"""Masses rigidly attached to interfaces (a hub, a motor, a gripper): what they add to a link. NumPy only.

A lump of mass m sits with its center at the interface x_I and has the inertia tensor J = diag(J_x, J_y, J_z) there. Its
material points x_I + ξ move by Φ0 + φ × ξ, with translation Φ0 and rotation φ (3, n) of the interface, and
∫ρ ξ dV = 0, ∫ρ ξ ξᵀ dV = E = ½ tr(J) I − J. The integrals are those of docs/theory.md, Inertia shape integrals.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...common.arrays import Array
from ..link_records import InterfaceRecord
from .body import Interface
from .invariants import Invariants
from .tensors import LEVI_CIVITA


@dataclass(frozen=True)
class Lump:
    """A mass on the interface `name`.

    Attributes:
        at: what the modes do there.
        mass: m in kg.
        inertia: (3,) J_x, J_y, J_z about the interface, in kg·m².
    """

    name: str
    at: Interface
    mass: float
    inertia: Array

    @property
    def weights(self) -> Array:
        """(6,) m, m, m, J_x, J_y, J_z: M gains Bᵀ diag(weights) B, B (6, dofs) the motion of the interface."""
        return lump_weights(self.mass, self.inertia)

    @property
    def spread(self) -> Array:
        """E (3, 3) = ½ tr(J) I − J in kg·m²."""
        return np.diag(0.5 * self.inertia.sum() - self.inertia)


def lump_weights(mass: float, inertia: Iterable[float]) -> Array:
    """(6,) what multiplies the squares of the three velocities and three angular velocities of an interface."""
    return np.array([mass, mass, mass, *inertia])


def lumps(records: Iterable[InterfaceRecord], interfaces: Mapping[str, Interface]) -> list[Lump]:
    """The lumps of a link: every record with mass or inertia, and what the modes do at its interface."""
    return [
        Lump(record.name, interfaces[record.name], record.mass, np.array(record.inertia))
        for record in records
        if record.mass or any(record.inertia)
    ]


def with_lumped_masses(integrals: Invariants, attached: Iterable[Lump]) -> Invariants:
    """The integrals (meaning and shapes as in `ModalBody`) of the link together with what is attached to it."""
    for lump in attached:
        m, E, x = lump.mass, lump.spread, lump.at.position
        Phi, phi = lump.at.translation, lump.at.rotation
        # (φ × ξ)_k = turn[k, b] ξ_b, each (n,).
        turn = np.einsum("kab,an->kbn", LEVI_CIVITA, phi)
        integrals = replace(
            integrals,
            mass=integrals.mass + m,
            first_moment=integrals.first_moment + m * x,
            second_moment=integrals.second_moment + m * np.outer(x, x) + E,
            S_bar=integrals.S_bar + m * Phi,
            I_bar=integrals.I_bar + m * np.einsum("k,ln->kln", x, Phi) + np.einsum("kb,lbn->kln", E, turn),
            S_bar_kl=integrals.S_bar_kl
            + m * np.einsum("km,ln->klmn", Phi, Phi)
            + np.einsum("kbm,bd,ldn->klmn", turn, E, turn),
        )
    return integrals


def with_lumped_loads(geometric_stiffness: Mapping[str, Array], attached: Iterable[Lump]) -> dict[str, Array]:
    """Geometric stiffness of unit frame motions, the inertia of the lumps included.

    A lump loads the link by its inertia force and moment at its interface, whose unit loads `force/NAME/x` …,
    `moment/NAME/x` … have a geometric stiffness of their own: all is linear in the load.

    Args:
        geometric_stiffness: (n, n) by load, of the bare link. `omega_xy` belongs to the product ω_x ω_y, once.
        attached: lumps; their interfaces are among the loads.
    """
    total = dict(geometric_stiffness)
    for lump in attached:
        for load, (force, moment) in _inertia_loads(lump).items():
            for kind, components in (("force", force), ("moment", moment)):
                for axis, size in zip("xyz", components, strict=True):
                    if size:
                        total[load] = total[load] + size * geometric_stiffness[f"{kind}/{lump.name}/{axis}"]
    return total


def _inertia_loads(lump: Lump) -> dict[str, tuple[Array, Array]]:
    """D'Alembert force (3,) and moment (3,) about its center of a lump, for each unit motion of the frame.

    Frame acceleration a, angular acceleration α and angular velocity ω (Newton and Euler): force
    −m [a + α × x + ω × (ω × x)], moment −J α − ω × J ω.
    """
    m, x, J = lump.mass, lump.at.position, np.diag(lump.inertia)
    e = np.eye(3)
    loads: dict[str, tuple[Array, Array]] = {}
    for k, axis in enumerate("xyz"):
        loads[f"t_{axis}"] = (-m * e[k], np.zeros(3))
        loads[f"r_{axis}"] = (-m * np.cross(e[k], x), -J @ e[k])
    for k, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        pairs = [(k, j)] if k == j else [(k, j), (j, k)]
        loads[f"omega_{'xyz'[k]}{'xyz'[j]}"] = (
            -m * sum((np.cross(e[a], np.cross(e[b], x)) for a, b in pairs), np.zeros(3)),
            -sum((np.cross(e[a], J @ e[b]) for a, b in pairs), np.zeros(3)),
        )
    return loads
