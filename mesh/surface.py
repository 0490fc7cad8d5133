"""The boundary of a distributed solid mesh: its facets, and the triangles that a picture shows of it.

Importing this loads dolfinx.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import basix
import numpy as np
from dolfinx.mesh import exterior_facet_indices

from ..common.arrays import Array, Integers
from .compat import coordinate_element, geometry_nodes

if TYPE_CHECKING:
    from dolfinx.mesh import Mesh

# A picture gets about so many triangles, where the mesh has fewer facets.
TRIANGLES = 6000
_FINEST = 4
# Points closer than this, relative to the size of the part, are one.
_COINCIDENT = 1e-6


@dataclass(frozen=True)
class Surface:
    """Triangles on the boundary of the whole part, the same on every process, and which points each process knows.

    Attributes:
        points: (p, 3) in m; the order does not depend on the number of processes.
        triangles: (t, 3) rows of `points`, counter-clockwise seen from outside.
        edges: (e, 2) rows of `points`: the borders of the facets, of which triangles may be a finer division.
        rows: (k,) the points that this process evaluates fields at: each belongs to one process.
        cells: (k,) local cell of each of these.
        X: (k, 3) reference coordinates there.
    """

    points: Array
    triangles: Integers
    edges: Integers
    rows: Integers
    cells: Integers
    X: Array


def boundary(mesh: Mesh) -> tuple[Integers, Integers, Integers]:
    """The boundary facets of this process.

    Returns:
        (b,) facets ascending, (b,) the cell of each, and (b,) which facet of the reference cell it is.
    """
    mesh.topology.create_connectivity(2, 3)
    mesh.topology.create_connectivity(3, 2)
    facets = np.sort(np.asarray(exterior_facet_indices(mesh.topology), dtype=np.int64))
    to_cells, to_facets = mesh.topology.connectivity(2, 3), mesh.topology.connectivity(3, 2)
    cells = np.asarray(to_cells.array, dtype=np.int64)[np.asarray(to_cells.offsets)[facets]]
    of_cell = np.asarray(to_facets.array).reshape(-1, len(reference_facets(mesh)))[cells]
    return facets, cells, np.argmax(of_cell == facets[:, None], axis=1)


def reference_facets(mesh: Mesh) -> Integers:
    """(m, 3 or 4) corners of each facet of the reference cell, in dolfinx's order."""
    return np.array(basix.topology(coordinate_element(mesh).cell_type)[2])


def surface_of(mesh: Mesh) -> Surface:
    """Triangles on the boundary of `mesh`, several on each facet where the mesh is coarse. All processes call."""
    _, cells, which = boundary(mesh)
    count = mesh.comm.allreduce(len(cells))
    n = int(np.clip(np.sqrt(TRIANGLES / max(count, 1)), 1, _FINEST))
    element = coordinate_element(mesh)
    corners = np.asarray(basix.geometry(element.cell_type))[reference_facets(mesh)][which]
    weights, pattern, border = _lattice(corners.shape[1], n)
    X = np.einsum("la,bai->bli", weights, corners)
    points, inward = _positions(mesh, element, cells, X)
    first_point = (len(weights) * np.arange(len(cells)))[:, None, None]
    triangles, edges = pattern[None] + first_point, border[None] + first_point
    # Corners of the reference facets run either way round.
    first, second, third = (points.reshape(-1, 3)[triangles[:, 0, k]] for k in range(3))
    turned = np.einsum("bi,bi->b", np.cross(second - first, third - first), inward) > 0
    triangles[turned] = triangles[turned][..., ::-1]
    owners = np.repeat(cells, len(weights))
    return _gathered(mesh, points.reshape(-1, 3), triangles.reshape(-1, 3), edges.reshape(-1, 2), owners, X)


def _positions(
    mesh: Mesh, element: basix.finite_element.FiniteElement, cells: Integers, X: Array
) -> tuple[Array, Array]:
    """(b, l, 3) positions of the reference points `X` (b, l, 3), and (b, 3) from each facet to its cell's middle."""
    if not cells.size:
        return np.empty((0, X.shape[1], 3)), np.empty((0, 3))
    nodes = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    table = element.tabulate(0, X.reshape(-1, 3))[0, ..., 0].reshape(*X.shape[:2], -1)
    points: Array = np.einsum("blv,bvi->bli", table, nodes)
    return points, nodes.mean(axis=1) - points.mean(axis=1)


@lru_cache
def _lattice(corners: int, n: int) -> tuple[Array, Integers, Integers]:
    """A facet divided into n × n triangles (or twice that).

    Returns:
        (l, corners) weights of its corners at the points, (m, 3) triangles, (b, 2) their sides on the facet's border.
    """
    square = corners == 4
    places = [(i, j) for j in range(n + 1) for i in range(n + 1) if square or i + j <= n]
    number = {place: k for k, place in enumerate(places)}
    s, t = np.array(places, dtype=np.float64).T / n
    if square:
        weights = np.stack([(1 - s) * (1 - t), s * (1 - t), (1 - s) * t, s * t], axis=1)
    else:
        weights = np.stack([1 - s - t, s, t], axis=1)
    low = [[(i, j), (i + 1, j), (i, j + 1)] for i, j in places if (i + 1, j) in number and (i, j + 1) in number]
    high = [[(i + 1, j), (i + 1, j + 1), (i, j + 1)] for i, j in places if (i + 1, j + 1) in number]
    triangles = np.array([[number[place] for place in triangle] for triangle in low + high])
    sides = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    sides, count = np.unique(sides, axis=0, return_counts=True)
    return weights, triangles, sides[count == 1]


def _gathered(mesh: Mesh, points: Array, triangles: Integers, edges: Integers, cells: Integers, X: Array) -> Surface:
    """One numbering for the points of all processes; a point that several have belongs to the first of them."""
    comm = mesh.comm
    counts = comm.allgather(len(points))
    begin = sum(counts[: comm.rank])
    everything = np.concatenate(comm.allgather(points))
    all_triangles = np.concatenate(comm.allgather(triangles + begin))
    all_edges = np.concatenate(comm.allgather(edges + begin))
    grid = np.rint(everything / (_COINCIDENT * np.ptp(everything, axis=0).max())).astype(np.int64)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    mine = np.flatnonzero((first >= begin) & (first < begin + len(points)))
    local = first[mine] - begin
    renumbered = number[all_triangles]
    # Each begins with its smallest corner, then all are sorted.
    shift = (np.argmin(renumbered, axis=1)[:, None] + np.arange(3)) % 3
    renumbered = np.take_along_axis(renumbered, shift, axis=1)
    renumbered = renumbered[np.lexsort(renumbered.T[::-1])]
    borders = np.unique(np.sort(number[all_edges], axis=1), axis=0)
    return Surface(everything[first], renumbered, borders, mine, cells[local], X.reshape(-1, 3)[local])
