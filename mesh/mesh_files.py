"""Ready meshes: which reader a file gets, and those in formats that meshio reads (VTK, XDMF …).

meshio is loaded where it is used, in a process of its own.
"""

import io
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.arrays import Integers, NDArray
from ..common.errors import InputError, blaming_file
from ..common.libraries import missing
from .cells import in_gmsh_order
from .part_reader import read_apart
from .source import RawMesh

if TYPE_CHECKING:
    import meshio

_OTHERS = re.compile(r"(vertex|line|triangle|quad)\d*")
_CORNERS = {"line": 2, "triangle": 3, "quad": 4}
# VTK's cells of any degree that others have names for.
_LAGRANGE = {
    ("VTK_LAGRANGE_TETRAHEDRON", 4): "tetra",
    ("VTK_LAGRANGE_TETRAHEDRON", 10): "tetra10",
    ("VTK_LAGRANGE_HEXAHEDRON", 8): "hexahedron",
}
_VOXEL = [0, 1, 3, 2, 4, 5, 7, 6]  # corners of VTK's voxel, which are in order of x, then y, then z, as a hexahedron's
_TECPLOT = re.compile(rb"^\s*ZONE\b", re.MULTILINE | re.IGNORECASE)  # other files with the ending .dat are Nastran's
# VTK's types of cells that are neither solids nor their faces, which may stand beside solids.
_VTK_TYPES = {2: "sets of points", 4: "polylines", 6: "strips of triangles", 7: "polygons"}
_ENDINGS = (".step", ".stp", ".msh", ".inp", ".bdf", ".nas", ".fem", ".dat", ".vtk", ".vtu", ".med", ".xdmf", ".mesh")
# Integer data of cells with more values than this number cells, not groups.
_MOST_GROUPS = 1000


def read_mesh(path: Path) -> RawMesh:
    """Read the mesh in `path`, whose ending tells the format. Raises `InputError` for what is wrong in it."""
    ending = path.suffix.lower()
    with blaming_file("expected a deck that can be read, found one that cannot: {!r}".format):  # one like no other
        if ending == ".inp":
            from .abaqus import read_abaqus

            return read_abaqus(path)
        if ending in (".bdf", ".nas", ".fem") or (ending == ".dat" and not _TECPLOT.search(path.read_bytes())):
            from .nastran import read_nastran

            return read_nastran(path)
    read: Callable[[Path], RawMesh] = read_foreign
    if ending == ".msh":
        from .msh import read_msh

        read = read_msh
    elif ending == ".med":
        from .med import read_med

        read = read_med
    return read_apart(read, path)


def read_foreign(path: Path) -> RawMesh:
    """Read the mesh in `path` by meshio. Raises `InputError` where that cannot.

    Integer data of cells, groups and sets of the format name regions and faces; so do sets of nodes.
    """
    import meshio

    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            raw = _raw_mesh(_read(path, said))
    except (Exception, SystemExit) as error:  # whatever a reader meets in a corrupt file, it raises as it comes
        reason = said.getvalue() if isinstance(error, SystemExit) else f"{said.getvalue()} {_in_words(error)}"
        reason = " ".join(reason.replace(str(path), path.name).split())
        if isinstance(error, meshio.ReadError) and path.suffix.lower() not in meshio.extension_to_filetypes:
            reason = f"its ending is not one of {', '.join(_ENDINGS)}: another program has to convert it"
        raise InputError("expected a mesh that meshio can read", f"that it cannot: {reason}") from None
    words = " ".join(said.getvalue().replace(str(path), path.name).split())
    return replace(raw, remarks=(f"meshio on {path.name}: {words}",)) if words else raw


def _in_words(error: BaseException) -> str:
    if isinstance(error, KeyError):
        kind = _VTK_TYPES.get(error.args[0], error.args[0]) if error.args else "unknown ones"
        return f"cells or data of a kind that it does not know: {kind}"
    if isinstance(error, ModuleNotFoundError) and (message := missing(error)):
        return message
    return str(error) or f"data that end or contradict ({type(error).__name__})"


def _read(path: Path, said: io.StringIO) -> "meshio.Mesh":
    """By meshio; what it cannot read of VTK's files VTK reads, where PyVista is installed (binary 5.1, LZ4, voxels)."""
    import meshio

    try:
        mesh = meshio.read(path)
        if "cells that meshio cannot handle" in said.getvalue():
            raise ValueError("cells of other types")
        return mesh
    except (Exception, SystemExit):
        if path.suffix.lower() not in (".vtk", ".vtu"):
            raise
        try:
            import pyvista
        except ModuleNotFoundError:
            pyvista = None
        if pyvista is None:
            raise
        said.truncate(said.seek(0))
    failed = list[object]()
    reader = pyvista.get_reader(path)
    reader.reader.AddObserver("ErrorEvent", lambda *_: failed.append(None))
    try:
        data = reader.read()
    except RuntimeError:  # of later versions of PyVista
        failed.append(None)
    if failed:
        said.truncate(said.seek(0))
        raise ValueError("VTK finds an error in it")
    _check_ghosts(data.cell_data)
    types = getattr(data, "celltypes", None)
    if types is not None and (flat := np.isin(types, list(_VTK_TYPES))).any() and not flat.all():
        data = data.extract_cells(~flat)
        data.cell_data.pop("vtkOriginalCellIds", None)  # integers that are no groups
    return pyvista.to_meshio(data)


def _check_ghosts(data: Mapping[str, Any]) -> None:
    """Check that all cells are shown: some readers drop the others."""
    if hidden := sum(int(np.count_nonzero(values)) for values in data.get("vtkGhostType", ())):
        raise ValueError(f"{hidden} cells that vtkGhostType hides or has as copies of others")


def _raw_mesh(mesh: "meshio.Mesh") -> RawMesh:
    _check_ghosts(mesh.cell_data)
    points = np.zeros((len(mesh.points), 3))
    points[:, : mesh.points.shape[1]] = mesh.points
    sets = mesh.point_sets or {}
    raw = RawMesh(points, {name: np.asarray(group, dtype=np.int64) for name, group in sets.items()})
    for block, groups in zip(mesh.cells, _groups(mesh), strict=True):
        cells = np.asarray(block.data, dtype=np.int64)
        if other := _OTHERS.fullmatch(block.type):
            if other[1] == "line":
                raw.lines.append(cells[:, :2])
            elif other[1] != "vertex":
                raw.add_surfaces(cells[:, : _CORNERS[other[1]]], groups.items())
        else:  # of unknown types, too: these are rejected by name
            kind = "hexahedron" if block.type == "voxel" else block.type
            kind = _LAGRANGE.get((kind, cells.shape[1]), kind)
            cells = cells[:, _VOXEL] if block.type == "voxel" else in_gmsh_order(kind, cells)
            raw.add_solids(kind, cells, groups.items())
    return raw


def _groups(mesh: "meshio.Mesh") -> Iterator[Mapping[str, Integers]]:
    """For each block, the cells of each group that has any in it."""
    values = _numbered(mesh)
    titles = {int(tag): name for name, (tag, *_) in mesh.field_data.items()}
    for k, block in enumerate(mesh.cells):
        members: dict[str, Integers] = {}  # cells may belong to several
        if values is not None:
            for value in np.unique(values[k]).tolist():
                members[titles.get(value, str(value))] = np.flatnonzero(values[k] == value)
        for name, sets in mesh.cell_sets.items():
            rows = np.asarray(sets[k] if k < len(sets) and sets[k] is not None else [], dtype=np.int64)
            if np.any((rows < 0) | (rows >= len(block.data))):
                raise ValueError(f"missing cells in the set {name}")
            members[name] = rows
        yield {name: rows for name, rows in members.items() if rows.size}


def _numbered(mesh: "meshio.Mesh") -> list[NDArray[np.generic]] | None:
    """The first integer data of cells that number groups, by block."""
    for values in mesh.cell_data.values():
        arrays = [np.asarray(value) for value in values]
        is_group = all(np.issubdtype(array.dtype, np.integer) and array.ndim == 1 for array in arrays)
        if is_group and np.unique(np.concatenate(arrays)).size <= _MOST_GROUPS:
            return arrays
    return None
