"""Cross sections x = const of a solid mesh: quadrature on the plane figure in which the plane cuts the cells.

Every cell is cut in its reference coordinates, where it is a few tetrahedra, by marching through these: a tetrahedron
that the plane cuts contributes one triangle or two. Where the map of the cell bends, the corners and the mid-sides of
each triangle are moved onto the plane along the faces of the tetrahedra, so that the pieces still meet, and the
triangle becomes one with six nodes: what remains is of third order in its size.

Importing this loads dolfinx.
"""

from collections.abc import Iterator
from functools import lru_cache

import basix
import numpy as np
from dolfinx.mesh import Mesh

from ..common.arrays import Array, Booleans, Integers
from ..common.errors import SolveError
from ..common.structs import struct
from .cells import HEXAHEDRON, KUHN, TETRAHEDRON
from .compat import coordinate_element, geometry_nodes

# Nodes closer to the plane than this, relative to the length of the part, lie in it.
IN_PLANE = 1e-9


@struct
class SectionQuadrature:
    """Quadrature, by q points, on the part of a cross section that lies in this process's cells."""

    cells: Integers  # (q,) number of each point's local cell
    X: Array  # (q, 3) reference coordinates of the points in these cells, no unit
    weights: Array  # (q,) in m²; their sum over all processes is the area of the section
    points: Array  # (q, 3) in m
    y_range: tuple[float, float]  # smallest and largest y of the section, in m; (inf, −inf) where no cell is cut
    z_range: tuple[float, float]  # likewise


def section_quadratures(mesh: Mesh, x: Array, degree: int) -> Iterator[SectionQuadrature]:
    """Quadrature on each cross section at `x` (k,), m, exact for polynomials of `degree` in the coordinates.

    Where faces of cells lie in the plane, the section is that of the material towards larger x; at the end of the part
    that towards smaller x; outside the part, it is empty. All processes of the mesh, of degree 1 or 2, must call.
    """
    nodes, coordinates = geometry_nodes(mesh), mesh.geometry.x
    begin, end = _extent(mesh)
    tolerance = IN_PLANE * (end - begin)
    along = coordinates[nodes, 0]
    low, high = along.min(axis=1), along.max(axis=1)
    for place in x:
        at_end = abs(place - end) <= tolerance
        cut = np.flatnonzero(_above(high - place, at_end, tolerance) & ~_above(low - place, at_end, tolerance))
        if not cut.size:
            none = (np.inf, -np.inf)
            yield SectionQuadrature(cut, np.empty((0, 3)), np.empty(0), np.empty((0, 3)), none, none)
            continue
        cells = _Cells(mesh, cut, coordinates[nodes[cut]], along[cut] - place)
        yield _integrate(cells, _march(cells, at_end, tolerance), degree)


def _above(f: Array, at_end: bool, tolerance: float) -> Booleans:
    """Which points at distance `f` count as lying above the plane: those in it do only at the end of the part."""
    return f >= -tolerance if at_end else f > tolerance


def _extent(mesh: Mesh) -> tuple[float, float]:
    x = mesh.geometry.x[:, 0]
    local = (x.min(), x.max()) if x.size else (np.inf, -np.inf)
    ranges = np.array(mesh.comm.allgather(local))
    return float(ranges[:, 0].min()), float(ranges[:, 1].max())


class _Cells:
    """The cells that a plane cuts: `index` (k,) local numbers, `nodes` (k, v, 3) and distances `f` (k, v) of nodes."""

    def __init__(self, mesh: Mesh, index: Integers, nodes: Array, f: Array) -> None:
        self.index, self.nodes, self.f = index, nodes, f
        self.element = coordinate_element(mesh)
        self.tetrahedral = self.element.cell_type == basix.CellType.tetrahedron
        self.affine = self.tetrahedral and mesh.geometry.cmap.degree == 1

    def basis(self, X: Array, derivatives: int) -> Array:
        """Values, and derivatives along X, of the shape functions at `X` (q, 3): (1 or 4, q, v)."""
        return self.element.tabulate(derivatives, X)[..., 0]

    def distance(self, cell: Integers, X: Array) -> tuple[Array, Array]:
        """Distance from the plane (q,) and its gradient (q, 3) along X, at `X` (q, 3) in `cell` (q,)."""
        table = np.einsum("dqv,qv->dq", self.basis(X, 1), self.f[cell])
        return table[0], table[1:].T


@struct
class _Triangles:
    """Pieces of the section, in reference coordinates."""

    cell: Integers  # (t,) which of the cut cells each lies in
    ends: Array  # (t, 3, 2, 3) ends, above and below the plane, of the edges that the corners lie on
    corners: Array  # (t, 3, 3)


# Edges (above, below) that carry the corners of the triangles, by how many of a tetrahedron's four corners lie above;
# these are numbered first.
_CUTS: dict[int, list[list[tuple[int, int]]]] = {
    1: [[(0, 1), (0, 2), (0, 3)]],
    2: [[(0, 2), (0, 3), (1, 3)], [(0, 2), (1, 3), (1, 2)]],
    3: [[(0, 3), (1, 3), (2, 3)]],
}


def _march(cells: _Cells, at_end: bool, tolerance: float) -> _Triangles:
    """Cut the tetrahedra that the cells consist of."""
    points, tetrahedra = _lattice(cells.tetrahedral, cells.affine, cells.element.degree)
    f = cells.f if cells.affine else cells.f @ cells.basis(points, 0)[0].T
    inside = _above(f, at_end, tolerance)[:, tetrahedra]  # (k, tetrahedra, 4)
    count = inside.sum(axis=2)
    pieces: list[tuple[Integers, Integers]] = []
    for number, cuts in _CUTS.items():
        cell, which = np.nonzero(count == number)
        order = np.argsort(~inside[cell, which], axis=1, kind="stable")
        sorted_corners = np.take_along_axis(tetrahedra[which], order, axis=1)
        pieces.extend((cell, sorted_corners[:, np.array(cut)]) for cut in cuts)
    cell = np.concatenate([piece[0] for piece in pieces])
    edges = np.concatenate([piece[1] for piece in pieces])  # (t, 3, 2) points of the lattice
    f_ends = f[cell[:, None, None], edges]
    t = np.clip(f_ends[..., 0] / (f_ends[..., 0] - f_ends[..., 1]), 0.0, 1.0)
    ends = points[edges]
    along = ends[..., 1, :] - ends[..., 0, :]
    corners = ends[..., 0, :] + t[..., None] * along
    if not cells.affine:
        moved = _onto_plane(cells, np.repeat(cell, 3), corners.reshape(-1, 3), along.reshape(-1, 3))
        corners = moved.reshape(-1, 3, 3)
    return _Triangles(cell, ends, corners)


@lru_cache
def _lattice(tetrahedral: bool, affine: bool, degree: int) -> tuple[Array, Integers]:
    """The reference cell as tetrahedra: points (l, 3) and corners (m, 4). Curved cells are divided once more."""
    if affine:
        return TETRAHEDRON.corners, np.arange(4).reshape(1, 4)
    n = degree
    axis = np.arange(n) / n
    origins = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 1, 1, 3)
    tetrahedra = (origins + HEXAHEDRON.corners[KUHN] / n).reshape(-1, 4, 3)
    if tetrahedral:
        # The Kuhn tetrahedra of the cube with 1 ≥ X ≥ Y ≥ Z fill one of its six, which shears into the reference cell.
        X, Y, Z = np.moveaxis(tetrahedra.mean(axis=1), -1, 0)
        tetrahedra = tetrahedra[(X > Y) & (Y > Z)] @ np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]])
    points, corners = np.unique(np.round(tetrahedra.reshape(-1, 3) * n) / n, axis=0, return_inverse=True)
    return points, corners.reshape(-1, 4)


GRAZING = 0.025  # of a cell: an eighth of a circle stands out by this from the chords of its halves


def _onto_plane(cells: _Cells, cell: Integers, X: Array, along: Array) -> Array:
    """Move reference points `X` (q, 3) onto the plane in the directions `along` (q, 3), by Newton.

    Where a curved cell only comes near the plane, that is the nearest point; `SolveError` where it is not `GRAZING`.
    """
    for reach in 0.5 ** np.arange(1, 5):
        f, gradient = cells.distance(cell, X)
        slope = np.einsum("qi,qi->q", gradient, along)
        step = np.divide(f, slope, out=np.zeros_like(f), where=slope != 0)
        X = X - np.clip(step, -reach, reach)[:, None] * along
        if np.all(np.abs(step) < 1e-8):  # the next would be round-off
            return X
    f, gradient = cells.distance(cell, X)
    if np.any(np.abs(f) > GRAZING * np.linalg.norm(gradient, axis=1)):
        raise SolveError("expected curved cells that a section cuts in points", "none in one: use smaller elements")
    return X


def _integrate(cells: _Cells, triangles: _Triangles, degree: int) -> SectionQuadrature:
    """Quadrature on the triangles: three nodes where the cells are affine, six elsewhere."""
    nodes = triangles.corners if cells.affine else _with_mid_sides(cells, triangles)
    basis, derivatives, rule = _triangle_rule(1 if cells.affine else 2, degree)
    X = np.einsum("qa,tai->tqi", basis, nodes)
    tangents = np.einsum("dqa,tai->dtqi", derivatives, nodes)
    flat = X.reshape(-1, 3)
    cell = np.repeat(triangles.cell, len(rule))
    corner_values = cells.nodes[cell]
    table = cells.basis(flat, 1)
    points = np.einsum("qv,qvi->qi", table[0], corner_values)
    # Rows y and z of the Jacobian give the tangents in the plane.
    J = np.einsum("dqv,qvi->qid", table[1:], corner_values[..., 1:])
    first, second = (np.einsum("qid,qd->qi", J, tangent.reshape(-1, 3)) for tangent in tangents)
    weights = np.tile(rule, len(triangles.cell)) * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    kept = weights > 1e-14 * weights.max(initial=0.0)
    ranges = [_range(cells, triangles.cell, nodes, axis) for axis in (1, 2)]
    return SectionQuadrature(cells.index[cell[kept]], flat[kept], weights[kept], points[kept], *ranges)


def _with_mid_sides(cells: _Cells, triangles: _Triangles) -> Array:
    """(t, 6, 3): corners and mid-sides, in the order of basix's triangle of degree 2.

    The two corners of a side lie on two edges of one face of a tetrahedron (or on opposite edges): moving along the sum
    of these edges stays in that face, so neighbors find the same point.
    """
    directions = triangles.ends[:, :, 1] - triangles.ends[:, :, 0]
    pairs = np.array([[1, 2], [0, 2], [0, 1]])
    middle = triangles.corners[:, pairs].mean(axis=2).reshape(-1, 3)
    along = directions[:, pairs].sum(axis=2).reshape(-1, 3)
    moved = _onto_plane(cells, np.repeat(triangles.cell, 3), middle, along).reshape(-1, 3, 3)
    return np.concatenate([triangles.corners, moved], axis=1)


@lru_cache
def _triangle_rule(nodes_degree: int, degree: int) -> tuple[Array, Array, Array]:
    """Shape functions (q, a), their derivatives (2, q, a) and weights (q,) on the reference triangle."""
    variant = basix.LagrangeVariant.equispaced
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, nodes_degree, variant)
    points, weights = basix.make_quadrature(basix.CellType.triangle, max(degree, 1))
    table = element.tabulate(1, points)[..., 0]
    return table[0], table[1:], weights


def _range(cells: _Cells, cell: Integers, nodes: Array, axis: int) -> tuple[float, float]:
    if not cell.size:
        return np.inf, -np.inf
    table = cells.basis(nodes.reshape(-1, 3), 0)[0]
    values = np.einsum("qv,qv->q", table, cells.nodes[np.repeat(cell, nodes.shape[1]), :, axis])
    return float(values.min()), float(values.max())
