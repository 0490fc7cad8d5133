"""Parts from STEP files, through gmsh's OpenCASCADE kernel."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import gmsh
import numpy as np

from ..common.arrays import as_floats
from ..common.errors import InputError, blaming_file
from .checks import check_size
from .gmsh_session import extract_mesh, gmsh_session, mesh_model, volume_and_surface
from .part_reader import MESHING, MESHING_CELL, allow
from .records import SolidMeshRecord, default_order, default_size
from .source import Source, source_from

# Units of length that a STEP file can declare, in mm: OpenCASCADE turns all numbers into millimeters.
_SI_PREFIXES = {"$": 1e3, ".MILLI.": 1.0, ".CENTI.": 10.0, ".DECI.": 100.0, ".MICRO.": 1e-3, ".KILO.": 1e6}
_OTHER_UNITS = {"INCH": 25.4, "FOOT": 304.8, "MILE": 1609344.0}
_SOLID = re.compile(r"=\s*(?:MANIFOLD_SOLID_BREP|BREP_WITH_VOIDS|FACETED_BREP)\s*\(")
_FACE = re.compile(r"=\s*(?:ADVANCED_FACE|FACE_SURFACE)\s*\(")
_COMPLAINT = re.compile(r"ERR \w+ : ([\w ]+?) : Fails Count : (\d+)")  # of OpenCASCADE's reader
_OFF = 1e-3  # how far edges may be from their faces and ends, relative to the part: files are exact to 1e-5 or so


def mesh_step(file: Path, record: SolidMeshRecord, scale: float, where: str) -> Source:
    """Tetrahedra in the volumes of a STEP file, in the file's own numbers, whose unit is `scale` m.

    Volumes that touch are joined. Labels of volumes and faces in the file name groups. Raises `InputError`, which
    begins with `where`, for a file that is damaged, holds no closed volume, or cannot be meshed.
    """
    text = file.read_text(encoding="latin-1")
    if "ISO-10303-21" not in text[:4096]:
        raise InputError(f"{where}: expected a STEP file, which begins with ISO-10303-21", "none")
    declared = declared_unit(text)
    with gmsh_session() as printed:
        gmsh.option.setNumber("Geometry.OCCImportLabels", 1)
        with blaming_file("expected a STEP file, found one that OpenCASCADE cannot read: {}".format, where):
            gmsh.model.occ.importShapes(str(file), highestDimOnly=False, format="step")
            gmsh.model.occ.synchronize()
        _check_volumes(text, where)
        # Of a damaged file OpenCASCADE makes a part of what is left, and says so.
        if complaints := [f"{what.lower()} ({count})" for what, count in _COMPLAINT.findall(printed())]:
            raise InputError(f"{where}: expected a sound STEP file", f"one damaged: {', '.join(complaints)}")
        _check_edges(where)
        remarks = tuple(_left_out(text))
        _join()
        _name_groups()
        order = record.order or default_order("tetrahedron")
        volume, surface = volume_and_surface()
        size = record.size / scale * declared if record.size else default_size(volume, surface, order)
        metres = scale / declared
        allow(MESHING + MESHING_CELL * check_size(size * metres, volume * metres**3, where))
        mesh_model(size, metres, where)
        source = source_from(extract_mesh(), where)
    part = source.part.moved(as_floats(source.part.points / declared))
    return replace(source, part=replace(part, remarks=(*remarks, *part.remarks)))


def declared_unit(content: str) -> float:
    """The unit of length that the file declares, in mm; millimeters if none."""
    text = re.sub(r"\s+", "", content).upper()
    units = [entity for entity in text.split(";") if "LENGTH_UNIT()" in entity]
    # An inch is declared as so many millimeters: the conversion comes first.
    for entity in units:
        if (other := re.search(r"CONVERSION_BASED_UNIT\('(\w+)'", entity)) and other[1] in _OTHER_UNITS:
            return _OTHER_UNITS[other[1]]
    prefixes = [match[1] for entity in units if (match := re.search(r"SI_UNIT\((\$|\.\w+\.),\.METRE\.\)", entity))]
    return _SI_PREFIXES.get(prefixes[0], 1.0) if prefixes else 1.0


def _check_volumes(text: str, where: str) -> None:
    volumes, declared = len(gmsh.model.getEntities(3)), len(_SOLID.findall(text))
    if 0 < volumes < declared:
        raise InputError(f"{where}: expected the {declared} solids of the file", f"{volumes} that can be read")
    if volumes:
        return
    faces = len(gmsh.model.getEntities(2))
    instead = (
        f"{faces} faces that enclose none: an open surface; close its gaps and export a solid"
        if faces
        else "nothing: the file is empty or corrupt"
    )
    raise InputError(f"{where}: expected a closed volume", instead)


def _check_edges(where: str) -> None:
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
                place = ", ".join(f"{value:.4g}" for value in points[2])
                raise InputError(
                    f"{where}: expected edges that lie on their faces and end at their vertices",
                    f"one {max(off):.3g} mm off, near ({place}) mm: a damaged file",
                )


def _left_out(text: str) -> Iterator[str]:
    faces, declared = len(gmsh.model.getEntities(2)), len(_FACE.findall(text))
    if faces < declared:
        yield f"{declared - faces} of the {declared} faces in the file are in no shape that OpenCASCADE makes of it"


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
