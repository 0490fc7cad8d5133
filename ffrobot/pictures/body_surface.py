"""The body that a picture shows: its surface with what the modes do there, and how it is deformed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, Integers
from ..fe_models.modal_body import ModalBody, PictureMesh

AMPLITUDE = 0.1  # of the length: the largest displacement of a mode as drawn


class DrawnMode(NamedTuple):
    """A mode as large as pictures show it: displacement (p, 3) in m, and its size (p,) relative to the largest."""

    displacement: Array
    size: Array


def drawn_mode(shape: Array, length: float) -> DrawnMode:
    """A mode (p, 3) of a body of `length` scaled to the same largest displacement as every other; zero stays zero."""
    size = np.linalg.norm(shape, axis=1)
    largest = float(size.max()) or 1.0
    return DrawnMode(AMPLITUDE * length / largest * shape, size / largest)


def body_surface(body: ModalBody) -> PictureMesh:
    """The surface of a solid as its file has it; of a beam, the section swept along the axis.

    Where a beam's file does not know the section (older ones), its axis.
    """
    return body.mesh if body.stations.outline is None or body.mesh.cells.shape[1] > 2 else _swept(body)


def _swept(body: ModalBody) -> PictureMesh:
    """Rings of the section's corners, joined by quadrilaterals and closed by caps; two rings where the section steps.

    Cross sections stay plane: the corner at a = (0, y, z) of the section moves by Φ + θ × a.
    """
    stations, outline = body.stations, body.stations.outline
    assert outline is not None
    k, q = outline.shape[:2]
    step = np.any(outline[1:-1] != outline[:-2], axis=(1, 2))
    at = np.sort(np.concatenate([np.arange(k), 1 + np.flatnonzero(step)]))
    # Of two rings at a station the first closes what lies before; the section there is that of the station before.
    first = np.append(at[1:] == at[:-1], False) | (at == k - 1)
    arm = np.zeros((len(at), q, 3))
    arm[:, :, 1:] = outline[np.where(first, at - 1, at)]
    points = stations.position[at, None] + arm
    turn = np.cross(stations.rotation[at].swapaxes(1, 2)[:, None], arm[:, :, None]).swapaxes(2, 3)
    shapes = stations.translation[at, None] + turn
    return PictureMesh(points.reshape(-1, 3), _tube(len(at), q), shapes.reshape(-1, 3, body.mode_count))


def _tube(rings: int, q: int) -> Integers:
    """(c, 4) quadrilaterals, normals outwards, of so many rings of q points, q even, each ordered about +x."""
    ring, corner = np.arange(rings - 1)[:, None] * q, np.arange(q)
    after = (corner + 1) % q
    sides = np.stack([ring + corner, ring + after, ring + q + after, ring + q + corner], axis=2).reshape(-1, 4)
    fan = np.array([[0, j, j + 1, j + 2] for j in range(1, q - 1, 2)])
    cells: Integers = np.concatenate([fan[:, ::-1], sides, (rings - 1) * q + fan]).astype(np.int64)
    return cells
