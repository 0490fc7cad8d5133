"""Stresses of a solid at points and on its surface: of modes, and static ones of unit loads. Loads dolfinx.

All functions are collective over the mesh's communicator and return the same on every process. At a point that several
cells share, their strains and stresses are averaged: across elements they jump by the discretisation error, and a
point on the border of two materials takes the mean of both.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from dolfinx.fem import FunctionSpace
from mpi4py import MPI

from ...common.arrays import Array
from ...common.errors import InputError
from ..link_records import SolidLink
from ..modal_body import StressPoint
from .elasticity import SolidModel
from .strains import locate, modal_strains

# Fractions of a cell's size: rounding, and how far a point on a curved face may be off the mesh of that face.
INSIDE, ON_CURVED_FACE = 1e-6, 0.02


def recovered_stresses(
    link: SolidLink, model: SolidModel, modes: Array, shapes: Mapping[str, Array], surface: Array, path: Path
) -> dict[str, Any]:
    """What a link file asks for: `stress` … `surface_static` of its `ModalBody`.

    Args:
        link: for the points.
        model: of the solid.
        modes: (3 (owned + ghosts), n).
        shapes: (3 owned,) static displacements by unit load.
        surface: (p, 3) points of the surface.
        path: of the link file, for errors.
    """
    if not (link.stress.points or link.stress.surface):
        return {}
    n, C = modes.shape[1], model.materials.C[model.materials.of_cell]
    fields = np.concatenate([modes, model.with_ghosts(np.stack(list(shapes.values()), axis=1))], axis=1)
    found: dict[str, Any] = {"stress_loads": tuple(shapes)}
    if link.stress.points:
        points = point_stresses(model.V, C, fields, link.stress.points, path)
        found["stress"] = {name: _split(point, n) for name, point in points.items()}
    if link.stress.surface:
        both = surface_stresses(model.V, C, fields, surface)
        found |= {"surface_stress": both[..., :n], "surface_static": both[..., n:]}
    return found


def _split(point: StressPoint, n: int) -> StressPoint:
    """The first n fields are modes, the others static shapes."""
    return StressPoint(point.position, point.stress[:, :n], point.strain[:, :n], point.stress[:, n:])


def point_stresses(
    space: FunctionSpace, C: Array, modes: Array, points: Mapping[str, tuple[float, float, float]], path: Path
) -> dict[str, StressPoint]:
    """Modal stresses and strains at named points.

    Args:
        space: vector Lagrange.
        C: (6, 6), or (cells, 6, 6) for the cells of this process, as in `constitutive.stiffness`, in Pa.
        modes: (dofs, n) degrees of freedom of each mode on this process, ghosts included.
        points: position of each, in m.
        path: of the link file, for the error.

    Raises:
        InputError: a point is outside the part; on every process.
    """
    positions = np.array(list(points.values()), dtype=np.float64).reshape(-1, 3)
    count, strain, stress = _averages(space, C, modes, positions)
    for k, name in enumerate(points):
        if not count[k]:
            distance, nearest = _nearest(space, positions[k])
            raise InputError(
                f"{path}: stress.points.{name}: expected a point of the part, found {list(points[name])}, "
                f"{distance:.3g} m from the nearest node of its mesh ({', '.join(f'{c:.6g}' for c in nearest)})"
            )
    return {name: StressPoint(positions[k], stress[k], strain[k]) for k, name in enumerate(points)}


def surface_stresses(space: FunctionSpace, C: Array, modes: Array, points: Array) -> Array:
    """(p, 6, n) modal stresses at `points` (p, 3), the same on all processes: those of the picture mesh.

    Raises:
        ValueError: a point is not on the mesh.
    """
    count, _, stress = _averages(space, C, modes, points)
    if not np.all(count):
        off = points[count == 0]
        raise ValueError(f"{len(off)} of {len(points)} points are not on the mesh, the first {off[0]}")
    return stress


def _averages(space: FunctionSpace, C: Array, modes: Array, points: Array) -> tuple[Array, Array, Array]:
    """How many cells hold each point (k,), and the means of their strains and stresses, (k, 6, n) each."""
    comm = space.mesh.comm
    shape = (len(points), 6, modes.shape[1])
    count, strain, stress = np.zeros(len(points)), np.zeros(shape), np.zeros(shape)
    for slack in (INSIDE, ON_CURVED_FACE):
        missing = np.flatnonzero(count == 0)
        point, cells, X = locate(space.mesh, points[missing], slack)
        strains = modal_strains(space, cells, X, modes)
        stresses = (C if C.ndim == 2 else C[cells]) @ strains
        hits = sp.csr_matrix((np.ones(len(point)), (point, np.arange(len(point)))), shape=(len(missing), len(point)))
        for total, part in ((count, np.ones(len(point))), (strain, strains), (stress, stresses)):
            sums = hits @ part.reshape(len(point), total[0].size)
            comm.Allreduce(MPI.IN_PLACE, sums, op=MPI.SUM)
            total[missing] = sums.reshape(total[missing].shape)
        if np.all(count):
            break
    each = np.maximum(count, 1.0)[:, None, None]
    return count, strain / each, stress / each


def _nearest(space: FunctionSpace, point: Array) -> tuple[float, Array]:
    """Distance in m from `point` to the nearest node of the mesh, and that node."""
    nodes = space.mesh.geometry.x
    distances = np.linalg.norm(nodes - point, axis=1)
    here = (float(distances.min()), *nodes[np.argmin(distances)]) if len(nodes) else (np.inf, 0.0, 0.0, 0.0)
    distance, *nearest = min(space.mesh.comm.allgather(here))
    return distance, np.array(nearest)
