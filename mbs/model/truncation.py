"""Fewer modes: the lowest ones of a body, and the static flexibility of the others where loads act on it. SI units.

Mode acceleration by residual vectors (Craig, Structural Dynamics, 1981, ch. 19; Dickens, Nakagawa and Wittbrodt, A
critique of mode acceleration and modal truncation augmentation methods, Comput. Struct. 62, 1997).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...common.arrays import Array
from ..scene.mechanism import MechanismKeys
from .body import Body, Reduction, transformed
from .masses import coupled_blocks

IMMOBILE = 1e-9  # of the ordinary size of modes, 1/√m: less is round-off
DEPENDENT = 1e-8  # of the first static shape, in energy: smaller ones are dependent


def with_fewer_modes(body: Body, lowest: int, loaded: Sequence[str]) -> Body:
    """The body with its `lowest` modes and the static response of others to each load at points `loaded`.

    A unit load bends the discarded modes. These shapes, orthonormal in mass and uncoupled, are further modes: the
    static flexibility at `loaded` stays exact. A body that would save none is unchanged. Attachment modes of
    the file are not kept, but contribute to the static shapes. Modes that no load couples have separate shapes, which
    stay in a plane of bending, or in torsion.
    """
    lowest = min(lowest, body.n_eigenmodes)
    kept = np.sort(np.argsort(body.stiffness[: body.n_eigenmodes], kind="stable")[:lowest])
    B_T = interface_loads(body, loaded)
    shapes: list[Array] = [np.zeros((body.n_modes, 0))]
    squares: list[Array] = [np.zeros(0)]
    for block in coupled_blocks(B_T @ B_T.T):
        others = np.setdiff1d(block, kept)
        if not others.size:
            continue
        static, of_block = _static_modes(body.stiffness[others], B_T[others])
        shapes.append(np.zeros((body.n_modes, len(of_block))))
        shapes[-1][others] = static
        squares.append(of_block)
    stiffness = np.concatenate([body.stiffness[kept], *squares])
    if len(stiffness) >= body.n_modes:
        return body
    T = np.hstack([np.eye(body.n_modes)[:, kept], *shapes])
    reduced = transformed(body, T, stiffness)
    static_shapes = len(stiffness) - lowest if body.attachment_modes else 0
    lift = T + (B_T - T @ (T.T @ B_T)) @ np.linalg.pinv(T.T @ B_T)
    reduction = Reduction(body, lowest, T, lift)
    return replace(reduced, reduction=reduction, attachment_modes=static_shapes)


def modes_kept(body: Body) -> str:
    """The number of modes of a body as text; in planar scenes of those that move in the plane."""
    if body.reduction is None:
        attachment = f" and {body.attachment_modes} attachment modes" if body.attachment_modes else ""
        return f"all {body.n_eigenmodes} modes{attachment}"
    lowest, static = body.reduction.lowest, body.n_modes - body.reduction.lowest
    shapes = f" and {static} static shapes for the others" if static else ""
    return f"{lowest} of {body.reduction.whole.n_eigenmodes} modes{shapes}"


def loaded_points(scene: MechanismKeys, body: str) -> list[str]:
    """Names of points of a body at which joints, trajectories and loads of the scene act."""
    loaded = [reference.body_and_point for reference in scene.references() if reference.loaded]
    return list(dict.fromkeys(part[1] for part in loaded if part is not None and part[0] == body))


def interface_loads(body: Body, loaded: Sequence[str]) -> Array:
    """Bᵀ (n, loads), no unit: modal forces by a load along and about each axis at points, scaled to size 1.

    Loads under which nothing moves are left out: forces on a support, or along a link without axial modes.
    """
    rows = [np.zeros((0, body.n_modes))]
    for label, at in body.points.items():
        if label in loaded:
            rows.append(np.sqrt(body.mass) * np.vstack([at.translation, (body.length or 1.0) * at.rotation]))
    B = np.vstack(rows)
    magnitude = np.linalg.norm(B, axis=1)
    moving = magnitude > IMMOBILE
    return (B[moving] / magnitude[moving, None]).T


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
