"""Linear elasticity in UFL: the matrices of a solid link, free in space. SI units; `owned`: nodes of this rank.

The mass matrix of three equal displacement components is one scalar matrix, used three times: a ninth of the memory of
the full one. The stiffness matrix is assembled straight into PETSc's symmetric block format (upper triangle, 3 × 3
blocks), which takes half the memory and, measured, a third of the time of the general one.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.fem import petsc as fem_petsc
from dolfinx.mesh import Mesh
from mpi4py import MPI
from petsc4py import PETSc

from ...common.arrays import Array, Integers, NDArray
from ...common.structs import struct
from ...mesh.compat import cell_name, compiled_form, function_space, node_map
from ..link_records.link import Material, OrthotropicMaterial
from .constitutive import stiffness

AnyMaterial = Material | OrthotropicMaterial


@struct
class MaterialMap:
    """Material of each cell of this rank, ghosts included."""

    C: Array  # (r, 6, 6) Pa, stiffness of each of r materials, as in `constitutive.stiffness`
    density: Array  # (r,) in kg/m³
    of_cell: Integers  # (c,) row of `C` and `density`


@struct
class ScalarMass:
    """Mass matrix M_ab = ∫ρ N_a N_b dV, kg, of shape functions N_a at the nodes."""

    matrix: PETSc.Mat

    def __matmul__(self, U: Array) -> Array:
        """M U of displacements U (3 owned, n), the same matrix for each component; collective."""
        columns = np.asfortranarray(U.reshape(-1, 3 * U.shape[1]))
        size = self.matrix.getSizes()[0], (None, columns.shape[1])
        factor = PETSc.Mat().createDense(size, array=columns, comm=self.matrix.comm)
        factor.assemble()
        product = self.matrix.matMult(factor)
        result = np.array(product.getDenseArray(), order="C").reshape(U.shape)
        for used in (factor, product):
            used.destroy()
        return result


@struct
class SolidModel:
    """Nodes, materials and matrices of a solid without supports."""

    mesh: Mesh  # distributed over `comm`
    order: int  # polynomial order of the displacements
    V: fem.FunctionSpace  # their space, three components at each node
    x: Array  # (owned, 3) nodes that this rank owns, in m
    materials: MaterialMap  # of the cells
    mass: ScalarMass  # scalar mass matrix
    # number of blocks in each row of the stiffness matrix: in this rank's columns and in later ranks'
    pattern: tuple[Integers, Integers]
    local_to_global: PETSc.LGMap  # numbers of the nodes that this rank sees
    stiffness_form: Any  # compiled

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.mesh.comm

    @property
    def owned(self) -> int:
        """Number of nodes that this rank owns."""
        return self.x.shape[0]

    def total(self, part: Array) -> Array:
        """Sum of each rank's `part`, of any shape and unit; collective."""
        part = np.ascontiguousarray(part, dtype=np.float64)
        if self.comm.size == 1:
            return part
        result = np.empty_like(part)
        self.comm.Allreduce(part, result)
        return result

    def to_owners(self, parts: Array) -> Array:
        """Sum `parts` (r, owned + ghosts), any unit, over the processes that share a node: (r, owned); collective."""
        if self.comm.size == 1:
            return parts
        seen = np.arange(parts.shape[1], dtype=PETSc.IntType)
        result = np.empty((parts.shape[0], self.owned))
        for target, row in zip(result, parts, strict=True):
            vector = PETSc.Vec().createMPI((self.owned, None), comm=self.comm)
            vector.setLGMap(self.local_to_global)
            vector.setValuesLocal(seen, row, addv=True)
            vector.assemble()
            target[:] = vector.array_r
            vector.destroy()
        return result

    def with_ghosts(self, U: Array) -> Array:
        """Extend displacements U (3 owned, n), m, to (3 (owned + ghosts), n), ghosts from their owners; collective."""
        if self.comm.size == 1:
            return U
        function = fem.Function(self.V)
        result = np.empty((function.x.array.size, U.shape[1]))
        for k, u in enumerate(U.T):
            function.x.array[: u.size] = u
            function.x.scatter_forward()
            result[:, k] = function.x.array
        return result


class MassMatrix:
    """Mass operator M u + Σ Bᵀ diag(w) B u: the mesh, and masses attached to interfaces.

    `attached`: for each such mass B (6, 3 owned), SI, the mean motion of its interface, and w (6,), kg and kg·m².
    """

    def __init__(self, model: SolidModel, attached: Sequence[tuple[Array, Array]]) -> None:
        self.model, self.attached = model, attached

    def __matmul__(self, U: Array) -> Array:
        """M U of U (3 owned, n); collective."""
        product = self.model.mass @ U
        for B, weights in self.attached:
            product = product + B.T @ (weights[:, None] * self.model.total(B @ U))
        return product


def material_map(
    mesh: Mesh, material: AnyMaterial, regions: Sequence[tuple[NDArray[np.int32], AnyMaterial]] = ()
) -> MaterialMap:
    """Assign `material` to all cells of this rank, ghosts too, except those of `regions`: (cells, their material)."""
    cells = mesh.topology.index_map(3)
    of_cell = np.zeros(cells.size_local + cells.num_ghosts, dtype=np.int64)
    for number, (members, _) in enumerate(regions, start=1):
        of_cell[members] = number
    all_materials = [material, *(other for _, other in regions)]
    C = np.array([stiffness(one) for one in all_materials])
    return MaterialMap(C, np.array([one.density for one in all_materials]), of_cell)


def solid_model(mesh: Mesh, order: int, materials: MaterialMap) -> SolidModel:
    """Space, mass matrix and stiffness form of a solid, displacements of `order`, for `stiffness_matrix`."""
    V, S = function_space(mesh, order, (3,)), function_space(mesh, order)
    assert np.array_equal(node_map(V), node_map(S)), "scalar and vector space number their nodes alike"
    owned = V.dofmap.index_map.size_local
    a, b = ufl.TrialFunction(S), ufl.TestFunction(S)
    rho = _cellwise(mesh, materials.density, materials.of_cell)
    geometry = mesh.geometry.cmap.degree
    curved = 3 * (geometry - 1) if cell_name(mesh) == "tetrahedron" else 3 * geometry - 1
    # Exact, but for curved cells of order beyond the second.
    dx = ufl.dx(metadata={"quadrature_degree": 2 * order + curved})
    M = fem_petsc.assemble_matrix(compiled_form(rho * a * b * dx))
    M.assemble()
    return SolidModel(
        mesh=mesh,
        order=order,
        V=V,
        x=np.array(V.tabulate_dof_coordinates()[:owned]),
        materials=materials,
        mass=ScalarMass(M),
        pattern=_pattern(M),
        local_to_global=M.getLGMap()[0],
        stiffness_form=compiled_form(_stiffness_form(V, materials, strain_degree(mesh, order))),
    )


def stiffness_matrix(model: SolidModel, fixed: Sequence[Any] = ()) -> PETSc.Mat:
    """Assemble K, N/m, upper triangle in 3 × 3 blocks; rows and columns of boundary conditions `fixed` are identity."""
    K = PETSc.Mat().create(model.comm)
    size = (3 * model.owned, 3 * model.V.dofmap.index_map.size_global)
    K.setSizes((size, size), 3)
    K.setType(PETSc.Mat.Type.SBAIJ)
    K.setPreallocationNNZ(model.pattern)
    K.setOption(PETSc.Mat.Option.IGNORE_LOWER_TRIANGULAR, True)
    blocks = PETSc.LGMap().create(model.local_to_global.indices, bsize=3, comm=model.comm)
    K.setLGMap(blocks, blocks)
    fem_petsc.assemble_matrix(K, model.stiffness_form, list(fixed))
    K.assemble()
    K.setOption(PETSc.Mat.Option.SPD, True)
    return K


def strain_degree(mesh: Mesh, order: int) -> int:
    """Degree of quadrature for products of two strains: exact on straight-sided cells."""
    geometry = mesh.geometry.cmap.degree
    highest = order - 1 if cell_name(mesh) == "tetrahedron" else order
    return 2 * highest + 2 * (geometry - 1)


def voigt(gradient: ufl.core.expr.Expr) -> ufl.core.expr.Expr:
    """ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy of ∂u_i/∂x_j at [i, j]."""
    g = gradient
    return ufl.as_vector([g[0, 0], g[1, 1], g[2, 2], g[1, 2] + g[2, 1], g[0, 2] + g[2, 0], g[0, 1] + g[1, 0]])


def _stiffness_form(V: fem.FunctionSpace, materials: MaterialMap, degree: int) -> ufl.Form:
    """∫ ε(v) : C : ε(u) dV; one isotropic material needs no 6 × 6 matrix: σ = λ tr(ε) I + 2μ ε."""
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    dx = ufl.dx(metadata={"quadrature_degree": degree})
    C = materials.C
    lame, mu = C[0, 0, 1], C[0, 3, 3]
    isotropic = np.diag([2 * mu] * 3 + [mu] * 3)
    isotropic[:3, :3] += lame
    if C.shape[0] == 1 and np.allclose(C[0], isotropic, rtol=1e-12, atol=0):
        lambda_, two_mu = fem.Constant(V.mesh, lame), fem.Constant(V.mesh, 2 * mu)
        strain_u, strain_v = ufl.sym(ufl.grad(u)), ufl.sym(ufl.grad(v))
        return (lambda_ * ufl.div(u) * ufl.div(v) + two_mu * ufl.inner(strain_u, strain_v)) * dx
    law = _cellwise(V.mesh, C, materials.of_cell)
    return ufl.dot(voigt(ufl.grad(v)), law * voigt(ufl.grad(u))) * dx


def _cellwise(mesh: Mesh, values: Array, of_cell: Integers) -> fem.Function:
    """The function that is values[of_cell[c]] in cell c."""
    function = fem.Function(function_space(mesh, 0, values.shape[1:]))
    cells = node_map(function.function_space)[:, 0]
    function.x.array.reshape(-1, *values.shape[1:])[cells] = values[of_cell]
    return function


def _pattern(M: PETSc.Mat) -> tuple[Integers, Integers]:
    """How many blocks an upper triangle of the pattern of M has in each row: in own columns, and in later ranks'."""
    indptr, columns, _ = M.getValuesCSR()
    first, end = M.getOwnershipRange()
    row = np.repeat(np.arange(end - first), np.diff(indptr))
    kept = columns >= first + row, columns >= end
    upper, beyond = (np.bincount(row[one], minlength=end - first).astype(PETSc.IntType) for one in kept)
    return upper - beyond, beyond
