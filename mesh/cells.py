"""The two cells that solids are made of: how gmsh numbers their nodes, their facets and edges, and their Jacobians.

gmsh's order of corners: the tetrahedron's first three counter-clockwise seen from outside the fourth's side; the
hexahedron's lower face, then the upper one. See "Node ordering" in the manual of gmsh.
"""

from collections.abc import Mapping
from functools import lru_cache
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from ..common.arrays import Array, Integers
from ..common.structs import struct

CellName = Literal["tetrahedron", "hexahedron"]


@struct
class Cell:
    """Topology of a cell in gmsh's order of nodes: v corners, m facets, e edges."""

    corners: Array  # (v, 3) of the reference cell, edges of 1, no unit
    facets: Integers  # (m, 3 or 4) corners of each facet, counter-clockwise seen from outside
    edges: Integers  # (e, 2) corners of each edge; the node of degree 2 on edge k is number v + k
    nodes: dict[int, int]  # number of nodes by degree


TETRAHEDRON = Cell(
    corners=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float64),
    facets=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]),
    edges=np.array([[0, 1], [1, 2], [2, 0], [3, 0], [3, 2], [3, 1]]),
    nodes={1: 4, 2: 10},
)

HEXAHEDRON = Cell(
    corners=np.array(
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], dtype=np.float64
    ),
    facets=np.array([[0, 3, 2, 1], [0, 1, 5, 4], [0, 4, 7, 3], [1, 2, 6, 5], [2, 3, 7, 6], [4, 5, 6, 7]]),
    edges=np.array([[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]]),
    nodes={1: 8, 2: 27},
)

CELLS: dict[CellName, Cell] = {"tetrahedron": TETRAHEDRON, "hexahedron": HEXAHEDRON}

# Six tetrahedra around the diagonal 0–6 of a hexahedron (Kuhn): they fill it and meet those of equally numbered
# neighbors face to face.
KUHN = np.array([[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]])

# gmsh's numbers of types of volume elements, under the names that meshio uses.
VOLUME_ELEMENTS = {
    4: "tetra",
    11: "tetra10",
    29: "tetra20",
    5: "hexahedron",
    17: "hexahedron20",
    12: "hexahedron27",
    6: "wedge",
    7: "pyramid",
    13: "wedge18",
    14: "pyramid14",
    18: "wedge15",
    19: "pyramid13",
}

# VTK and meshio number nodes otherwise: edges of the hexahedron around the lower face, the upper face, then upright.
_VTK_HEXAHEDRON_EDGES = [
    (0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7),
]  # fmt: skip
_HEXAHEDRON20 = [*range(8), *(8 + _VTK_HEXAHEDRON_EDGES.index((int(a), int(b))) for a, b in np.sort(HEXAHEDRON.edges))]
TO_GMSH = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hexahedron20": _HEXAHEDRON20,
    "hexahedron27": [*_HEXAHEDRON20, 24, 22, 20, 21, 23, 25, 26],
}
"""Type of element → which of VTK's nodes gmsh's nodes are."""


def in_gmsh_order(kind: str, cells: Integers, as_vtk: Mapping[str, list[int]] = MappingProxyType({})) -> Integers:
    """Reorder nodes (c, v) of cells of type `kind` from VTK's order, or one that `as_vtk` turns into it, to gmsh's."""
    for order in (as_vtk.get(kind), TO_GMSH.get(kind)):
        cells = cells if order is None else cells[:, order]
    return cells


# Quality below which a cell is flat.
SLIVER = 1e-3
_BLOCK = 20_000  # cells integrated at a time


@lru_cache
def reference_nodes(cell: CellName, degree: int) -> Array:
    """Nodes (v, 3), no unit, of the reference cell: corners, middles of edges, faces and the hexahedron."""
    shape = CELLS[cell]
    if degree == 1:
        return shape.corners
    middles = [shape.corners[shape.edges].mean(axis=1)]
    if cell == "hexahedron":
        middles += [shape.corners[shape.facets].mean(axis=1), np.full((1, 3), 0.5)]
    return np.concatenate([shape.corners, *middles])


@lru_cache
def _element(cell: CellName, degree: int) -> tuple[Any, Integers]:
    """Basix's Lagrange element, and which of its nodes gmsh's nodes are."""
    import basix

    variant = basix.LagrangeVariant.equispaced
    element = basix.create_element(basix.ElementFamily.P, getattr(basix.CellType, cell), degree, variant)
    return element, np.linalg.norm(reference_nodes(cell, degree)[:, None] - element.points, axis=2).argmin(axis=1)


def jacobians(nodes: Array, cell: CellName, degree: int, X: Array) -> Array:
    """Derivatives ∂x_i/∂X_d (c, q, 3, 3), m, of cells with `nodes` (c, v, 3), m, at X (q, 3), no unit."""
    element, order = _element(cell, degree)
    return np.einsum("dqv,cvi->cqid", element.tabulate(1, X)[1:, :, order, 0], nodes, optimize=True)


def volume_and_center(nodes: Array, cell: CellName, degree: int) -> tuple[float, Array]:
    """Volume, m³, and its center (3,), m, of warped or curved cells with `nodes` (c, v, 3), m, to round-off."""
    import basix

    element, order = _element(cell, degree)
    X, weights = basix.make_quadrature(element.cell_type, 4 * degree - 1)
    values = element.tabulate(0, X)[0, :, order, 0].T  # (q, v)
    volume, moment = 0.0, np.zeros(3)
    for some in np.array_split(nodes, len(nodes) // _BLOCK + 1):
        parts = np.linalg.det(jacobians(some, cell, degree, X)) * weights
        volume += float(parts.sum())
        moment += np.einsum("cv,cvi->i", parts @ values, some)
    return volume, moment / volume


def cell_quality(corners: Array, cell: CellName) -> Array:
    """Quality (c,) of cells with `corners` (c, v, 3), m: 1 for regular tetrahedra and cubes, 0 for flat cells.

    Volume of a tetrahedron relative to that of the regular one with the same mean square edge; smallest determinant of
    a hexahedron's Jacobian relative to the product of its edges.
    """
    J = jacobians(corners, cell, 1, CELLS[cell].corners)
    determinants = np.abs(np.linalg.det(J))
    if cell == "tetrahedron":
        edges = corners[:, CELLS[cell].edges]
        squares = np.sum((edges[:, :, 1] - edges[:, :, 0]) ** 2, axis=2)
        return np.sqrt(2) * determinants.min(axis=1) / np.maximum(squares.mean(axis=1), 1e-200) ** 1.5
    sides = np.prod(np.linalg.norm(J, axis=2), axis=2)
    return np.min(determinants / np.maximum(sides, 1e-300), axis=1)
