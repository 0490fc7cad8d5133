"""Jacobians of straight and curved cells in gmsh's order of nodes, with NumPy alone: for checks."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from ..common.arrays import Array, as_floats
from .cells import CELLS, CellName

# Quality below which a cell is flat.
SLIVER = 1e-3
# Quadrature on the reference tetrahedron that is exact for cubics.
_CUBIC_POINTS = np.array([[3, 3, 3], [2, 2, 2], [6, 2, 2], [2, 6, 2], [2, 2, 6]]) / 12
_CUBIC_WEIGHTS = np.array([-4 / 5, *[9 / 20] * 4]) / 6


@lru_cache
def reference_nodes(cell: CellName, degree: int) -> Array:
    """(v, 3) nodes on the reference cell: corners, then middles of edges, faces and (hexahedra) the cell."""
    shape = CELLS[cell]
    if degree == 1:
        return shape.corners
    middles = [shape.corners[shape.edges].mean(axis=1)]
    if cell == "hexahedron":
        middles += [shape.corners[shape.facets].mean(axis=1), np.full((1, 3), 0.5)]
    return np.concatenate([shape.corners, *middles])


@lru_cache
def _exponents(cell: CellName, degree: int) -> list[tuple[int, ...]]:
    """The monomials X^a Y^b Z^c that the shape functions combine."""
    all_of = product(range(degree + 1), repeat=3)
    return [powers for powers in all_of if cell == "hexahedron" or sum(powers) <= degree]


def jacobians(nodes: Array, cell: CellName, degree: int, X: Array) -> Array:
    """(c, q, 3, 3) derivatives ∂x_i/∂X_d of cells with `nodes` (c, v, 3), at `X` (q, 3)."""
    slopes = _monomial_slopes(cell, degree, X) @ _coefficients(cell, degree)  # (3, q, v)
    return np.einsum("dqv,cvi->cqid", slopes, nodes, optimize=True)


def volume_of_tetrahedra(nodes: Array, degree: int) -> float:
    """Of tetrahedra with `nodes` (c, v, 3): the determinant of their Jacobian is a cubic at most."""
    determinants = np.linalg.det(jacobians(nodes, "tetrahedron", degree, _CUBIC_POINTS))
    return float(np.sum(determinants @ _CUBIC_WEIGHTS))


def cell_quality(corners: Array, cell: CellName) -> Array:
    """(c,) 1 for regular tetrahedra and cubes, 0 for flat cells; `corners` (c, v, 3).

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


def _coefficients(cell: CellName, degree: int) -> Array:
    return as_floats(np.linalg.inv(_monomials(cell, degree, reference_nodes(cell, degree))))


def _monomials(cell: CellName, degree: int, X: Array) -> Array:
    return np.stack([np.prod(X**powers, axis=1) for powers in _exponents(cell, degree)], axis=1)


def _monomial_slopes(cell: CellName, degree: int, X: Array) -> Array:
    slopes = np.zeros((3, len(X), len(_exponents(cell, degree))))
    for k, powers in enumerate(_exponents(cell, degree)):
        for d in range(3):
            lowered = np.array(powers)
            lowered[d] = max(lowered[d] - 1, 0)
            slopes[d, :, k] = powers[d] * np.prod(X**lowered, axis=1)
    return slopes
