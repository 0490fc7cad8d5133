"""Shape functions of straight and curved cells in gmsh's order of nodes, with NumPy alone: for checks and volumes."""

from __future__ import annotations

from functools import lru_cache
from itertools import product

import numpy as np

from .cells import CELLS, CellName, Floats


@lru_cache
def reference_nodes(cell: CellName, degree: int) -> Floats:
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


def shape_functions(cell: CellName, degree: int, X: Floats) -> Floats:
    """(q, v) values at `X` (q, 3)."""
    return _monomials(cell, degree, X) @ _coefficients(cell, degree)


def jacobians(nodes: Floats, cell: CellName, degree: int, X: Floats) -> Floats:
    """(c, q, 3, 3) derivatives ∂x_i/∂X_d of cells with `nodes` (c, v, 3), at `X` (q, 3)."""
    slopes = _monomial_slopes(cell, degree, X) @ _coefficients(cell, degree)  # (3, q, v)
    J: Floats = np.einsum("dqv,cvi->cqid", slopes, nodes, optimize=True)
    return J


def _coefficients(cell: CellName, degree: int) -> Floats:
    return np.linalg.inv(_monomials(cell, degree, reference_nodes(cell, degree)))


def _monomials(cell: CellName, degree: int, X: Floats) -> Floats:
    return np.stack([np.prod(X**powers, axis=1) for powers in _exponents(cell, degree)], axis=1)


def _monomial_slopes(cell: CellName, degree: int, X: Floats) -> Floats:
    slopes = np.zeros((3, len(X), len(_exponents(cell, degree))))
    for k, powers in enumerate(_exponents(cell, degree)):
        for d in range(3):
            lowered = np.array(powers)
            lowered[d] = max(lowered[d] - 1, 0)
            slopes[d, :, k] = powers[d] * np.prod(X**lowered, axis=1)
    return slopes
