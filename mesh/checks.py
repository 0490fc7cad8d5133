"""What must hold for a part's mesh before anything is computed on it, and what can be mended."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from ..common.arrays import Array, Booleans
from ..common.errors import InputError
from .cells import KUHN, SLIVER, cell_quality, jacobians, reference_nodes, volume_and_center
from .part_mesh import PartMesh, boundary_facets, facet_geometry, show
from .records import SolidGeometry

# Smallest determinant of a curved cell's Jacobian relative to its largest.
_CURVED = 0.005
# Largest relative change of the volume by straightening.
_VOLUME = 0.005
MOST_CELLS = 1e7  # far more than fit into the memory of the machines this runs on
METRES = {"m": 1.0, "mm": 1e-3, "in": 0.0254}
_NAMES = {"m": "meters", "mm": "millimeters", "in": "inches"}
# How far outside a free side the part must not be, relative to the side; and how far inside a cell is inside it.
_OUTSIDE, _INSIDE = 1e-3, 1e-6
# A point on a facet, by its corners, that lies on no plane through some of them.
_ON_FACET = {3: np.array([0.4, 0.35, 0.25]), 4: np.array([0.65 * 0.58, 0.35 * 0.58, 0.35 * 0.42, 0.65 * 0.42])}
# A part may reach beyond its interfaces (bosses around joints); farther out than this it is taken for a slip.
_LENGTHS = (0.2, 5.0)


def check_size(size: float, volume: float) -> float:
    """The number of tetrahedra of `size` (m) in `volume` (m³). Raises `InputError` above `MOST_CELLS`."""
    cubes = volume / size**3
    count = 6 * 2**0.5 * cubes  # regular tetrahedra
    check_count(
        count,
        f"{size:.3g} m for the volume of a cube of {volume ** (1 / 3):.3g} m",
        ' Is it drawn in another unit (unit = "mm")?',
    )
    return count


def check_count(count: float, given: str, hint: str = "") -> None:
    """Raise `InputError` for a mesh of more than `MOST_CELLS` cells; `given` explains the number."""
    if count > MOST_CELLS:
        raise InputError(
            "expected a mesh.size that fits the part",
            f"{given}: about {count:.2g} cells, {MOST_CELLS:.0e} at most.{hint}",
        )


def check_shape(part: PartMesh, geometry: SolidGeometry) -> None:
    """Raise `InputError` for a part (link's frame) without thickness, or of a length by which its unit is wrong."""
    extent = np.ptp(part.points[part.corners.ravel()], axis=0)
    if extent.min() <= 1e-9 * extent.max():
        axis = "xyz"[int(np.argmin(extent))]
        raise InputError("expected a part of some thickness", f"all nodes in one plane: zero elements along {axis}")
    ratio = extent[0] / geometry.length
    if _LENGTHS[0] < ratio < _LENGTHS[1]:
        return
    others = {unit: ratio * metres / METRES[geometry.unit] for unit, metres in METRES.items() if unit != geometry.unit}
    likely = [unit for unit, corrected in others.items() if 0.8 < corrected < 1.25]
    hint = f': looks like {_NAMES[likely[0]]}: geometry.unit = "{likely[0]}"' if likely else ""
    raise InputError(f"expected a part {geometry.length:g} m long", f"{extent[0]:g} m along x{hint}")


def check_sound(part: PartMesh) -> None:
    """Raise `InputError` for bad cells, cells in one another, and a part in pieces."""
    check_quality(part)
    check_neighbours(part)
    check_connected(part)


def check_neighbours(part: PartMesh) -> None:
    """Raise `InputError` unless two right-handed cells that share a facet lie on either side of it.

    Else cells overlap: three or more have a facet, or two lie on the same side of it.
    """
    facets = part.cell_facets
    smallest = np.argmin(facets, axis=1)[:, None]
    sides, rows = facets.shape[1], np.arange(len(facets))[:, None]
    after, before = facets[rows, (smallest + 1) % sides], facets[rows, (smallest - 1) % sides]
    # Seen from the cells on its two sides, the corners of a facet run round it in opposite senses.
    sided = 2 * part.facet_numbers + (after < before)[:, 0]
    bad = np.bincount(sided)[sided] > 1
    bad_cells = np.any(bad.reshape(len(part.cells), -1), axis=1)
    _refuse(part, bad_cells, "overlapping elements", "elements side by side")


def check_connected(part: PartMesh) -> None:
    """Raise `InputError` unless the cells are connected by their faces."""
    cell = np.repeat(np.arange(len(part.cells)), len(part.shape.facets))
    incidence = sp.csr_matrix((np.ones(cell.size, dtype=np.int8), (cell, part.facet_numbers)))
    count, piece = connected_components(incidence @ incidence.T, directed=False)
    if count == 1:
        return
    middles = part.points[part.corners].mean(axis=1)
    pieces = [piece == k for k in range(min(count, 4))]
    listed = [f"{np.sum(own)} elements around {show(middles[own].mean(axis=0))}" for own in pieces]
    more = f", and {count - 4} more" if count > 4 else ""
    raise InputError(
        "expected one connected part",
        f"{count}: {'; '.join(listed)}{more}. Parts that touch must share their nodes",
    )


def check_boundary(part: PartMesh) -> None:
    """Raise `InputError` where the part lies on both sides of a facet that only one cell has.

    There elements overlap, or nodes at one place are not joined, which is a crack.
    """
    facets, owner = boundary_facets(part)
    _, normal, area = facet_geometry(part.points, facets)
    corners = part.points[facets]
    bent = np.linalg.norm(corners.mean(axis=1) - corners[:, ::2].mean(axis=1), axis=1) if corners.shape[1] == 4 else 0.0
    on_facets = np.einsum("k,fki->fi", _ON_FACET[corners.shape[1]], corners)
    probes = on_facets + (_OUTSIDE * np.sqrt(area) + 2 * bent)[:, None] * normal
    split = KUHN if part.cell == "hexahedron" else np.arange(4)[None]
    x = part.points[part.corners[:, split].reshape(-1, 4)]  # (t, 4, 3) tetrahedra
    middle = x.mean(axis=1)
    reach = np.linalg.norm(x - middle[:, None], axis=2).max(axis=1)
    tree = cKDTree(probes)
    near = np.flatnonzero(tree.query(middle)[0] <= reach)
    neighbors = tree.query_ball_point(middle[near], reach[near])
    inside = np.zeros(len(facets), dtype=bool)
    for some in np.array_split(np.arange(near.size), near.size // 100_000 + 1):
        probe = np.array([k for of in neighbors[some] for k in of], dtype=np.int64)
        of = np.repeat(near[some], [len(neighbors[k]) for k in some])
        other = of // len(split) != owner[probe]
        probe, of = probe[other], of[other]
        edges = (x[of, 1:] - x[of, :1]).transpose(0, 2, 1)
        share = np.linalg.solve(edges, (probes[probe] - x[of, 0])[..., None])[..., 0]  # of the corners but the first
        inside[probe[(share.min(axis=1, initial=1.0) > _INSIDE) & (share.sum(axis=1) < 1 - _INSIDE)]] = True
    if np.any(inside):
        listed = ", ".join(show(place) for place in on_facets[inside][:3])
        raise InputError(
            "expected elements side by side",
            f"{np.sum(inside)} of their free sides inside others, e.g. at {listed} m: elements overlap, or nodes at"
            " one place are not one",
        )


def oriented(part: PartMesh) -> PartMesh:
    """`part`, its cells mirrored if all of them are left-handed, as some formats number them."""
    at_corners = jacobians(part.points[part.corners], part.cell, 1, part.shape.corners)
    if np.all(np.linalg.det(at_corners) < 0):  # others may be curved too much
        nodes = reference_nodes(part.cell, part.degree)
        swapped = nodes[:, [1, 0, 2]]
        order = np.argmin(np.linalg.norm(nodes[None] - swapped[:, None], axis=2), axis=1)
        return replace(part, cells=part.cells[:, order])
    return part


def check_quality(part: PartMesh) -> None:
    """Raise `InputError`, with how many and where, for cells that are inverted or flat."""
    repeated = (np.diff(np.sort(part.cells)) == 0).any(axis=1)
    _refuse(part, repeated, "elements with a node twice", "elements of distinct nodes")
    determinants = _determinants(part)
    largest = np.abs(determinants).max(axis=1)
    inverted = determinants.min(axis=1) <= 1e-6 * largest
    # A flat cell's determinant has no sign to speak of.
    flat = cell_quality(part.points[part.corners], part.cell) < SLIVER
    _refuse(part, inverted & ~flat, "inverted elements", "elements with their nodes in order")
    _refuse(part, flat, "flat elements (slivers)", "elements of some volume")


def straightened(part: PartMesh) -> PartMesh:
    """`part` with mid-side nodes moved towards the middle of their edges until no curved cell is inverted.

    Where a coarse cell has two edges on one smooth curve its corner between them is (nearly) flat.
    """
    if part.degree == 1:
        return part
    points, shape = part.points.copy(), part.shape
    corners = len(shape.corners)
    for _ in range(20):
        determinants = _determinants(part.moved(points))
        bad = np.flatnonzero(determinants.min(axis=1) < _CURVED * determinants.max(axis=1))
        if not bad.size:
            break
        ends = part.cells[bad][:, shape.edges].reshape(-1, 2)
        middle, once = np.unique(part.cells[bad][:, corners : corners + len(shape.edges)], return_index=True)
        straight = points[ends[once]].mean(axis=1)
        points[middle] = straight + 0.7 * (points[middle] - straight)
    return part.moved(points)


def check_volume(part: PartMesh, curved: PartMesh) -> None:
    """Raise `InputError` unless `straightened` kept the volume that gmsh's `curved` part has.

    Else cells are too long for a thin curved wall, and the link would not have its mass.
    """
    if np.array_equal(part.points, curved.points):
        return
    volume, after = (volume_and_center(each.points[each.cells], each.cell, each.degree)[0] for each in (curved, part))
    change = after / volume - 1
    if abs(change) > _VOLUME:
        raise InputError(
            "expected a mesh.size at which cells follow curved faces",
            f"a volume {100 * change:+.1f} % off where cells that fold are straightened: cells are too long for a thin"
            " curved wall",
        )


def _determinants(part: PartMesh) -> Array:
    """(c, s) determinants of the Jacobian at the corners, and in curved cells at the other nodes of degree 2 too."""
    at = reference_nodes(part.cell, part.degree)
    return np.linalg.det(jacobians(part.points[part.cells], part.cell, part.degree, at))


def _refuse(part: PartMesh, bad: Booleans, what: str, expected: str) -> None:
    """Raise `InputError` for the cells that are `bad` (c,), with how many and where; none is fine."""
    if np.any(bad):
        listed = ", ".join(map(show, part.points[part.corners[bad]].mean(axis=1)[:3]))
        raise InputError(f"expected {expected}", f"{np.sum(bad)} {what} of {len(bad)}, e.g. at {listed} m")
