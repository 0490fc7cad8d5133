"""Inertia shape integrals and geometric stiffness of a beam, from its fields at the stations.

The stations are the cubic Lagrange points of the station mesh, so values at stations *are* the degrees of freedom of
the fields and every integral is a product with a mass or stiffness matrix, without error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh

from ...common.arrays import Array, Integers
from ...mesh.compat import assemble_matrix, cell_dofs, cell_vertices, function_space
from ..link_records import BeamLink
from ..modal_body.invariants import Invariants
from ..modal_body.tensors import LEVI_CIVITA
from ..modal_body.unit_loads import unit_load_names
from .beam import R_X, R_Y, R_Z, U_X, U_Y, U_Z, Property, cellwise

# N in N at x (m), and at which cell by its middle: N may jump from cell to cell.
AxialForce = Callable[[Array, Array], Array]


@dataclass(frozen=True)
class StationSpace:
    """Continuous cubics on the station mesh, numbered along the axis.

    Attributes:
        space: the dolfinx space.
        order: (k,) its degree of freedom at each station.
        x: (k,) where the stations lie, in m.
        element: (e, 4) stations of each cell, both ascending.
    """

    space: fem.FunctionSpace
    order: Integers
    x: Array
    element: Integers

    def matrix(self, form: ufl.Form) -> sp.csr_matrix:
        """(k, k): a bilinear form of two fields given by their values at the stations."""
        return assemble_matrix(form)[self.order][:, self.order]


def station_space(mesh: Mesh) -> StationSpace:
    """Stations at the vertices of the station mesh (exactly) and at two points inside each cell."""
    space = function_space(mesh, "P", 3)
    x = space.tabulate_dof_coordinates()[:, 0].copy()
    order = np.argsort(x)
    rank = np.argsort(order)
    cells = cell_dofs(space)
    x[cells[:, :2]] = cell_vertices(mesh)  # as given, not as mapped from the reference cell
    element = np.sort(rank[cells], axis=1)
    return StationSpace(space, order, x[order], element[np.argsort(element[:, 0])])


def shape_integrals(link: BeamLink, stations: StationSpace, fields: Array) -> Invariants:
    """Inertia shape integrals (docs/theory.md) over axis and cross section.

    With displacement (u, v, w) and rotation (φ, θ_y, θ_z) of the section, a point (x, y, z) moves by Φ0 + y Φy + z Φz,
    Φ0 = (u, v, w), Φy = (−θ_z, 0, φ), Φz = (θ_y, −φ, 0); principal axes leave ∫y = ∫z = ∫yz = 0.

    Euler–Bernoulli links are a line of mass on the axis, ∫y² = ∫z² = 0 in all that bends or turns as a whole. Their
    torsion modes keep their own ρI_p, booked in S̄_33: no planar invariant then holds any rotary inertia, and
    m_ff = S̄_11 + S̄_22 + S̄_33 stays true. What such a link has of inertia about its own axis, in space, is the spin
    inertia ½∫ρI_p (ω_1 + φ̇)² dx: J_s = ∫ρI_p, h_s = ∫ρI_p φ, S_s = ∫ρI_p φᵀφ, apart from the integrals over the axis.

    Args:
        link: for density and sections.
        stations: k of them.
        fields: (6, k, n) rows U_X … R_Z at the stations.
    """
    rho = link.material.density
    line_mass = link.model.theory == "euler-bernoulli"
    zero = np.zeros_like(fields[U_X])
    Phi = [
        fields[[U_X, U_Y, U_Z]],
        np.stack([-fields[R_Z], zero, fields[R_X]]),
        np.stack([fields[R_Y], -fields[R_X], zero]),
    ]
    # Position likewise: x e1 + y e2 + z e3, per unit of (1, y, z).
    one = np.ones_like(stations.x)
    position = np.zeros((3, 3, stations.x.size))
    position[0, 0], position[1, 1], position[2, 2] = stations.x, one, one
    moments: list[Property] = [lambda s: s.area, lambda s: s.I_yy, lambda s: s.I_zz]
    weights = [_weighted(link, stations, moment, rho) for moment in (moments[:1] if line_mass else moments)]

    n = fields.shape[2]
    S_bar = np.einsum("i,lin->ln", weights[0] @ one, Phi[0])
    second_moment, I_bar, S_bar_kl = np.zeros((3, 3)), np.zeros((3, 3, n)), np.zeros((3, 3, n, n))
    for W, x, shape in zip(weights, position, Phi, strict=False):
        W_x, W_shape = np.stack([W @ row for row in x]), np.stack([W @ component for component in shape])
        second_moment += np.einsum("ki,li->kl", x, W_x)
        I_bar += np.einsum("ki,lin->kln", W_x, shape)
        S_bar_kl += np.einsum("kim,lin->klmn", shape, W_shape)
    J_spin, h_spin, S_spin = 0.0, np.zeros(n), np.zeros((n, n))
    if line_mass:
        spin, twist = _weighted(link, stations, lambda s: s.I_p, rho), fields[R_X]
        J_spin, h_spin, S_spin = float(one @ (spin @ one)), (spin @ one) @ twist, twist.T @ spin @ twist
        S_bar_kl[2, 2] += S_spin
    first = float(stations.x @ (weights[0] @ one))
    symmetric = 0.5 * (S_bar_kl + S_bar_kl.transpose(1, 0, 3, 2))
    return Invariants(
        mass=float(one @ (weights[0] @ one)),
        first_moment=np.array([first, 0.0, 0.0]),
        second_moment=second_moment,
        S_bar=S_bar,
        I_bar=I_bar,
        S_bar_kl=symmetric,
        J_spin=J_spin,
        h_spin=h_spin,
        S_spin=0.5 * (S_spin + S_spin.T),
    )


def _weighted(link: BeamLink, stations: StationSpace, moment: Property, rho: float) -> sp.csr_matrix:
    """(k, k): ∫ρ·moment·a b dx of two fields a, b at the stations."""
    a, b = ufl.TrialFunction(stations.space), ufl.TestFunction(stations.space)
    weight = cellwise(link, stations.space.mesh, lambda s: rho * moment(s))
    return stations.matrix(weight * a * b * ufl.dx)


def geometric_stiffness(
    link: BeamLink, stations: StationSpace, fields: Array, interfaces: dict[str, float]
) -> dict[str, Array]:
    """(n, n) ∫N(x) (v'v' + w'w') dx of the axial force N that each unit load causes, positive in tension.

    Loads (docs/theory.md, Geometric stiffness) on the undeformed link, held axially at its root: inertia of unit frame
    acceleration `t_x` … `t_z`, of unit angular acceleration `r_x` …, of unit products of angular velocity `omega_xx` …;
    `force/NAME/x` … and `moment/NAME/x` …. Those that load a straight axis across, or twist it, leave N = 0: zero, but
    for what sections with rotary inertia have of it.

    Args:
        link: for density and sections.
        stations: k of them; every interface is a vertex of their mesh.
        fields: (6, k, n).
        interfaces: position of each in m.
    """
    n = fields.shape[2]
    matrices: dict[str, Array] = {name: np.zeros((n, n)) for name in unit_load_names(interfaces)}
    # D'Alembert: a frame that accelerates along x pushes the link together; spinning about y or z pulls it apart.
    matrices["t_x"] = _stiffness_of(stations, fields, lambda x, _: -_mass_beyond(link, x, 0))
    matrices["omega_yy"] = _stiffness_of(stations, fields, lambda x, _: _mass_beyond(link, x, 1))
    matrices["omega_zz"] = matrices["omega_yy"].copy()
    for name, position in interfaces.items():
        if position > 0:
            matrices[f"force/{name}/x"] = _stiffness_of(stations, fields, partial(_up_to, position))
    if link.model.theory == "timoshenko":  # others are a line of mass
        for name, matrix in _of_sections(link, stations, fields[[R_X, R_Y, R_Z]]).items():
            matrices[name] = matrices[name] + matrix
    return matrices


def _of_sections(link: BeamLink, stations: StationSpace, phi: Array) -> dict[str, Array]:
    """(n, n) by load: what the inertia of sections that turn by φ (3, k, n) has of geometric stiffness.

    A point d from the axis moves by ½ φ × (φ × d) = −½ (d φ² − φ φ·d) besides φ × d. Of d φ² − φ φ·d = pᵀG p are
    K_x,kl = ∫ρ d_k G_l dV, and from them K_ω = 1 tr K_x − sym K_x and K_r,a = ε_abc K_x,bc (docs/theory.md).
    """
    n, rho = phi.shape[2], link.material.density
    K_x = np.zeros((3, 3, n, n))
    for k, moment in ((1, lambda s: s.I_yy), (2, lambda s: s.I_zz)):
        W = _weighted(link, stations, moment, rho)
        products = np.array([[a.T @ (W @ b) for b in phi] for a in phi])
        products = 0.5 * (products + products.transpose(0, 1, 3, 2))
        K_x[k] = -products[k]
        K_x[k, k] += np.einsum("aamn->mn", products)
    K_omega = np.einsum("ij,kkmn->ijmn", np.eye(3), K_x) - 0.5 * (K_x + K_x.transpose(1, 0, 2, 3))
    K_r = np.einsum("abc,bcmn->amn", LEVI_CIVITA, K_x)
    found = {f"r_{axis}": -K_r[a] for a, axis in enumerate("xyz")}  # of d'Alembert's loads
    for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)):
        found[f"omega_{'xyz'[i]}{'xyz'[j]}"] = K_omega[i, j] * (1.0 if i == j else 2.0)
    return found


def _stiffness_of(stations: StationSpace, fields: Array, axial_force: AxialForce) -> Array:
    """∫N (v'v' + w'w') dx for N = axial_force(x, middle of the cell of x), at most quadratic in each cell."""
    mesh = stations.space.mesh
    N = fem.Function(function_space(mesh, "P", 2, discontinuous=True))
    dofs = cell_dofs(N.function_space)
    x = N.function_space.tabulate_dof_coordinates()[dofs, 0]
    middles = np.broadcast_to(cell_vertices(mesh).mean(axis=1)[:, None], x.shape)
    N.x.array[dofs] = axial_force(x, middles)
    a, b = ufl.TrialFunction(stations.space), ufl.TestFunction(stations.space)
    G = stations.matrix(N * a.dx(0) * b.dx(0) * ufl.dx)
    total = sum(fields[row].T @ (G @ fields[row]) for row in (U_Y, U_Z))
    return np.asarray(0.5 * (total + total.T))


def _up_to(position: float, x: Array, middle: Array) -> Array:
    """1 in the cells between the root and `position`, 0 beyond."""
    return np.where(middle < position, 1.0, 0.0)


def _mass_beyond(link: BeamLink, x: Array, power: int) -> Array:
    """∫_x^L ρA sᵖ ds for each x, in kg·mᵖ."""
    total = np.zeros_like(x)
    points = link.geometry.breakpoints
    for start, end, section in zip(points[:-1], points[1:], link.sections, strict=True):
        lower = np.clip(x, start, end)
        total += link.material.density * section.area * (end ** (power + 1) - lower ** (power + 1)) / (power + 1)
    return total
