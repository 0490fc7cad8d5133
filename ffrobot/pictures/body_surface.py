"""The body that a picture shows: its surface with what the modes do there, and how it is deformed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..common.arrays import Array, Indices, Integers
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


LAYERS = 4  # clusters that remain at least over each of the three dimensions of a link


def triangles_of(cells: Integers) -> Integers:
    """(t, 3) of triangles or quadrilaterals."""
    return cells if cells.shape[1] == 3 else np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def coarsened(points: Array, triangles: Integers, limit: int) -> tuple[Indices, Integers]:
    """Which of many points (p, 3) remain, and triangles (at most `limit`, 3) on those.

    Points in the same box of a grid become the one nearest to their mean (vertex clustering: Rossignac & Borrel, 1993),
    so that the points that remain keep their exact displacements. Boxes are as small as the limit allows, and across a
    slender link never larger than a quarter of it.
    """
    used, inverse = np.unique(triangles, return_inverse=True)
    if len(triangles) <= limit:
        return used, inverse.reshape(-1, 3)
    extent = np.ptp(points[used], axis=0)
    low, high = 0.0, float(extent.max())
    found = _clustered(points[used], inverse.reshape(-1, 3), np.minimum(high, extent / LAYERS))
    for _ in range(12):
        size = 0.5 * (low + high)
        trial = _clustered(points[used], inverse.reshape(-1, 3), np.minimum(size, extent / LAYERS))
        low, high, found = (size, high, found) if len(trial[1]) > limit else (low, size, trial)
    return used[found[0]], found[1]


def _clustered(points: Array, triangles: Integers, size: Array) -> tuple[Indices, Integers]:
    """Points that remain with boxes of `size` (3,), and the triangles whose corners stay apart."""
    box = np.floor((points - points.min(axis=0)) / np.where(size > 0.0, size, 1.0)).astype(np.int64)
    cluster = np.unique(box, axis=0, return_inverse=True)[1].ravel()
    mean = np.stack([np.bincount(cluster, column) for column in points.T], axis=1) / np.bincount(cluster)[:, None]
    order = np.lexsort((np.linalg.norm(points - mean[cluster], axis=1), cluster))
    kept = order[np.unique(cluster[order], return_index=True)[1]]
    mapped = cluster[triangles]
    apart = np.all(mapped != np.roll(mapped, 1, axis=1), axis=1)
    _, first = np.unique(np.sort(mapped[apart], axis=1), axis=0, return_index=True)
    return kept, mapped[apart][np.sort(first)]
