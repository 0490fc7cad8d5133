"""A mesh as a file or a mesher gives it, and what becomes of it: one kind of cell, numbered without gaps.

Names of element types are meshio's; nodes are in gmsh's order.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array, Integers
from ..common.errors import InputError
from .cells import CELLS, CellName
from .part_mesh import PartMesh

_SUPPORTED: dict[str, tuple[CellName, int]] = {
    "tetra": ("tetrahedron", 1),
    "tetra10": ("tetrahedron", 2),
    "hexahedron": ("hexahedron", 1),
    "hexahedron20": ("hexahedron", 2),
    "hexahedron27": ("hexahedron", 2),
}
# Mid-side nodes closer to the middle of their edge than this, relative to its length, make a straight edge.
STRAIGHT = 1e-9


@dataclass(frozen=True)
class RawMesh:
    """What a source gives.

    Attributes:
        points: (p, 3) in the source's unit and axes; some may belong to no volume.
        blocks: of volume elements: type, (c, v) points, region or None.
        facet_groups: name → facets, as arrays (k, ≥ 3) of corners.
        point_groups: name → (k,) points: a face is what has all its corners among them.
        surface_elements: how many triangles and quadrilaterals there are.
    """

    points: Array
    blocks: Sequence[tuple[str, Integers, str | None]]
    facet_groups: Mapping[str, Sequence[Integers]]
    point_groups: Mapping[str, Integers]
    surface_elements: int


@dataclass(frozen=True)
class Source:
    """A part, and the groups of facets or points that its file names.

    Attributes:
        part: not placed yet, no faces named.
        facet_groups: name → (k, 3 or 4) corners.
        point_groups: name → (k,) points.
    """

    part: PartMesh
    facet_groups: Mapping[str, Integers]
    point_groups: Mapping[str, Integers]


def source_from(raw: RawMesh, where: str) -> Source:
    """One mesh from the blocks of `raw`; `where` (file and key) begins the messages.

    Raises:
        InputError: no volume elements, unsupported or mixed ones, or curved hexahedra of 20 nodes.
    """
    kind = _only_kind(raw, where)
    cell, degree = _SUPPORTED[kind]
    cells = np.concatenate([block[1] for block in raw.blocks])
    names = list(dict.fromkeys(block[2] for block in raw.blocks if block[2] is not None))
    regions = {name: k + 1 for k, name in enumerate(names)}
    cell_tag = np.concatenate(
        [np.full(len(block[1]), regions.get(block[2] or "", 0), dtype=np.int32) for block in raw.blocks]
    )
    straight = degree == 2 and _is_straight(raw.points, cells, cell)
    if kind == "hexahedron20" and not straight:
        raise InputError(
            f"{where}: expected hexahedra of 8 or 27 nodes where edges are curved, found hexahedra of 20 nodes"
        )
    if straight:
        cells, degree = cells[:, : len(CELLS[cell].corners)], 1
    used, flat = np.unique(cells, return_inverse=True)
    number = np.full(len(raw.points), -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    part = PartMesh(raw.points[used], flat.reshape(cells.shape), cell, degree, cell_tag, regions)
    facets = {name: number[np.concatenate(list(pieces))] for name, pieces in raw.facet_groups.items()}
    points = {name: number[group][number[group] >= 0] for name, group in raw.point_groups.items()}
    return Source(part, facets, points)


def _only_kind(raw: RawMesh, where: str) -> str:
    """The type of all the volume elements."""
    counts: dict[str, int] = {}
    for kind, cells, _ in raw.blocks:
        counts[kind] = counts.get(kind, 0) + len(cells)
    listed = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    if not listed:
        hint = f": {raw.surface_elements} triangles or quadrilaterals (shells) only" if raw.surface_elements else ""
        raise InputError(f"{where}: expected a mesh of volume elements, found none{hint}")
    unsupported = [kind for kind in counts if kind not in _SUPPORTED]
    if unsupported:
        known = "tetrahedra of 4 or 10 nodes, hexahedra of 8 or 27 nodes"
        raise InputError(f"{where}: expected {known}, found unsupported elements: {listed}")
    if len(counts) > 1:
        raise InputError(f"{where}: expected volume elements of one type, found a mixture: {listed}")
    return next(iter(counts))


def _is_straight(points: Array, cells: Integers, cell: CellName) -> bool:
    """Whether all nodes on edges are the middles of these."""
    shape = CELLS[cell]
    corners = points[cells[:, : len(shape.corners)]]
    first, second = corners[:, shape.edges[:, 0]], corners[:, shape.edges[:, 1]]
    middles = points[cells[:, len(shape.corners) : len(shape.corners) + len(shape.edges)]]
    off = np.linalg.norm(middles - (first + second) / 2, axis=2)
    return bool(np.all(off <= STRAIGHT * np.linalg.norm(second - first, axis=2)))
