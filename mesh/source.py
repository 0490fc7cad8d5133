"""A mesh as a file or a mesher gives it, and what becomes of it: one kind of cell, numbered without gaps.

Names of element types are meshio's; nodes are in gmsh's order.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field

import numpy as np

from ..common.arrays import Array, Integers, NDArray
from ..common.errors import InputError
from ..common.structs import struct
from .cells import CELLS, CellName
from .part_mesh import PartMesh, facet_keys

_SUPPORTED: dict[str, tuple[CellName, int]] = {
    "tetra": ("tetrahedron", 1),
    "tetra10": ("tetrahedron", 2),
    "hexahedron": ("hexahedron", 1),
    "hexahedron20": ("hexahedron", 2),
    "hexahedron27": ("hexahedron", 2),
}
# Mid-side nodes closer to the middle of their edge than this, relative to the part, make a straight edge: files carry
# as few as five digits.
STRAIGHT = 5e-6
_LISTED = 5  # concentrated masses, one by one


@struct
class PointMass:
    """A concentrated mass, which a link can have on an interface, in the units of its file."""

    label: str  # what the file calls it, and where
    mass: float  # in the file's unit, kg where lengths are in m
    point: Array  # (3,) in the source's unit and axes


Groups = Iterable[tuple[str, Integers]]
"""Names with their members (k,) in a block of elements."""


@struct
class RawMesh:
    """Mesh as read from a source, in its unit of length; readers add elements block by block."""

    points: Array  # (p, 3) in the source's unit and axes; some may belong to no volume
    # name → numbers (k,) of points: a face is what has all its corners among them
    point_groups: Mapping[str, Integers] = field(default_factory=dict)
    blocks: list[tuple[str, Integers]] = field(default_factory=list)  # of volume elements: type, (c, v) points
    # name → arrays (k,) of elements, counted through all `blocks`; an element may belong to several
    regions: dict[str, list[Integers]] = field(default_factory=dict)
    facet_groups: dict[str, list[Integers]] = field(default_factory=dict)  # name → arrays (k, ≥ 3) of corners
    surfaces: list[Integers] = field(default_factory=list)  # corners of all triangles and quadrilaterals (k, 3 or 4)
    lines: list[Integers] = field(default_factory=list)  # ends (k, 2) of all elements that are lines
    remarks: Sequence[str] = ()  # what the file holds and the link does not, a sentence each
    masses: Sequence[PointMass] = ()  # concentrated ones, which the link does not have either

    def add_solids(self, kind: str, cells: Integers, groups: Groups) -> None:
        """Add c volume elements (c, v) of meshio's type `kind`, nodes in gmsh's order, and the groups among them."""
        count = sum(len(block) for _, block in self.blocks)
        self.blocks.append((kind, cells))
        for name, members in groups:
            self.regions.setdefault(name, []).append(count + members)

    def add_surfaces(self, corners: Integers, groups: Groups) -> None:
        """Add `corners` (k, 3 or 4) of triangles or quadrilaterals, and the groups among them."""
        self.surfaces.append(corners)
        for name, members in groups:
            self.facet_groups.setdefault(name, []).append(corners[members])


def left_out(others: Mapping[str, int], unread: Collection[str]) -> Iterator[str]:
    """Yield remarks on a deck's elements that are no solids (`others`: numbers by type), and on `unread` keywords."""
    if others:
        listed = ", ".join(f"{count} {kind}" for kind, count in others.items())
        yield f"elements that are not solids are left out, with their stiffness and mass: {listed}"
    if unread:
        yield f"not read: {', '.join(unread)}"


@struct
class Source:
    """A part, and the groups of facets or points that its file names."""

    part: PartMesh  # in the file's axes, or placed in the link's frame; no faces named
    facet_groups: Mapping[str, Integers]  # name → (k, 3 or 4) corners
    point_groups: Mapping[str, Integers]  # name → (k,) points
    masses: Sequence[PointMass] = ()  # concentrated ones that the part does not have


def source_from(raw: RawMesh) -> Source:
    """One mesh from the blocks of `raw`, each cell once.

    Raises `InputError` for no volume elements, unsupported or mixed ones, curved hexahedra of 20 nodes, and nodes that
    are missing or have no finite coordinates.
    """
    kind = _only_kind(raw)
    cell, degree = _SUPPORTED[kind]
    cells: Integers = np.concatenate([block for _, block in raw.blocks])
    _check_nodes(raw, cells)
    _, first, like = np.unique(np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True)
    kept = np.sort(first)  # each cell once, in the file's order
    once = np.searchsorted(kept, first)[like.reshape(-1)]
    cells = cells[kept]
    members = {name: np.concatenate(of) for name, of in raw.regions.items()}
    regions = {name: np.unique(once[of]) for name, of in members.items() if of.size}
    cell_tag, tags = _tags(len(cells), regions)
    straight = degree == 2 and _is_straight(raw.points, cells, cell)
    if kind == "hexahedron20" and not straight:
        raise InputError("expected hexahedra of 8 or 27 nodes where edges are curved", "hexahedra of 20 nodes")
    if straight:
        cells, degree = cells[:, : len(CELLS[cell].corners)], 1
    used, flat = np.unique(cells, return_inverse=True)
    number = np.full(len(raw.points), -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    remarks = [*raw.remarks, *_masses_left_out(raw.masses), *_left_out(raw, cells, cell)]
    if doubles := len(once) - len(cells):
        remarks.append(f"{doubles} of {len(once)} cells are duplicates in the file, and count once")
    part = PartMesh(
        raw.points[used],
        flat.reshape(cells.shape),
        cell,
        degree,
        cell_tag,
        {name: of[0] for name, of in tags.items()},
        overlaps={name: of[1:] for name, of in tags.items() if of[1:]},
        remarks=tuple(remarks),
    )
    facets = {name: _facets(pieces, number, part) for name, pieces in raw.facet_groups.items()}
    points = {name: number[group][number[group] >= 0] for name, group in raw.point_groups.items()}
    return Source(part, facets, points, raw.masses)


def _masses_left_out(masses: Sequence[PointMass]) -> Iterator[str]:
    for one in masses[:_LISTED]:
        place = ", ".join(f"{value:.6g}" for value in one.point)
        yield f"{one.label}: mass {one.mass:g} at ({place}) is left out: give the interface there its `mass`, kg"
    if more := masses[_LISTED:]:
        yield f"{len(more)} more concentrated masses, {sum(one.mass for one in more):g} in all, are left out"


def _facets(pieces: Sequence[Integers], number: Integers, part: PartMesh) -> Integers:
    """(k, 3 or 4) corners of the facets of a group, in the numbers of `part`; -1 where its cells have no such ones."""
    sides = part.shape.facets.shape[1]
    strange = [np.full((len(piece), sides), -1) for piece in pieces if piece.shape[1] != sides]
    return np.concatenate([*(number[piece] for piece in pieces if piece.shape[1] == sides), *strange])


def _check_nodes(raw: RawMesh, cells: Integers) -> None:
    """Check that `cells` and groups have nodes of the file, and that those of cells are at some place."""
    groups = [piece for pieces in raw.facet_groups.values() for piece in pieces]
    for what, nodes in [("cells", cells), *(("facets", piece) for piece in groups)]:
        outside = np.any((nodes < 0) | (nodes >= len(raw.points)), axis=1)
        if np.any(outside):
            first = int(np.argmax(outside)) + 1
            raise InputError(
                f"expected {what} with nodes 1 to {len(raw.points)} of the file",
                f"{np.sum(outside)} of {len(nodes)} with others, first in number {first}",
            )
    if any(np.any((group < 0) | (group >= len(raw.points))) for group in raw.point_groups.values()):
        raise InputError("expected sets of nodes of the file", "missing nodes")
    with np.errstate(over="ignore"):
        lost = ~np.isfinite(np.sum(raw.points[np.unique(cells)] ** 2, axis=1))
    if np.any(lost):
        raise InputError("expected nodes with finite coordinates", f"{np.sum(lost)} without")


def _left_out(raw: RawMesh, cells: Integers, cell: CellName) -> Iterator[str]:
    """What to say of surfaces and lines that are no sides and edges of `cells`: shells and beams, it may be."""
    shape, count = CELLS[cell], len(raw.points)
    sides = facet_keys(cells[:, shape.facets].reshape(-1, shape.facets.shape[1]), count)
    loose = sum(int(np.sum(~np.isin(facet_keys(surface, count), sides))) for surface in raw.surfaces)
    if loose:
        yield f"{loose} triangles or quadrilaterals that are no side of a volume element (shells?) are left out"
    if raw.lines:
        edges = np.sort(cells[:, shape.edges].reshape(-1, 2), axis=1) @ np.array([count, 1])
        lines = np.sort(np.concatenate(raw.lines), axis=1) @ np.array([count, 1])
        if loose := int(np.sum(~np.isin(lines, edges))):
            yield f"{loose} lines that are no edge of a volume element (beams?) are left out"


def _tags(count: int, regions: Mapping[str, Integers]) -> tuple[NDArray[np.int32], dict[str, tuple[int, ...]]]:
    """A tag for each set of regions that a cell belongs to, and the tags of each region, the largest region first.

    The first of a region's tags is that of cells of the fewest other regions.
    """
    tag = np.zeros(count, dtype=np.int32)
    owners: list[tuple[str, ...]] = [()]
    for name, members in sorted(regions.items(), key=lambda item: -item[1].size):
        before, which = np.unique(tag[members], return_inverse=True)
        tag[members] = len(owners) + which
        owners += [(*owners[old], name) for old in before]
    tags_of: dict[str, list[int]] = {}
    for number in np.unique(tag).tolist():
        for name in owners[number]:
            tags_of.setdefault(name, []).append(number)
    ordered = {name: sorted(of, key=lambda number: len(owners[number])) for name, of in tags_of.items()}
    largest = sorted(ordered, key=lambda name: -regions[name].size)
    return tag, {name: tuple(ordered[name]) for name in largest}


def _only_kind(raw: RawMesh) -> str:
    counts = Counter[str]()
    for kind, cells in raw.blocks:
        counts[kind] += len(cells)
    listed = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
    if not listed:
        shells = sum(map(len, raw.surfaces))
        hint = f": {shells} triangles or quadrilaterals (shells) only" if shells else ""
        raise InputError("expected a mesh of volume elements", f"none{'; '.join((hint, *raw.remarks))}")
    if not counts.keys() <= _SUPPORTED.keys():
        known = "tetrahedra of 4 or 10 nodes, hexahedra of 8 or 27 nodes"
        raise InputError(f"expected {known}", f"unsupported elements: {listed}")
    if len(counts) > 1:
        raise InputError("expected volume elements of one type", f"a mixture: {listed}")
    return next(iter(counts))


def _is_straight(points: Array, cells: Integers, cell: CellName) -> bool:
    """Whether all nodes on edges are the middles of these."""
    shape = CELLS[cell]
    corners = points[cells[:, : len(shape.corners)]]
    first, second = corners[:, shape.edges[:, 0]], corners[:, shape.edges[:, 1]]
    middles = points[cells[:, len(shape.corners) : len(shape.corners) + len(shape.edges)]]
    off = np.linalg.norm(middles - (first + second) / 2, axis=2)
    return bool(np.all(off <= STRAIGHT * np.ptp(points[cells.ravel()], axis=0).max()))
