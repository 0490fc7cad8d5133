"""Structured meshes of boxes, straight or tapered: hexahedra in layers, or six tetrahedra in place of each."""

from __future__ import annotations

import numpy as np

from ..common.arrays import Array, Integers
from .cells import KUHN, CellName
from .part_mesh import PartMesh

Divisions = tuple[int, int, int]


def structured_box(
    length: float, root: tuple[float, float], tip: tuple[float, float], divisions: Divisions, cell: CellName
) -> PartMesh:
    """A box along x, 0 … `length`, centred on the axis.

    Args:
        length: in m.
        root: height (along y) and width (along z) at x = 0, in m.
        tip: the same at x = length; in between they change linearly.
        divisions: number of layers along x, y, z.
        cell: hexahedra, or tetrahedra in their place.
    """
    x, y, z = np.meshgrid(*(np.linspace(0.0, 1.0, n + 1) for n in divisions), indexing="ij")
    height = root[0] + (tip[0] - root[0]) * x
    width = root[1] + (tip[1] - root[1]) * x
    points: Array = np.stack([length * x, height * (y - 0.5), width * (z - 0.5)], axis=-1).reshape(-1, 3)
    cells = _hexahedra(divisions)
    if cell == "tetrahedron":
        cells = cells[:, KUHN].reshape(-1, 4)
    return PartMesh(points, cells, cell, 1, np.zeros(len(cells), dtype=np.int32))


def _hexahedra(divisions: Divisions) -> Integers:
    """(c, 8) corners in gmsh's order."""
    nx, ny, nz = divisions
    number = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    low, high = slice(None, -1), slice(1, None)
    # gmsh's corner order: around the lower face (z), then around the upper one.
    around = [(low, low), (high, low), (high, high), (low, high)]
    corners = [number[i, j, k].ravel() for k in (low, high) for i, j in around]
    return np.stack(corners, axis=1)
