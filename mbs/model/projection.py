"""Bodies of planar scenes: of their motion what is in the plane z = 0 of their frames, by declaration.

What a mode moves across the plane keeps its share of m_ff = 1. Of masses the plane sees affine fields of displacement
that keep shapes alone: translations along x and y, an expansion (x, y) and a rotation (−y, x). A body gets the
integrals of a mass that is as wide along x as along y about its center, in which these are all there are: then
geometric stiffening, which is by affine fields, is the same in 3D.
"""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from ...common.arrays import Array, as_floats
from .. import _core
from .body import Body, BodyPoint, transformed

IMMOBILE = 1e-12  # of m_ff = 1: a mode that moves less of it in the plane does so by round-off
ALONG = np.array([1.0, 1.0, 0.0])
PLANE, TURN = np.diag(ALONG), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def projected(body: Body) -> Body:
    """A body without its motion across the plane z = 0 of its frame, and without modes that have no other."""
    moving = np.flatnonzero(np.einsum("kknn->n", body.S_bar_kl[:2, :2]) > IMMOBILE)
    kept = transformed(body, np.eye(body.n_modes)[:, moving], body.stiffness[moving])
    center = kept.first_moment * ALONG / kept.mass
    S_bar, S_bar_kl = ALONG[:, None] * kept.S_bar, _keeping_shapes(kept.S_bar_kl)
    about_center = np.trace(kept.second_moment[:2, :2]) - kept.mass * center @ center
    points = {
        label: BodyPoint(
            at.position * ALONG, ALONG[:, None] * at.translation, (1.0 - ALONG)[:, None] * at.rotation, at.triad
        )
        for label, at in kept.points.items()
    }
    planar = replace(
        kept, first_moment=kept.mass * center, S_bar=S_bar, S_bar_kl=S_bar_kl, points=MappingProxyType(points),
        second_moment=kept.mass * np.outer(center, center) + 0.5 * about_center * np.eye(3),
        I_bar=_about(center, S_bar, kept.I_bar), J_spin=0.0, h_spin=0.0 * kept.h_spin, S_spin=0.0 * kept.S_spin,
        attachment_modes=int(np.sum(moving >= body.n_eigenmodes)),
    )  # fmt: skip
    if kept.stiffening is None:
        return planar
    K_s = ALONG[:, None, None] * kept.stiffening.K_s
    K_points = {
        point: np.concatenate([ALONG, 1.0 - ALONG])[:, None, None] * K for point, K in kept.stiffening.K_points.items()
    }
    stiffening = replace(
        kept.stiffening,
        K_s=K_s,
        K_x=_about(center, K_s, kept.stiffening.K_x),
        K_points=MappingProxyType(K_points),
        S_turned=_keeping_shapes(kept.stiffening.S_turned),
    )
    return replace(planar, stiffening=stiffening)


def vanishing_in_plane(body: Body) -> tuple[str, ...]:
    """Return names of terms that are round-off in the planar equations of a body; none of a rigid one."""
    if not body.n_modes:
        return ()
    size = np.sqrt(body.mass) * max((float(np.linalg.norm(at.position)) for at in body.points.values()), default=0.0)
    terms = {
        "D_ff": (body.damping, 0.0),
        "j": (body.I_bar[0, 0] + body.I_bar[1, 1], IMMOBILE * size),
        "S_tilde": (body.spin_slope[2], IMMOBILE),
    }
    return tuple(name for name, (array, limit) in terms.items() if np.abs(array).max(initial=0.0) <= limit)


def _about(center: Array, S: Array, I: Array) -> Array:  # noqa: E741
    """∫ρ x_k u_l dV (3, 3, …) that keep shapes about the center, of S = ∫ρ u_l dV (3, …) and those of all fields."""
    moved = np.multiply.outer(center, S)
    return as_floats(moved + _keeping_shapes(I - moved))


def _keeping_shapes(I: Array) -> Array:  # noqa: E741
    """Of tensors (3, 3, …) the part in the plane that stretch and turn have."""
    stretch, turn = 0.5 * (I[0, 0] + I[1, 1]), 0.5 * (I[0, 1] - I[1, 0])
    return as_floats(np.multiply.outer(PLANE, stretch) + np.multiply.outer(TURN, turn))


EXACT = 1e-12  # of unit vectors, and of shapes relative to the largest: what round-off leaves of axes that are the same
UPRIGHT = 0.437  # of the normal along z of a triad: below it z is nearer to the plane (an angle that nobody draws)


class AcrossError(Exception):
    """Something moves across the plane."""


def axes_across(normal: Array) -> Array:
    """Return axes (3, 3), rows x, y and the normal; x is the axis x if the normal is perpendicular to it."""
    x = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    x = x - normal * (normal @ x)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal])


def axes_of_triad(normal: Array) -> Array:
    """Return axes (3, 3) of a planar marker, rows x, y and the normal, in axes of the triad it stands for.

    Revolute and planar joints have z along the normal and keep x and y, prismatic ones slide along z: it becomes x.
    """
    if abs(normal[2]) >= UPRIGHT:
        return axes_across(normal)
    z = np.eye(3)[2] - normal * normal[2]
    z /= np.linalg.norm(z)
    return np.array([z, np.cross(normal, z), normal])


def _is_small(across: Array, whole: Array) -> bool:
    return bool(np.abs(across).max(initial=0.0) <= EXACT * np.abs(whole).max(initial=0.0))


def planar_marker(marker: _core.SpatialMarker, axes: Array) -> _core.PlanarMarker:
    """Return the marker in 2D; `axes` (3, 3): rows x, y of the plane and its normal, body axes.

    Raises `AcrossError` if modes move it out of the plane.
    """
    planar, Phi, Phi_r = _core.PlanarMarker(), axes @ marker.Phi[:3], axes @ marker.Phi[3:]
    if not (_is_small(Phi[2], Phi) and _is_small(Phi_r[:2], Phi_r)):
        raise AcrossError
    x = axes @ marker.triad @ axes_of_triad(marker.triad.T @ axes[2])[0]
    planar.position, planar.angle = np.ascontiguousarray((axes @ marker.position)[:2]), float(np.arctan2(x[1], x[0]))
    planar.Phi = np.vstack([Phi[:2], Phi_r[2:]])
    if len(marker.K):
        K = np.einsum("skl,slmn->skmn", np.array([axes, axes]), np.reshape(marker.K, (2, 3, *marker.K[0].shape)))
        if not (_is_small(K[0, 2], K[0]) and _is_small(K[1, :2], K[1])):
            raise AcrossError
        planar.K = [K[0, 0], K[0, 1], K[1, 2]]
    return planar


def planar_data(data: _core.SpatialData, axes: Array) -> _core.PlanarData:
    """Return the constants of a body in 2D. Raises `AcrossError` if it bends out of the plane or twists."""
    planar, normal = _core.PlanarData(), axes[2]
    along = float(normal @ data.spin_axis)
    planar.mass, planar.first_moment = data.mass, np.ascontiguousarray(axes[:2] @ data.first_moment)
    planar.inertia = float(np.trace(data.J2) - normal @ data.J2 @ normal + data.J_spin * along**2)
    if len(data.stiffness):
        if np.any(data.h_spin) or np.any(data.S_spin):
            raise AcrossError
        n = len(data.stiffness)
        S = _turned(np.array(data.S_bar_kl).reshape(3, 3, n, n), axes)
        # ∫ρ u_n² dV of modes with ∫ρ u² dV = 1
        if np.diag(S[2, 2]).max() > EXACT or not _is_small(normal @ data.S_bar, data.S_bar):
            raise AcrossError
        I_bar = _turned(data.I_bar.reshape(3, 3, n), axes)
        planar.stiffness, planar.damping = data.stiffness, data.damping
        planar.S_bar = np.ascontiguousarray(axes[:2] @ data.S_bar)
        planar.h, planar.j = I_bar[0, 1] - I_bar[1, 0], I_bar[0, 0] + I_bar[1, 1]
        planar.S_tilde, planar.m_xy = S[0, 1] - S[1, 0], S[0, 0] + S[1, 1]
        if data.K_s:
            K_s = as_floats(np.einsum("kl,lmn->kmn", axes, np.array(data.K_s)))
            K_x = _turned(np.array(data.K_x).reshape(3, 3, n, n), axes)
            if not (_is_small(K_s[2], K_s) and _is_small(K_x[:, 2], K_x)):
                raise AcrossError
            planar.K = [K_s[0], K_s[1], K_x[0, 0] + K_x[1, 1], K_x[0, 1] - K_x[1, 0]]
            S, J2 = axes[:2] @ data.first_moment, axes[:2] @ data.J2 @ axes[:2].T
            N = np.block([[np.array([[data.mass]]), S[None]], [S[:, None], J2]])
            for moved, by_place in ((planar.S_bar, I_bar[:2, :2]), (K_s[:2], K_x[:2, :2])):
                _check_shapes(N, np.concatenate([moved[None], by_place]).reshape(3, 2, -1))
    planar.markers = [planar_marker(marker, axes) for marker in data.markers]
    return planar


def _check_shapes(N: Array, F: Array) -> None:
    """Raise `AcrossError` unless fields of displacement keep shapes: the core has no others of them in the plane.

    N (3, 3) and F (3, 2, fields): integrals of 1, x, y times 1, x, y, and times displacements along x and y.
    """
    (m, x, y), J = N[0], N[1, 1] + N[2, 2]
    by_shape = np.array([[m, 0, x, -y], [0, m, y, x], [x, y, J, 0], [-y, x, 0, J]])
    along_x, along_y, stretch, turn = np.linalg.solve(
        by_shape, np.array([F[0, 0], F[0, 1], F[1, 0] + F[2, 1], F[1, 1] - F[2, 0]])
    )
    fields = np.array([[along_x, along_y], [stretch, turn], [-turn, stretch]])
    if not _is_small(F - np.einsum("ij,jkn->ikn", N, fields), F):
        raise AcrossError


def _turned(tensor: Array, axes: Array) -> Array:
    return as_floats(np.einsum("ik,jl,kl...->ij...", axes, axes, tensor))
