"""Geometric stiffening of a planar body: what loads along a link do to its bending stiffness, and the energy with it.

A unit load has the geometric stiffness K (n, n) of the prestress it causes. By virtual work, the displacement along
that load is then Φp − ½ pᵀK p: to second order, a bent link is shorter. Everything else follows from it: mass matrix,
velocity terms, gravity, constraints (docs/theory.md, Geometric stiffness).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, Indices
from ...fe_models.modal_body import ModalBody

NEGLIGIBLE = 1e-12


@dataclass(frozen=True)
class GeometricStiffening:
    """K of unit loads, in the modal coordinates of a `PlanarBody`; positive where it stiffens.

    K_omega (n, n) of θ̇² = 1; K_s (2, n, n) of forces ρ along x and y (the opposite of a frame acceleration); K_h (n, n)
    likewise of an angular acceleration; K_points: (3, n, n) of forces along x and y and a moment at each interface.
    rotary (n, n): Σ I_p φφᵀ of payloads, which have no extent: what K_omega and m_xy would have more of if their moment
    of inertia were masses about the point, which turn with it.
    """

    K_omega: Array
    K_s: Array
    K_h: Array
    K_points: Mapping[str, Array]
    rotary: Array

    @property
    def by_affine_fields(self) -> list[Array]:
        """Four (n, n): of translations along x and y, of stretch and of turn, as the core takes them."""
        return [*self.K_s, self.K_omega + self.rotary, self.K_h]

    def turns(self, point: str) -> bool:
        """Whether the section at a point turns to second order, which those of beams do not."""
        largest = max((float(np.abs(K).max(initial=0.0)) for K in self.K_points.values()), default=0.0)
        return point in self.K_points and bool(np.abs(self.K_points[point][2]).max(initial=0.0) > NEGLIGIBLE * largest)

    def transformed(self, T: Array) -> GeometricStiffening:
        """In coordinates p' with p = T p'."""
        points = {name: T.T @ K @ T for name, K in self.K_points.items()}
        return GeometricStiffening(
            T.T @ self.K_omega @ T,
            T.T @ self.K_s @ T,
            T.T @ self.K_h @ T,
            MappingProxyType(points),
            T.T @ self.rotary @ T,
        )

    def with_payload(
        self, point: str, position: Array, rotation: Array, mass: float, inertia: float
    ) -> GeometricStiffening:
        """With a mass (kg) and moment of inertia (kg·m²) at one of its points: the loads of their inertia are added.

        position (2,) m and section rotation (n,) of the point.
        """
        n = len(self.K_h)
        K_x, K_y, K_phi = self.K_points.get(point, np.zeros((3, n, n)))
        x, y = position
        return GeometricStiffening(
            self.K_omega + mass * (x * K_x + y * K_y),
            self.K_s + mass * np.array([K_x, K_y]),
            self.K_h + mass * (x * K_y - y * K_x) + inertia * K_phi,
            self.K_points,
            self.rotary + inertia * np.outer(rotation, rotation),
        )


def from_modal_body(body: ModalBody, in_plane: Indices) -> GeometricStiffening | None:
    """What the file of a modal body holds for planar motion; None where it holds nothing of the kind."""
    K = {load: matrix[np.ix_(in_plane, in_plane)] for load, matrix in body.geometric_stiffness.items()}
    if "omega_zz" not in K:
        return None
    points = {
        name: np.array([K[f"force/{name}/x"], K[f"force/{name}/y"], K[f"moment/{name}/z"]])
        for name in body.interfaces
        if f"force/{name}/x" in K
    }
    # The file's loads are d'Alembert's: opposite to the acceleration.
    return GeometricStiffening(
        K["omega_zz"],
        np.array([-K["t_x"], -K["t_y"]]),
        -K["r_z"],
        MappingProxyType(points),
        np.zeros((len(in_plane), len(in_plane))),
    )


def core_arguments(stiffening: GeometricStiffening | None, markers: list[str]) -> dict[str, list[Array]]:
    """Arguments of `_core.System.add_body`, with empty matrices for those that vanish.

    `second_order` is by rows of markers; `geometric_stiffness` is K of mbs/core/body/affine_inertia.h: of x, y, stretch
    and turn.
    """
    none = np.zeros((0, 0))
    if stiffening is None:
        return {"second_order": [], "geometric_stiffness": [none] * 4}
    n = len(stiffening.K_omega)
    at_markers = [K for name in markers for K in stiffening.K_points.get(name, np.zeros((3, n, n)))]
    affine = stiffening.by_affine_fields
    largest = max(float(np.abs(K).max(initial=0.0)) for K in [*at_markers, *affine])

    def kept(matrices: list[Array]) -> list[Array]:
        return [K if np.abs(K).max(initial=0.0) > NEGLIGIBLE * largest else none for K in matrices]

    return {"second_order": kept(at_markers), "geometric_stiffness": kept(affine)}


def second_order_displacement(stiffening: GeometricStiffening | None, point: str, p: Array) -> Array:
    """−½ pᵀK p (T, 2) of a point, for p (T, n), in body axes; zero where it is not known."""
    if stiffening is None or point not in stiffening.K_points:
        return np.zeros((len(p), 2))
    displacement: Array = -0.5 * np.einsum("ti,kij,tj->tk", p, stiffening.K_points[point][:2], p)
    return displacement
