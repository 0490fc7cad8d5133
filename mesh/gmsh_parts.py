"""Parts that gmsh meshes through its OpenCASCADE kernel: from STEP files, and sections drawn out along x.

Sections are drawn about 1 long, in a power of ten of meters: gmsh and OpenCASCADE take points closer than 1e-7 for one.
"""

import re
from dataclasses import replace
from math import log10
from pathlib import Path
from typing import TypeVar, cast

import gmsh
import numpy as np

from ..common.errors import InputError, blaming_file
from ..common.validation import Record
from .checks import check_size
from .gmsh_session import extract_mesh, gmsh_session, mesh_model, volume_and_surface
from .part_mesh import show
from .part_reader import MESHING, MESHING_CELL, allow
from .records import (
    PartTables,
    RectangleSection,
    SolidGeometry,
    SolidMeshRecord,
    SurfacePatches,
    default_order,
    default_size,
    extents,
)
from .source import Source, source_from

# Units of length that a STEP file can declare, in mm: OpenCASCADE turns all numbers into millimeters.
_SI_PREFIXES = {"$": 1e3, ".MILLI.": 1.0, ".CENTI.": 10.0, ".DECI.": 100.0, ".MICRO.": 1e-3, ".KILO.": 1e6}
_OTHER_UNITS = {"INCH": 25.4, "FOOT": 304.8, "MILE": 1609344.0}
_SOLID = re.compile(r"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
_FACE = re.compile(r"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(")
_COMPLAINT = re.compile(r"ERR \w+ : ([\w ]+?) : Fails Count : (\d+)")  # of OpenCASCADE's reader
_OFF = 1e-3  # how far edges may be from their faces and ends, relative to the part: files are exact to 1e-5 or so


def mesh_step(file: Path, record: SolidMeshRecord, scale: float) -> Source:
    """Tetrahedra in the volumes of a STEP file, in the file's own numbers, whose unit is `scale` m.

    Volumes that touch are joined. Labels of volumes and faces in the file name groups. Raises `InputError` for a
    file that is damaged, holds no closed volume, or cannot be meshed.
    """
    text = file.read_text(encoding="latin-1")
    if "ISO-10303-21" not in text[:4096]:
        raise InputError("expected a STEP file, which begins with ISO-10303-21", "none")
    declared = declared_unit(text)
    with gmsh_session() as printed:
        gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
        with blaming_file("expected a STEP file, found one that OpenCASCADE cannot read: {}".format):
            gmsh.model.occ.importShapes(str(file), highestDimOnly=False, format="step")
            gmsh.model.occ.synchronize()
        _check_volumes(text)
        # Of a damaged file OpenCASCADE makes a part of what is left, and says so.
        if complaints := [f"{what.lower()} ({count})" for what, count in _COMPLAINT.findall(printed())]:
            raise InputError("expected a sound STEP file", f"one damaged: {', '.join(complaints)}")
        _check_edges()
        faces, named = len(gmsh.model.getEntities(2)), len(_FACE.findall(text))
        missing = f"{named - faces} of the {named} faces in the file are in no shape that OpenCASCADE makes of it"
        _join()
        _name_groups()
        order = record.order or default_order("tetrahedron")
        volume, surface = volume_and_surface()
        size = record.size / scale * declared if record.size else default_size(volume, surface, order)
        metres = scale / declared
        allow(MESHING + MESHING_CELL * check_size(size * metres, volume * metres**3))
        mesh_model(size, metres)
        source = source_from(extract_mesh())
    part = source.part.moved(source.part.points / declared)
    remarks = (missing, *part.remarks) if faces < named else part.remarks
    return replace(source, part=replace(part, remarks=remarks))


def declared_unit(content: str) -> float:
    """Unit of length, in mm, that the `content` of a STEP file declares; 1 if none."""
    text = re.sub(r"\s+", "", content).upper()
    units = [entity for entity in text.split(";") if "LENGTH_UNIT()" in entity]
    # An inch is declared as so many millimeters: the conversion comes first.
    for entity in units:
        if (other := re.search(r"CONVERSION_BASED_UNIT\('(\w+)'", entity)) and other[1] in _OTHER_UNITS:
            return _OTHER_UNITS[other[1]]
    prefixes = [match[1] for entity in units if (match := re.search(r"SI_UNIT\((\$|\.\w+\.),\.METRE\.\)", entity))]
    return _SI_PREFIXES.get(prefixes[0], 1.0) if prefixes else 1.0


def _check_volumes(text: str) -> None:
    volumes, declared = len(gmsh.model.getEntities(3)), len(_SOLID.findall(text))
    if 0 < volumes < declared:
        raise InputError(f"expected the {declared} solids of the file", f"{volumes} that can be read")
    if volumes:
        return
    faces = len(gmsh.model.getEntities(2))
    instead = (
        f"{faces} faces that enclose none: an open surface; close its gaps and export a solid"
        if faces
        else "nothing: the file is empty or corrupt"
    )
    raise InputError("expected a closed volume", instead)


def _check_edges() -> None:
    """Check that edges lie on their faces and end at their vertices, in places of a few parameters each."""
    model = gmsh.model
    box = np.reshape(model.getBoundingBox(-1, -1), (2, 3))
    most = _OFF * float(np.linalg.norm(box[1] - box[0]))
    for _, face in model.getEntities(2):
        for _, edge in model.getBoundary([(2, face)], combined=False, oriented=False):
            (begin,), (end,) = model.getParametrizationBounds(1, edge)
            at = np.linspace(begin, end, 5)
            points = np.reshape(model.getValue(1, edge, at), (-1, 3))
            on_face = np.reshape(model.getValue(2, face, model.reparametrizeOnSurface(1, edge, at, face)), (-1, 3))
            vertices = model.getBoundary([(1, edge)], combined=False, oriented=False)
            off = [np.linalg.norm(points - on_face, axis=1).max()]
            off += [np.linalg.norm(points[[0, -1]] - model.getValue(*of, []), axis=1).min() for of in vertices]
            if not max(off) <= most:
                raise InputError(
                    "expected edges that lie on their faces and end at their vertices",
                    f"one {max(off):.3g} mm off, near {show(points[2])} mm: a damaged file",
                )


def _join() -> None:
    """Make volumes that touch share their faces; the labels go with the pieces."""
    volumes = gmsh.model.getEntities(3)
    if len(volumes) < 2:
        return
    labels = [gmsh.model.getEntityName(*volume) for volume in volumes]
    _, pieces = gmsh.model.occ.fragment(volumes, [])
    gmsh.model.occ.synchronize()
    for label, of_volume in zip(labels, pieces, strict=False):
        for piece in of_volume:
            gmsh.model.setEntityName(*piece, label)


def _name_groups() -> None:
    """Physical groups from the labels: the last part of "Shapes/Arm/Hub"."""
    for dim in (2, 3):
        groups: dict[str, list[int]] = {}
        for entity in gmsh.model.getEntities(dim):
            label = gmsh.model.getEntityName(*entity).split("/")[-1].strip()
            # OpenCASCADE's own writer calls nameless shapes after itself.
            if label and not label.startswith("Open CASCADE"):
                groups.setdefault(label, []).append(entity[1])
        for label, tags in groups.items():
            gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, tags), label)


_ORIGIN = 0, 0, 0
DimTags = list[tuple[int, int]]
Lengths = TypeVar("Lengths")


def mesh_shape(tables: PartTables) -> Source:
    """Tetrahedra in the shape that `tables.geometry` describes, with edges along the outlines of patches.

    Raises `InputError` where the shape cannot be meshed.
    """
    unit = 10.0 ** round(log10(tables.geometry.length))
    geometry = _in(unit, tables.geometry)
    with gmsh_session():
        body = _body(geometry)
        for hole in geometry.hole:
            reach = max(extents(geometry.section))
            across = hole.position, hole.offset, -reach, 0, 0, 2 * reach, hole.diameter / 2
            body, _ = gmsh.model.occ.cut(body, [(3, gmsh.model.occ.addCylinder(*across))])
        if tables.patches is not None:
            _outline(body, geometry, _in(unit, tables.patches))
        gmsh.model.occ.synchronize()
        volume, surface = volume_and_surface()
        order = tables.mesh.order or default_order("tetrahedron")
        size = _in(unit, tables.mesh.size) if tables.mesh.size else default_size(volume, surface, order)
        check_size(size * unit, volume * unit**3)
        mesh_model(size, unit)
        source = source_from(extract_mesh())
    return replace(source, part=source.part.moved(source.part.points * unit))


def _in(unit: float, lengths: Lengths) -> Lengths:
    """Lengths in m, in a number, tuple or record, as multiples of `unit`; to 12 digits, the same in m and mm."""
    converted: object = lengths
    if isinstance(lengths, float):
        converted = float(f"{lengths / unit:.12g}")
    elif isinstance(lengths, tuple):
        converted = tuple(_in(unit, item) for item in lengths)
    elif isinstance(lengths, Record):
        converted = lengths.model_copy(update={name: _in(unit, value) for name, value in lengths})
    return cast(Lengths, converted)


def _body(geometry: SolidGeometry) -> DimTags:
    section, length, occ = geometry.section, geometry.length, gmsh.model.occ
    if isinstance(section, RectangleSection):
        if isinstance(geometry.tip_section, RectangleSection):
            wires = [_wire(0.0, section), _wire(length, geometry.tip_section)]
            return _volumes(occ.addThruSections(wires, makeSolid=True, makeRuled=True))
        body = [_box(length, section.height, section.width)]
        if section.wall is None:
            return body
        hollow = _box(length, section.height - 2 * section.wall, section.width - 2 * section.wall)
        return _volumes(occ.cut(body, [hollow])[0])
    assert section is not None
    outer, *inner = [(3, occ.addCylinder(*_ORIGIN, length, 0, 0, d / 2)) for d in (section.outer, section.inner) if d]
    return _volumes(occ.cut([outer], inner)[0]) if inner else [outer]


def _box(length: float, height: float, width: float) -> tuple[int, int]:
    return 3, gmsh.model.occ.addBox(0, -height / 2, -width / 2, length, height, width)


def _wire(x: float, section: RectangleSection) -> int:
    occ, h, w = gmsh.model.occ, section.height / 2, section.width / 2
    points = [occ.addPoint(x, y, z) for y, z in ((-h, -w), (h, -w), (h, w), (-h, w))]
    lines = [occ.addLine(first, second) for first, second in zip(points, points[1:] + points[:1], strict=True)]
    return int(occ.addWire(lines))


def _outline(body: DimTags, geometry: SolidGeometry, patches: SurfacePatches) -> None:
    """Press the outlined rectangles into the faces at largest and smallest y."""
    assert isinstance(geometry.section, RectangleSection)
    half = geometry.section.height / 2
    sides = {"top": [half], "bottom": [-half], "both": [half, -half]}[patches.faces]
    rectangles: DimTags = []
    for begin, end in patches.edges(geometry.length):
        begin, end = max(begin, 0.0), min(end, geometry.length)
        for y in sides:
            face = gmsh.model.occ.addRectangle(begin, -patches.width / 2, 0, end - begin, patches.width)
            gmsh.model.occ.rotate([(2, face)], *_ORIGIN, *(1, 0, 0), 1.5707963267948966)
            gmsh.model.occ.translate([(2, face)], 0, y, 0)
            rectangles.append((2, face))
    gmsh.model.occ.fragment(body, rectangles)


def _volumes(entities: DimTags) -> DimTags:
    return [entity for entity in entities if entity[0] == 3]
