"""Fewer modes: the lowest ones of a body, and the static flexibility of the others where loads act on it.

Mode acceleration by residual vectors (Craig, Structural Dynamics, 1981, ch. 19; Dickens, Nakagawa and Wittbrodt, A
critique of mode acceleration and modal truncation augmentation methods, Comput. Struct. 62, 1997).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ..scene.mechanism import MechanismKeys
from .planar_body import PlanarBody, Reduction, transformed

IMMOBILE = 1e-9  # of the ordinary size of modes, 1/√m: less is rounding
DEPENDENT = 1e-8  # static shapes below this fraction of the first one, in energy, say nothing new


def with_fewer_modes(body: PlanarBody, lowest: int, loaded: Sequence[str]) -> PlanarBody:
    """The body with its `lowest` modes and, for each load at a point of `loaded`, the static response of the others.

    A unit load (modal forces Bᵀ) bends the discarded modes d by Ω_d⁻² B_dᵀ. These shapes, made orthonormal in mass and
    uncoupled, are further modes: the flexibility B K⁻¹ Bᵀ stays exact. The body comes back where nothing is saved.
    """
    if lowest >= body.n_modes:
        return body
    B_T = interface_loads(body, loaded)
    static, squares = _static_modes(body.stiffness[lowest:], B_T[lowest:])
    if lowest + len(squares) >= body.n_modes:
        return body
    T = np.eye(body.n_modes, lowest + len(squares))
    T[lowest:, lowest:] = static
    lift = T + (B_T - T @ (T.T @ B_T)) @ np.linalg.pinv(T.T @ B_T)
    reduced = transformed(body, T, np.concatenate([body.stiffness[:lowest], squares]))
    return replace(reduced, reduction=Reduction(body, lowest, T, lift))


def modes_kept(body: PlanarBody) -> str:
    """How many of the modes that move in the plane a body has, in words."""
    if body.reduction is None:
        return f"all {body.n_modes} modes"
    lowest, static = body.reduction.lowest, body.n_modes - body.reduction.lowest
    shapes = f" and {static} static shapes for the others" if static else ""
    return f"{lowest} of {body.reduction.whole.n_modes} modes{shapes}"


def loaded_points(scene: MechanismKeys, body: str) -> list[str]:
    """Points of a body at which joints, trajectories and loads of the scene act."""
    found = [reference.body_and_point for reference in scene.references() if reference.loaded]
    return list(dict.fromkeys(part[1] for part in found if part is not None and part[0] == body))


def interface_loads(body: PlanarBody, loaded: Sequence[str]) -> Array:
    """Bᵀ (n, loads): modal forces of forces along x and y and a moment at each point, scaled to size 1.

    Left out are loads under which nothing moves: forces on a support, along a link without axial modes.
    """
    rows = [np.zeros((0, body.n_modes))]
    for label, at in body.points.items():
        if label in loaded:
            rows.append(np.sqrt(body.mass) * np.vstack([at.translation, (body.length or 1.0) * at.rotation]))
    B = np.vstack(rows)
    magnitude = np.linalg.norm(B, axis=1)
    moving = magnitude > IMMOBILE
    return np.asarray((B[moving] / magnitude[moving, None]).T)


def _static_modes(squares: Array, B_T: Array) -> tuple[Array, Array]:
    """(n_d, r) mass-orthonormal combinations of modes of stiffness `squares` that carry the loads, and their ω²."""
    omega = np.sqrt(squares)[:, None]
    left, sizes, _ = np.linalg.svd(B_T / omega, full_matrices=False)
    V = left[:, sizes > DEPENDENT * sizes.max(initial=0.0)] / omega  # orthonormal in energy
    flexibility, turn = np.linalg.eigh(V.T @ V)
    shapes = (V @ turn / np.sqrt(flexibility))[:, ::-1]
    largest = np.abs(shapes).argmax(axis=0)
    signs = np.sign(shapes[largest, np.arange(shapes.shape[1])])
    return shapes * signs, 1.0 / flexibility[::-1]
