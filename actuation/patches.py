"""Piezoelectric patches on a link: what a volt does to its modal coordinates (Shaban 2022, Eqs. 14–17)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..fe_models.modal_body import ModalBody
from ..mbs.planar_body import PlanarBody
from ..mbs.scene_records import PztLayout

Array = NDArray[np.float64]

STEP = 0.1  # of the height, from one station to the next; less is a taper
SINGULAR = 1e12  # condition number of Φ_V beyond which voltages are rounding


@dataclass(frozen=True)
class PatchArray:
    """The patches of one body.

    Attributes:
        body: its name.
        edges: (k, 2) where each patch begins and ends along the link, m.
        moment_per_volt: (k,) c in N·m/V.
        Phi_V: (n, k) modal forces per volt, in the coordinates of the `PlanarBody`: c [φ'(x2) − φ'(x1)].
        limit: largest voltage, V; None where the scene gives none.
    """

    body: str
    edges: Array
    moment_per_volt: Array
    Phi_V: Array
    limit: float | None

    @property
    def condition_number(self) -> float:
        """Of Φ_V: how unequally the patches reach the modes; infinite where some mode is out of reach."""
        return float(np.linalg.cond(self.Phi_V))

    @property
    def projector(self) -> Array:
        """(n, n) what the best voltages make of wanted modal forces: the identity where the patches reach all modes."""
        n, k = self.Phi_V.shape
        if n == k:
            return np.eye(n)
        return self.Phi_V @ np.linalg.pinv(self.Phi_V)


def patch_array(scene_path: Path, layout: PztLayout, body: ModalBody, planar: PlanarBody) -> PatchArray:
    """Place the patches of `layout` on a link.

    c = E_p d31 w_p (t_p + t_b)/2 with the link's height t_b in the plane. A patch works on the difference of the
    section rotations at its ends, piecewise where t_b changes gradually; with `coupling = "surface"`, on the strain of
    the faces on which it is outlined in the mesh. Raises `InputError` for a patch beyond the link or across a step of
    its section, for outlines that are not those of the layout, and for as many patches as modes that do not reach them
    all.
    """
    key = f'{scene_path}: pzt "{layout.body}"'
    if layout.centers is not None:
        centers = np.array(layout.centers)
    else:
        centers = (np.arange(layout.patch_count) + 0.5) * body.length / layout.patch_count
    edges = centers[:, None] + np.array([-0.5, 0.5]) * layout.length
    slack = 1e-9 * body.length
    for k, (start, end) in enumerate(edges, 1):
        if start < -slack or end > body.length + slack:
            raise InputError(
                f"{key}: expected patches within the link, 0 … {body.length:g} m, found patch {k} from {start:g} to"
                f" {end:g} m"
            )
    pieces = [_pieces(key, body, k, start, end) for k, (start, end) in enumerate(edges, 1)]
    moments = [layout.modulus * layout.d31 * layout.width * (layout.thickness + height) / 2 for _, height in pieces]
    moment_per_volt = np.array([np.average(c, weights=np.diff(x)) for (x, _), c in zip(pieces, moments, strict=True)])
    if layout.coupling == "surface":
        height = np.array([np.average(height, weights=np.diff(x)) for x, height in pieces])
        per_volt = (moment_per_volt / (layout.width * height / 2))[:, None] * _outlined(key, layout, body, edges)
    else:
        per_volt = np.array(
            [
                c @ np.diff([body.interpolate(end).rotation[2] for end in x], axis=0)
                for (x, _), c in zip(pieces, moments, strict=True)
            ]
        )
    Phi_V = per_volt @ planar.modal_transform
    array = PatchArray(layout.body, edges, moment_per_volt, Phi_V.T, layout.limit)
    if len(edges) == planar.n_modes and not array.condition_number < SINGULAR:
        raise InputError(
            f"{key}: expected patches that reach every mode, found a singular Φ_V (condition number"
            f" {array.condition_number:.1g}): move them, or use more of them"
        )
    return array


def _pieces(key: str, body: ModalBody, number: int, start: float, end: float) -> tuple[Array, Array]:
    """The stretches (m + 1,) into which a change of the link's height along y cuts a patch, and the heights (m,)."""
    x = body.stations.position[:, 0]
    slack = 1e-9 * body.length
    covered = np.flatnonzero((x[1:] > start + slack) & (x[:-1] < end - slack))
    heights = body.stations.height[covered]
    jump = np.abs(np.diff(heights)) / np.maximum(heights[1:], heights[:-1])
    if jump.max(initial=0.0) > STEP:
        k = int(jump.argmax())
        raise InputError(
            f"{key}: expected patches on one section each, found patch {number} ({start:g} to {end:g} m) across a step"
            f" of the height from {heights[k]:g} to {heights[k + 1]:g} m at {x[covered[k + 1]]:g} m"
        )
    changes = np.flatnonzero(jump > 1e-9)
    ends = np.concatenate([[max(start, 0.0)], x[covered[changes + 1]], [min(end, body.length)]])
    return ends, heights[np.append(changes, len(heights) - 1)]


def _outlined(key: str, layout: PztLayout, body: ModalBody, edges: Array) -> Array:
    """(k, n) modal forces of unit membrane force (N/m): pressing the upper face, pulling the lower, halved on both."""
    patches = body.surface_patches
    if patches is None:
        raise InputError(
            f'{key}: coupling: expected "rotation", or a link whose file outlines the patches ([surface_patch]), found'
            ' "surface" and none outlined'
        )
    found = (*edges.ravel(), layout.width)
    outlined = (*patches.edges.ravel(), patches.width)
    if len(found) != len(outlined) or not np.allclose(found, outlined, rtol=0.0, atol=1e-6 * body.length):
        raise InputError(
            f"{key}: coupling: expected the {len(patches.edges)} patches that the link file outlines, from"
            f" {_places(patches.edges)} m and {patches.width:g} m wide, found {len(edges)}, from {_places(edges)} m and"
            f" {layout.width:g} m wide"
        )
    faces = [sign * face for sign, face in ((-1.0, patches.top), (1.0, patches.bottom)) if face is not None]
    return np.asarray(sum(faces) / len(faces))


def _places(edges: Array) -> str:
    return ", ".join(f"{start:g} to {end:g}" for start, end in edges)
