"""Modal forces of piezoelectric patches outlined in the mesh of a solid. Importing this loads dolfinx.

A patch that strains along the link loads the face beneath it by a membrane force N (N/m) along t = e_x: virtual work
∫ N t·δε t ds. One whose width is fixed does the same along e_z, which bends the link back by ν: its N is 1/(1 − ν)
times as large.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import ufl
from dolfinx import fem
from dolfinx.mesh import meshtags
from mpi4py import MPI

from ...common.arrays import Array
from ...common.errors import SolveError
from ...mesh.compat import compiled_form
from ..link_records.link import SurfacePatches
from ..modal_body import OutlinedPatches

if TYPE_CHECKING:
    from dolfinx.mesh import MeshTags  # 0.5 has no such name


AREA_TOLERANCE = 1e-9


def outlined_patches(
    space: fem.FunctionSpace,
    facet_tags: MeshTags,
    faces: Mapping[str, int],
    record: SurfacePatches,
    length: float,
    modes: Array,
    path: Path,
) -> OutlinedPatches:
    """Modal forces of the patches of a link file; collective, the same on every process.

    `faces` has the tags, among `facet_tags`, of "patch/K/top" and "patch/K/bottom", K from 0, where the record has
    them; `length` (m) is that of the link, `modes` (dofs, n) with ghosts. Raises `SolveError` where the facets of a
    patch do not fill its outline.
    """
    edges = record.edges(length)
    sides = ("top", "bottom") if record.faces == "both" else (record.faces,)
    forces: dict[str, Array] = {}
    for side in sides:
        rows: list[Array] = []
        for k in range(len(edges)):
            area, row = _membrane(space, facet_tags, faces[f"patch/{k}/{side}"], modes)
            wanted = record.length * record.width
            if not abs(area - wanted) <= AREA_TOLERANCE * wanted:
                raise SolveError(
                    f"{path}: surface_patch: the mesh does not follow the outline of patch {k + 1} on the {side} face: "
                    f"its facets have {area:.9g} m2, length × width is {wanted:.9g} m2"
                )
            rows.append(row)
        forces[side], forces[f"{side}_across"] = np.stack(rows, axis=1)
    return OutlinedPatches(np.array(edges), record.width, **forces)


def _membrane(space: fem.FunctionSpace, facet_tags: MeshTags, tag: int, modes: Array) -> tuple[float, Array]:
    """Area in m² of the facets tagged `tag`, and (2, n) ∫ ε_xx(Φ) ds and ∫ ε_zz(Φ) ds over them."""
    mesh = space.mesh
    facets = facet_tags.find(tag)
    # Tag 1 of a set of its own, so that one form serves all patches: its numbers are compiled into it.
    patch = meshtags(mesh, mesh.topology.dim - 1, facets, np.ones(len(facets), dtype=np.int32))
    ds = ufl.Measure("ds", domain=mesh, subdomain_data=patch)
    one = fem.Constant(mesh, 1.0)
    area = fem.assemble_scalar(compiled_form(one * ds(1)))
    v = ufl.TestFunction(space)
    work = [fem.assemble_vector(compiled_form(v[axis].dx(axis) * ds(1))).array for axis in (0, 2)]
    # What this process adds to the degrees of freedom of others meets their ghosts in `modes`: the sum is complete.
    total = mesh.comm.allreduce(np.append(np.array(work) @ modes, area), op=MPI.SUM)
    return float(total[-1]), total[:-1].reshape(2, -1)
