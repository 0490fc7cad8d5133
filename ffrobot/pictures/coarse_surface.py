"""Surfaces with fewer triangles, where a picture needs no more."""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array, Indices, Integers

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
