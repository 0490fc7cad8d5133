"""gmsh, used quietly: started and always ended, one thread, no output, interrupts left to the program.

Importing this loads gmsh.
"""

import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from itertools import product
from tempfile import TemporaryFile

import gmsh
import numpy as np

from ..common.arrays import Array, Integers
from ..common.errors import InputError, is_own_fault
from .cells import SLIVER, VOLUME_ELEMENTS, cell_quality
from .records import CIRCLE, GROWTH
from .source import RawMesh

_MOST_PRINTED = 1 << 20  # bytes
# gmsh's newer algorithm, HXT, makes better meshes faster, but other ones in every run.
_DELAUNAY = 1
# A mesh too coarse for the shape crosses itself: then finer ones along curved faces are tried. Now and then one has a
# flat cell: a slightly smaller size gives another mesh. Factors of the elements around a circle, and of the size:
_ATTEMPTS = ((1, 1.0), (1, 0.94), (1, 0.88), (2, 0.5), (4, 0.25))


@contextmanager
def gmsh_session() -> Iterator[Callable[[], str]]:
    """Context of an empty, reproducible gmsh model (one thread, no settings files); yields a reader of its output."""
    interrupt = signal.getsignal(signal.SIGINT)
    with _stdout_captured() as printed:
        gmsh.initialize([], False)
        try:
            if threading.current_thread() is threading.main_thread():
                signal.signal(signal.SIGINT, interrupt)
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.option.setNumber("General.NumThreads", 1)
            gmsh.option.setNumber("General.AbortOnError", 0)
            gmsh.option.setNumber("Mesh.Algorithm3D", _DELAUNAY)
            yield printed
        finally:
            gmsh.finalize()


@contextmanager
def _stdout_captured() -> Iterator[Callable[[], str]]:
    # OpenCASCADE writes to the process's standard output itself, past Python.
    sys.stdout.flush()
    kept = os.dup(1)
    with TemporaryFile() as file:
        try:
            os.dup2(file.fileno(), 1)
            yield lambda: os.pread(file.fileno(), _MOST_PRINTED, 0).decode(errors="replace")
        finally:
            os.dup2(kept, 1)
            os.close(kept)


def volume_and_surface() -> tuple[float, float]:
    """Volume of the gmsh model and area of its faces, in the model's units."""
    occ = gmsh.model.occ
    faces = gmsh.model.getBoundary(gmsh.model.getEntities(3), combined=True, oriented=False)
    return sum(occ.getMass(*e) for e in gmsh.model.getEntities(3)), sum(occ.getMass(*e) for e in faces)


def mesh_model(size: float, metres: float) -> None:
    """Fill the gmsh model with tetrahedra of edge length `size`, finer along curved faces, and bend them to these.

    `size` is in the model's unit of `metres` m. Raises `InputError` for a shape that gmsh cannot mesh.
    """
    problem: object = None
    for finer, smaller in _ATTEMPTS:
        gmsh.option.setNumber("Mesh.MeshSizeMax", smaller * size)
        curved = _refine_curved_faces(smaller * size, CIRCLE * finer)
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:  # gmsh raises nothing more special
            if is_own_fault(error):
                raise
            problem = error
        else:
            if not _has_slivers():
                if curved:
                    gmsh.model.mesh.setOrder(2)
                return
            problem = "some are flat"
        gmsh.model.mesh.clear()
    raise InputError(f"expected a shape that elements of {size * metres:g} m can fill", f"that they cannot: {problem}")


def _has_slivers() -> bool:
    points, number = _nodes()
    _, _, nodes = gmsh.model.mesh.getElements(3)
    corners = points[number[np.concatenate(nodes).astype(np.int64)].reshape(-1, 4)]
    return bool(np.min(cell_quality(corners, "tetrahedron")) < SLIVER)


def _refine_curved_faces(size: float, around: int) -> bool:
    """Ask for `around` elements on a full circle; whether the model has curved faces at all."""
    by_size: dict[float, list[int]] = {}
    curved = [face for face in gmsh.model.getEntities(2) if gmsh.model.getType(*face) != "Plane"]
    for dim, tag in curved:
        low, high = gmsh.model.getParametrizationBounds(dim, tag)
        at = low + np.array(list(product((0.1, 0.5, 0.9), repeat=2))) * np.subtract(high, low)
        curvature = float(np.max(np.abs(gmsh.model.getCurvature(dim, tag, at.ravel()))))
        wanted = float(f"{2 * np.pi / max(curvature, 1e-12) / around:.6g}")
        if wanted < size:
            by_size.setdefault(wanted, []).append(tag)
    fields = [_growing_field(wanted, size, tags) for wanted, tags in by_size.items()]
    if fields:
        smallest = gmsh.model.mesh.field.add("Min")
        gmsh.model.mesh.field.setNumbers(smallest, "FieldsList", fields)
        gmsh.model.mesh.field.setAsBackgroundMesh(smallest)
    return bool(curved)


def _growing_field(begin: float, end: float, faces: list[int]) -> int:
    """A size field: `begin` on `faces`, growing with the distance from them up to `end`."""
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "FacesList", faces)
    size = int(field.add("Threshold"))
    values = {"IField": distance, "LcMin": begin, "LcMax": end, "DistMin": 0.0, "DistMax": (end - begin) / GROWTH}
    for name, value in values.items():
        field.setNumber(size, name, value)
    return size


def own_entities(dim: int = -1) -> list[tuple[int, int]]:
    """Entities (dimension, tag) of dimension `dim`, or of all (−1), without ghosts of the mesh's partitions."""
    return [entity for entity in gmsh.model.getEntities(dim) if not gmsh.model.getType(*entity).startswith("Ghost")]


def _nodes() -> tuple[Array, Integers]:
    """(p, 3) the nodes of the gmsh model, and their numbers, from 0, by tag; −1 of none."""
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    number = np.full(int(tags.max(initial=0)) + 1, -1, dtype=np.int64)
    number[tags.astype(np.int64)] = np.arange(len(tags))
    return np.reshape(coordinates, (-1, 3)), number


def extract_mesh() -> RawMesh:
    """The volume and surface elements and lines of the gmsh model, with the names of its physical groups."""
    points, number = _nodes()
    mesh = RawMesh(points)
    for dim, entity in [*own_entities(3), *gmsh.model.getEntities(2), *gmsh.model.getEntities(1)]:
        physical = gmsh.model.getPhysicalGroupsForEntity(dim, entity)
        names = [gmsh.model.getPhysicalName(dim, tag) or str(tag) for tag in physical]
        for kind, elements, nodes in zip(*gmsh.model.mesh.getElements(dim, entity), strict=True):
            cells = number[nodes.astype(np.int64)].reshape(len(elements), -1)
            groups = [(name, np.arange(len(cells))) for name in names]
            corners = cells[:, : gmsh.model.mesh.getElementProperties(kind)[5]]
            if dim == 3:
                mesh.add_solids(VOLUME_ELEMENTS.get(int(kind), f"gmsh type {kind}"), cells, groups)
            elif dim == 2:
                mesh.add_surfaces(corners, groups)
            else:
                mesh.lines.append(corners)
    return mesh
