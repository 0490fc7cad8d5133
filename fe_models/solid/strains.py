"""Strains of the modes of a solid at given points of its cells. Importing this loads dolfinx."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from dolfinx.fem import FunctionSpace
from dolfinx.mesh import Mesh
from scipy.spatial import cKDTree

from ...common.arrays import Array, Integers
from ...mesh.compat import coordinate_element, geometry_nodes, lagrange_element, node_map

CHUNK = 4096  # points at a time: some 50 MB with 20 modes on cubic tetrahedra
NEWTON_STEPS = 10
# Rows xx, yy, zz, yz, xz, xy of a symmetric tensor: the two indices of each.
VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


def modal_strains(space: FunctionSpace, cells: Integers, X: Array, modes: Array) -> Array:
    """(q, 6, n) strains ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy of modes at points of cells.

    Args:
        space: vector Lagrange.
        cells: (q,) cells of this process.
        X: (q, 3) reference coordinates in them.
        modes: (dofs, n) degrees of freedom of each mode on this process, ghosts included.
    """
    element, nodes = lagrange_element(space), node_map(space)
    n = modes.shape[1]
    values = modes.reshape(-1, 3 * n)
    strains = np.empty((len(cells), 6, n))
    for part in _chunks(len(cells)):
        # ∂φ/∂x = J⁻ᵀ ∂φ/∂X; displacement gradient [j, (i, n)] = ∂u_i/∂x_j.
        J = jacobians(space.mesh, cells[part], X[part])
        basis = element.tabulate(1, X[part])[1:, :, :, 0].transpose(1, 0, 2)
        physical = np.linalg.solve(J.transpose(0, 2, 1), basis)
        gradient = (physical @ values[nodes[cells[part]]]).reshape(-1, 3, 3, n)
        for row, (i, j) in enumerate(VOIGT):
            strains[part, row] = gradient[:, j, i] if i == j else gradient[:, j, i] + gradient[:, i, j]
    return strains


def jacobians(mesh: Mesh, cells: Integers, X: Array) -> Array:
    """(q, 3, 3) J = ∂x/∂X at reference coordinates X (q, 3) in each of `cells` (q,)."""
    shapes = coordinate_element(mesh).tabulate(1, X)[1:, :, :, 0]
    corners = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    return np.asarray(np.einsum("kqv,qvi->qik", shapes, corners))


def locate(mesh: Mesh, points: Array, slack: float) -> tuple[Integers, Integers, Array]:
    """All cells owned by this process that contain each of `points` (k, 3), in m.

    Args:
        mesh: any geometry; curved cells are inverted by Newton's method.
        points: in m.
        slack: how far outside its cell a point may be, in reference coordinates (fractions of the cell's size).

    Returns:
        For each hit the point (h,), the cell (h,) and the reference coordinates (h, 3).
    """
    owned = mesh.topology.index_map(3).size_local
    corners = mesh.geometry.x[geometry_nodes(mesh)]
    if not owned or not len(points):
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3))
    centers = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centers[:, None], axis=2).max()
    near = cKDTree(centers).query_ball_point(points, (1 + slack) * radius, return_sorted=True)
    point = np.repeat(np.arange(len(points)), [len(found) for found in near])
    cell = np.concatenate([np.asarray(found, dtype=np.int64) for found in near])
    low, high = corners.min(axis=1), corners.max(axis=1)
    pad = (slack + 0.1) * (high - low).max(axis=1, keepdims=True)  # a curved cell bulges out of its corners' box
    boxed = np.all((points[point] >= (low - pad)[cell]) & (points[point] <= (high + pad)[cell]), axis=1)
    point, cell = point[boxed], cell[boxed]
    X = pulled_back(mesh, cell, points[point])
    outside = -X.min(axis=1)
    if mesh.topology.cell_type.name == "tetrahedron":
        outside = np.maximum(outside, X.sum(axis=1) - 1)
    else:
        outside = np.maximum(outside, X.max(axis=1) - 1)
    inside = outside <= slack
    return point[inside], cell[inside], X[inside]


def pulled_back(mesh: Mesh, cells: Integers, points: Array) -> Array:
    """(q, 3) reference coordinates of `points` (q, 3) in `cells` (q,); far outside a curved cell anything."""
    element = coordinate_element(mesh)
    corners = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    X = np.full_like(points, 0.25)
    for _ in range(NEWTON_STEPS if len(points) else 0):
        x = np.einsum("qv,qvi->qi", element.tabulate(0, X)[0, :, :, 0], corners)
        step = np.linalg.solve(jacobians(mesh, cells, X), (points - x)[:, :, None])[:, :, 0]
        X += np.clip(step, -1.0, 1.0)  # far from the cell a curved map may fold
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return X


def _chunks(size: int) -> Iterator[slice]:
    return (slice(start, min(start + CHUNK, size)) for start in range(0, size, CHUNK))
