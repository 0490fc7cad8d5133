"""The mesh of a solid part as NumPy arrays, wherever it comes from: what the sources give and dolfinx is built from."""

from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from ..common.arrays import Array, Integers, NDArray
from ..common.structs import struct
from .cells import CELLS, Cell, CellName

Tags = NDArray[np.int32]


@struct
class PartMesh:
    """A solid part, meshed, in m: p points, c cells, f tagged facets."""

    points: Array  # (p, 3) in m, in the link's frame once the part is placed
    cells: Integers  # (c, v) points of each cell, in gmsh's order of nodes
    cell: CellName  # shape of the cells
    degree: int  # 1 (corners only) or 2 (curved cells: gmsh's 10 or 27 nodes)
    cell_tag: Tags  # (c,) tag of the region of each cell, 0 of none
    # volume group → its tag, the largest group first
    regions: Mapping[str, int] = field(default_factory=dict)
    # (f, 3 or 4) corners of the tagged facets, all of them on the boundary
    facets: Integers = field(default_factory=lambda: np.empty((0, 3), dtype=np.int64))
    # (f,) tag of the face of each
    facet_tag: Tags = field(default_factory=lambda: np.empty(0, dtype=np.int32))
    # name → tag in `facet_tag`; two names may share a face
    faces: Mapping[str, int] = field(default_factory=dict)
    # volume group → further tags, of its cells that belong to other groups too
    overlaps: Mapping[str, Sequence[int]] = field(default_factory=dict)
    remarks: Sequence[str] = ()  # what the part's file holds and the link does not, a sentence each

    @property
    def shape(self) -> Cell:
        """Corners, facets and edges of a cell."""
        return CELLS[self.cell]

    @property
    def corners(self) -> Integers:
        """Numbers (c, 4 or 8) of each cell's corner points."""
        return self.cells[:, : len(self.shape.corners)]

    @property
    def cell_facets(self) -> Integers:
        """Numbers (c·m, 3 or 4) of corner points of the m facets of every cell, cell by cell."""
        facets = self.shape.facets
        return self.corners[:, facets].reshape(-1, facets.shape[1])

    @cached_property
    def facet_numbers(self) -> Integers:
        """Number (c·m,) of each of `cell_facets`; a facet that cells share has one number."""
        return np.unique(facet_keys(self.cell_facets, len(self.points)), return_inverse=True)[1].reshape(-1)

    def tags_of(self, region: str) -> tuple[int, ...]:
        """The tags in `cell_tag` of all cells of a volume group."""
        return self.regions[region], *self.overlaps.get(region, ())

    def moved(self, points: Array) -> "PartMesh":
        """The mesh with other `points` (p, 3), m."""
        return replace(self, points=points)


def facet_keys(facets: Integers, points: int) -> Integers:
    """Numbers (f,) that identify `facets` (f, 3 or 4) of a mesh of so many `points` by their three smallest corners."""
    low = np.sort(facets, axis=1).astype(np.int64)
    return (low[:, 0] * points + low[:, 1]) * points + low[:, 2]


def boundary_facets(part: PartMesh) -> tuple[Integers, Integers]:
    """Corners (b, 3 or 4) of facets of one cell only, counter-clockwise seen from outside, and their cells (b,)."""
    number = part.facet_numbers
    alone = np.flatnonzero(np.bincount(number)[number] == 1)
    return part.cell_facets[alone], alone // len(part.shape.facets)


def facet_geometry(points: Array, facets: Integers) -> tuple[Array, Array, Array]:
    """Centroid (f, 3), m, unit normal (f, 3), area (f,), m², of facets (f, 3 or 4) between `points` (p, 3), m.

    Corners run counter-clockwise about the normal; quadrilaterals count as two triangles.
    """
    fan = [facets[:, [0, k, k + 1]] for k in range(1, facets.shape[1] - 1)]
    vectors = [np.cross(points[t[:, 1]] - points[t[:, 0]], points[t[:, 2]] - points[t[:, 0]]) / 2 for t in fan]
    areas = [np.linalg.norm(vector, axis=1) for vector in vectors]
    area = np.sum(areas, axis=0)
    moments = sum(a[:, None] * points[t].mean(axis=1) for a, t in zip(areas, fan, strict=True))
    total = np.sum(vectors, axis=0)
    size = np.linalg.norm(total, axis=1)
    safe = np.where(area > 0, area, 1.0)
    return moments / safe[:, None], total / np.where(size > 0, size, 1.0)[:, None], area


def show(vector: Array) -> str:
    """A point, m, or a direction (3,) as text, without digits below a micrometer."""
    return f"({', '.join(f'{value:.4g}' for value in np.round(vector, 6) + 0.0)})"  # −0 is 0
