"""Stiffness and mass of a beam by dolfinx, from their weak forms in UFL. Importing this loads dolfinx.

All are bilinear forms ∫ weight u⁽ⁱ⁾ v⁽ʲ⁾ dx of piecewise cubics and quadratics, with weights that are constant in
elements: a link needs three forms, with shear six, whatever its families are.
"""

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
from .line import Functions


class BeamForms:
    """Bilinear forms on the elements between `nodes` (e + 1,), in m."""

    def __init__(self, nodes: Array) -> None:
        self.nodes = nodes
        cells = nodes.size - 1
        self._mesh = dolfinx_mesh.create_interval(MPI.COMM_SELF, cells, [0.0, 1.0])
        x = self._mesh.geometry.x
        x[:, 0] = nodes[np.rint(x[:, 0] * cells).astype(int)]
        self._weight = fem.Function(function_space(self._mesh, 0))
        middle = self._weight.function_space.tabulate_dof_coordinates()[:, 0]
        self._element = np.searchsorted(nodes, middle) - 1
        self._spaces: dict[int, fem.FunctionSpace] = {}
        self._forms: dict[tuple[int, ...], fem.Form] = {}

    def matrix(
        self,
        weight: Array,
        of: Functions,
        derivative: int = 0,
        by: Functions | None = None,
        derivative_by: int | None = None,
    ) -> sp.csr_matrix:
        """Return ∫ weight f⁽ᵈ⁾ g⁽ᵈ⁾ dx for weights (e,) of the elements: test functions f `of`, trial functions g `by`.

        Without `by` both are the same functions, and so are the derivatives.
        """
        by = of if by is None else by
        order = derivative if derivative_by is None else derivative_by
        self._weight.x.array[:] = weight[self._element]
        assembled = fem_petsc.assemble_matrix(self._form(of.degree, derivative, by.degree, order))
        assembled.assemble()
        indptr, indices, values = assembled.getValuesCSR()
        rows, columns = (self._points(functions.degree) for functions in (of, by))
        A = sp.csr_matrix((values, indices, indptr), shape=(rows.size, columns.size))
        assembled.destroy()
        # Degrees of freedom of Lagrange functions are values at points.
        return (of.at(rows).T @ A @ by.at(columns)).tocsr()

    def _form(self, *key: int) -> fem.Form:
        """Compiled, by degree and derivative of test and trial functions."""
        if key not in self._forms:
            v, u = ufl.TestFunction(self._space(key[0])), ufl.TrialFunction(self._space(key[2]))
            for _ in range(key[1]):
                v = v.dx(0)
            for _ in range(key[3]):
                u = u.dx(0)
            self._forms[key] = compiled_form(self._weight * u * v * ufl.dx)
        return self._forms[key]

    def _space(self, degree: int) -> fem.FunctionSpace:
        if degree not in self._spaces:
            self._spaces[degree] = function_space(self._mesh, degree)
        return self._spaces[degree]

    def _points(self, degree: int) -> Array:
        return self._space(degree).tabulate_dof_coordinates()[:, 0]
