"""Ready meshes in foreign formats (Abaqus, Nastran, VTK …), through meshio. Importing this loads meshio."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import meshio
import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Booleans, Integers
from ..common.errors import InputError
from .cells import HEXAHEDRON
from .source import RawMesh

_VOLUMES = re.compile(r"tetra|hexahedron|wedge|pyramid|polyhedron")
_SURFACES = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}

# meshio numbers nodes as VTK does: edges of the hexahedron around the lower face, the upper face, then upright.
_VTK_HEXAHEDRON_EDGES = [
    (0, 1), (1, 2), (2, 3), (0, 3), (4, 5), (5, 6), (6, 7), (4, 7), (0, 4), (1, 5), (2, 6), (3, 7),
]  # fmt: skip
_HEXAHEDRON20 = [*range(8), *(8 + _VTK_HEXAHEDRON_EDGES.index((int(a), int(b))) for a, b in np.sort(HEXAHEDRON.edges))]
_TO_GMSH = {
    "tetra10": [0, 1, 2, 3, 4, 5, 6, 7, 9, 8],
    "hexahedron20": _HEXAHEDRON20,
    "hexahedron27": [*_HEXAHEDRON20, 24, 22, 20, 21, 23, 25, 26],
}


def read_foreign(path: Path, where: str) -> RawMesh:
    """The mesh in `path`, whose ending tells the format; `where` (file and key) begins the message of an error.

    Element sets (Abaqus), property numbers (Nastran) and integer cell data name regions and faces; so do node sets.

    Raises:
        InputError: meshio cannot read it.
    """
    said = io.StringIO()
    try:
        with redirect_stdout(said), redirect_stderr(said):
            mesh = meshio.read(path)
            names = _names_of_cells(mesh, path)
            points = np.zeros((len(mesh.points), 3))
            points[:, : mesh.points.shape[1]] = mesh.points
    except (Exception, SystemExit) as error:  # whatever a reader meets in a corrupt file, it raises as it comes
        reason = said.getvalue() if isinstance(error, SystemExit) else f"{said.getvalue()} {error!r}"
        reason = " ".join(reason.replace(str(path), path.name).split())
        raise InputError(f"{where}: expected a mesh that meshio can read, found one that it cannot: {reason}") from None
    blocks: list[tuple[str, Integers, str | None]] = []
    faces: dict[str, list[Integers]] = {}
    surfaces = 0
    for block, labels in zip(mesh.cells, names, strict=True):
        cells = np.asarray(block.data, dtype=np.int64)
        if _VOLUMES.match(block.type):
            order = _TO_GMSH.get(block.type)
            ordered = cells if order is None else cells[:, order]
            blocks.extend((block.type, ordered[rows], label) for label, rows in _by_label(labels))
        elif block.type in _SURFACES:
            surfaces += len(cells)
            for label, rows in _by_label(labels):
                if label is not None:
                    faces.setdefault(label, []).append(cells[rows][:, : _SURFACES[block.type]])
    point_groups = {name: np.asarray(group, dtype=np.int64) for name, group in (mesh.point_sets or {}).items()}
    return RawMesh(points, tuple(blocks), faces, point_groups, surfaces)


Labels = NDArray[np.object_]


def _by_label(labels: Labels) -> Iterator[tuple[str | None, Booleans]]:
    for label in dict.fromkeys(labels.tolist()):
        yield label, np.array([item == label for item in labels], dtype=bool)


def _names_of_cells(mesh: meshio.Mesh, path: Path) -> list[Labels]:
    """For each block, the name of the set that each of its cells belongs to, the smallest where there are several."""
    names: list[Labels] = [np.full(len(block.data), None, dtype=object) for block in mesh.cells]
    for key, values in mesh.cell_data.items():
        if all(np.issubdtype(np.asarray(value).dtype, np.integer) for value in values):
            titles = {int(tag): name for name, (tag, *_) in mesh.field_data.items()} if "physical" in key else {}
            names = [np.array([titles.get(int(v), str(int(v))) for v in value], dtype=object) for value in values]
            break
    sets = {name: [np.asarray(rows, dtype=np.int64) for rows in found] for name, found in mesh.cell_sets.items()}
    if path.suffix.lower() == ".inp":
        sets |= _abaqus_element_sets(mesh, path)
    for name, found in sorted(sets.items(), key=lambda item: -sum(rows.size for rows in item[1])):
        for block, rows in zip(names, found, strict=False):
            block[rows] = name
    return names


def _abaqus_element_sets(mesh: meshio.Mesh, path: Path) -> dict[str, list[Integers]]:
    """The sets that *ELEMENT lines name: meshio 5.0 takes them for other blocks unless each line names one."""
    lines = re.findall(r"^\*ELEMENT\b(?! *OUTPUT)(.*)$", path.read_text(errors="replace"), re.MULTILINE | re.IGNORECASE)
    if len(lines) != len(mesh.cells):
        return {}
    sets: dict[str, list[Integers]] = {}
    for k, line in enumerate(lines):
        named = re.search(r"ELSET\s*=\s*([^,\s]+)", line, re.IGNORECASE)
        if named:
            found = sets.setdefault(named[1], [np.empty(0, dtype=np.int64) for _ in lines])
            found[k] = np.arange(len(mesh.cells[k].data))
    return sets
