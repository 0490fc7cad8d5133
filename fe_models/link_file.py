"""The link file: read, and checked for all that one key alone cannot tell (the records check the keys)."""

from __future__ import annotations

from itertools import pairwise
from math import isclose
from pathlib import Path
from typing import NoReturn

import numpy as np

from ..common.errors import InputError
from ..common.validation import validate
from ..mesh.records import RectangleSection, SectionRecord, TubeSection
from .beam.section_stress import contains
from .link_records.families import DEFAULT_COUNT, FAMILIES
from .link_records.link import BeamLink, Link, Material, OrthotropicMaterial, SolidLink
from .link_records.measured import read_measured
from .link_source import LinkSource, link_keys, link_path
from .solid.constitutive import is_stable


def read_link(source: LinkSource) -> Link:
    """Read and check a link file. Raises `InputError`, with file and key, for what is wrong in it."""
    data, path = link_keys(source), link_path(source)
    geometry = data.get("geometry")
    kind = geometry.get("kind", "beam") if isinstance(geometry, dict) else "beam"
    link: Link
    if kind == "beam":
        link = beam = validate(BeamLink, data, path)
        _check_beam_geometry(beam, path)
        _check_beam_mesh(beam, path)
        _check_beam_interfaces(beam, path)
    elif kind == "solid":
        link = solid = validate(SolidLink, data, path)
        _check_shape(solid, path)
        _check_solid_mesh(solid, path)
        _check_solid_interfaces(solid, path)
    else:
        _reject(path, "geometry.kind", '"beam" or "solid"', repr(kind))
    _check_places(link, path)
    _check_modes(link, path)
    _check_measured(link, path)
    if isinstance(link, BeamLink):
        _check_beam_material(link, path)
        _check_beam_stress(link, path)
    else:
        _check_solid_materials(link, path)
        _check_surface_patches(link, path)
    return link


def _check_beam_geometry(link: BeamLink, path: Path) -> None:
    geometry = link.geometry
    if (geometry.section is None) == (geometry.segment is None):
        _reject(path, "geometry", "either section or [[geometry.segment]]", _both_or_neither(geometry.section))
    ends = [segment.until for segment in geometry.segment or ()]
    if any(after - before <= 1e-9 * geometry.length for before, after in pairwise([0.0, *ends])):
        _reject(path, "geometry.segment", "ascending values of until, apart by more than 1e-9 of the length", ends)
    if ends and ends[-1] != geometry.length:
        _reject(path, "geometry.segment", f"the last until at the length, {geometry.length}", ends[-1])
    for record in [geometry.section, *(segment.section for segment in geometry.segment or ())]:
        _check_section(record, path)
        if isinstance(record, RectangleSection) and record.wall is not None:
            _reject(path, "geometry.section.wall", 'no wall where geometry.kind = "beam"', record.wall)


def _check_section(record: SectionRecord | None, path: Path) -> None:
    if isinstance(record, TubeSection) and record.inner >= record.outer:
        _reject(path, "geometry.section.inner", f"less than outer, {record.outer}", record.inner)
    if isinstance(record, RectangleSection) and record.wall is not None:
        half = min(record.height, record.width) / 2
        if record.wall >= half:
            _reject(path, "geometry.section.wall", f"less than half of height and width, {half:g}", record.wall)


def _check_beam_mesh(link: BeamLink, path: Path) -> None:
    breakpoints, length = link.geometry.breakpoints, link.geometry.length
    mesh = link.mesh
    if (mesh.elements is None) == (mesh.nodes is None):
        _reject(path, "mesh", "either elements or nodes", _both_or_neither(mesh.elements))
    if mesh.elements is not None and mesh.elements < len(breakpoints) - 1:
        _reject(path, "mesh.elements", f"at least one per segment, {len(breakpoints) - 1}", mesh.elements)
    if mesh.nodes is None:
        return
    if any(after - before <= 1e-9 * length for before, after in pairwise(mesh.nodes)):
        _reject(path, "mesh.nodes", "strictly ascending positions, apart by more than 1e-9 of the length", mesh.nodes)
    if mesh.nodes[0] != 0.0 or mesh.nodes[-1] != length:
        _reject(path, "mesh.nodes", f"from 0 to the length, {length}", f"{mesh.nodes[0]} to {mesh.nodes[-1]}")
    missing = [point for point in breakpoints if point not in mesh.nodes]
    if missing:
        _reject(path, "mesh.nodes", f"a node at every step of the section, {missing} too", mesh.nodes)


def _check_names(link: Link, path: Path) -> None:
    # `mid` is the name under which results give the point at exactly half length.
    taken = {"mid"}
    for interface in link.interface:
        if interface.name in taken:
            _reject(path, "interface.name", f"a name besides {', '.join(sorted(taken))}", interface.name)
        taken.add(interface.name)


def _check_beam_interfaces(link: BeamLink, path: Path) -> None:
    _check_names(link, path)
    for interface in link.interface:
        key = f"interface.{{}} of {interface.name}"
        for name in ("normal", "group"):
            if getattr(interface, name) is not None:
                _reject(path, key.format(name), f"no {name} on a beam", getattr(interface, name))
        if interface.name in ("root", "tip"):
            if interface.position is not None:
                _reject(path, key.format("position"), "none: it is an end of the beam", interface.position)
        elif not isinstance(interface.position, float):
            _reject(path, key.format("position"), "one number, m from the root", interface.position)
        else:
            _check_within(link, interface.position, path, key)


def _check_within(link: Link, position: float, path: Path, key: str) -> None:
    if position > link.geometry.length:
        _reject(path, key.format("position"), f"within the length, {link.geometry.length}", position)


def _check_places(link: Link, path: Path) -> None:
    """Interfaces at one place cannot move by themselves, as those of Craig–Bampton modes do."""
    if link.reference.condition != "craig-bampton":
        return
    taken: dict[object, str] = {}
    by_record = {record.name: record.group or record.position for record in link.interface}
    for name, place in (link.places if isinstance(link, BeamLink) else by_record).items():
        near = round(place / link.geometry.length, 9) if isinstance(place, float) else place
        if near is not None and near in taken:
            expected = f'a place apart from {taken[near]} with condition = "craig-bampton"'
            _reject(path, f"interface.position of {name}", expected, place)
        taken[near] = name


def _check_modes(link: Link, path: Path) -> None:
    modes, damping = link.modes, link.damping
    if modes.count is not None and modes.indices is not None:
        _reject(path, "modes", "either count or indices", "both")
    if modes.are_default and not modes.attachment_modes:
        _reject(path, "modes", "either count or indices", "neither")
    if modes.indices and sorted(set(modes.indices)) != list(modes.indices):
        _reject(path, "modes.indices", "ascending numbers, each once", modes.indices)
    if damping.ratio is not None and damping.rayleigh is not None:
        _reject(path, "damping", "either ratio or rayleigh", "both")
    if damping.of == "robot" and not isinstance(damping.ratio, float):
        given = damping.rayleigh if damping.ratio is None else damping.ratio
        _reject(path, "damping", 'one ratio, with of = "robot"', "none" if given is None else given)
    number = modes.count or len(modes.indices or ()) or sum(DEFAULT_COUNT[family] for family in link.families)
    if isinstance(damping.ratio, tuple) and len(damping.ratio) != number:
        _reject(path, "damping.ratio", f"one number, or one for each of the {number} modes", len(damping.ratio))


def _check_measured(link: Link, path: Path) -> None:
    if link.measured is None:
        return
    rows = read_measured(link.measured.table, FAMILIES)
    if link.damping.of == "robot" and any(row.damping_ratio is not None for row in rows):
        _reject(path, "measured", 'no damping_ratio with damping.of = "robot"', f"some in {link.measured.table}")


def _check_beam_material(link: BeamLink, path: Path) -> None:
    bends = any(family.endswith("bending") for family in link.families)
    shear = bends and link.model.theory == "timoshenko"
    use = "torsion" if "torsion" in link.families else "shear" if shear else "strains" if link.stress.points else None
    if use and link.material.poissons_ratio is None:
        _reject(path, "material.poissons_ratio", f"a value, for {use} (modes.family = {link.modes.family!r})", "none")


def _check_beam_stress(link: BeamLink, path: Path) -> None:
    if link.stress.surface:
        _reject(path, "stress.surface", "points, not a surface, on a beam", "true")
    for name, (x, y, z) in link.stress.points.items():
        key, length = f"stress.points.{name}", link.geometry.length
        if not 0.0 <= x <= length:
            _reject(path, key, f"x within the length, 0 … {length:g} m", f"{x:g} m")
        shape = link.shapes[int(np.searchsorted(link.geometry.breakpoints[1:-1], x, side="right"))]
        if not contains(shape, y, z):
            _reject(path, key, f"y, z within the section, a {shape.shape}, at x = {x:g} m", f"{y:g}, {z:g} m")


def _check_shape(link: SolidLink, path: Path) -> None:
    geometry = link.geometry
    if (geometry.section is None) == (geometry.file is None):
        _reject(path, "geometry", "either section or file", _both_or_neither(geometry.section))
    _check_section(geometry.section, path)
    tip = geometry.tip_section
    if tip is not None and (
        not isinstance(tip, RectangleSection)
        or not isinstance(geometry.section, RectangleSection)
        or tip.wall is not None
        or geometry.section.wall is not None
    ):
        _reject(path, "geometry.tip_section", "a taper between two rectangles without wall", "another shape")
    if geometry.file is not None and geometry.hole:
        _reject(path, "geometry.hole", "no holes if geometry.file names a part", len(geometry.hole))
    sizes = np.linalg.norm(geometry.x_axis) * np.linalg.norm(geometry.y_axis)
    if np.linalg.norm(np.cross(geometry.x_axis, geometry.y_axis)) <= 1e-6 * sizes:
        _reject(path, "geometry.y_axis", f"a direction across x_axis, {list(geometry.x_axis)}", list(geometry.y_axis))


def _check_solid_mesh(link: SolidLink, path: Path) -> None:
    geometry, mesh = link.geometry, link.mesh
    if mesh.size is not None and mesh.divisions is not None:
        _reject(path, "mesh", "either size or divisions", "both")
    plain = isinstance(geometry.section, RectangleSection) and geometry.section.wall is None and not geometry.hole
    if mesh.divisions is not None and not plain:
        _reject(path, "mesh.divisions", "a box, of one section or tapered, for a structured mesh", "another shape")
    if mesh.cell == "hexahedron" and not plain:
        _reject(path, "mesh.cell", '"tetrahedron", since hexahedra are made in boxes only', '"hexahedron"')
    if mesh.divisions is not None and link.surface_patch is not None:
        _reject(path, "mesh.divisions", "size in its place, where patches are outlined in the mesh", "both")


def _check_solid_interfaces(link: SolidLink, path: Path) -> None:
    _check_names(link, path)
    for interface in link.interface:
        key = f"interface.{{}} of {interface.name}"
        if interface.group is not None and interface.position is not None:
            _reject(path, key.format("group"), "either group or position", "both")
        if interface.normal is not None and not isinstance(interface.position, tuple):
            _reject(path, key.format("normal"), "it only with a position of three numbers", interface.position)
        if isinstance(interface.position, tuple) and interface.normal is None:
            _reject(path, key.format("normal"), "the outward normal of the face at position", "none")
        if isinstance(interface.position, float):
            _check_within(link, interface.position, path, key)
            if interface.coupling == "rigid":
                _reject(path, key.format("coupling"), '"mean" for a cross section inside the part', '"rigid"')
        is_supported = interface.name == "root" or (interface.name == "tip" and not link.reference.holds_root)
        if is_supported and interface.coupling == "mean" and link.coupling == "rigid":
            expected = '"rigid", or coupling = "mean" in [reference], which holds this face'
            _reject(path, key.format("coupling"), expected, '"mean"')
        if interface.group is None and interface.position is None and interface.name not in ("root", "tip"):
            _reject(path, key.format("position"), "either group or position", "neither")


def _check_solid_materials(link: SolidLink, path: Path) -> None:
    for key, material in [("material", link.material), *((f"region {r.group}", r.material) for r in link.region)]:
        if isinstance(material, Material) and material.poissons_ratio is None:
            _reject(path, f"{key}.poissons_ratio", "a value: solids need it", "none")
        if isinstance(material, OrthotropicMaterial) and not is_stable(material):
            _reject(path, f"{key}.poissons_ratio", "ratios that leave the energy positive", material.poissons_ratio)
    if link.region and link.geometry.file is None:
        _reject(path, "region", "geometry.file, a mesh with that physical volume group", "a generated shape")


def _check_surface_patches(link: SolidLink, path: Path) -> None:
    patches = link.surface_patch
    if patches is None:
        return
    if (patches.count is None) == (patches.centers is None):
        _reject(path, "surface_patch", "either count or centers", _both_or_neither(patches.count))
    section = link.geometry.section
    if not isinstance(section, RectangleSection) or link.geometry.tip_section is not None:
        _reject(path, "surface_patch", "a rectangular section without taper to lie on", "another shape")
    if patches.width > section.width and not isclose(patches.width, section.width):
        _reject(path, "surface_patch.width", f"at most the width of the section, {section.width}", patches.width)
    edges = sorted(patches.edges(link.geometry.length))
    slack = 1e-9 * link.geometry.length
    if edges[0][0] < -slack or edges[-1][1] > link.geometry.length + slack:
        _reject(path, "surface_patch", f"patches within the link, 0 … {link.geometry.length:g} m", edges)
    if any(after[0] < before[1] - slack for before, after in pairwise(edges)):
        _reject(path, "surface_patch", "patches that do not overlap", edges)


def _both_or_neither(value: object) -> str:
    return "neither" if value is None else "both"


def _reject(path: Path, key: str, expected: str, given: object) -> NoReturn:
    raise InputError(f"{path}: {key}: expected {expected}", given)
