"""What needs the displacement gradients of many fields at once: strain energies and geometric stiffness of modes.

Both are integrals of products of gradients over the cells, done a few hundred cells at a time, with dense products in
place of sparse matrices. Strain energies come out free of the round-off errors of an assembled stiffness matrix, whose
entries are up to (length / element size)⁴ as large as the lowest ω².
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import basix
import numpy as np
import scipy.sparse as sp

from ...common.arrays import Array
from ...common.structs import struct
from ...mesh.compat import coordinate_element, geometry_nodes, lagrange_element, node_map
from .elasticity import SolidModel, strain_degree

# Numbers that a chunk of gradients may have: 2 MB, with products of modes as large, which stay in the cache.
CHUNK = 250_000

# Rows xx, yy, zz, yz, xz, xy.
VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@struct
class Gradients:
    """Displacement gradients of k fields in some cells."""

    cells: slice  # which, of this rank's own
    weights: Array  # (c, q) quadrature weight times volume in m³
    values: Array  # (c, 3, q, 3, k): ∂u_i/∂x_j at [:, j, :, i]
    inverse: Array  # (c, 1 or q, 3, 3) ∂X_a/∂x_j at [:, :, j, a]
    shapes: Array  # (3, q, d) slopes of the shape functions on the reference cell

    def only(self, fields: slice) -> Gradients:
        """Return the gradients of some of the fields."""
        return replace(self, values=self.values[..., fields])

    def forces(self, stress: Array) -> Array:
        """Return ∫ σ : ∇N_a dV (c, d, 3, k) at the nodes of each cell, of stresses (c, 6, q, k) times weights."""
        c, _, q, k = stress.shape
        tensor = np.empty((c, 3, q, 3, k))
        for row, (i, j) in enumerate(VOIGT):
            tensor[:, j, :, i] = tensor[:, i, :, j] = stress[:, row]
        if self.inverse.shape[1] == 1:
            reference = np.swapaxes(self.inverse[:, 0], 1, 2) @ tensor.reshape(c, 3, -1)
        else:
            reference = _at_points(np.swapaxes(self.inverse, 2, 3), tensor.reshape(c, 3, q, -1))
        slopes = self.shapes.reshape(-1, self.shapes.shape[2]).T
        return np.asarray(slopes @ reference.reshape(c, 3 * q, -1)).reshape(c, -1, 3, k)

    def strains(self) -> Array:
        """Strains (c, 6, q, k) ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy."""
        g = self.values
        rows = [g[:, j, :, i] if i == j else g[:, j, :, i] + g[:, i, :, j] for i, j in VOIGT]
        return np.stack(rows, axis=1)


def gradients(model: SolidModel, fields: Array) -> Iterator[Gradients]:
    """Gradients of `fields` (3 (owned + ghosts), k) in all cells that this rank owns, a chunk at a time."""
    mesh, k = model.mesh, fields.shape[1]
    if not k:
        return
    cell = lagrange_element(model.V).cell_type
    X, rule = basix.make_quadrature(cell, strain_degree(mesh, model.order))
    shapes = lagrange_element(model.V).tabulate(1, X)[1:, :, :, 0]  # (3, q, d)
    points = geometry_nodes(mesh)[: mesh.topology.index_map(3).size_local]
    nodes, values = node_map(model.V), fields.reshape(-1, 3 * k)
    # The Jacobian of a straight tetrahedron is the same everywhere.
    straight = cell == basix.CellType.tetrahedron and mesh.geometry.cmap.degree == 1
    maps = coordinate_element(mesh).tabulate(1, X[:1] if straight else X)[1:, :, :, 0]
    step = max(1, CHUNK // (9 * len(rule) * k))
    for start in range(0, len(points), step):
        part = slice(start, min(start + step, len(points)))
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


def stresses(model: SolidModel, piece: Gradients, strains: Array) -> Array:
    """Return stresses (c, 6, q, k) σ = C ε, Pa, in the cells of `piece`."""
    C = model.materials.C[model.materials.of_cell[piece.cells]]
    return np.asarray((C @ strains.reshape(*strains.shape[:2], -1)).reshape(strains.shape))


def strain_energy(model: SolidModel, modes: Array) -> Array:
    """Return K_ff (n, n) = ∫ ε(Φ_i) : C : ε(Φ_j) dV of `modes` (3 (owned + ghosts), n); collective."""
    n = modes.shape[1]
    total: Array = np.zeros((n, n))
    for piece in gradients(model, modes):
        strain = piece.strains()
        stress = stresses(model, piece, strain) * piece.weights[:, None, :, None]
        total += strain.reshape(-1, n).T @ stress.reshape(-1, n)
    total = model.total(total)
    return 0.5 * (total + total.T)


def internal_forces(model: SolidModel, fields: Array) -> Array:
    """Return K u (3 owned, k), N, of displacements, m, `fields` (3 (owned + ghosts), k), from strains; collective."""
    k = fields.shape[1]
    nodes = node_map(model.V)
    total = np.zeros((fields.shape[0] // 3, 3 * k))
    for piece in gradients(model, fields):
        stress = stresses(model, piece, piece.strains()) * piece.weights[:, None, :, None]
        here, row = np.unique(nodes[piece.cells].ravel(), return_inverse=True)
        collect = sp.csr_matrix((np.ones(row.size), (row, np.arange(row.size))), shape=(here.size, row.size))
        total[here] += collect @ piece.forces(stress).reshape(row.size, 3 * k)
    return np.ascontiguousarray(model.to_owners(total.T).T).reshape(-1, k)


def geometric_stiffness(model: SolidModel, modes: Array, prestress: Array) -> Array:
    """Return (l, n, n) ∫ σ_ab ∂_aΦ_i · ∂_bΦ_j dV for the stresses σ of each of l displacement fields; collective.

    Second variation of the work of a stress σ on the quadratic part of Green's strain (Bathe, Finite Element
    Procedures, §6.2.3): positive where tension stiffens. `modes` (3 (owned + ghosts), n) are Φ, `prestress` (3 (owned +
    ghosts), l) the displacements that cause the stresses.
    """
    n, loads = modes.shape[1], prestress.shape[1]
    total = np.zeros((loads, n * n))
    for piece in gradients(model, np.concatenate([modes, prestress], axis=1)):
        Phi = piece.values[..., :n]
        load = piece.only(slice(n, None))
        stress = stresses(model, load, load.strains()) * piece.weights[:, None, :, None]
        for row, (a, b) in enumerate(VOIGT):
            products = np.swapaxes(Phi[:, a], -1, -2) @ Phi[:, b]  # (c, q, n, n)
            total += (1 if a == b else 2) * stress[:, row].reshape(-1, loads).T @ products.reshape(-1, n * n)
    matrices = model.total(total).reshape(loads, n, n)
    return np.asarray(0.5 * (matrices + matrices.transpose(0, 2, 1)))
