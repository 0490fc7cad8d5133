"""From the tables of a link file to a dolfinx mesh with tagged regions and faces. Importing this loads dolfinx.

The part is read or made, checked and its faces found on rank 0; dolfinx distributes it. All ranks raise the same error.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import basix
import numpy as np
from dolfinx.mesh import Mesh, exterior_facet_indices, meshtags
from mpi4py import MPI

from ..common.arrays import Array, Integers
from ..common.errors import FfrobotError, InputError
from ..common.structs import struct
from .compat import coordinate_element, create_solid_mesh, geometry_nodes
from .part import Progress, kept_or_new
from .part_mesh import PartMesh, facet_keys
from .records import PartTables

# A picture gets about so many triangles, where the mesh has fewer facets.
TRIANGLES = 6000
_FINEST = 4
# Points closer than this, relative to the size of the part, are one.
_COINCIDENT = 1e-6


@struct
class Surface:
    """Boundary triangles of the whole part, equal on all processes, and where each process evaluates fields."""

    points: Array  # (p, 3) in m; the order does not depend on the number of processes
    triangles: Integers  # (t, 3) rows of `points`, counter-clockwise seen from outside
    edges: Integers  # (e, 2) rows of `points`: the borders of the facets, of which triangles may be a finer division
    rows: Integers  # (k,) numbers of the points that this process evaluates; each belongs to one process
    cells: Integers  # (k,) local cell of each of these points
    X: Array  # (k, 3) their reference coordinates in it, no unit


def boundary(mesh: Mesh) -> tuple[Integers, Integers, Integers]:
    """The b boundary facets (b,) of this process, ascending, their cells (b,) and local numbers in them (b,)."""
    mesh.topology.create_connectivity(2, 3)
    mesh.topology.create_connectivity(3, 2)
    facets = np.sort(np.asarray(exterior_facet_indices(mesh.topology), dtype=np.int64))
    to_cells, to_facets = mesh.topology.connectivity(2, 3), mesh.topology.connectivity(3, 2)
    cells = np.asarray(to_cells.array, dtype=np.int64)[np.asarray(to_cells.offsets)[facets]]
    of_cell = np.asarray(to_facets.array).reshape(-1, len(reference_facets(mesh)))[cells]
    return facets, cells, np.argmax(of_cell == facets[:, None], axis=1)


def reference_facets(mesh: Mesh) -> Integers:
    """Numbers (m, 3 or 4) of the corners of the reference cell's m facets, in dolfinx's order."""
    return np.array(basix.topology(coordinate_element(mesh).cell_type)[2])


def surface_of(mesh: Mesh) -> Surface:
    """Triangulate the boundary of `mesh`, with several triangles on a facet where it is coarse. Collective."""
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
    begin = sum(comm.allgather(len(points))[: comm.rank])
    everything = np.concatenate(comm.allgather(points))
    all_triangles = np.concatenate(comm.allgather(triangles + begin))
    all_edges = np.concatenate(comm.allgather(edges + begin))
    grid = np.rint(everything / (_COINCIDENT * np.ptp(everything, axis=0).max())).astype(np.int64)
    _, first, number = np.unique(grid, axis=0, return_index=True, return_inverse=True)
    number = number.reshape(-1)
    mine = np.flatnonzero((first >= begin) & (first < begin + len(points)))
    local = first[mine] - begin
    renumbered = number[all_triangles]
    shift = (np.argmin(renumbered, axis=1)[:, None] + np.arange(3)) % 3
    renumbered = np.take_along_axis(renumbered, shift, axis=1)
    renumbered = renumbered[np.lexsort(renumbered.T[::-1])]
    borders = np.unique(np.sort(number[all_edges], axis=1), axis=0)
    return Surface(everything[first], renumbered, borders, mine, cells[local], X.reshape(-1, 3)[local])


MeshTags = Any  # dolfinx 0.5 and 0.9 name this class differently


@struct
class SolidMesh:
    """Mesh of a solid part for its finite element model."""

    mesh: Mesh  # of tetrahedra or hexahedra, distributed, without ghost cells; coordinates in m in the link's frame
    part: PartMesh  # names of regions and faces, and their tags; without points and cells
    cell_tags: MeshTags  # region of every local cell, one of `part.tags_of`; 0 of none
    facet_tags: MeshTags  # the facets of the named faces, all of them on the boundary: `part.faces`
    size: float  # mean extent of the cells along x, in m
    surface: Surface  # what a picture shows


def solid_mesh(tables: PartTables, progress: Progress = lambda _: None, *, remesh: bool = False) -> SolidMesh:
    """Mesh of a solid link, distributed over all processes; collective. See `part_mesh`.

    Unless `remesh`, a mesh of the same part from an earlier run is used. Raises `InputError` on every process.
    """
    outcome: PartMesh | FfrobotError | None = None
    comm = MPI.COMM_WORLD
    if comm.rank == 0:
        try:
            outcome = kept_or_new(tables, progress, remesh=remesh)
        except FfrobotError as error:
            outcome = error
    failure = comm.bcast(outcome if isinstance(outcome, FfrobotError) else None)
    if failure is not None:
        raise failure
    return distributed(outcome if isinstance(outcome, PartMesh) else None)


def distributed(part: PartMesh | None) -> SolidMesh:
    """Distribute the mesh of `part`, given on rank 0 and None elsewhere, over all processes."""
    comm = MPI.COMM_WORLD
    shared: tuple[PartMesh, int, float] | None = None
    if part is not None:
        without = replace(part, points=part.points[:0], cells=part.cells[:0])
        shared = without, len(part.points), float(np.mean(np.ptp(part.points[part.corners, 0], axis=1)))
    known, count, size = comm.bcast(shared)
    own = known if part is None else part
    mesh = create_solid_mesh(comm, known.cell, known.degree, own.cells, own.points)
    local = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
    fewest = comm.allreduce(local.size, op=MPI.MIN)
    if not fewest:
        raise InputError(f"mpirun: expected fewer processes than {comm.size}: some got none of the mesh's elements")
    cell_tag = known.cell_tag[np.asarray(mesh.topology.original_cell_index)[: local.size]]
    tags = meshtags(mesh, 3, local, cell_tag.astype(np.int32)), meshtags(mesh, 2, *_tagged_facets(mesh, known, count))
    return SolidMesh(mesh, known, *tags, size=size, surface=surface_of(mesh))


def _tagged_facets(mesh: Mesh, part: PartMesh, points: int) -> tuple[Integers, Integers]:
    """Local facets that belong to a face, ascending, and their tags; `points`: number of those of the whole part."""
    facets, cells, which = boundary(mesh)
    nodes = np.take_along_axis(geometry_nodes(mesh)[cells], reference_facets(mesh)[which], axis=1)
    keys = facet_keys(np.asarray(mesh.geometry.input_global_indices)[nodes], points)
    known = facet_keys(part.facets, points)
    _, here, there = np.intersect1d(keys, known, assume_unique=True, return_indices=True)
    order = np.argsort(here)
    return facets[here[order]].astype(np.int32), part.facet_tag[there[order]].astype(np.int32)
