"""A link's part as a mesh with its faces named: which source makes it, where it stands, what is checked.

Runs on one process; gmsh and meshio are loaded where they are used.
"""

from collections.abc import Callable
from dataclasses import replace
from math import prod
from pathlib import Path

import numpy as np

from ..common.errors import InputError, naming
from .checks import (
    METRES,
    check_boundary,
    check_count,
    check_shape,
    check_sound,
    check_volume,
    oriented,
    straightened,
)
from .faces import named_faces
from .kept_parts import keep_part, kept_part, kept_path
from .mesh_files import read_mesh
from .part_mesh import PartMesh
from .part_reader import read_apart
from .records import PartTables, RectangleSection, SolidGeometry, SolidMeshRecord, default_order, default_size, extents
from .source import Source, source_from
from .structured import structured_box

Progress = Callable[[str], None]


def kept_or_new(tables: PartTables, progress: Progress, *, remesh: bool) -> PartMesh:
    """The mesh of a part (`part_mesh`); if gmsh makes it, an earlier one in the cache unless `remesh`."""
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
    geometry, file, record = tables.geometry, tables.geometry.file, tables.mesh
    ready = file if file is not None and not is_step(file) else None  # a mesh
    progress(f"reading {ready.name}" if ready else "meshing")
    if ready:
        for key in ("cell", "size", "divisions"):
            if (given := getattr(record, key)) is not None:
                raise InputError(f"{tables.path}: mesh.{key}: expected none, since {ready.name} is a mesh", given)
    with naming(f"{tables.path}: geometry" + (f".file: {file.name}" if file else "")):
        if file is not None:
            source = source_of_file(file, record, METRES[geometry.unit])
            source = replace(source, part=_placed(source.part, geometry))
        elif _is_meshed(tables):
            from .gmsh_parts import mesh_shape

            source = mesh_shape(tables)
        else:
            source = Source(_box(geometry, record), {}, {})
        check_shape(source.part, geometry)
        part = oriented(source.part)
        if not ready:
            curved, part = part, straightened(part)
            check_volume(part, curved)
        check_sound(part)
        if ready:
            check_boundary(part)
    with naming(tables.path):
        return named_faces(replace(source, part=part), tables)


def _is_meshed(tables: PartTables) -> bool:
    """Whether gmsh makes the mesh: of a shape drawn here, or a STEP file."""
    if tables.geometry.file is not None:
        return is_step(tables.geometry.file)
    return tables.mesh.divisions is None and tables.mesh.cell != "hexahedron"


def is_step(file: Path) -> bool:
    """Whether the file's ending is one of STEP."""
    return file.suffix.lower() in (".step", ".stp")


def source_of_file(file: Path, record: SolidMeshRecord, metres: float) -> Source:
    """Read a mesh file, or mesh a STEP file by `record` with gmsh; coordinates are in the file's unit of `metres` m.

    Raises `InputError` where it cannot be read or meshed.
    """
    if is_step(file):
        from .gmsh_parts import mesh_step

        return read_apart(mesh_step, file.absolute(), record, metres)
    return source_from(read_mesh(file.absolute()))


def _box(geometry: SolidGeometry, record: SolidMeshRecord) -> PartMesh:
    """Structured cells; without `divisions`, as many as their size makes."""
    root = geometry.section
    tip = geometry.tip_section or root
    assert isinstance(root, RectangleSection)
    assert isinstance(tip, RectangleSection)
    cell = record.cell or "tetrahedron"
    ends, length, divisions = (extents(root), extents(tip)), geometry.length, record.divisions
    if divisions is None:
        height, width = np.mean(ends, axis=0)
        volume, surface = length * height * width, 2 * (length * (height + width) + height * width)
        size = record.size or default_size(volume, surface, record.order or default_order("hexahedron"))
        x, y, z = (max(1, round(extent / size)) for extent in (length, height, width))
        divisions = x, y, z
    count = prod(divisions) * (1 if cell == "hexahedron" else 6)
    check_count(count, " × ".join(map(str, divisions)) + " divisions")
    return structured_box(length, *ends, divisions, cell)


def _placed(part: PartMesh, geometry: SolidGeometry) -> PartMesh:
    x_axis, y_axis = np.array(geometry.x_axis), np.array(geometry.y_axis)
    z_axis = np.cross(x_axis, y_axis)
    x_axis, z_axis = x_axis / np.linalg.norm(x_axis), z_axis / np.linalg.norm(z_axis)
    axes = np.stack([x_axis, np.cross(z_axis, x_axis), z_axis])
    return part.moved(METRES[geometry.unit] * (part.points - np.array(geometry.origin)) @ axes.T)
