"""Stiffness and mass of a beam by dolfinx, from their weak forms in UFL: `[modes] solver = "slepc"`. Loads dolfinx."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI

from ...common.arrays import Array
from ...mesh.compat import compiled_form, function_space
from ..link_records.families import Family
from ..link_records.link import BeamLink
from .line import Functions, hermite, lagrange
from .sections import Property, cellwise, rod_properties, second_moment, shear_modulus


def assembled(link: BeamLink, family: Family, nodes: Array) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """K and M of the free beam over all degrees of freedom of the functions that `family_model` takes."""
    beam = _Forms(link, nodes)
    u, v = beam.functions(3)
    if family in ("axial", "torsion"):
        stiffness, inertia = (beam.constant(each) for each in rod_properties(link, family))
        cubics = lagrange(nodes, 3)
        return beam.matrix(stiffness * u.dx(0) * v.dx(0), cubics), beam.matrix(inertia * u * v, cubics)
    moment, rho = second_moment(family), link.material.density
    EI = beam.constant(lambda s: link.material.youngs_modulus * moment(s))
    rhoA = beam.constant(lambda s: rho * s.area)
    if link.model.theory == "euler-bernoulli":
        # Of all piecewise cubics those whose slopes meet.
        splines = hermite(nodes)
        return beam.matrix(EI * u.dx(0).dx(0) * v.dx(0).dx(0), splines), beam.matrix(rhoA * u * v, splines)
    theta, eta = beam.functions(2)
    G, rhoI = shear_modulus(link), beam.constant(lambda s: rho * moment(s))
    kGA = beam.constant(lambda s: s.shear * G * s.area)
    W, T = lagrange(nodes, 3), lagrange(nodes, 2)
    K_ww = beam.matrix(kGA * u.dx(0) * v.dx(0), W)
    K_wt = beam.matrix(-kGA * theta * v.dx(0), W, T)
    K_tt = beam.matrix(EI * theta.dx(0) * eta.dx(0) + kGA * theta * eta, T)
    mass = [beam.matrix(rhoA * u * v, W), beam.matrix(rhoI * theta * eta, T)]
    return sp.bmat([[K_ww, K_wt], [K_wt.T, K_tt]], format="csr"), sp.block_diag(mass, format="csr")


class _Forms:
    """Forms on the elements between `nodes` (e + 1,), in m."""

    def __init__(self, link: BeamLink, nodes: Array) -> None:
        cells = nodes.size - 1
        self._link, self._nodes = link, nodes
        self._mesh = dolfinx_mesh.create_interval(MPI.COMM_SELF, cells, [0.0, 1.0])
        x = self._mesh.geometry.x
        x[:, 0] = nodes[np.rint(x[:, 0] * cells).astype(int)]

    def functions(self, degree: int) -> tuple[ufl.Argument, ufl.Argument]:
        """Trial and test function, continuous and piecewise of a degree."""
        space = function_space(self._mesh, degree)
        return ufl.TrialFunction(space), ufl.TestFunction(space)

    def constant(self, quantity: Property) -> fem.Function:
        """`quantity` of the section in each element."""
        function = fem.Function(function_space(self._mesh, 0))
        middle = function.function_space.tabulate_dof_coordinates()[:, 0]
        function.x.array[:] = cellwise(self._link, self._nodes, quantity)[np.searchsorted(self._nodes, middle) - 1]
        return function

    def matrix(self, integrand: ufl.core.expr.Expr, rows: Functions, columns: Functions | None = None) -> sp.csr_matrix:
        """∫ of a bilinear integrand over functions `rows` of the test space, and `columns` of the trial space."""
        form = integrand * ufl.dx
        found = fem_petsc.assemble_matrix(compiled_form(form))
        found.assemble()
        indptr, indices, values = found.getValuesCSR()
        # Degrees of freedom of Lagrange functions are values at points.
        test, trial = (each.ufl_function_space().tabulate_dof_coordinates()[:, 0] for each in form.arguments())
        A = sp.csr_matrix((values, indices, indptr), shape=(test.size, trial.size))
        return (rows.at(test).T @ A @ (columns or rows).at(trial)).tocsr()
