"""Geometric stiffening of a body: what bending does to second order, u = x + Φp − ½ pᵀG p.

A unit load has the geometric stiffness K (n, n) of the prestress it causes; by virtual work the displacement along that
load is Φp − ½ pᵀK p (docs/theory.md, Geometric stiffness). SI units, axes of the body.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.lumped_masses import attached_integrals
from ...fe_models.modal_body.parts import LEVI_CIVITA
from ...fe_models.modal_body.unit_loads import PAIRS, interface_load_names, unit_load_names

IN_PLANE = ("t_x", "t_y", "r_z", "omega_zz")
"""Inertial loads of motion in the plane z = 0."""


@struct
class Stiffening:
    """Integrals of G in the modal coordinates of a `Body`; K is positive where it stiffens under that load."""

    K_s: Array  # (3, n, n) ∫ρ G_l dV
    K_x: Array  # (3, 3, n, n) ∫ρ x_k G_l dV at [k, l]
    K_points: Mapping[str, Array]  # (6, n, n) of forces along and moments about x, y, z at each interface
    # (3, 3, n, n) of the extent of payloads, which turn with their points: what S̄_kl has of it where K_x has it to
    # second order, too
    S_turned: Array

    def at(self, point: str) -> Array:
        """(6, n, n) of a point; zero where it is not known."""
        n = self.K_s.shape[-1]
        return self.K_points.get(point, np.zeros((6, n, n)))

    def transformed(self, T: Array) -> Stiffening:
        """In coordinates p' with p = T p'."""
        points = {name: T.T @ K @ T for name, K in self.K_points.items()}
        return Stiffening(T.T @ self.K_s @ T, T.T @ self.K_x @ T, MappingProxyType(points), T.T @ self.S_turned @ T)

    def with_payload(self, point: str, position: Array, phi: Array, mass: float, arm: Array, E: Array) -> Stiffening:
        """With a rigid mass (kg) at `arm` (3,) from one of its points, E (3, 3) = ∫ρ ξ ξᵀ dV about its center.

        position (3,) and `phi` = Φ_r (3, n) of the point. What is d from it moves by (exp φ~ − 1) d besides, so that
        pᵀG p = pᵀK p + pᵀK_r p × d − φ × (φ × d), with φ = Φ_r p, K along and K_r about the axes.
        """
        by_arm = self._by_arm(point, phi)
        G_center = self.at(point)[:3] + np.einsum("lbmn,b->lmn", by_arm, arm)
        K_x = self.K_x + mass * np.einsum("k,lmn->klmn", position + arm, G_center)
        turned = attached_integrals(0.0, position, E, np.zeros_like(phi), phi)["S_bar_kl"]
        return replace(
            self,
            K_s=self.K_s + mass * G_center,
            K_x=K_x + np.einsum("kb,lbmn->klmn", E, by_arm),
            S_turned=self.S_turned + turned,
        )

    def with_tool(self, name: str, point: str, phi: Array, arm: Array) -> Stiffening:
        """With a further point `name` at `arm` (3,) from one of its points, with which it moves and turns."""
        K = self.at(point).copy()
        K[:3] += np.einsum("lbmn,b->lmn", self._by_arm(point, phi), arm)
        return replace(self, K_points=MappingProxyType({**self.K_points, name: K}))

    def _by_arm(self, point: str, phi: Array) -> Array:
        """(3, 3, n, n) at [l, b]: what d_b from a point adds to pᵀG_l p of the point itself, Φ_r = phi (3, n)."""
        turning = np.einsum("am,bn->abmn", phi, phi)  # φ_a φ_b
        turning = 0.5 * (turning + turning.transpose(1, 0, 2, 3))
        by_arm = np.einsum("lab,amn->lbmn", LEVI_CIVITA, self.at(point)[3:])
        return as_floats(by_arm + np.einsum("lb,aamn->lbmn", np.eye(3), turning) - turning)


def from_modal_body(body: ModalBody, *, is_planar: bool = False) -> Stiffening | None:
    """What the file of a modal body holds; None where it lacks what motion in space asks, or in the plane z = 0.

    With K of its d'Alembert loads: K_s,i = −K(t_i), K_r,i = −K(r_i), K_ω,ii = K(omega_ii), K_ω,ij = ½ K(omega_ij).
    """
    inertial = unit_load_names(())
    if any(load not in body.geometric_stiffness for load in (IN_PLANE if is_planar else inertial)):
        return None
    zero = np.zeros((body.mode_count, body.mode_count))
    K = dict.fromkeys(inertial, zero) | dict(body.geometric_stiffness)
    K_omega = np.zeros((3, 3, body.mode_count, body.mode_count))
    for pair, (i, j) in PAIRS.items():
        K_omega[i, j] = K_omega[j, i] = K[f"omega_{pair}"] * (1.0 if i == j else 0.5)
    K_r = -np.array([K[f"r_{axis}"] for axis in "xyz"])
    # J_ij = … − pᵀK_ω,ij p and h_a = … − pᵀK_r,a by their integrals of x_k G_l
    K_x = (
        0.5 * np.einsum("ij,kkmn->ijmn", np.eye(3), K_omega)
        - K_omega
        + 0.5 * np.einsum("abc,amn->bcmn", LEVI_CIVITA, K_r)
    )
    loads = {name: interface_load_names([name]) for name in body.interfaces}
    needed = (0, 1, 5) if is_planar else range(6)
    points = {
        name: np.array([K.get(load, zero) for load in of_name])
        for name, of_name in loads.items()
        if all(of_name[k] in K for k in needed)
    }
    K_s = -np.array([K[f"t_{axis}"] for axis in "xyz"])
    return Stiffening(K_s, K_x, MappingProxyType(points), np.zeros_like(K_x))
