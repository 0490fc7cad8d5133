"""Mean motion of faces and cross sections of a solid, linear in u. SI units; `owned`: nodes of this rank.

Area-weighted averages about the centroid c of the face (the RBE3 convention): translation ∫u ds / A, and rotation
θ = J⁻¹ ∫ r × u ds with r = x − c and J = ∫ (r·r I − r rᵀ) ds: the rigid motion nearest to u in the mean square. Both
need no more than ∫N_a ds and ∫x N_a ds of each shape function N_a. Work of patches on faces.
"""

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp
import ufl
from dolfinx import fem
from dolfinx.mesh import Mesh, meshtags
from mpi4py import MPI

from ...common.arrays import Array
from ...common.structs import struct
from ...mesh.compat import compiled_form, function_space, lagrange_element, node_map
from ...mesh.records import SurfacePatches
from ...mesh.slices import section_quadratures
from ...mesh.solid_mesh import MeshTags
from ..modal_body import OutlinedPatches
from ..modal_body.parts import LEVI_CIVITA
from .elasticity import SolidModel


@struct
class Averages:
    """Mean motion of k plane figures: faces, or cross sections; SI units."""

    # (4k, owned + ghosts) this rank's part of ∫N_a ds, ∫x N_a ds, ∫y N_a ds, ∫z N_a ds of each figure
    weights: sp.csr_matrix
    area: Array  # (k,) in m²
    centroid: Array  # (k, 3) in m
    inertia: Array  # (k, 3, 3) J about the centroid in m⁴
    height: Array  # (k,) extent along y in m
    width: Array  # (k,) extent along z in m
    middle: Array  # (k, 2) middle of these extents, along y and z from the centroid, in m
    density: Array  # (k,) mean density in kg/m³

    def of(self, model: SolidModel, modes: Array) -> tuple[Array, Array]:
        """Mean translation, m, and rotation, rad, (k, 3, n) each, of `modes` (3 owned, n), m; collective."""
        n = modes.shape[1]
        moments = model.total(self.weights @ model.with_ghosts(modes).reshape(-1, 3 * n)).reshape(-1, 4, 3, n)
        translation = moments[:, 0] / self.area[:, None, None]
        # ∫ r × u = ∫ x × u − c × ∫u
        about_origin = np.einsum("abc,kbcn->kan", LEVI_CIVITA, moments[:, 1:])
        shift = np.einsum("abc,kb,kcn->kan", LEVI_CIVITA, self.centroid, moments[:, 0])
        return translation, np.linalg.solve(self.inertia, about_origin - shift)

    def rows(self, model: SolidModel) -> Array:
        """B (k, 6, 3 owned): translation, m, and rotation, rad, as rows over degrees of freedom; collective."""
        weights = model.to_owners(self.weights.toarray()).reshape(-1, 4, model.owned)
        result = np.zeros((weights.shape[0], 6, model.owned, 3))
        for axis in range(3):
            result[:, axis, :, axis] = weights[:, 0] / self.area[:, None]
        arm = weights[:, 1:] - self.centroid[:, :, None] * weights[:, :1]  # ∫ r_b N_a
        moment = np.einsum("abc,kbi->kaic", LEVI_CIVITA, arm).reshape(len(arm), 3, -1)
        result[:, 3:] = np.linalg.solve(self.inertia, moment).reshape(len(arm), 3, model.owned, 3)
        return result.reshape(-1, 6, 3 * model.owned)


def face_averages(model: SolidModel, facet_tags: MeshTags, tag: int) -> Averages:
    """Mean motion of the face with the given `tag`; collective."""
    mesh = model.mesh
    ds = _on_face(mesh, facet_tags, tag, quadrature_degree=2 * mesh.geometry.cmap.degree + model.order)
    select, other = fem.Constant(mesh, np.zeros(4)), fem.Constant(mesh, np.zeros(4))
    x = ufl.SpatialCoordinate(mesh)
    monomial, factor = (c[0] + sum(c[k + 1] * x[k] for k in range(3)) for c in (select, other))
    load = compiled_form(monomial * ufl.TestFunction(function_space(mesh, model.order)) * ds)
    moment = compiled_form(monomial * factor * ds)
    weights, moments = [], np.zeros((1, 4, 4))
    for row, unit in enumerate(np.eye(4)):
        select.value[:] = unit
        weights.append(fem.assemble_vector(load).array.copy())
        for column, another in enumerate(np.eye(4)):
            other.value[:] = another
            moments[0, row, column] = fem.assemble_scalar(moment)
    unknown = np.full((1, 2), np.nan)
    return _averages(model, sp.csr_matrix(np.array(weights)), moments, unknown, unknown, unknown[:, 0])


def _on_face(mesh: Mesh, facet_tags: MeshTags, tag: int, **metadata: int) -> ufl.Measure:
    """The measure ds of the facets with a tag: their own set has tag 1, a number that is compiled into forms."""
    facets = facet_tags.find(tag)
    face = meshtags(mesh, 2, facets, np.ones(len(facets), dtype=np.int32))
    return ufl.Measure("ds", domain=mesh, subdomain_data=face, metadata=metadata)(1)


def section_averages(model: SolidModel, x: Array) -> Averages:
    """`Averages` of cross sections at `x` (k,), m: six functionals of u each, which `of` evaluates; collective."""
    element, nodes = lagrange_element(model.V), node_map(model.V)
    degree = model.order + model.mesh.geometry.cmap.degree
    size = model.V.dofmap.index_map.size_local + model.V.dofmap.index_map.num_ghosts
    rows, moments, ranges, masses = [], [], [], []
    for section in section_quadratures(model.mesh, x, degree):
        w = section.weights
        monomials = np.concatenate([np.ones((w.size, 1)), section.points], axis=1)
        shapes = element.tabulate(0, section.X)[0, :, :, 0] if w.size else np.empty((0, element.dim))
        cells, place_of = np.unique(section.cells, return_inverse=True)
        gather = sp.csr_matrix((w, (place_of, np.arange(w.size))), shape=(cells.size, w.size))
        entries = gather @ (monomials[:, :, None] * shapes[:, None, :]).reshape(w.size, 4 * element.dim)
        columns = np.broadcast_to(nodes[cells][:, None, :], (cells.size, 4, element.dim))
        row = np.broadcast_to(np.arange(4)[:, None], columns.shape)
        rows.append(sp.csr_matrix((entries.ravel(), (row.ravel(), columns.ravel())), shape=(4, size)))
        moments.append(monomials.T * w @ monomials)
        ranges.append((section.y_range, section.z_range))
        density = model.materials.density[model.materials.of_cell[section.cells]]
        masses.append(w @ density)
    every = np.array(model.comm.allgather(np.array(ranges)))  # (processes, k, along y and z, from and to)
    low, high = every[..., 0].min(axis=0), every[..., 1].max(axis=0)
    return _averages(model, sp.vstack(rows, format="csr"), np.array(moments), low, high, np.array(masses))


def _averages(
    model: SolidModel, weights: sp.csr_matrix, moments: Array, low: Array, high: Array, mass: Array
) -> Averages:
    """`moments` (k, 4, 4): this rank's part of ∫ (1, x)ᵀ(1, x) ds; `mass` (k,) of ∫ρ ds; y and z from, to (k, 2)."""
    moments = model.total(moments)
    area = moments[:, 0, 0]
    centroid = moments[:, 0, 1:] / area[:, None]
    second = moments[:, 1:, 1:] - area[:, None, None] * centroid[:, :, None] * centroid[:, None, :]
    inertia = np.trace(second, axis1=1, axis2=2)[:, None, None] * np.eye(3) - second
    height, width = (high - low).T
    middle = 0.5 * (low + high) - centroid[:, 1:]
    return Averages(
        weights, area, centroid, inertia, height=height, width=width, middle=middle, density=model.total(mass) / area
    )


def outlined_patches(
    space: fem.FunctionSpace,
    facet_tags: MeshTags,
    faces: Mapping[str, int],
    record: SurfacePatches,
    length: float,
    modes: Array,
) -> OutlinedPatches:
    """Modal forces of piezoelectric patches outlined in the mesh; collective, the same on every process.

    A patch that strains along the link loads the face beneath it by a membrane force N (N/m) along t = e_x: virtual
    work ∫ N t·δε t ds. One whose width is fixed does the same along e_z, which bends the link back by ν: its N is
    1/(1 − ν) times as large.

    `faces` has the tags, among `facet_tags`, of "patch/K/top" and "patch/K/bottom", K from 0; `length` (m) is that of
    the link, `modes` (3 (owned + ghosts), n), 1/√kg.
    """
    edges, mesh, v = record.edges(length), space.mesh, ufl.TestFunction(space)
    forces: dict[str, Array] = {}
    for side in ("top", "bottom") if record.faces == "both" else (record.faces,):
        rows: list[Array] = []
        for k in range(len(edges)):
            ds = _on_face(mesh, facet_tags, faces[f"patch/{k}/{side}"])
            work = [fem.assemble_vector(compiled_form(v[axis].dx(axis) * ds)).array for axis in (0, 2)]
            # What this process adds to others' degrees of freedom meets their ghosts in `modes`: the sum is complete.
            rows.append(mesh.comm.allreduce(np.array(work) @ modes, op=MPI.SUM))
        forces[side], forces[f"{side}_across"] = np.stack(rows, axis=1)
    return OutlinedPatches(np.array(edges), record.width, **forces)
