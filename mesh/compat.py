"""The few calls that differ between dolfinx 0.5 (Debian 12), 0.9 (Debian 13), 0.10 and 0.11 (PyPI).

Nothing outside this module asks for a dolfinx version. Importing it loads dolfinx, and has to come before all else that
does: PyPI's wheel, PETSc's signal handlers and versions of UFL are dealt with before.
"""

import logging
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import metadata
from inspect import signature
from types import ModuleType
from typing import Any

import numpy as np

from ..common.arrays import Array, Integers
from .cells import CellName
from .form_cache import form_folder

with suppress(ModuleNotFoundError):
    import dolfinx_solver  # noqa: F401 (PyPI's dolfinx: it has MPI loaded before its PETSc)
import petsc4py

# Before dolfinx does it: PETSc's own signal handlers would answer a closed pipe or a kill with a page on debuggers.
petsc4py.init(["ffrobot", "-no_signal_handler"])

# The setuptools of Debian 12's UFL and FFCx, which ask it for their versions alone, are a third of the time of loading.
_NEEDS_SETUPTOOLS = "pkg_resources" not in sys.modules
if _NEEDS_SETUPTOOLS:
    sys.modules["pkg_resources"] = ModuleType("pkg_resources")
    sys.modules["pkg_resources"].get_distribution = metadata.distribution  # type: ignore[attr-defined]

_SHOWN = warnings.showwarning

import basix
import dolfinx
import ufl
from dolfinx import fem
from dolfinx.fem import FunctionSpace
from dolfinx.mesh import CellType, GhostMode, Mesh, create_cell_partitioner, create_mesh
from mpi4py import MPI

if warnings.showwarning is not _SHOWN:  # FFCx has the log take all warnings, also those of others
    logging.captureWarnings(False)
if _NEEDS_SETUPTOOLS:
    del sys.modules["pkg_resources"]

_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
_OLD = _VERSION < (0, 7)
_SPACES_COMPILE = _OLD or "jit_options" in signature(fem.functionspace).parameters

if _OLD:
    from basix import ufl_wrapper as basix_ufl
else:
    from basix import ufl as basix_ufl


def assembly() -> str:
    """Name and versions of the library that assembles the matrices."""
    return f"dolfinx {dolfinx.__version__}, UFL {ufl.__version__}"


def create_solid_mesh(comm: MPI.Comm, cell: CellName, degree: int, cells: Integers, points: Array) -> Mesh:
    """Mesh of tetrahedra or hexahedra, distributed over `comm` without ghost cells; every rank calls with its share.

    `degree` 1 or 2 of the geometry, `cells` (c, v) numbers of each cell's points in gmsh's order, `points` (p, 3) in m.
    """
    # dolfinx's own order of nodes: dolfinx[i] = gmsh[order[i]].
    order = dolfinx.cpp.io.perm_gmsh(getattr(CellType, cell), cells.shape[1])
    nodes = np.ascontiguousarray(cells[:, order], dtype=np.int64)
    if _OLD:
        scalar = ufl.FiniteElement("Lagrange", ufl.Cell(cell, geometric_dimension=3), degree, variant="equispaced")
        return create_mesh(comm, nodes, points, ufl.Mesh(ufl.VectorElement(scalar)), GhostMode.none)
    element = basix_ufl.element("Lagrange", cell, degree, basix.LagrangeVariant.equispaced, shape=(3,))
    if _VERSION < (0, 10):
        return create_mesh(comm, nodes, points, ufl.Mesh(element), create_cell_partitioner(GhostMode.none))
    links = [2] if _VERSION >= (0, 11) else []  # cells at a facet, at most
    return create_mesh(comm, nodes, ufl.Mesh(element), points, create_cell_partitioner(GhostMode.none, *links))


def cell_name(mesh: Mesh) -> str:
    """Shape of the cells: "interval", "tetrahedron" or "hexahedron"."""
    name = mesh.ufl_domain().ufl_cell().cellname
    return name() if callable(name) else name


def geometry_nodes(mesh: Mesh) -> Integers:
    """The nodes (c, v) of each local cell, rows of `mesh.geometry.x`, in dolfinx's order; corners first."""
    dofmap = mesh.geometry.dofmap
    cells = mesh.topology.index_map(mesh.topology.dim).size_local
    if not _OLD:
        return np.asarray(dofmap, dtype=np.int64)[:cells]
    return np.asarray(dofmap.array, dtype=np.int64).reshape(-1, dofmap.links(0).size if cells else 1)[:cells]


def coordinate_element(mesh: Mesh) -> basix.finite_element.FiniteElement:
    """Basix element of the map from the reference cell to cells of `mesh`; its nodes are in dolfinx's order."""
    cell = getattr(basix.CellType, cell_name(mesh))
    equispaced = basix.LagrangeVariant.equispaced
    return basix.create_element(basix.ElementFamily.P, cell, mesh.geometry.cmap.degree, equispaced)


def compiled_form(form: ufl.Form) -> "fem.Form":
    """`form` compiled, ready to be assembled."""
    with _compiling(form.ufl_domain().ufl_cargo().comm) as jit:
        return fem.form(form, **jit)


def lagrange_element(space: FunctionSpace) -> basix.finite_element.FiniteElement:
    """Basix element of one component of a vector Lagrange space."""
    scalar = space.sub(0) if space.num_sub_spaces else space
    return scalar.element.basix_element


def node_map(space: FunctionSpace) -> Integers:
    """Node numbers (c, d) of this process's cells, ghosts too; degree of freedom 3k + i is component i of node k."""
    nodes = space.dofmap.list
    return np.asarray(nodes.array if _OLD else nodes, dtype=np.int64).reshape(-1, lagrange_element(space).dim)


@contextmanager
def _compiling(comm: MPI.Comm) -> Iterator[dict[str, Any]]:
    """Arguments that have dolfinx compile, and find what is compiled, by way of `form_cache`; logs are muted."""
    before = logging.root.manager.disable
    logging.disable(logging.WARNING)
    try:
        with form_folder(comm, dolfinx.__version__) as folder:
            yield {"jit_params" if _OLD else "jit_options": {"cache_dir": str(folder)}}
    finally:
        logging.disable(before)


def function_space(mesh: Mesh, degree: int, shape: tuple[int, ...] = ()) -> FunctionSpace:
    """Space of continuous Lagrange functions with values of `shape`; of degree 0, functions constant in cells."""
    options: dict[str, Any] = {"discontinuous": degree == 0}
    if degree:
        options["lagrange_variant"] = basix.LagrangeVariant.gll_warped
    cell = getattr(basix.CellType, cell_name(mesh))
    with _compiling(mesh.comm) as jit:
        if _OLD:
            element = basix_ufl.create_element(basix.ElementFamily.P, cell, degree, **options)
            wrap = {0: lambda e: e, 1: basix_ufl.VectorElement, 2: basix_ufl.TensorElement}[len(shape)]
            return fem.FunctionSpace(mesh, wrap(element, *([shape] if len(shape) == 2 else shape)), **jit)
        element = basix_ufl.element(basix.ElementFamily.P, cell, degree, shape=shape or None, **options)
        return fem.functionspace(mesh, element, **(jit if _SPACES_COMPILE else {}))
