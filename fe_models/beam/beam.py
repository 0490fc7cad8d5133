"""Beam models: one small eigenproblem for each family of motion of a straight link.

The families of a straight beam with principal axes y and z do not couple. All six fields (displacement and rotation of
the cross section) are continuous piecewise cubics, which values at cubic Lagrange points determine. dolfinx assembles K
and M from weak forms ∫ weight u⁽ⁱ⁾ v⁽ʲ⁾ dx in UFL: a link needs three, with shear six. Strains at Gauss points, which
integrate products exactly, are the root of K: K = BᵀB but for round-off. Loads dolfinx.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from dolfinx import mesh as dolfinx_mesh
from dolfinx.fem import petsc as fem_petsc
from mpi4py import MPI

from ...common.arrays import Array
from ...common.structs import struct
from ...mesh.compat import compiled_form, function_space
from ..link_records.families import Family
from ..link_records.link import BeamLink
from .line import R_X, R_Y, R_Z, U_X, U_Y, U_Z, Functions, hermite, lagrange
from .sections import cellwise, rod_properties, shear_modulus

Bending = tuple[sp.csr_matrix, sp.csr_matrix, sp.csr_matrix, sp.csr_matrix, sp.csr_matrix, list[int]]
"""K, M, strains, deflection and rotation at the stations, fixed degrees of freedom."""


@struct
class FamilyModel:
    """One family's eigenproblem K x = ω² M x, SI units, over its m free degrees of freedom."""

    # K, M: (m, m)
    K: sp.csr_matrix
    M: sp.csr_matrix
    strain: sp.csr_matrix  # (s, m) s strains at Gauss points, scaled such that K = strainᵀ strain
    # for each component U_X … R_Z that the family moves, (k, m): translation or rotation at k stations from x
    fields: Mapping[int, sp.csr_matrix]

    def motion(self, places: Sequence[int]) -> Array:
        """Rows (r, m) of the `fields` at the stations `places`, one by one: translations (m), then rotations (rad)."""
        return np.array([values[place].toarray()[0] for place in places for values in self.fields.values()])


def family_model(link: BeamLink, family: Family, forms: "BeamForms", stations: Array) -> FamilyModel:
    """The eigenproblem of `family` on the elements of `forms`, its fields at `stations` (k,), m."""
    if family in ("axial", "torsion"):
        V = lagrange(forms.nodes, 3)  # K = ∫EA u' v' dx, M = ∫ρA u v dx
        EA, rhoA = rod_properties(link, family, forms.nodes)
        K, M, strain = forms.matrix(EA, V, 1), forms.matrix(rhoA, V), V.root(EA, 1)
        fields, fixed = {U_X if family == "axial" else R_X: V.at(stations)}, [0]
    else:
        bending = _timoshenko if link.model.theory == "timoshenko" else _euler_bernoulli
        in_plane = family == "in-plane-bending"
        K, M, strain, deflection, slope, fixed = bending(link, forms, stations, "I_yy" if in_plane else "I_zz")
        # Out of plane, w' is a rotation about −y.
        fields = {U_Y: deflection, R_Z: slope} if in_plane else {U_Z: deflection, R_Y: -slope}
    free = np.setdiff1d(np.arange(strain.shape[1]), fixed)
    K, M = (A[free][:, free] for A in (K, M))
    return FamilyModel(K, M, strain[:, free], {row: values[:, free] for row, values in fields.items()})


def _euler_bernoulli(link: BeamLink, forms: "BeamForms", stations: Array, second_moment: str) -> Bending:
    """K = ∫EI w'' v'' dx, M = ∫ρA w v dx on cubic Hermite elements; stations read w and w'."""
    V, E, rho = hermite(forms.nodes), link.material.youngs_modulus, link.material.density
    EI, rhoA = E * cellwise(link, forms.nodes, second_moment), rho * cellwise(link, forms.nodes, "area")
    fixed = [0, 1] if link.reference.holds_root else [0, V.x.size - 2]
    read = V.at(stations), V.at(stations, derivative=1)
    return forms.matrix(EI, V, 2), forms.matrix(rhoA, V), V.root(EI, 2), *read, fixed


def _timoshenko(link: BeamLink, forms: "BeamForms", stations: Array, second_moment: str) -> Bending:
    """K = ∫EI θ' η' + kGA (w' − θ)(v' − η) dx, M = ∫ρA w v + ρI θ η dx; w cubic, θ quadratic: no locking.

    Stations read w and the section's rotation θ.
    """
    nodes = forms.nodes
    W, T = lagrange(nodes, 3), lagrange(nodes, 2)
    E, G, rho = link.material.youngs_modulus, shear_modulus(link), link.material.density
    area, moment = cellwise(link, nodes, "area"), cellwise(link, nodes, second_moment)
    EI, kGA, rhoA, rhoI = E * moment, G * area * cellwise(link, nodes, "shear"), rho * area, rho * moment
    shear = -forms.matrix(kGA, W, 1, T, 0)
    K = sp.bmat(
        [[forms.matrix(kGA, W, 1), shear], [shear.T, forms.matrix(EI, T, 1) + forms.matrix(kGA, T)]], format="csr"
    )
    M = sp.block_diag([forms.matrix(rhoA, W), forms.matrix(rhoI, T)], format="csr")
    strain = sp.bmat([[None, T.root(EI, derivative=1)], [W.root(kGA, derivative=1), -T.root(kGA)]], format="csr")
    read, count = sp.block_diag([W.at(stations), T.at(stations)], format="csr"), len(stations)
    fixed = [0, W.x.size if link.reference.holds_root else W.x.size - 1]
    return K, M, strain, read[:count], read[count:], fixed


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
        """∫ weight f⁽ᵈ⁾ g⁽ᵈ⁾ dx, x in m, for weights (e,), any unit: test functions f `of`, trial ones g `by`.

        By default g = f, and both derivatives d are `derivative`.
        """
        by = of if by is None else by
        order = derivative if derivative_by is None else derivative_by
        self._weight.x.array[:] = weight[self._element]
        assembled = fem_petsc.assemble_matrix(self._form(of.degree, derivative, by.degree, order))
        assembled.assemble()
        indptr, indices, values = assembled.getValuesCSR()
        rows, columns = (self._space(one.degree).tabulate_dof_coordinates()[:, 0] for one in (of, by))
        A = sp.csr_matrix((values, indices, indptr), shape=(rows.size, columns.size))
        assembled.destroy()
        # Degrees of freedom of Lagrange functions are values at points.
        return (of.at(rows).T @ A @ by.at(columns)).tocsr()

    def _form(self, *key: int) -> "fem.Form":
        """The form compiled, by degree and derivative of test and trial functions."""
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
