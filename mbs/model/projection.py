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
    found = replace(
        kept, first_moment=kept.mass * center, S_bar=S_bar, S_bar_kl=S_bar_kl, points=MappingProxyType(points),
        second_moment=kept.mass * np.outer(center, center) + 0.5 * about_center * np.eye(3),
        I_bar=_about(center, S_bar, kept.I_bar), J_spin=0.0, h_spin=0.0 * kept.h_spin, S_spin=0.0 * kept.S_spin,
        attachment_modes=int(np.sum(moving >= body.n_eigenmodes)),
    )  # fmt: skip
    if kept.stiffening is None:
        return found
    K_s = ALONG[:, None, None] * kept.stiffening.K_s
    K_points = {
        point: np.concatenate([ALONG, 1.0 - ALONG])[:, None, None] * K for point, K in kept.stiffening.K_points.items()
    }
    stiffening = replace(
        kept.stiffening, K_s=K_s, K_x=_about(center, K_s, kept.stiffening.K_x), K_points=MappingProxyType(K_points),
        S_turned=_keeping_shapes(kept.stiffening.S_turned),
    )  # fmt: skip
    return replace(found, stiffening=stiffening)


def vanishing_in_plane(body: Body) -> tuple[str, ...]:
    """Which terms of the equations in the plane are round-off for the modes of a body; none of a rigid one."""
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
