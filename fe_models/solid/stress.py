"""Strains, stresses, energies, geometric stiffness of a solid. Loads dolfinx. `owned`: nodes of this rank.

At a point that several cells share, their strains and stresses are averaged: across elements they jump by the
discretization error, and a point on the border of two materials takes the mean of both; all processes get the same.

Strain energies and geometric stiffness are integrals of products of gradients over the cells, done a few hundred cells
at a time, with dense products in place of sparse matrices. Strain energies come out free of the round-off errors of an
assembled stiffness matrix, whose entries are up to (length / element size)⁴ as large as the lowest ω².
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import basix
import numpy as np
import scipy.sparse as sp
from dolfinx.fem import FunctionSpace
from dolfinx.mesh import Mesh
from mpi4py import MPI
from scipy.spatial import cKDTree

from ...common.arrays import Array, Integers, in_parts
from ...common.errors import InputError
from ...common.structs import struct
from ...mesh.compat import coordinate_element, geometry_nodes, lagrange_element, node_map
from ..link_records.link import SolidLink
from ..modal_body import StressPoint
from .elasticity import SolidModel, strain_degree

CHUNK = 4096  # points at a time: some 50 MB with 20 modes on cubic tetrahedra
NEWTON_STEPS = 10


def modal_strains(space: FunctionSpace, cells: Integers, X: Array, modes: Array) -> Array:
    """Strains (q, 6, n) ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy of modes, per unit of each, at points of cells.

    `cells` (q,) of this process, X (q, 3) reference coordinates in them, `modes` (3 (owned + ghosts), n), 1/√kg.
    """
    element, nodes = lagrange_element(space), node_map(space)
    n = modes.shape[1]
    values = modes.reshape(-1, 3 * n)
    strains = np.empty((len(cells), 6, n))
    for part in in_parts(len(cells), CHUNK):
        # ∂φ/∂x = J⁻ᵀ ∂φ/∂X; displacement gradient [j, (i, n)] = ∂u_i/∂x_j.
        J = jacobians(space.mesh, cells[part], X[part])
        basis = element.tabulate(1, X[part])[1:, :, :, 0].transpose(1, 0, 2)
        physical = np.linalg.solve(J.transpose(0, 2, 1), basis)
        strains[part] = _symmetric((physical @ values[nodes[cells[part]]]).reshape(-1, 3, 3, n))
    return strains


def _symmetric(gradient: Array) -> Array:
    """Strains (c, 6, …, k) ε_xx … 2ε_xy of displacement gradients (c, 3, …, 3, k), ∂u_i/∂x_j at [:, j, …, i]."""
    g = np.moveaxis(gradient, -2, 2)
    return np.stack([g[:, j, i] if i == j else g[:, j, i] + g[:, i, j] for i, j in VOIGT], axis=1)


def jacobians(mesh: Mesh, cells: Integers, X: Array) -> Array:
    """J (q, 3, 3) = ∂x/∂X, m, at reference coordinates X (q, 3), no unit, one point in each of `cells` (q,)."""
    shapes = coordinate_element(mesh).tabulate(1, X)[1:, :, :, 0]
    corners = mesh.geometry.x[geometry_nodes(mesh)[cells]]
    return np.einsum("kqv,qvi->qik", shapes, corners)


def locate(mesh: Mesh, points: Array, slack: float) -> tuple[Integers, Integers, Array]:
    """Find the cells owned by this process that contain `points` (k, 3), m, a point in none, one or several.

    Returns for each of h hits the number of the point (h,), the cell (h,) and reference coordinates X (h, 3), no unit.
    `slack` is how far outside its cell a point may be, in X. Curved cells are inverted by Newton's method.
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
    beyond = X.sum(axis=1) if mesh.topology.cell_type.name == "tetrahedron" else X.max(axis=1)
    inside = np.maximum(-X.min(axis=1), beyond - 1) <= slack
    return point[inside], cell[inside], X[inside]


def pulled_back(mesh: Mesh, cells: Integers, points: Array) -> Array:
    """Reference coordinates (q, 3), no unit, of `points` (q, 3), m, in `cells` (q,); NaN far outside cells."""
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
    link: SolidLink, model: SolidModel, modes: Array, shapes: Array, surface: Array, path: Path
) -> dict[str, Any]:
    """Compute the stresses that a link file (`path`) requests: fields of its `ModalBody`, in its units, by name.

    `modes` (3 (owned + ghosts), n), 1/√kg; `shapes` (3 owned, l), m, under unit loads; points `surface` (p, 3), m.
    """
    if not (link.stress.points or link.stress.surface):
        return {}
    n, C = modes.shape[1], model.materials.C[model.materials.of_cell]
    fields = np.concatenate([modes, model.with_ghosts(shapes)], axis=1)
    stresses: dict[str, Any] = {}
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

    C (6, 6), or (cells, 6, 6) for the cells of this process, in Pa, as in `constitutive.stiffness`; `modes` (3 (owned +
    ghosts), n), 1/√kg. Raises `InputError` for a point outside the part, on every process.
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
    """Modal stresses (p, 6, n), Pa/(m·√kg), at `points` (p, 3), m, of the picture mesh; equal on all processes.

    C and `modes` are as in `point_stresses`. Raises `ValueError` for a point that is not on the mesh.
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


# That a chunk of gradients may have: 2 MB, with products of modes as large, which stay in the cache.
NUMBERS = 250_000

# Rows xx, yy, zz, yz, xz, xy.
VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@struct
class Gradients:
    """Displacement gradients of k fields at q quadrature points of each of c cells."""

    cells: slice  # which of this rank's own
    weights: Array  # (c, q) quadrature weight times volume in m³
    values: Array  # (c, 3, q, 3, k), no unit: ∂u_i/∂x_j at [:, j, :, i]
    inverse: Array  # (c, 1 or q, 3, 3) 1/m, ∂X_a/∂x_j at [:, :, j, a]
    shapes: Array  # (3, q, d) slopes of the d shape functions on the reference cell, no unit

    def forces(self, stress: Array) -> Array:
        """∫ σ : ∇N_a dV (c, d, 3, k), N, at nodes of each cell, of stresses (c, 6, q, k) times weights, N·m."""
        c, _, q, k = stress.shape
        tensor = np.empty((c, 3, q, 3, k))
        for row, (i, j) in enumerate(VOIGT):
            tensor[:, j, :, i] = tensor[:, i, :, j] = stress[:, row]
        if self.inverse.shape[1] == 1:
            reference = np.swapaxes(self.inverse[:, 0], 1, 2) @ tensor.reshape(c, 3, -1)
        else:
            reference = _at_points(np.swapaxes(self.inverse, 2, 3), tensor.reshape(c, 3, q, -1))
        slopes = self.shapes.reshape(-1, self.shapes.shape[2]).T
        return (slopes @ reference.reshape(c, 3 * q, -1)).reshape(c, -1, 3, k)

    @cached_property
    def strains(self) -> Array:
        """Strains (c, 6, q, k), dimensionless: ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy."""
        return _symmetric(self.values)

    def stresses(self, model: SolidModel) -> Array:
        """σ = C ε (c, 6, q, k) times `weights`, N·m."""
        strains = self.strains
        C = model.materials.C[model.materials.of_cell[self.cells]]
        stress = (C @ strains.reshape(*strains.shape[:2], -1)).reshape(strains.shape)
        return stress * self.weights[:, None, :, None]


def gradients(model: SolidModel, fields: Array) -> Iterator[Gradients]:
    """Yield gradients of `fields` (3 owned, k), m, in all cells that this rank owns, chunk by chunk; collective."""
    mesh, k = model.mesh, fields.shape[1]
    if not k:
        return
    fields = model.with_ghosts(fields)
    cell = lagrange_element(model.V).cell_type
    X, rule = basix.make_quadrature(cell, strain_degree(mesh, model.order))
    shapes = lagrange_element(model.V).tabulate(1, X)[1:, :, :, 0]  # (3, q, d)
    points = geometry_nodes(mesh)[: mesh.topology.index_map(3).size_local]
    nodes, values = node_map(model.V), fields.reshape(-1, 3 * k)
    # The Jacobian of a straight tetrahedron is the same everywhere.
    straight = cell == basix.CellType.tetrahedron and mesh.geometry.cmap.degree == 1
    maps = coordinate_element(mesh).tabulate(1, X[:1] if straight else X)[1:, :, :, 0]
    for part in in_parts(len(points), max(1, NUMBERS // (9 * len(rule) * k))):
        J = np.einsum("jqv,cvi->cqij", maps, mesh.geometry.x[points[part]])
        weights = np.abs(np.linalg.det(J)) * rule
        inverse = np.linalg.inv(J).transpose(0, 1, 3, 2)  # ∂X_a/∂x_j at [j, a]
        local = values[nodes[part]]  # (c, d, 3k)
        reference = shapes.reshape(-1, shapes.shape[2]) @ local  # (c, 3q, 3k)
        if straight:
            physical = inverse[:, 0] @ reference.reshape(len(weights), 3, -1)
        else:
            physical = _at_points(inverse, reference.reshape(len(weights), 3, len(rule), -1))
        yield Gradients(part, weights, physical.reshape(len(weights), 3, len(rule), 3, k), inverse, shapes)


def _at_points(inverse: Array, gradient: Array) -> Array:
    """(c, 3, q, k): (3, 3) matrices `inverse` (c, q, 3, 3) times `gradient` (c, 3, q, k), point by point."""
    return np.swapaxes(inverse @ np.swapaxes(gradient, 1, 2), 1, 2)


def strain_energy(model: SolidModel, modes: Array) -> Array:
    """K_ff (n, n) = ∫ ε(Φ_i) : C : ε(Φ_j) dV, J, of displacements Φ (3 owned, n), m; collective."""
    n = modes.shape[1]
    total: Array = np.zeros((n, n))
    for piece in gradients(model, modes):
        total += piece.strains.reshape(-1, n).T @ piece.stresses(model).reshape(-1, n)
    total = model.total(total)
    return 0.5 * (total + total.T)


def internal_forces(model: SolidModel, fields: Array) -> Array:
    """K u (3 owned, k), N, for displacements u = `fields` (3 owned, k), m, by their strains; collective."""
    k, nodes, index = fields.shape[1], node_map(model.V), model.V.dofmap.index_map
    total = np.zeros((index.size_local + index.num_ghosts, 3 * k))
    for piece in gradients(model, fields):
        here, row = np.unique(nodes[piece.cells].ravel(), return_inverse=True)
        collect = sp.csr_matrix((np.ones(row.size), (row, np.arange(row.size))), shape=(here.size, row.size))
        total[here] += collect @ piece.forces(piece.stresses(model)).reshape(row.size, 3 * k)
    return np.ascontiguousarray(model.to_owners(total.T).T).reshape(-1, k)


def geometric_stiffness(model: SolidModel, modes: Array, prestress: Array) -> Array:
    """∫ σ_ab ∂_aΦ_i · ∂_bΦ_j dV (l, n, n), J, for the stresses σ of each of l displacement fields; collective.

    Second variation of the work of a stress σ on the quadratic part of Green's strain (Bathe, Finite Element
    Procedures, §6.2.3): positive where tension stiffens. `modes` (3 owned, n), m, are Φ, `prestress` (3 owned, l) the
    displacements, m, that cause the stresses.
    """
    n, loads = modes.shape[1], prestress.shape[1]
    total = np.zeros((loads, n * n))
    for piece in gradients(model, np.concatenate([modes, prestress], axis=1)):
        Phi = piece.values[..., :n]
        stress = replace(piece, values=piece.values[..., n:]).stresses(model)
        for row, (a, b) in enumerate(VOIGT):
            products = np.swapaxes(Phi[:, a], -1, -2) @ Phi[:, b]  # (c, q, n, n)
            total += (1 if a == b else 2) * stress[:, row].reshape(-1, loads).T @ products.reshape(-1, n * n)
    matrices = model.total(total).reshape(loads, n, n)
    return 0.5 * (matrices + matrices.transpose(0, 2, 1))
