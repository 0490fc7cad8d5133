"""Beam models in UFL: one small eigenproblem for each family of motion of a straight link.

The families of a straight beam with principal axes y and z do not couple. Each gives its stiffness K and mass M over
its free degrees of freedom, and what the motion is at the stations: all six fields (displacement and rotation of the
cross section) are continuous piecewise cubics, so cubic Lagrange points hold them exactly.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh
from scipy.special import roots_legendre

from ...common.arrays import Array, Integers
from ...mesh.compat import ElementName, assemble_matrix, basix_element, cell_dofs, cell_vertices, function_space
from ...mesh.interval import cells_containing
from ..link_records import BeamLink, Family
from ..link_records.section import Section

# Rows of a station: displacement and rotation of the cross section about x, y, z.
U_X, U_Y, U_Z, R_X, R_Y, R_Z = range(6)


@dataclass(frozen=True)
class FamilyModel:
    """One family's eigenproblem K x = ω² M x over its m free degrees of freedom.

    Attributes:
        K, M: (m, m).
        strain: (s, m) the strains at Gauss points, scaled such that K = strainᵀ strain.
        fields: for each of the rows U_X … R_Z that the family moves, (k, m): the field at k stations from x.
    """

    K: sp.csr_matrix
    M: sp.csr_matrix
    strain: sp.csr_matrix
    fields: Mapping[int, sp.csr_matrix]


def family_model(link: BeamLink, family: Family, mesh: Mesh, stations: Array) -> FamilyModel:
    """The eigenproblem of `family` on the interval `mesh`, read at `stations` (k,) in m."""
    if family == "axial":
        return _rod(link, mesh, stations, U_X, lambda s: link_modulus(link) * s.area, lambda s: s.area)
    if family == "torsion":
        return _rod(link, mesh, stations, R_X, lambda s: shear_modulus(link) * s.torsion, lambda s: s.I_p)
    # Out of plane, w' is a rotation about −y.
    in_plane = family == "in-plane-bending"
    second_moment: Property = (lambda s: s.I_yy) if in_plane else (lambda s: s.I_zz)
    row, rotation, sign = (U_Y, R_Z, 1.0) if in_plane else (U_Z, R_Y, -1.0)
    bending = _timoshenko if link.model.theory == "timoshenko" else _euler_bernoulli
    K, M, strain, deflection, slope = bending(link, mesh, stations, second_moment)
    return FamilyModel(K, M, strain, {row: deflection, rotation: sign * slope})


Property = Callable[[Section], float]


def link_modulus(link: BeamLink) -> float:
    """E in Pa."""
    return link.material.youngs_modulus


def shear_modulus(link: BeamLink) -> float:
    """G = E / (2 (1 + ν)) in Pa; the link file has been checked for ν where G is needed."""
    assert link.material.poissons_ratio is not None
    return link.material.youngs_modulus / (2 * (1 + link.material.poissons_ratio))


def cellwise(link: BeamLink, mesh: Mesh, quantity: Property) -> fem.Function:
    """A function that is constant in each cell, from the section that holds there."""
    function = fem.Function(function_space(mesh, "P", 0, discontinuous=True))
    middles = cell_vertices(mesh).mean(axis=1)
    segment = np.searchsorted(link.geometry.breakpoints[1:-1], middles)
    values = np.array([quantity(section) for section in link.sections])
    function.x.array[cell_dofs(function.function_space)[:, 0]] = values[segment]
    return function


def _rod(link: BeamLink, mesh: Mesh, stations: Array, row: int, stiffness: Property, inertia: Property) -> FamilyModel:
    """Axial or torsional motion on cubic Lagrange elements: K = ∫EA u' v' dx, M = ∫ρA u v dx; root held, tip free."""
    V = function_space(mesh, "P", 3)
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    rho = link.material.density
    EA = cellwise(link, mesh, stiffness)
    K = assemble_matrix(EA * u.dx(0) * v.dx(0) * ufl.dx)
    M = assemble_matrix(cellwise(link, mesh, lambda s: rho * inertia(s)) * u * v * ufl.dx)
    strain = _at_gauss_points(V, "P", 3, EA, derivative=1)
    free = _all_but(K.shape[0], [_dof_at(V, 0.0)])
    fields = {row: _values(V, "P", 3, stations)[:, free]}
    return FamilyModel(K[free][:, free], M[free][:, free], strain[:, free], fields)


# K, M, strain as in FamilyModel; deflection and rotation at the stations.
Bending = tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix, sp.csr_matrix, sp.csr_matrix]


def _euler_bernoulli(link: BeamLink, mesh: Mesh, stations: Array, second_moment: Property) -> Bending:
    """K = ∫EI w'' v'' dx, M = ∫ρA w v dx on cubic Hermite elements; stations read w and w'.

    Basix scales Hermite's derivative degrees of freedom on the reference cell, so neighbours of different size (or
    direction) would not share a slope. The forms are therefore assembled cell by cell, on the discontinuous space, and
    mapped to nodal values (w, dw/dx): K ← Pᵀ K P.
    """
    V = function_space(mesh, "Hermite", 3, discontinuous=True)
    w, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    E, rho = link_modulus(link), link.material.density
    P = _nodal_to_cell(V)
    EI = cellwise(link, mesh, lambda s: E * second_moment(s))
    rhoA = cellwise(link, mesh, lambda s: rho * s.area)
    K = P.T @ assemble_matrix(EI * w.dx(0).dx(0) * v.dx(0).dx(0) * ufl.dx) @ P
    M = P.T @ assemble_matrix(rhoA * w * v * ufl.dx) @ P
    strain = _at_gauss_points(V, "Hermite", 3, EI, derivative=2) @ P
    last = K.shape[0] - 2
    free = _all_but(K.shape[0], [0, 1] if link.reference.holds_root else [0, last])
    deflection = _values(V, "Hermite", 3, stations) @ P
    slope = _values(V, "Hermite", 3, stations, derivative=1) @ P
    return K[free][:, free], M[free][:, free], strain[:, free], deflection[:, free], slope[:, free]


def _nodal_to_cell(V: fem.FunctionSpace) -> sp.csr_matrix:
    """P: nodal (w, dw/dx) at nodes ascending in x → each cell's (w, dw/dX at X = 0, w, dw/dX at X = 1).

    dw/dX = J dw/dx with J = x(1) − x(0), negative where a cell runs backwards.
    """
    vertices = cell_vertices(V.mesh)
    node = np.searchsorted(np.unique(vertices), vertices)
    J = vertices[:, 1] - vertices[:, 0]
    columns = np.stack([2 * node[:, 0], 2 * node[:, 0] + 1, 2 * node[:, 1], 2 * node[:, 1] + 1], axis=1)
    entries = np.stack([np.ones_like(J), J, np.ones_like(J), J], axis=1)
    rows = cell_dofs(V)
    return sp.csr_matrix((entries.ravel(), (rows.ravel(), columns.ravel())))


def _timoshenko(link: BeamLink, mesh: Mesh, stations: Array, second_moment: Property) -> Bending:
    """K = ∫EI θ' η' + kGA (w' − θ)(v' − η) dx, M = ∫ρA w v + ρI θ η dx; w cubic, θ quadratic: no locking.

    Stations read w and the section's rotation θ.
    """
    W, T = function_space(mesh, "P", 3), function_space(mesh, "P", 2)
    w, v = ufl.TrialFunction(W), ufl.TestFunction(W)
    theta, eta = ufl.TrialFunction(T), ufl.TestFunction(T)
    E, G, rho = link_modulus(link), shear_modulus(link), link.material.density
    EI = cellwise(link, mesh, lambda s: E * second_moment(s))
    kGA = cellwise(link, mesh, lambda s: s.shear * G * s.area)
    rhoA = cellwise(link, mesh, lambda s: rho * s.area)
    rhoI = cellwise(link, mesh, lambda s: rho * second_moment(s))
    K_wt = assemble_matrix(-kGA * theta * v.dx(0) * ufl.dx)
    K_ww = assemble_matrix(kGA * w.dx(0) * v.dx(0) * ufl.dx)
    K_tt = assemble_matrix((EI * theta.dx(0) * eta.dx(0) + kGA * theta * eta) * ufl.dx)
    K = sp.bmat([[K_ww, K_wt], [K_wt.T, K_tt]], format="csr")
    M = sp.block_diag(
        [assemble_matrix(rhoA * w * v * ufl.dx), assemble_matrix(rhoI * theta * eta * ufl.dx)], format="csr"
    )
    size = K_ww.shape[0]
    clamped = link.reference.holds_root
    held = [_dof_at(W, 0.0), size + _dof_at(T, 0.0) if clamped else _dof_at(W, link.geometry.length)]
    free = _all_but(K.shape[0], held)
    deflection, rotation = _values(W, "P", 3, stations), _values(T, "P", 2, stations)
    nothing_w, nothing_t = sp.csr_matrix(deflection.shape), sp.csr_matrix(rotation.shape)
    shear = [_at_gauss_points(W, "P", 3, kGA, derivative=1), -_at_gauss_points(T, "P", 2, kGA)]
    strain = sp.bmat([[None, _at_gauss_points(T, "P", 2, EI, derivative=1)], shear], format="csr")
    return (
        K[free][:, free],
        M[free][:, free],
        strain[:, free],
        sp.hstack([deflection, nothing_t], format="csr")[:, free],
        sp.hstack([nothing_w, rotation], format="csr")[:, free],
    )


def _values(
    V: fem.FunctionSpace, element: ElementName, degree: int, points: Array, derivative: int = 0
) -> sp.csr_matrix:
    """(k, dofs): value, or x-derivative, of a function of V at `points` (k,) from its degrees of freedom."""
    cells, X = cells_containing(V.mesh, points)
    first, second = cell_vertices(V.mesh)[cells].T
    # (k, d) reference basis; d/dx = (1/J) d/dX.
    basis = basix_element(element, degree).tabulate(derivative, X[:, None])[derivative, :, :, 0]
    basis = np.where(np.abs(basis) < 1e-14, 0.0, basis) / (second - first)[:, None] ** derivative
    dofs = cell_dofs(V)
    rows = np.repeat(np.arange(points.size), dofs.shape[1])
    return sp.csr_matrix((basis.ravel(), (rows, dofs[cells].ravel())), shape=(points.size, dofs.max() + 1))


def _at_gauss_points(
    V: fem.FunctionSpace, element: ElementName, degree: int, weight: fem.Function, derivative: int = 0
) -> sp.csr_matrix:
    """B (3c, dofs): a derivative of a function of V at three Gauss points a cell, times √(weight · quadrature weight).

    Bᵀ B is then the matrix of ∫ weight · derivative² dx, exact up to quadratic derivatives.
    """
    nodes, weights = roots_legendre(3)
    vertices = cell_vertices(V.mesh)
    middle, half = vertices.mean(axis=1), 0.5 * np.abs(vertices[:, 1] - vertices[:, 0])
    points = middle[:, None] + half[:, None] * nodes
    values = _values(V, element, degree, points.ravel(), derivative)
    constant = weight.x.array[cell_dofs(weight.function_space)[:, 0]]
    scale = np.sqrt((constant * half)[:, None] * weights)
    return sp.diags(scale.ravel()) @ values


def _dof_at(V: fem.FunctionSpace, x: float) -> int:
    """The degree of freedom of a Lagrange space at x (a vertex), in m."""
    return int(np.argmin(np.abs(V.tabulate_dof_coordinates()[:, 0] - x)))


def _all_but(size: int, held: list[int]) -> Integers:
    return np.setdiff1d(np.arange(size), held)
