"""Solid shapes drawn out along x, by gmsh's OpenCASCADE kernel: box, cylinder, tube, hollow rectangle, taper, holes.

They are drawn about 1 long, in a power of ten of meters: gmsh and OpenCASCADE take points closer than 1e-7 for one.
"""

from __future__ import annotations

from dataclasses import replace
from math import log10
from pathlib import Path
from typing import NoReturn, TypeVar, cast

import gmsh

from ..common.errors import InputError
from ..common.validation import Record
from .checks import check_size
from .gmsh_session import extract_mesh, gmsh_session, mesh_model, volume_and_surface
from .records import (
    BAR,
    CIRCLE,
    CircleSection,
    Outlines,
    PartTables,
    RectangleSection,
    SectionRecord,
    SolidGeometry,
    default_order,
    default_size,
)
from .source import Source, source_from

_VOLUME, _FACE = 3, 2
_ORIGIN = 0, 0, 0
DimTags = list[tuple[int, int]]
Lengths = TypeVar("Lengths")


def mesh_shape(tables: PartTables) -> Source:
    """Tetrahedra in the shape that the geometry describes, outlines along edges of elements.

    Raises `InputError` where a hole leaves the section, or the shape cannot be meshed.
    """
    _check_holes(tables.geometry, tables.path)
    unit, where = 10.0 ** round(log10(tables.geometry.length)), f"{tables.path}: geometry"
    geometry, outlines = _in(unit, tables.geometry), tables.outlines and _in(unit, tables.outlines)
    with gmsh_session():
        body = _body(geometry)
        for hole in geometry.hole:
            reach = 2 * max(_breadths(geometry.section))
            across = hole.position, hole.offset, -reach / 2, 0, 0, reach, hole.diameter / 2
            body, _ = gmsh.model.occ.cut(body, [(_VOLUME, gmsh.model.occ.addCylinder(*across))])
        if outlines is not None:
            _outline(body, geometry, outlines)
        gmsh.model.occ.synchronize()
        volume, surface = volume_and_surface()
        order = tables.mesh.order or default_order("tetrahedron")
        size = _in(unit, tables.mesh.size) if tables.mesh.size else default_size(volume, surface, order)
        check_size(size * unit, volume * unit**3, where)
        around = BAR if isinstance(geometry.section, CircleSection) else CIRCLE
        mesh_model(size, unit, where, around)
        source = source_from(extract_mesh(), where)
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
    elif isinstance(lengths, Outlines):
        converted = replace(lengths, edges=_in(unit, lengths.edges), width=_in(unit, lengths.width))
    return cast(Lengths, converted)


def _body(geometry: SolidGeometry) -> DimTags:
    section, length, occ = geometry.section, geometry.length, gmsh.model.occ
    if isinstance(section, RectangleSection):
        if isinstance(geometry.tip_section, RectangleSection):
            wires = [_wire(0.0, section), _wire(length, geometry.tip_section)]
            return _dim_tags(occ.addThruSections(wires, makeSolid=True, makeRuled=True))
        body = [_box(length, section.height, section.width)]
        if section.wall is None:
            return body
        inner = _box(length, section.height - 2 * section.wall, section.width - 2 * section.wall)
        return _dim_tags(occ.cut(body, [inner])[0])
    if isinstance(section, CircleSection):
        return [(_VOLUME, occ.addCylinder(*_ORIGIN, *(length, 0, 0), section.diameter / 2))]
    assert section is not None
    outer, inner = (occ.addCylinder(*_ORIGIN, *(length, 0, 0), d / 2) for d in (section.outer, section.inner))
    return _dim_tags(occ.cut([(_VOLUME, outer)], [(_VOLUME, inner)])[0])


def _box(length: float, height: float, width: float) -> tuple[int, int]:
    return _VOLUME, gmsh.model.occ.addBox(0, -height / 2, -width / 2, length, height, width)


def _wire(x: float, section: RectangleSection) -> int:
    occ, h, w = gmsh.model.occ, section.height / 2, section.width / 2
    points = [occ.addPoint(x, y, z) for y, z in ((-h, -w), (h, -w), (h, w), (-h, w))]
    lines = [occ.addLine(first, second) for first, second in zip(points, points[1:] + points[:1], strict=True)]
    return int(occ.addWire(lines))


def _breadths(section: SectionRecord | None) -> tuple[float, float]:
    if isinstance(section, RectangleSection):
        return section.height, section.width
    if isinstance(section, CircleSection):
        return section.diameter, section.diameter
    assert section is not None
    return section.outer, section.outer


def _check_holes(geometry: SolidGeometry, path: Path) -> None:
    """Holes stay within the outline of the side view; that of a taper is taken at the narrower side of each hole."""
    for hole in geometry.hole:
        radius = hole.diameter / 2
        begin, end = hole.position - radius, hole.position + radius
        if begin <= 0 or end >= geometry.length:
            _reject(path, "position", f"holes within the length, 0 … {geometry.length:g} m", f"{begin:g} … {end:g}")
        height = min(_height(geometry, begin), _height(geometry, end))
        if abs(hole.offset) + radius >= height / 2:
            low, high = hole.offset - radius, hole.offset + radius
            _reject(path, "diameter", f"holes within ±{height / 2:g} m of the axis", f"{low:g} … {high:g}")


def _height(geometry: SolidGeometry, x: float) -> float:
    root = _breadths(geometry.section)[0]
    tip = _breadths(geometry.tip_section)[0] if geometry.tip_section is not None else root
    return root + (tip - root) * x / geometry.length


def _outline(body: DimTags, geometry: SolidGeometry, outlines: Outlines) -> None:
    """Press the outlined rectangles into the faces at largest and smallest y."""
    assert isinstance(geometry.section, RectangleSection)
    half = geometry.section.height / 2
    sides = {"top": [half], "bottom": [-half], "both": [half, -half]}[outlines.faces]
    rectangles: DimTags = []
    for begin, end in outlines.edges:
        begin, end = max(begin, 0.0), min(end, geometry.length)
        for y in sides:
            face = gmsh.model.occ.addRectangle(begin, -outlines.width / 2, 0, end - begin, outlines.width)
            gmsh.model.occ.rotate([(_FACE, face)], *_ORIGIN, *(1, 0, 0), 1.5707963267948966)
            gmsh.model.occ.translate([(_FACE, face)], 0, y, 0)
            rectangles.append((_FACE, face))
    gmsh.model.occ.fragment(body, rectangles)


def _dim_tags(entities: DimTags) -> DimTags:
    return [entity for entity in entities if entity[0] == _VOLUME]


def _reject(path: Path, key: str, expected: str, given: str) -> NoReturn:
    raise InputError(f"{path}: geometry.hole.{key}: expected {expected}", given)
