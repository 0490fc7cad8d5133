"""What a body looks like in the plane, undeformed, and how its coordinates deform it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array
from ..fe_models.modal_body import ModalBody
from .silhouette import silhouette

CURVE_POINTS = 41


@dataclass(frozen=True)
class Outline:
    """A line in the body frame that deforms with coordinates p.

    Attributes:
        at: (m, 2) in m, undeformed; rows of NaN part loops, of which openings go clockwise.
        modes: (m, 2, n) displacement in m per unit of coordinate.
        p: (T, n) the coordinates over the outputs.
        filled: whether the line goes around the body.
    """

    at: Array
    modes: Array
    p: Array
    filled: bool


def body_outline(body: ModalBody, p: Array) -> Outline:
    """What a flexible link covers of the plane: of a solid its surface, of a beam its section along the axis.

    `p` is (T, n) modal.
    """
    return _swept(body, p) if body.mesh.cells.shape[1] == 2 else _surface(body, p)


def _surface(body: ModalBody, p: Array) -> Outline:
    """Around the surface and its openings."""
    loops = silhouette(body.mesh.points, body.mesh.cells)
    gap = np.full((1, 2), np.nan)
    at = [part for loop in loops for part in (body.mesh.points[np.append(loop, loop[0]), :2], gap)][:-1]
    shapes = [body.mesh.mode_shapes[np.append(loop, [loop[0], loop[0]]), :2] for loop in loops]
    return Outline(np.concatenate(at), np.concatenate(shapes)[:-1], p, filled=True)


def _swept(body: ModalBody, p: Array) -> Outline:
    """Upper and lower edge of a beam, from its stations; cross sections stay plane."""
    stations, n = body.stations, body.mode_count
    # The height of a stretch holds at both its ends: a step of the section shows as one.
    ends = np.arange(len(stations.position) - 1)[:, None] + np.array([0, 1])
    half = np.repeat(stations.height[ends[:, 0]], 2) / 2
    k = ends.ravel()
    at, move, turn = stations.position[k, :2], stations.translation[k, :2], stations.rotation[k, 2]
    edges = []
    for side in (half, -half):
        modes = move.copy()
        modes[:, 0] -= turn * side[:, None]  # rotation θ moves a point at (0, y) by (−θ y, 0)
        edges.append((at + np.column_stack([np.zeros_like(side), side]), modes))
    (upper, upper_modes), (lower, lower_modes) = edges
    closed = np.concatenate([upper, lower[::-1], upper[:1]])
    modes = np.concatenate([upper_modes, lower_modes[::-1], upper_modes[:1]]).reshape(-1, 2, n)
    return Outline(closed, modes, p, filled=True)


def points_outline(names: Sequence[str], at: Array, deflection: Array) -> Outline:
    """A line through named points at (k, 2) of known deflection (T, k, 2), which serves as coordinates.

    Through root, mid and tip the parabola; otherwise straight from point to point.
    """
    k = len(names)
    if {"root", "mid", "tip"} <= set(names):
        s = np.linspace(0.0, 1.0, CURVE_POINTS)
        weights: Array = np.zeros((CURVE_POINTS, k))
        weights[:, names.index("root")] = (1 - s) * (1 - 2 * s)
        weights[:, names.index("mid")] = 4 * s * (1 - s)
        weights[:, names.index("tip")] = s * (2 * s - 1)
    else:
        weights = np.eye(k)
    modes = np.einsum("mk,ij->mikj", weights, np.eye(2)).reshape(len(weights), 2, 2 * k)
    return Outline(weights @ at, modes, deflection.reshape(len(deflection), 2 * k), filled=False)
