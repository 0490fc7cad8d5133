"""Strains and stresses of a solid at points and on its surface: of modes, and static ones of unit loads. Loads dolfinx.

All functions are collective over the mesh's communicator and return the same on every process. At a point that several
cells share, their strains and stresses are averaged: across elements they jump by the discretization error, and a
point on the border of two materials takes the mean of both.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from dolfinx.fem import FunctionSpace
from dolfinx.mesh import Mesh
from mpi4py import MPI
from scipy.spatial import cKDTree

from ...common.arrays import Array, Integers
from ...common.errors import InputError
from ...mesh.compat import coordinate_element, geometry_nodes, lagrange_element, node_map
from ..link_records.link import SolidLink
from ..modal_body import StressPoint
from .elasticity import SolidModel
from .strain_energy import VOIGT

CHUNK = 4096  # points at a time: some 50 MB with 20 modes on cubic tetrahedra
NEWTON_STEPS = 10


def modal_strains(space: FunctionSpace, cells: Integers, X: Array, modes: Array) -> Array:
    """Return strains (q, 6, n) ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy of modes at points of cells.

    `cells` (q,) of this process, X (q, 3) reference coordinates in them, `modes` (dofs, n) with ghosts.
    """
    element, nodes = lagrange_element(space), node_map(space)
    n = modes.shape[1]
    values = modes.reshape(-1, 3 * n)
    strains = np.empty((len(cells), 6, n))
    for part in (slice(start, start + CHUNK) for start in range(0, len(cells), CHUNK)):
        # ∂φ/∂x = J⁻ᵀ ∂φ/∂X; displacement gradient [j, (i, n)] = ∂u_i/∂x_j.
        J = jacobians(space.mesh, cells[part], X[part])
        basis = element.tabulate(1, X[part])[1:, :, :, 0].transpose(1, 0, 2)
        physical = np.linalg.solve(J.transpose(0, 2, 1), basis)
        gradient = (physical @ values[nodes[cells[part]]]).reshape(-1, 3, 3, n)
        for row, (i, j) in enumerate(VOIGT):
            strains[part, row] = gradient[:, j, i] if i == j else gradient[:, j, i] + gradient[:, i, j]
    return strains


def jacobians(mesh: Mesh, cells: Integers, X: Array) -> Array:
    """Return J (q, 3, 3) = ∂x/∂X at reference coordinates X (q, 3) in each of `cells` (q,)."""
    shapes = coordinate_element(mesh).tabulate(1, X)[1:, :, :, 0]
    corners = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    return np.asarray(np.einsum("kqv,qvi->qik", shapes, corners))


def locate(mesh: Mesh, points: Array, slack: float) -> tuple[Integers, Integers, Array]:
    """All cells owned by this process that contain each of `points` (k, 3), m.

    For each hit the point (h,), the cell (h,) and the reference coordinates X (h, 3); `slack` is how far outside its
    cell a point may be, in X. Curved cells are inverted by Newton's method.
    """
    owned = mesh.topology.index_map(3).size_local
    corners = mesh.geometry.x[geometry_nodes(mesh)]
    if not owned or not len(points):
        return np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3))
    centers = corners.mean(axis=1)
    radius = np.linalg.norm(corners - centers[:, None], axis=2).max()
    near = cKDTree(centers).query_ball_point(points, (1 + slack) * radius, return_sorted=True)
    point = np.repeat(np.arange(len(points)), [len(cells) for cells in near])
    cell = np.concatenate([np.asarray(cells, dtype=np.int64) for cells in near])
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
    """Return reference coordinates (q, 3) of `points` (q, 3), m, in `cells` (q,); NaN if none, far outside cells."""
    element = coordinate_element(mesh)
    corners = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    X = np.full_like(points, 0.25)
    step = np.zeros_like(X)
    for _ in range(NEWTON_STEPS if len(points) else 0):
        x = np.einsum("qv,qvi->qi", element.tabulate(0, X)[0, :, :, 0], corners)
        step = np.linalg.solve(jacobians(mesh, cells, X), (points - x)[:, :, None])[:, :, 0]
        X += np.clip(step, -1.0, 1.0)  # far from the cell a curved map may fold
        if np.abs(step).max(initial=0.0) < 1e-12:
            return X
    X[np.abs(step).max(axis=1) > INSIDE] = np.nan
    return X


# Fractions of a cell's size: round-off, and how far a point on a curved face may be off the mesh of that face.
INSIDE, ON_CURVED_FACE = 1e-6, 0.02


def recovered_stresses(
    link: SolidLink, model: SolidModel, modes: Array, shapes: Mapping[str, Array], surface: Array, path: Path
) -> dict[str, Any]:
    """Compute the stresses that a link file requests: `stress` … `surface_static` of its `ModalBody`.

    `modes` (3 (owned + ghosts), n); `shapes` (3 owned,) static displacements by unit load; `surface` (p, 3) its points.
    """
    if not (link.stress.points or link.stress.surface):
        return {}
    n, C = modes.shape[1], model.materials.C[model.materials.of_cell]
    fields = np.concatenate([modes, model.with_ghosts(np.stack(list(shapes.values()), axis=1))], axis=1)
    stresses: dict[str, Any] = {"stress_loads": tuple(shapes)}
    if link.stress.points:
        points = point_stresses(model.V, C, fields, link.stress.points, path)
        stresses["stress"] = {
            name: StressPoint(point.position, point.stress[:, :n], point.strain[:, :n], point.stress[:, n:])
            for name, point in points.items()
        }
    if link.stress.surface:
        both = surface_stresses(model.V, C, fields, surface)
        stresses |= {"surface_stress": both[..., :n], "surface_static": both[..., n:]}
    return stresses


def point_stresses(
    space: FunctionSpace, C: Array, modes: Array, points: Mapping[str, tuple[float, float, float]], path: Path
) -> dict[str, StressPoint]:
    """Modal stresses and strains at named points, m.

    C (6, 6), or (cells, 6, 6) for the cells of this process, in Pa, as in `constitutive.stiffness`; `modes` (dofs, n)
    with ghosts. Raises `InputError` for a point outside the part, on every process.
    """
    positions = np.array(list(points.values()), dtype=np.float64).reshape(-1, 3)
    count, strain, stress = _averages(space, C, modes, positions)
    for k, name in enumerate(points):
        if not count[k]:
            distance, nearest = _nearest(space, positions[k])
            raise InputError(
                f"{path}: stress.points.{name}: expected a point of the part",
                f"{list(points[name])}, {distance:.3g} m from the nearest node of its mesh"
                f" ({', '.join(f'{c:.6g}' for c in nearest)})",
            )
    return {name: StressPoint(positions[k], stress[k], strain[k]) for k, name in enumerate(points)}


def surface_stresses(space: FunctionSpace, C: Array, modes: Array, points: Array) -> Array:
    """Return modal stresses (p, 6, n), Pa/(m·√kg), at `points` (p, 3), m, of the picture mesh; equal on all processes.

    Raises `ValueError` for a point that is not on the mesh.
    """
    count, _, stress = _averages(space, C, modes, points)
    if not np.all(count):
        off = points[count == 0]
        raise ValueError(f"{len(off)} of {len(points)} points are not on the mesh, the first {off[0]}")
    return stress


def _averages(space: FunctionSpace, C: Array, modes: Array, points: Array) -> tuple[Array, Array, Array]:
    """How many cells hold each point (k,), and the means of their strains and stresses, (k, 6, n) each."""
    comm = space.mesh.comm
    shape = (len(points), 6, modes.shape[1])
    count, strain, stress = np.zeros(len(points)), np.zeros(shape), np.zeros(shape)
    for slack in (INSIDE, ON_CURVED_FACE):
        missing = np.flatnonzero(count == 0)
        point, cells, X = locate(space.mesh, points[missing], slack)
        strains = modal_strains(space, cells, X, modes)
        stresses = (C if C.ndim == 2 else C[cells]) @ strains
        hits = sp.csr_matrix((np.ones(len(point)), (point, np.arange(len(point)))), shape=(len(missing), len(point)))
        for total, part in ((count, np.ones(len(point))), (strain, strains), (stress, stresses)):
            sums = hits @ part.reshape(len(point), total[0].size)
            comm.Allreduce(MPI.IN_PLACE, sums, op=MPI.SUM)
            total[missing] = sums.reshape(total[missing].shape)
        if np.all(count):
            break
    each = np.maximum(count, 1.0)[:, None, None]
    return count, strain / each, stress / each


def _nearest(space: FunctionSpace, point: Array) -> tuple[float, Array]:
    """Distance in m from `point` to the nearest node of the mesh, and that node."""
    nodes = space.mesh.geometry.x
    distances = np.linalg.norm(nodes - point, axis=1)
    here = (float(distances.min()), *nodes[np.argmin(distances)]) if len(nodes) else (np.inf, 0.0, 0.0, 0.0)
    distance, *nearest = min(space.mesh.comm.allgather(here))
    return distance, np.array(nearest)
