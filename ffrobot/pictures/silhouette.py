"""What a surface covers of the plane x, y: the outline of a solid as planar pictures show it, bores included."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ..common.arrays import Array, Indices, Integers, as_rows

VERTICAL = 1e-3  # z of a unit normal below which a cell counts as seen from its side
TESTED = 24  # edges of a loop beside which it is asked what is there
BESIDE = 1e-4  # of the size of the surface: how far beside


def silhouette(points: Array, cells: Integers) -> list[Indices]:
    """Closed loops of point numbers around what cells (c, v) on points (p, 3), normals outwards, cover of the plane.

    The cells that face +z cover all that is covered. Along the edges at which these end lie the outer boundary,
    counter-clockwise, boundaries of openings, clockwise, and edges with further cells below or above them, which are
    left out. So every place has a winding number above zero where the surface is, and zero elsewhere.
    """
    loops = [loop for loop in _loops(_ends_of_front(points, cells)) if len(loop) > 2]
    corners = [points[loop, :2] for loop in loops]
    size = float(np.ptp(points[:, :2], axis=0).max(initial=0.0))
    return [loop for loop, path in zip(loops, corners, strict=True) if _is_boundary(path, corners, BESIDE * size)]


def winding_number(places: Array, loops: Sequence[Array]) -> Integers:
    """(k,) how often loops (m, 2), closed by their first corner, go around places (k, 2), counter-clockwise.

    Signed crossings of the ray to +x (Sunday, "Inclusion of a point in a polygon", 2001).
    """
    count = np.zeros(len(places), dtype=np.int64)
    x, y = places[:, :1], places[:, 1:]
    for loop in loops:
        (ax, ay), (bx, by) = loop.T, np.roll(loop, -1, axis=0).T
        left = (bx - ax) * (y - ay) - (x - ax) * (by - ay)
        count += np.sum((ay <= y) & (by > y) & (left > 0.0), axis=1)
        count -= np.sum((ay > y) & (by <= y) & (left < 0.0), axis=1)
    return count


def _ends_of_front(points: Array, cells: Integers) -> Integers:
    """(e, 2) edges that have a cell facing +z on their left, and none on their right."""
    first = points[cells[:, 0]]
    normals = np.cross(points[cells[:, 1]] - first, points[cells[:, -1]] - first)
    front = cells[normals[:, 2] > VERTICAL * np.linalg.norm(normals, axis=1)]
    edges = np.stack([front, np.roll(front, -1, axis=1)], axis=2).reshape(-1, 2)
    number = len(points)
    inner = np.isin(edges @ [number, 1], edges @ [1, number])
    return np.asarray(edges[~inner], dtype=np.int64)


def _loops(edges: Integers) -> Iterator[Indices]:
    """Directed edges (e, 2), as many into each point as out of it, put together to closed ways."""
    after: dict[int, list[int]] = {}
    for start, end in as_rows(edges):
        after.setdefault(start, []).append(end)
    while after:
        way = [next(iter(after))]
        while way[-1] in after:
            here = way[-1]
            way.append(after[here].pop())
            if not after[here]:
                del after[here]
        yield np.array(way[:-1], dtype=np.intp)


def _is_boundary(path: Array, loops: Sequence[Array], beside: float) -> bool:
    """Whether nothing is covered on the right of `path`, somewhere along it."""
    way = np.roll(path, -1, axis=0) - path
    length = np.linalg.norm(way, axis=1)
    longest = np.argsort(-length, kind="stable")[:TESTED]
    way, length = way[longest], np.maximum(length[longest], 1e-300)[:, None]
    right = np.stack([way[:, 1], -way[:, 0]], axis=1) / length
    return bool(np.any(winding_number(path[longest] + way / 2 + beside * right, loops) <= 0))
