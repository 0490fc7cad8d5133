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

    c = E_p d31 w_p (t_p + t_b)/2 with the link's height t_b in the plane; a patch works on the difference of the
    section rotations at its ends. Raises `InputError` for a patch beyond the link or across a step of its section, and
    for as many patches as modes that do not reach them all.
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
    heights = np.array([_height(key, body, k, start, end) for k, (start, end) in enumerate(edges, 1)])
    moment_per_volt = layout.modulus * layout.d31 * layout.width * (layout.thickness + heights) / 2
    rotation = np.array([[body.interpolate(x).rotation[2] for x in pair] for pair in edges.clip(0.0, body.length)])
    Phi_V = moment_per_volt[:, None] * (rotation[:, 1] - rotation[:, 0]) @ planar.modal_transform
    array = PatchArray(layout.body, edges, moment_per_volt, Phi_V.T, layout.limit)
    if len(edges) == planar.n_modes and not array.condition_number < SINGULAR:
        raise InputError(
            f"{key}: expected patches that reach every mode, found a singular Φ_V (condition number"
            f" {array.condition_number:.1g}): move them, or use more of them"
        )
    return array


def _height(key: str, body: ModalBody, number: int, start: float, end: float) -> float:
    """The height of the link along y under a patch."""
    x = body.stations.position[:, 0]
    slack = 1e-9 * body.length
    covered = (x[1:] > start + slack) & (x[:-1] < end - slack)
    heights = body.stations.height[:-1][covered]
    if np.ptp(heights) > 1e-9 * heights.max():
        raise InputError(
            f"{key}: expected patches on one section each, found patch {number} ({start:g} to {end:g} m) across a step"
            f" of the height from {heights.min():g} to {heights.max():g} m"
        )
    return float(heights[0])
