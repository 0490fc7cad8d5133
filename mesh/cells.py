"""The two cells that solids are made of: how gmsh numbers their nodes, and what their facets and edges are.

gmsh's order of corners: the tetrahedron's first three counter-clockwise seen from outside the fourth's side; the
hexahedron's lower face, then the upper one. See "Node ordering" in the manual of gmsh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..common.arrays import Array, Integers

CellName = Literal["tetrahedron", "hexahedron"]


@dataclass(frozen=True)
class Cell:
    """Topology of a cell in gmsh's order of nodes.

    Attributes:
        corners: (v, 3) of the reference cell.
        facets: (m, 3 or 4) corners of each facet, counter-clockwise seen from outside.
        edges: (e, 2) corners of each edge; the node of degree 2 on edge k is number v + k.
        nodes: number of nodes by degree.
    """

    corners: Array
    facets: Integers
    edges: Integers
    nodes: dict[int, int]


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
    edges=np.array(
        [[0, 1], [0, 3], [0, 4], [1, 2], [1, 5], [2, 3], [2, 6], [3, 7], [4, 5], [4, 7], [5, 6], [6, 7]],
    ),
    nodes={1: 8, 2: 27},
)

CELLS: dict[CellName, Cell] = {"tetrahedron": TETRAHEDRON, "hexahedron": HEXAHEDRON}

# Six tetrahedra around the diagonal 0–6 of a hexahedron (Kuhn): they fill it and meet those of equally numbered
# neighbours face to face.
KUHN = np.array([[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]])
