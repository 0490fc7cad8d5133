"""Bodies in the equations of motion: invariants of the (R, e, p) equations, and sections. SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import about, of_rpy, skew
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body.lumped_masses import attached_integrals
from ...fe_models.modal_body.parts import LEVI_CIVITA, Invariants
from ...fe_models.modal_body.unit_loads import PAIRS, interface_load_names, unit_load_names
from ..fields.field_types import split_point
from ..scene.bodies import Tool

IN_PLANE = ("t_x", "t_y", "r_z", "omega_zz")
"""Inertial loads of motion in the plane z = 0."""


@struct
class Stiffening:
    """Integrals of G (n, n), 1/(kg·m): bending moves points by −½ pᵀ G_l p along axis l; K > 0 stiffens under load."""

    K_s: Array  # (3, n, n) ∫ρ G_l dV, 1/m
    K_x: Array  # (3, 3, n, n) ∫ρ x_k G_l dV at [k, l], no unit
    # (6, n, n) G of each interface along x, y, z, 1/(kg·m), and of its rotation about them, 1/(kg·m²)
    K_points: Mapping[str, Array]
    # (3, 3, n, n), no unit, part of S̄_kl by the extent of payloads, for equations with K_x alone: `Body.S_bar_kl`
    # lacks it
    S_turned: Array

    def at(self, point: str) -> Array:
        """Stiffness (6, n, n), 1/s² per N and N·m, of loads along and about x, y, z at a point; 0 if unknown."""
        n = self.K_s.shape[-1]
        return self.K_points.get(point, np.zeros((6, n, n)))

    def transformed(self, T: Array) -> "Stiffening":
        """The stiffness in coordinates p' (m,) with p = T p', T (n, m), no unit."""
        points = {name: T.T @ K @ T for name, K in self.K_points.items()}
        return Stiffening(T.T @ self.K_s @ T, T.T @ self.K_x @ T, MappingProxyType(points), T.T @ self.S_turned @ T)

    def with_payload(self, point: str, position: Array, phi: Array, mass: float, arm: Array, E: Array) -> "Stiffening":
        """Add a rigid payload: `mass`, kg, its center at `arm` (3,), m, from a point; E (3, 3) = ∫ρ ξ ξᵀ dV, kg·m².

        ξ is from its center; all are in the link's frame. `position` (3,), m, and `phi` = Φ_r (3, n), 1/(m·√kg), are of
        the point.
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

    def with_tool(self, name: str, point: str, phi: Array, arm: Array) -> "Stiffening":
        """Add a point `name` at `arm` (3,), m, from a point of the body with `phi` = Φ_r (3, n), 1/(m·√kg)."""
        K = self.at(point).copy()
        K[:3] += np.einsum("lbmn,b->lmn", self._by_arm(point, phi), arm)
        return replace(self, K_points=MappingProxyType({**self.K_points, name: K}))

    def _by_arm(self, point: str, phi: Array) -> Array:
        """(3, 3, n, n) at [l, b]: what d_b from a point adds to pᵀG_l p of the point itself, Φ_r = phi (3, n)."""
        turning = np.einsum("am,bn->abmn", phi, phi)  # φ_a φ_b
        turning = 0.5 * (turning + turning.transpose(1, 0, 2, 3))
        by_arm = np.einsum("lab,amn->lbmn", LEVI_CIVITA, self.at(point)[3:])
        return by_arm + np.einsum("lb,aamn->lbmn", np.eye(3), turning) - turning


def stiffening_of(body: ModalBody, *, is_planar: bool) -> Stiffening | None:
    """The geometric stiffness in a modal body; None if the file lacks what 3D or planar motion needs.

    It follows from K of d'Alembert loads (theory.md, Eq. 52).
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


@struct
class BodyPoint:
    """A section of a body: position (3,), m, Φ as `translation` (3, n), 1/√kg, Φ_r as `rotation` (3, n), 1/(m·√kg).

    All are in body axes. `triad` (3, 3): its axes, columns; those of a tool may differ from those of the body.
    """

    position: Array
    translation: Array
    rotation: Array
    triad: Array = field(default_factory=lambda: np.eye(3))

    @property
    def is_turned(self) -> bool:
        """Whether axes of the section differ from those of the body."""
        return not np.array_equal(self.triad, np.eye(3))


@dataclass(frozen=True, kw_only=True, eq=False)
class Body(Invariants):
    """Constants of one body in the equations of motion, SI units (Shabana, Dynamics of Multibody Systems, ch. 5).

    Arrays are over all n modes of the equations; `m_ff` = 1. `S_bar_kl` is without S_spin, which files have at [2, 2].
    """

    name: str  # of the body
    stiffness: Array  # K_ff (n,) in rad²/s²
    damping: Array  # D_ff (n, n) in 1/s
    points: Mapping[str, BodyPoint]  # its sections by name
    modal_transform: Array  # (n_file, n) from p to modal coordinates of the file, no unit
    length: float | None = None  # of a link in m; None of a rigid body
    reduction: "Reduction | None" = None  # where it has fewer modes than its file
    attachment_modes: int = 0  # how many of the n, after all others, are static shapes of loads at interfaces
    stiffening: Stiffening | None = None  # geometric stiffness; left out of the equations where None

    @property
    def n_modes(self) -> int:
        """Number n of modal coordinates in the equations."""
        return len(self.stiffness)

    @property
    def n_eigenmodes(self) -> int:
        """Number of modes that count as modes of the link, for `modes = k`."""
        return self.n_modes - self.attachment_modes

    @property
    def whole(self) -> "Body":
        """The body with all modes of its file."""
        return self if self.reduction is None else self.reduction.whole

    @cached_property
    def on_file(self) -> Array:
        """Matrix (n, n_file), no unit: modal forces F_p (n,), N/√kg, times it do the same work on the file's modes.

        After `truncation.with_fewer_modes`, these forces are those of loads at its `loaded` points.
        """
        if self.reduction is not None:
            return self.reduction.lift.T @ self.whole.on_file
        return np.linalg.pinv(self.modal_transform)

    @property
    def inertia(self) -> Array:
        """Inertia tensor J0 (3, 3) about the origin of the frame, kg·m²."""
        J: Array = np.trace(self.second_moment) * np.eye(3) - self.second_moment
        J[0, 0] += self.J_spin
        return J

    @property
    def largest_moment(self) -> float:
        """Largest moment of inertia about the origin, kg·m²; |p|² of this size bends the body by about its length."""
        return max(float(np.linalg.eigvalsh(self.inertia)[-1]), 0.0)

    @property
    def inertia_slope(self) -> Array:
        """J1 (3, 3, n), √kg·m, change of the inertia tensor by modes."""
        return 2 * np.einsum("ij,kkn->ijn", np.eye(3), self.I_bar) - self.I_bar - self.I_bar.transpose(1, 0, 2)

    @property
    def spin(self) -> Array:
        """h0 (3, n), √kg·m, angular momentum by modal rates of the undeformed body."""
        h: Array = np.einsum("abc,bcn->an", LEVI_CIVITA, self.I_bar)
        h[0] += self.h_spin
        return h

    @property
    def spin_slope(self) -> Array:
        """H (3, n, n), skew, no unit: change of `spin` by deformation, h_a(p) = h0_a + pᵀH_a."""
        S = self.S_bar_kl
        return np.array([S[1, 2] - S[2, 1], S[2, 0] - S[0, 2], S[0, 1] - S[1, 0]])


@struct
class Reduction:
    """Relation of a body with m coordinates to all n modes, without units; see `truncation.with_fewer_modes`."""

    whole: Body  # the body with all n modes of its file
    lowest: int  # number of modes that are kept; other coordinates are static shapes
    T: Array  # (n, m) coordinates of `whole` from the m ones, TᵀT = 1
    # (n, m) modal forces on all modes from those on the m coordinates, Tᵀ lift = 1: exact for forces that come from
    # loads at the loaded points
    lift: Array


def transformed(body: Body, T: Array, stiffness: Array) -> Body:
    """The body in p' with p = T p', T (n, m), no unit: m_ff = 1, K_ff = diag(`stiffness` (m,)), rad²/s²."""
    return replace(
        body,
        stiffness=stiffness,
        damping=T.T @ body.damping @ T,
        S_bar=body.S_bar @ T,
        I_bar=body.I_bar @ T,
        S_bar_kl=T.T @ body.S_bar_kl @ T,
        h_spin=body.h_spin @ T,
        S_spin=T.T @ body.S_spin @ T,
        points=MappingProxyType(
            {
                label: replace(at, translation=at.translation @ T, rotation=at.rotation @ T)
                for label, at in body.points.items()
            }
        ),
        modal_transform=body.modal_transform @ T,
        stiffening=body.stiffening and body.stiffening.transformed(T),
    )


def scaled(body: Body, *, mass: float = 1.0, stiffness: float = 1.0) -> Body:
    """The body with its mass and stiffness times factors `mass` and `stiffness`, at the same damping ratios."""
    of_mass = ("mass", "first_moment", "second_moment", "S_bar", "I_bar", "S_bar_kl", "J_spin", "h_spin", "S_spin")
    damping = body.damping * (mass * stiffness) ** 0.5
    heavier = replace(body, damping=damping, **{key: mass * getattr(body, key) for key in of_mass})
    if (of := body.stiffening) is not None:
        scaled_up = {key: mass * getattr(of, key) for key in ("K_s", "K_x", "S_turned")}
        heavier = replace(heavier, stiffening=replace(of, **scaled_up))
    heavy = transformed(heavier, np.eye(body.n_modes) / mass**0.5, body.stiffness * stiffness / mass)
    if (kept := body.reduction) is not None:
        heavy = replace(heavy, reduction=replace(kept, whole=scaled(kept.whole, mass=mass, stiffness=stiffness)))
    return heavy


def from_modal_body(name: str, body: ModalBody, stiffened: bool = False, *, is_planar: bool = False) -> Body:
    """Make a body with all modes of a modal body; `stiffened`: with geometric stiffness; `is_planar`: in z = 0.

    Raises `InputError` where the file lacks the inertia of a beam about its own axis, or the geometric stiffness.
    """
    stiffening = stiffening_of(body, is_planar=is_planar) if stiffened else None
    if stiffened and stiffening is None:
        raise InputError(
            "geometric_stiffening: expected modal bodies with the geometric stiffness of all accelerations"
            " (geometric_stiffness/t_x to omega_yz)",
            f'none in that of "{name}": make it again from its link file with `ffrobot link`',
        )
    J_spin, h_spin, S_spin = _spin_inertia(name, body, is_planar=is_planar)
    S_bar_kl = body.S_bar_kl.copy()
    S_bar_kl[2, 2] -= S_spin
    omega = 2 * np.pi * body.frequency
    sections = dict(body.interfaces)
    sections.setdefault("mid", body.interpolate(body.begin + body.length / 2))
    return Body(
        name=name,
        mass=body.mass,
        first_moment=body.first_moment,
        second_moment=body.second_moment,
        S_bar=body.S_bar,
        I_bar=body.I_bar,
        S_bar_kl=S_bar_kl,
        J_spin=J_spin,
        h_spin=h_spin,
        S_spin=S_spin,
        stiffness=np.diag(body.stiffness).copy(),
        damping=np.diag(2 * body.damping_ratio * omega),
        points=MappingProxyType(
            {label: BodyPoint(at.position, at.translation, at.rotation) for label, at in sections.items()}
        ),
        modal_transform=np.eye(len(omega)),
        length=body.length,
        attachment_modes=int(body.residual.sum()),
        stiffening=stiffening,
    )


def rigid_body(name: str, mass: float, center: Array, inertia: Array, points: Mapping[str, Array]) -> Body:
    """Make a body without modes: `mass`, kg, at `center` (3,), m, `inertia` (3, 3), kg·m², about it, points (3,), m."""
    places = {label: np.asarray(position, dtype=float) for label, position in points.items()}
    if "mid" not in places and {"root", "tip"} <= places.keys():
        places["mid"] = (places["root"] + places["tip"]) / 2
    none, center = np.zeros((3, 0)), np.asarray(center, dtype=float)
    return Body(
        name=name,
        mass=mass,
        first_moment=mass * center,
        second_moment=0.5 * np.trace(inertia) * np.eye(3) - inertia + mass * np.outer(center, center),
        S_bar=none,
        I_bar=np.zeros((3, 3, 0)),
        S_bar_kl=np.zeros((3, 3, 0, 0)),
        J_spin=0.0,
        h_spin=np.zeros(0),
        S_spin=np.zeros((0, 0)),
        stiffness=np.zeros(0),
        damping=np.zeros((0, 0)),
        points=MappingProxyType({label: BodyPoint(position, none, none) for label, position in places.items()}),
        modal_transform=np.zeros((0, 0)),
    )


def _spin_inertia(name: str, body: ModalBody, *, is_planar: bool) -> tuple[float, Array, Array]:
    """J_s, h_s, S_s; files of earlier versions lack them, which matters for beams alone, and not in the plane."""
    if body.J_spin is not None and body.h_spin is not None and body.S_spin is not None:
        return body.J_spin, body.h_spin, body.S_spin
    if is_planar or body.kind != "beam":
        return 0.0, np.zeros(body.mode_count), np.zeros((body.mode_count, body.mode_count))
    raise InputError(
        f'body "{name}": expected a modal body file with the inertia of the beam about its own axis'
        ' (invariants/J_spin, h_spin, S_spin), which space = "spatial" needs',
        "one of an earlier version without it. Recompute it from its link file with `ffrobot link`",
    )


class BentSection(NamedTuple):
    """Section of a bent body to second order: position u = x + Φp − … (…, 3), m, rotation φ = Φ_r p − … (…, 3), rad."""

    u: Array
    phi: Array


def bent_section(body: Body, point: str, p: Array) -> BentSection:
    """The section `point` of a body bent by p (…, n), √kg·m, in body axes."""
    at = body.points[point]
    u, phi = at.position + p @ at.translation.T, p @ at.rotation.T
    if body.stiffening is None:
        return BentSection(u, phi)
    second = 0.5 * np.einsum("kmn,...m,...n->...k", body.stiffening.at(point), p, p)
    return BentSection(u - second[..., :3], phi - second[..., 3:])


def orientation(tool: Tool) -> Array:
    """The axes (3, 3) of a tool, unit columns, in body axes."""
    return about(2, tool.angle) @ of_rpy(*tool.rpy)


def with_tool(body: Body, tool: Tool) -> Body:
    """The body with a tool as one more point, at d from a section: bending moves it by Φp + φ × d, φ = Φ_r p.

    Geometric stiffness adds ½ φ × (φ × d): see `Stiffening.with_tool`.
    """
    point = split_point(tool.point)[1]
    at, d = body.points[point], np.array(tool.at)
    translation = at.translation - skew(d) @ at.rotation
    placed = replace(at, position=at.position + d, translation=translation, triad=orientation(tool))
    stiffening = body.stiffening
    if stiffening is not None and point in stiffening.K_points:
        stiffening = stiffening.with_tool(tool.name, point, at.rotation, d)
    return replace(body, points=MappingProxyType({**body.points, tool.name: placed}), stiffening=stiffening)
