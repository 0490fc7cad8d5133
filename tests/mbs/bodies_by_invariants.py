"""Planar bodies by their invariants, as docs/theory.md writes the (R, θ, p) equations: what `oracle` is made of.

`in_3d` is how models get them; payloads, rigid bodies and modal bodies come to the same by their own formulas here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ffrobot.common.arrays import Array
from ffrobot.fe_models.modal_body import ModalBody
from ffrobot.mbs.model.body import Body, BodyPoint
from ffrobot.mbs.model.projection import projected
from ffrobot.mbs.model.stiffening import Stiffening

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


@dataclass(frozen=True)
class PlanarPoint:
    """A point of a body: position (2,) m, Φx and Φy as `translation` (2, n), section rotation (n,), in body axes."""

    position: Array
    translation: Array
    rotation: Array


@dataclass(frozen=True)
class PlanarBody:
    """Constants of one body in the equations of motion (docs/theory.md; Shabana, Dynamics of Multibody Systems, ch. 5).

    Arrays are over the n modes that move in the plane; p of the modal file is `modal_transform` (n_file, n) times p.
    `m_ff` is the identity. Symbols: S_bar = S̄ (2, n); h = Ī_12 − Ī_21 (n,); j = Ī_11 + Ī_22 (n,);
    S_tilde = S̄_12 − S̄_21 (n, n); m_xy = S̄_11 + S̄_22 (n, n); first_moment s0 (2,) kg·m; inertia about the origin of
    the frame, kg·m²; stiffness K_ff (n,) rad²/s²; damping D_ff (n, n) 1/s.
    """

    name: str
    mass: float
    inertia: float
    first_moment: Array
    stiffness: Array
    damping: Array
    S_bar: Array
    h: Array
    j: Array
    S_tilde: Array
    m_xy: Array
    points: Mapping[str, PlanarPoint]
    modal_transform: Array
    length: float | None
    stiffening: GeometricStiffening | None = None  # left out of the equations where None
    attachment_modes: int = 0  # how many of the n, after all others, are static shapes of loads at interfaces

    @property
    def n_modes(self) -> int:
        """Number n of modal coordinates in the equations."""
        return len(self.stiffness)

    @property
    def n_eigenmodes(self) -> int:
        """How many of them count as modes of the link: for patches, for `modes = k`."""
        return self.n_modes - self.attachment_modes


def from_modal_body(name: str, body: ModalBody) -> PlanarBody:
    """The planar part of a modal body: modes without motion in the plane are left out, their p stay zero."""
    m_xy = body.S_bar_kl[0, 0] + body.S_bar_kl[1, 1]
    in_plane = np.flatnonzero(np.diag(m_xy) > NEGLIGIBLE)
    block = np.ix_(in_plane, in_plane)
    omega = 2 * np.pi * body.frequency
    points = {label: (i.position, i.translation, i.rotation) for label, i in body.interfaces.items()}
    if "mid" not in points:
        mid = body.interpolate(body.length / 2)
        points["mid"] = (mid.position, mid.translation, mid.rotation)
    planar = PlanarBody(
        name=name,
        mass=body.mass,
        inertia=float(body.second_moment[0, 0] + body.second_moment[1, 1]),
        first_moment=body.first_moment[:2].copy(),
        stiffness=np.diag(body.stiffness)[in_plane],
        damping=np.diag(2 * body.damping_ratio * omega)[block],
        S_bar=body.S_bar[:2, in_plane],
        h=(body.I_bar[0, 1] - body.I_bar[1, 0])[in_plane],
        j=(body.I_bar[0, 0] + body.I_bar[1, 1])[in_plane],
        S_tilde=(body.S_bar_kl[0, 1] - body.S_bar_kl[1, 0])[block],
        m_xy=m_xy[block],
        points=MappingProxyType(
            {
                label: PlanarPoint(position[:2], translation[:2, in_plane], rotation[2, in_plane])
                for label, (position, translation, rotation) in points.items()
            }
        ),
        modal_transform=np.eye(len(omega))[:, in_plane],
        length=body.length,
        stiffening=_stiffening(body, in_plane),
        attachment_modes=int(body.residual[in_plane].sum()),
    )
    return diagonalised(planar, body.stiffness[block], np.eye(len(in_plane)))


def _stiffening(body: ModalBody, in_plane: Array) -> GeometricStiffening | None:
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


def rigid_body(name, mass, inertia, center, points) -> PlanarBody:
    """A body without modes, `inertia` about its center; it is moved to the origin of the frame (Steiner)."""
    none, center = np.zeros(0), np.array(center)
    places = {label: np.array(position) for label, position in points.items()}
    if {"root", "tip"} <= places.keys():
        places.setdefault("mid", (places["root"] + places["tip"]) / 2)
    return PlanarBody(
        name=name, mass=mass, inertia=inertia + mass * float(center @ center), first_moment=mass * center,
        stiffness=none, damping=np.zeros((0, 0)), S_bar=np.zeros((2, 0)), h=none, j=none, S_tilde=np.zeros((0, 0)),
        m_xy=np.zeros((0, 0)), modal_transform=np.zeros((0, 0)), length=None,
        points=MappingProxyType({label: PlanarPoint(at, np.zeros((2, 0)), none) for label, at in places.items()}),
    )  # fmt: skip


def with_payload(body: PlanarBody, point: str, mass: float, inertia: float) -> PlanarBody:
    """The body with a point mass (kg) and moment of inertia (kg·m²) on one of its points, modes made anew."""
    at = body.points[point]
    stiffening = body.stiffening and body.stiffening.with_payload(point, at.position, at.rotation, mass, inertia)
    return _with_mass(replace(body, stiffening=stiffening), at, mass, inertia)


def _with_mass(body: PlanarBody, at: PlanarPoint, mass: float, inertia: float) -> PlanarBody:
    """Masses are summed into every invariant as more material points (integrals become sums)."""
    (x, y), (Phi_x, Phi_y), phi = at.position, at.translation, at.rotation
    xy = mass * np.outer(Phi_x, Phi_y)
    m_xy = mass * (np.outer(Phi_x, Phi_x) + np.outer(Phi_y, Phi_y))
    loaded = replace(
        body,
        mass=body.mass + mass,
        inertia=body.inertia + mass * (x * x + y * y) + inertia,
        first_moment=body.first_moment + mass * at.position,
        S_bar=body.S_bar + mass * at.translation,
        h=body.h + mass * (x * Phi_y - y * Phi_x) + inertia * phi,
        j=body.j + mass * (x * Phi_x + y * Phi_y),
        S_tilde=body.S_tilde + xy - xy.T,
        m_xy=body.m_xy + m_xy,
    )
    return diagonalised(loaded, np.diag(body.stiffness), np.eye(body.n_modes) + m_xy + inertia * np.outer(phi, phi))


def diagonalised(body: PlanarBody, K_ff: Array, m_ff: Array) -> PlanarBody:
    """The body in modal coordinates that make m_ff the identity and K_ff diagonal; unchanged if they are already."""
    off_diagonal = K_ff - np.diag(np.diag(K_ff))
    if np.array_equal(m_ff, np.eye(len(m_ff))) and np.abs(off_diagonal).max(initial=0.0) <= 1e-9 * np.abs(K_ff).max(
        initial=0.0
    ):
        return replace(body, stiffness=np.diag(K_ff).copy())
    L_inverse = np.linalg.inv(np.linalg.cholesky(m_ff))
    stiffness, vectors = np.linalg.eigh(L_inverse @ K_ff @ L_inverse.T)
    return transformed(body, L_inverse.T @ vectors, stiffness)


def transformed(body: PlanarBody, T: Array, stiffness: Array) -> PlanarBody:
    """The body in coordinates p' with p = T p', T (n, m), in which m_ff is the identity and K_ff diag(stiffness)."""
    return replace(
        body,
        stiffness=stiffness,
        damping=T.T @ body.damping @ T,
        S_bar=body.S_bar @ T,
        h=body.h @ T,
        j=body.j @ T,
        S_tilde=T.T @ body.S_tilde @ T,
        m_xy=T.T @ body.m_xy @ T,
        points=MappingProxyType(
            {
                label: PlanarPoint(point.position, point.translation @ T, point.rotation @ T)
                for label, point in body.points.items()
            }
        ),
        modal_transform=body.modal_transform @ T,
        stiffening=body.stiffening and body.stiffening.transformed(T),
    )


def in_3d(body: PlanarBody) -> Body:
    """The body whose motion in z = 0 is that of `body`; what it is across the plane, nothing in it sees."""
    none, about_z = np.zeros((3, body.n_modes)), np.array([0.0, 0.0, 1.0])[:, None]
    stretch, turn = np.diag([0.5, 0.5, 0.0]), np.array([[0.0, 0.5, 0.0], [-0.5, 0.0, 0.0], [0.0, 0.0, 0.0]])

    def fields(of_stretch: Array, of_turn: Array) -> Array:  # (3, 3, …) with these integrals of (x, y) and (−y, x)
        return np.multiply.outer(stretch, of_stretch) + np.multiply.outer(turn, of_turn)

    def vectors(x_y: Array) -> Array:
        return np.concatenate([x_y, np.zeros_like(x_y[:1])])

    points = {
        label: BodyPoint(vectors(at.position), vectors(at.translation), about_z * at.rotation)
        for label, at in body.points.items()
    }
    stiffening, n = body.stiffening, body.n_modes
    if stiffening is not None:
        known = {label: np.array([K[0], K[1], *np.zeros((3, n, n)), K[2]]) for label, K in stiffening.K_points.items()}
        stiffening = Stiffening(
            vectors(stiffening.K_s), fields(stiffening.by_affine_fields[2], stiffening.K_h), MappingProxyType(known),
            fields(stiffening.rotary, 0.0 * stiffening.rotary),
        )  # fmt: skip
    found = Body(
        name=body.name, mass=body.mass, first_moment=vectors(body.first_moment),
        second_moment=fields(np.array(body.inertia), np.array(0.0)), S_bar=vectors(body.S_bar),
        I_bar=fields(body.j, body.h), S_bar_kl=fields(body.m_xy, body.S_tilde), J_spin=0.0, h_spin=none[0],
        S_spin=np.zeros((n, n)), stiffness=body.stiffness, damping=body.damping, points=MappingProxyType(points),
        modal_transform=body.modal_transform, length=body.length, attachment_modes=body.attachment_modes,
        stiffening=stiffening,
    )  # fmt: skip
    return projected(found)
