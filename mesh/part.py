"""A link's part as a mesh with its faces named: which source makes it, where it stands, what is checked.

Runs on one process; gmsh and meshio are loaded where they are used.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import prod
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from .checks import (
    METRES,
    check_boundary,
    check_connected,
    check_count,
    check_neighbours,
    check_quality,
    check_shape,
    check_volume,
    oriented,
    straightened,
)
from .faces import named_faces
from .kept_parts import keep_part, kept_part, kept_path
from .mesh_files import read_mesh
from .part_mesh import PartMesh
from .part_reader import read_apart
from .records import PartTables, RectangleSection, SolidGeometry, SolidMeshRecord, default_order, default_size
from .source import Source, source_from
from .structured import Divisions, structured_box

Progress = Callable[[str], None]

_STEP = (".step", ".stp")


def kept_or_new(tables: PartTables, progress: Progress, *, remesh: bool) -> PartMesh:
    """Return `part_mesh`, or its cached result where gmsh would mesh the part again and not `remesh`."""
    if not _is_meshed(tables):
        return part_mesh(tables, progress)
    kept = kept_path(tables)
    part = None if remesh else kept_part(kept)
    if part is None:
        part = part_mesh(tables, progress)
        keep_part(kept, part)
    return part


def part_mesh(tables: PartTables, progress: Progress) -> PartMesh:
    """Make or read the part of a link file, put it into the link's frame, check it, name its faces.

    Raises `InputError`, which names the link file, where the part cannot be read or meshed, its mesh is unsound, or a
    face is not there.
    """
    geometry, where = tables.geometry, f"{tables.path}: geometry"
    where = where if geometry.file is None else f"{where}.file: {geometry.file.name}"
    progress("meshing" if geometry.file is None or is_step(geometry.file) else f"reading {geometry.file.name}")
    source = _source(tables, where)
    part = _placed(source.part, geometry) if geometry.file is not None else source.part
    check_shape(part, geometry, where)
    part = oriented(part)
    if geometry.file is None or is_step(geometry.file):
        curved, part = part, straightened(part)
        check_volume(part, curved, where)
    check_quality(part, where)
    check_neighbours(part, where)
    check_connected(part, where)
    if geometry.file is not None and not is_step(geometry.file):
        check_boundary(part, where)
    return named_faces(replace(source, part=part), tables)


def _is_meshed(tables: PartTables) -> bool:
    """Whether gmsh makes the mesh: of a shape drawn here, or a STEP file."""
    if tables.geometry.file is not None:
        return is_step(tables.geometry.file)
    return tables.mesh.divisions is None and tables.mesh.cell != "hexahedron"


def is_step(file: Path) -> bool:
    """Whether the file's ending is one of STEP."""
    return file.suffix.lower() in _STEP


def _source(tables: PartTables, where: str) -> Source:
    file, record = tables.geometry.file, tables.mesh
    if file is None:
        if not _is_meshed(tables):
            return Source(_box(tables.geometry, record, where), {}, {})
        from .shapes import mesh_shape

        return mesh_shape(tables)
    if not is_step(file):
        for key in ("cell", "size", "divisions"):
            if getattr(record, key) is not None:
                raise InputError(
                    f"{tables.path}: mesh.{key}: expected none, since {file.name} is a mesh", getattr(record, key)
                )
    return source_of_file(file, record, METRES[tables.geometry.unit], where)


def source_of_file(file: Path, record: SolidMeshRecord, metres: float, where: str) -> Source:
    """The mesh of a part's file, made by gmsh of a STEP file, in the file's own numbers.

    `metres` are those of the file's unit; `where` (file and key) begins the messages. Raises `InputError`.
    """
    if is_step(file):
        from .step import mesh_step

        arguments = file.absolute(), record, metres, where
        return read_apart(mesh_step, file.stat().st_size, where, *arguments)
    return source_from(read_mesh(file.absolute(), where), where)


def _box(geometry: SolidGeometry, record: SolidMeshRecord, where: str) -> PartMesh:
    """Structured cells; without `divisions`, as many as their size makes."""
    root = geometry.section
    tip = geometry.tip_section or root
    assert isinstance(root, RectangleSection)
    assert isinstance(tip, RectangleSection)
    cell = record.cell or "tetrahedron"
    ends = (root.height, root.width), (tip.height, tip.width)
    divisions = record.divisions or _divisions(geometry.length, np.array(ends), record)
    count = prod(divisions) * (1 if cell == "hexahedron" else 6)
    check_count(count, " × ".join(map(str, divisions)) + " divisions", where)
    return structured_box(geometry.length, *ends, divisions, cell)


def _divisions(length: float, ends: Array, record: SolidMeshRecord) -> Divisions:
    """Layers along x, y, z that come nearest to the wanted size; `ends` (2, 2) are height and width at root and tip."""
    height, width = ends.mean(axis=0)
    volume, surface = length * height * width, 2 * (length * (height + width) + height * width)
    size = record.size or default_size(volume, surface, record.order or default_order("hexahedron"))
    x, y, z = (max(1, round(extent / size)) for extent in (length, height, width))
    return x, y, z


def _placed(part: PartMesh, geometry: SolidGeometry) -> PartMesh:
    """The part of a file in the link's frame, in m."""
    x_axis, y_axis = np.array(geometry.x_axis), np.array(geometry.y_axis)
    z_axis = np.cross(x_axis, y_axis)
    x_axis, z_axis = x_axis / np.linalg.norm(x_axis), z_axis / np.linalg.norm(z_axis)
    axes = np.stack([x_axis, np.cross(z_axis, x_axis), z_axis])
    return part.moved(METRES[geometry.unit] * (part.points - np.array(geometry.origin)) @ axes.T)
