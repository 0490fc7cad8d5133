"""From the tables of a link file to a dolfinx mesh with tagged regions and faces. Importing this loads dolfinx.

The part is read or made, checked and its faces found on rank 0; dolfinx distributes it. All ranks raise the same error.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from dolfinx.mesh import meshtags
from mpi4py import MPI

from ..common.arrays import Integers
from ..common.errors import FfrobotError, InputError
from .cells import CellName
from .compat import create_solid_mesh, geometry_nodes
from .part import kept_or_new
from .part_mesh import PartMesh, facet_keys
from .records import Outlines, PlaceRecord, SolidGeometry, SolidMeshRecord
from .surface import Surface, boundary, reference_facets, surface_of

if TYPE_CHECKING:
    from dolfinx.mesh import Mesh

Progress = Callable[[str], None]
MeshTags = Any  # dolfinx 0.5 and 0.9 name this class differently


@dataclass(frozen=True)
class SolidMesh:
    """A solid part as the finite element models take it.

    Attributes:
        mesh: of tetrahedra or hexahedra, distributed, without ghost cells; coordinates in m in the link's frame.
        cell: shape of the cells.
        cell_tags: region of every local cell.
        facet_tags: the facets of the named faces, all of them on the boundary.
        regions: volume group → tag in `cell_tags`, the largest group first; cells of none have the tag 0.
        faces: "root", "tip", the interfaces that are faces, "patch/K/top", "patch/K/bottom" → tag in `facet_tags`; two
            names may have one tag.
        size: mean extent of the cells along x, in m.
        surface: what a picture shows.
        overlaps: volume group → further tags in `cell_tags`, of its cells that belong to other groups too.
        remarks: what the part's file holds and the link does not, a sentence each.
    """

    mesh: Mesh
    cell: CellName
    cell_tags: MeshTags
    facet_tags: MeshTags
    regions: Mapping[str, int]
    faces: Mapping[str, int]
    size: float
    surface: Surface
    overlaps: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()

    def cells_of(self, region: str) -> tuple[int, ...]:
        """The tags in `cell_tags` of all cells of a volume group."""
        return self.regions[region], *self.overlaps.get(region, ())


def solid_mesh(
    geometry: SolidGeometry,
    record: SolidMeshRecord,
    places: Sequence[PlaceRecord],
    outlines: Outlines | None,
    path: Path,
    comm: MPI.Comm = MPI.COMM_WORLD,
    progress: Progress | None = None,
    *,
    remesh: bool = False,
) -> SolidMesh:
    """Mesh of a solid link, distributed over `comm`.

    Args:
        geometry: of the link file.
        record: its table `mesh`.
        places: its tables `interface`.
        outlines: of its patches.
        path: the link file, named in errors.
        comm: all its processes call.
        progress: is called with what is being done.
        remesh: whether a mesh of the same part kept from an earlier run does not count.

    Raises:
        InputError: the part cannot be read or meshed, or a face is not there; on every process.
    """
    outcome: PartMesh | FfrobotError | None = None
    if comm.rank == 0:
        try:
            outcome = kept_or_new(geometry, record, places, outlines, path, progress or _silent, remesh=remesh)
        except FfrobotError as error:
            outcome = error
    failure = comm.bcast(outcome if isinstance(outcome, FfrobotError) else None)
    if failure is not None:
        raise failure
    return distributed(outcome if isinstance(outcome, PartMesh) else None, comm)


def distributed(part: PartMesh | None, comm: MPI.Comm = MPI.COMM_WORLD) -> SolidMesh:
    """The distributed mesh of `part`, which rank 0 gives and all others pass as None."""
    described = comm.bcast(_description(part) if part is not None else None)
    cell, degree, nodes = described["cell"], described["degree"], described["nodes"]
    cells = part.cells if part is not None else np.empty((0, nodes), dtype=np.int64)
    points = part.points if part is not None else np.empty((0, 3))
    mesh = create_solid_mesh(comm, cell, degree, cells, points)
    local = np.arange(mesh.topology.index_map(3).size_local, dtype=np.int32)
    fewest = comm.allreduce(local.size, op=MPI.MIN)
    if not fewest:
        raise InputError(f"mpirun: expected fewer processes than {comm.size}: some got none of the mesh's elements")
    cell_tag = described["cell_tag"][np.asarray(mesh.topology.original_cell_index)[: local.size]]
    facets, facet_tag = _tagged_facets(mesh, described)
    return SolidMesh(
        mesh,
        cell,
        meshtags(mesh, 3, local, cell_tag.astype(np.int32)),
        meshtags(mesh, 2, facets, facet_tag),
        described["regions"],
        described["faces"],
        described["size"],
        surface_of(mesh),
        described["overlaps"],
        described["remarks"],
    )


def _description(part: PartMesh) -> dict[str, Any]:
    """What every process knows of the part besides its share of cells and points."""
    x = part.points[part.corners, 0]
    return {
        "cell": part.cell,
        "degree": part.degree,
        "nodes": part.cells.shape[1],
        "points": len(part.points),
        "cell_tag": part.cell_tag,
        "regions": dict(part.regions),
        "overlaps": dict(part.overlaps),
        "remarks": part.remarks,
        "faces": dict(part.faces),
        "keys": facet_keys(part.facets, len(part.points)),
        "facet_tag": part.facet_tag,
        "size": float(np.mean(x.max(axis=1) - x.min(axis=1))),
    }


def _tagged_facets(mesh: Mesh, described: Mapping[str, Any]) -> tuple[Integers, Integers]:
    """Local facets that belong to a face, ascending, and their tags."""
    facets, cells, which = boundary(mesh)
    nodes = np.take_along_axis(geometry_nodes(mesh)[cells], reference_facets(mesh)[which], axis=1)
    keys = facet_keys(np.asarray(mesh.geometry.input_global_indices)[nodes], described["points"])
    order = np.argsort(described["keys"])
    sorted_keys = described["keys"][order]
    if not sorted_keys.size or not keys.size:
        return np.empty(0, dtype=np.int32), np.empty(0, dtype=np.int32)
    place = np.minimum(np.searchsorted(sorted_keys, keys), sorted_keys.size - 1)
    found = sorted_keys[place] == keys
    return facets[found].astype(np.int32), described["facet_tag"][order[place[found]]].astype(np.int32)


def _silent(_: str) -> None:
    pass
