"""The interval mesh of a beam link: where its nodes lie, and the dolfinx mesh on them. Importing this loads dolfinx."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from ..common.arrays import Array, Integers
from .compat import cell_vertices, create_interval_mesh

if TYPE_CHECKING:
    from dolfinx.mesh import Mesh

# Points closer than this, relative to the length, are one point.
COINCIDENT = 1e-9


def graded_nodes(breakpoints: Sequence[float], elements: int) -> Array:
    """Nodes of `elements` elements between the first and the last of `breakpoints`, with a node at each of them.

    Within a segment the elements are equal; they are shared out so that the longest is as short as possible. A uniform
    mesh that meets all breakpoints is therefore kept.

    Args:
        breakpoints: (s + 1,) ascending ends of the s segments, in m.
        elements: at least s.

    Returns:
        (elements + 1,) ascending coordinates in m, breakpoints included exactly.

    Raises:
        ValueError: fewer elements than segments.
    """
    lengths = np.diff(np.asarray(breakpoints, dtype=np.float64))
    if elements < lengths.size:
        raise ValueError(f"{lengths.size} segments need at least {lengths.size} elements, found {elements}")
    shares = np.ones(lengths.size, dtype=np.int64)
    for _ in range(elements - lengths.size):
        shares[np.argmax(lengths / shares)] += 1
    pieces = [
        np.linspace(start, end, share + 1)
        for start, end, share in zip(breakpoints[:-1], breakpoints[1:], shares, strict=True)
    ]
    return np.concatenate([pieces[0][:1], *(piece[1:] for piece in pieces)])


def with_points(nodes: Array, points: Sequence[float]) -> Array:
    """`nodes` (m,) and `points` in one ascending list (≥ m,); a point that coincides with a node adds nothing."""
    length = nodes[-1] - nodes[0]
    merged = list(nodes)
    for point in points:
        if np.min(np.abs(np.asarray(merged) - point)) > COINCIDENT * length:
            merged.append(point)
    return np.sort(np.asarray(merged, dtype=np.float64))


def interval_mesh(nodes: Array, flipped: Sequence[int] = ()) -> Mesh:
    """Mesh of the intervals between neighbouring `nodes` (m,), ascending, in m.

    Args:
        nodes: coordinates along the link's axis.
        flipped: cells whose second vertex comes first, as mesh files may have them.
    """
    cells = np.stack([np.arange(nodes.size - 1), np.arange(1, nodes.size)], axis=1)
    cells[list(flipped)] = cells[list(flipped)][:, ::-1]
    return create_interval_mesh(nodes, cells)


def cells_containing(mesh: Mesh, points: Array) -> tuple[Integers, Array]:
    """Cell and reference coordinate X ∈ [0, 1] of each of `points` (k,) in m: two arrays (k,).

    A point on a boundary belongs to either of its cells. Points must lie on the mesh.
    """
    vertices = cell_vertices(mesh)
    order = np.argsort(vertices.min(axis=1))
    starts = vertices.min(axis=1)[order]
    cells = order[np.clip(np.searchsorted(starts, points, side="right") - 1, 0, order.size - 1)]
    first, second = vertices[cells].T
    return cells, (points - first) / (second - first)
