"""Nodes along the axis of a link; structured meshes of boxes: hexahedra, or six tetrahedra in place of each."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..common.arrays import Array, Integers
from .cells import KUHN, CellName
from .part_mesh import PartMesh


def structured_box(
    length: float, root: tuple[float, float], tip: tuple[float, float], divisions: tuple[int, int, int], cell: CellName
) -> PartMesh:
    """A box along x, 0 … `length` (m), centered on the axis, of hexahedra, or six tetrahedra in place of each.

    `root` and `tip` are height (along y) and width (along z) at the ends, m, with linear change in between;
    `divisions` are numbers of hexahedra along x, y, z.
    """
    x, y, z = np.meshgrid(*(np.linspace(0.0, 1.0, n + 1) for n in divisions), indexing="ij")
    height = root[0] + (tip[0] - root[0]) * x
    width = root[1] + (tip[1] - root[1]) * x
    points: Array = np.stack([length * x, height * (y - 0.5), width * (z - 0.5)], axis=-1).reshape(-1, 3)
    number, low, high = np.arange(x.size).reshape(x.shape), slice(None, -1), slice(1, None)
    # gmsh's corner order: around the lower face (z), then around the upper one.
    around = [(low, low), (high, low), (high, high), (low, high)]
    cells: Integers = np.stack([number[i, j, k].ravel() for k in (low, high) for i, j in around], axis=1)
    if cell == "tetrahedron":
        cells = cells[:, KUHN].reshape(-1, 4)
    return PartMesh(points, cells, cell, 1, np.zeros(len(cells), dtype=np.int32))


# Points closer than this, relative to the length, are one point.
COINCIDENT = 1e-9


def graded_nodes(breakpoints: Sequence[float], elements: int) -> Array:
    """Ascending nodes (elements + 1,), m, with a node at each of `breakpoints` (s + 1,), m, of s segments.

    Elements of a segment are equal, the longest of all is as short as possible: a uniform mesh that meets all
    breakpoints stays. Raises `ValueError` for fewer elements than segments.
    """
    lengths = np.diff(np.asarray(breakpoints, dtype=np.float64))
    if elements < lengths.size:
        raise ValueError(f"{lengths.size} segments need at least {lengths.size} elements, found {elements}")
    shares = np.ones(lengths.size, dtype=np.int64)
    for _ in range(elements - lengths.size):
        shares[np.argmax(lengths / shares)] += 1
    pieces = [
        np.linspace(*ends, share, endpoint=False) for ends, share in zip(pairwise(breakpoints), shares, strict=True)
    ]
    return np.append(np.concatenate(pieces), breakpoints[-1])


def with_points(nodes: Array, points: Sequence[float]) -> Array:
    """`nodes` (k,), m, and `points`, m, in one ascending array; points that coincide with nodes add nothing."""
    length = nodes[-1] - nodes[0]
    for point in points:
        if np.min(np.abs(nodes - point)) > COINCIDENT * length:
            nodes = np.append(nodes, point)
    return np.sort(nodes)
