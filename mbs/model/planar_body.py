"""What a planar scene needs of a body: invariants of the (R, θ, p) equations and the points where things attach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...fe_models.modal_body import ModalBody
from ..scene.bodies import RigidBody
from . import geometric_stiffening
from .geometric_stiffening import GeometricStiffening

# Terms below this fraction of their natural size are rounding of the FE stage: they are left out of the equations.
NEGLIGIBLE = 1e-12


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
    reduction: Reduction | None = None  # where it has fewer modes than move in the plane
    attachment_modes: int = 0  # how many of the n, after all others, are static shapes of loads at interfaces

    @property
    def n_modes(self) -> int:
        """Number n of modal coordinates in the equations."""
        return len(self.stiffness)

    @property
    def n_eigenmodes(self) -> int:
        """How many of them count as modes of the link: for patches, for `modes = k`."""
        return self.n_modes - self.attachment_modes


@dataclass(frozen=True)
class Reduction:
    """How a body came by fewer modes: see `truncation.with_fewer_modes`.

    Attributes:
        whole: the body with all n modes that move in the plane.
        lowest: how many of these it kept; the other coordinates stand for the rest.
        T: (n, m) coordinates of `whole` from the m that it has, TᵀT = 1.
        lift: (n, m) modal forces on all modes from those on the m coordinates, Tᵀ lift = 1: exact for forces that come
            from loads at the loaded points.
    """

    whole: PlanarBody
    lowest: int
    T: Array
    lift: Array


def from_modal_body(name: str, body: ModalBody) -> PlanarBody:
    """The planar part of a modal body: modes without motion in the plane are left out, their p stay zero.

    Geometric stiffness comes along where the file has it; who wants equations without it puts None in its place.
    """
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
        stiffening=geometric_stiffening.from_modal_body(body, in_plane),
        attachment_modes=int(body.residual[in_plane].sum()),
    )
    return diagonalised(planar, body.stiffness[block], np.eye(len(in_plane)))


def from_rigid_body(name: str, body: RigidBody) -> PlanarBody:
    """A body without modes; inertia is moved from the center of mass to the origin of the frame (Steiner)."""
    none, center = np.zeros(0), np.array(body.center)
    points = {label: np.array(position) for label, position in body.points.items()}
    if "mid" not in points and {"root", "tip"} <= points.keys():
        points["mid"] = (points["root"] + points["tip"]) / 2
    return PlanarBody(
        name=name,
        mass=body.mass,
        inertia=body.inertia + body.mass * float(center @ center),
        first_moment=body.mass * center,
        stiffness=none,
        damping=np.zeros((0, 0)),
        S_bar=np.zeros((2, 0)),
        h=none,
        j=none,
        S_tilde=np.zeros((0, 0)),
        m_xy=np.zeros((0, 0)),
        points=MappingProxyType(
            {label: PlanarPoint(position, np.zeros((2, 0)), none) for label, position in points.items()}
        ),
        modal_transform=np.zeros((0, 0)),
        length=None,
    )


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


def core_arguments(body: PlanarBody, markers: list[PlanarPoint], names: list[str]) -> dict[str, Any]:
    """Arguments of `_core.System.add_body`; terms that vanish are passed as empty arrays, which the core skips."""
    if body.stiffening is not None:
        body = replace(body, m_xy=body.m_xy + body.stiffening.rotary)
    n, vanishing = body.n_modes, vanishing_terms(body)
    diagonal = np.array_equal(body.damping, np.diag(np.diag(body.damping)))
    none = np.zeros((0, 0))
    rows = [body.S_bar, body.h[None], *(np.vstack([m.translation, m.rotation]) for m in markers)]
    return {
        "mass": body.mass,
        "inertia": body.inertia,
        "first_moment": body.first_moment,
        "stiffness": body.stiffness,
        "damping": none if "D_ff" in vanishing else np.diag(body.damping)[:, None] if diagonal else body.damping,
        "W": np.vstack(rows) if n else np.zeros((3 + 3 * len(markers), 0)),
        "j": np.zeros(0) if "j" in vanishing else body.j,
        "S_tilde": none if "S_tilde" in vanishing else body.S_tilde,
        "m_xy": none if "m_xy - 1" in vanishing else body.m_xy,
        "marker_positions": [m.position for m in markers],
        **geometric_stiffening.core_arguments(body.stiffening, names),
    }


def vanishing_terms(body: PlanarBody) -> tuple[str, ...]:
    """Which terms of the equations are nothing but rounding for the modes of a body; none of a rigid one."""
    if not body.n_modes:
        return ()
    size = np.sqrt(body.mass) * max((float(np.linalg.norm(p.position)) for p in body.points.values()), default=0.0)
    sizes = {
        "D_ff": (body.damping, 0.0),
        "j": (body.j, NEGLIGIBLE * size),
        "S_tilde": (body.S_tilde, NEGLIGIBLE),
        "m_xy - 1": (body.m_xy - np.eye(body.n_modes), NEGLIGIBLE),
    }
    return tuple(name for name, (array, limit) in sizes.items() if np.abs(array).max(initial=0.0) <= limit)
