"""The peer without ffrobot: a mesh file's lowest modes, clamped at x = 0, with dolfinx and SLEPc and nothing else.

    python raw_dolfinx.py MESH.msh ORDER COUNT

What an experienced user would write: P2 or P3 displacements, MUMPS' Cholesky in symmetric storage, shift-invert at 0.
Prints the frequencies in Hz. Written for dolfinx 0.5 (Debian 12).
"""

import sys

import gmsh
import numpy as np
import ufl
from dolfinx import fem
from dolfinx.io import gmshio
from mpi4py import MPI
from petsc4py import PETSc
from slepc4py import SLEPc

E, NU, RHO = 2.068427e11, 0.3, 7850.0


def main(path: str, order: int, count: int) -> None:
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.open(path)
    domain, _, _ = gmshio.model_to_mesh(gmsh.model, MPI.COMM_WORLD, 0, gdim=3)
    gmsh.finalize()
    V = fem.VectorFunctionSpace(domain, ("Lagrange", order))
    u, v = ufl.TrialFunction(V), ufl.TestFunction(V)
    mu, lmbda = E / (2 * (1 + NU)), E * NU / ((1 + NU) * (1 - 2 * NU))
    eps = ufl.sym(ufl.grad(u))
    sigma = 2 * mu * eps + lmbda * ufl.tr(eps) * ufl.Identity(3)
    root = fem.locate_dofs_geometrical(V, lambda x: np.isclose(x[0], 0.0))
    clamp = fem.dirichletbc(np.zeros(3), root, V)
    dx = ufl.dx(metadata={"quadrature_degree": 2 * order})
    K = fem.petsc.assemble_matrix(fem.form(ufl.inner(sigma, ufl.sym(ufl.grad(v))) * dx), [clamp], diagonal=1.0)
    K.assemble()
    M = fem.petsc.assemble_matrix(fem.form(RHO * ufl.inner(u, v) * dx), [clamp], diagonal=0.0)
    M.assemble()
    K.setOption(PETSc.Mat.Option.SYMMETRIC, True)
    K.convert("sbaij")
    solver = SLEPc.EPS().create(domain.comm)
    solver.setOperators(K, M)
    solver.setProblemType(SLEPc.EPS.ProblemType.GHEP)
    solver.setDimensions(count)
    solver.setTolerances(1e-13, 1000)
    solver.setWhichEigenpairs(SLEPc.EPS.Which.TARGET_MAGNITUDE)
    solver.setTarget(0.0)
    transform = solver.getST()
    transform.setType(SLEPc.ST.Type.SINVERT)
    transform.getKSP().setType(PETSc.KSP.Type.PREONLY)
    transform.getKSP().getPC().setType(PETSc.PC.Type.CHOLESKY)
    transform.getKSP().getPC().setFactorSolverType("mumps")
    solver.solve()
    for k in range(count):
        print(np.sqrt(solver.getEigenvalue(k).real) / (2 * np.pi))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]))
