"""The link file: read, and checked for all that one key alone cannot tell (the records check the keys)."""

from collections.abc import Iterator
from itertools import chain, pairwise
from math import isclose

import numpy as np

from ..common.errors import InputError
from ..common.validation import Record, validate
from ..mesh.records import RectangleSection, SectionRecord, SolidGeometry, TubeSection, extents
from .beam.section_stress import contains
from .link_records.families import DEFAULT_COUNT, FAMILIES
from .link_records.link import BeamLink, Link, Material, OrthotropicMaterial, SolidLink
from .link_records.measured import read_measured
from .link_source import LinkSource, link_keys, link_path
from .solid.constitutive import is_stable

Slips = Iterator[tuple[str, str, object]]
"""What is wrong in a link file: key, what is expected, and what is there instead. The first one counts."""


def read_link(source: LinkSource) -> Link:
    """Read and check a link file. Raises `InputError`, with file and key, for what is wrong in it."""
    data, path = link_keys(source), link_path(source)
    geometry = data.get("geometry")
    kind = geometry.get("kind", "beam") if isinstance(geometry, dict) else "beam"
    link: Link
    if kind == "beam":
        link = beam = validate(BeamLink, data, path)
        slips = chain(_beam_geometry(beam), _beam_mesh(beam), _beam_interfaces(beam))
        of_kind = chain(_beam_material(beam), _beam_stress(beam))
    elif kind == "solid":
        link = solid = validate(SolidLink, data, path)
        slips = chain(_shape(solid), _holes(solid.geometry), _solid_mesh(solid), _solid_interfaces(solid))
        of_kind = chain(_solid_materials(solid), _surface_patches(solid))
    else:
        raise InputError(f'{path}: geometry.kind: expected "beam" or "solid"', repr(kind))
    for key, expected, given in chain(slips, _places(link), _modes(link), _measured(link), of_kind):
        raise InputError(f"{path}: {key}: expected {expected}", given)
    return link


def _beam_geometry(link: BeamLink) -> Slips:
    geometry = link.geometry
    yield from _one_of("geometry", geometry, "section", "segment", "[[geometry.segment]]")
    ends = [segment.until for segment in geometry.segment or ()]
    if any(after - before <= 1e-9 * geometry.length for before, after in pairwise([0.0, *ends])):
        yield "geometry.segment", "ascending values of until, apart by more than 1e-9 of the length", ends
    if ends and ends[-1] != geometry.length:
        yield "geometry.segment", f"the last until at the length, {geometry.length}", ends[-1]
    for record in [geometry.section, *(segment.section for segment in geometry.segment or ())]:
        yield from _section(record)
        if isinstance(record, RectangleSection) and record.wall is not None:
            yield "geometry.section.wall", 'no wall where geometry.kind = "beam"', record.wall


def _section(record: SectionRecord | None) -> Slips:
    if isinstance(record, TubeSection) and record.inner >= record.outer:
        yield "geometry.section.inner", f"less than outer, {record.outer}", record.inner
    if isinstance(record, RectangleSection) and record.wall is not None:
        half = min(record.height, record.width) / 2
        if record.wall >= half:
            yield "geometry.section.wall", f"less than half of height and width, {half:g}", record.wall


def _beam_mesh(link: BeamLink) -> Slips:
    breakpoints, length = link.geometry.breakpoints, link.geometry.length
    mesh = link.mesh
    yield from _one_of("mesh", mesh, "elements", "nodes")
    if mesh.elements is not None and mesh.elements < len(breakpoints) - 1:
        yield "mesh.elements", f"at least one per segment, {len(breakpoints) - 1}", mesh.elements
    if mesh.nodes is None:
        return
    if any(after - before <= 1e-9 * length for before, after in pairwise(mesh.nodes)):
        yield "mesh.nodes", "strictly ascending positions, apart by more than 1e-9 of the length", mesh.nodes
    if mesh.nodes[0] != 0.0 or mesh.nodes[-1] != length:
        yield "mesh.nodes", f"from 0 to the length, {length}", f"{mesh.nodes[0]} to {mesh.nodes[-1]}"
    missing = [point for point in breakpoints if point not in mesh.nodes]
    if missing:
        yield "mesh.nodes", f"a node at every step of the section, {missing} too", mesh.nodes


def _beam_interfaces(link: BeamLink) -> Slips:
    for interface in link.interface:
        key = f"interface.{{}} of {interface.name}"
        for name in ("normal", "group"):
            if getattr(interface, name) is not None:
                yield key.format(name), f"no {name} on a beam", getattr(interface, name)
        if interface.name in ("root", "tip"):
            if interface.position is not None:
                yield key.format("position"), "none: it is an end of the beam", interface.position
        elif not isinstance(interface.position, float):
            yield key.format("position"), "one number, m from the root", interface.position


def _places(link: Link) -> Slips:
    """Names differ; interfaces at one place cannot move by themselves, as those of Craig–Bampton modes do."""
    names = {"mid"}  # under which results have the point at exactly half length
    for interface in link.interface:
        if interface.name in names:
            yield "interface.name", f"a name besides {', '.join(sorted(names))}", interface.name
        names.add(interface.name)
        if isinstance(interface.position, float) and interface.position > link.geometry.length:
            key = f"interface.position of {interface.name}"
            yield key, f"within the length, {link.geometry.length}", interface.position
    if link.reference.condition != "craig-bampton":
        return
    taken: dict[object, str] = {}
    by_record = {record.name: record.group or record.position for record in link.interface}
    for name, place in (link.places if isinstance(link, BeamLink) else by_record).items():
        near = round(place / link.geometry.length, 9) if isinstance(place, float) else place
        if near is not None and near in taken:
            expected = f'a place apart from {taken[near]} with condition = "craig-bampton"'
            yield f"interface.position of {name}", expected, place
        taken[near] = name


def _modes(link: Link) -> Slips:
    modes, damping = link.modes, link.damping
    yield from _one_of("modes", modes, "count", "indices", needed=not modes.attachment_modes)
    if modes.indices and sorted(set(modes.indices)) != list(modes.indices):
        yield "modes.indices", "ascending numbers, each once", modes.indices
    yield from _one_of("damping", damping, "ratio", "rayleigh", needed=False)
    if damping.of == "robot" and not isinstance(damping.ratio, float):
        given = damping.rayleigh if damping.ratio is None else damping.ratio
        yield "damping", 'one ratio, with of = "robot"', "none" if given is None else given
    number = modes.count or len(modes.indices or ()) or sum(DEFAULT_COUNT[family] for family in link.families)
    if isinstance(damping.ratio, tuple) and len(damping.ratio) != number:
        yield "damping.ratio", f"one number, or one for each of the {number} modes", len(damping.ratio)


def _measured(link: Link) -> Slips:
    if link.measured is None:
        return
    rows = read_measured(link.measured.table, FAMILIES)
    if link.damping.of == "robot" and any(row.damping_ratio is not None for row in rows):
        yield "measured", 'no damping_ratio with damping.of = "robot"', f"some in {link.measured.table}"


def _beam_material(link: BeamLink) -> Slips:
    bends = any(family.endswith("bending") for family in link.families)
    shear = bends and link.model.theory == "timoshenko"
    use = "torsion" if "torsion" in link.families else "shear" if shear else "strains" if link.stress.points else None
    if use and link.material.poissons_ratio is None:
        yield "material.poissons_ratio", f"a value, for {use} (modes.family = {link.modes.family!r})", "none"


def _beam_stress(link: BeamLink) -> Slips:
    if link.stress.surface:
        yield "stress.surface", "points, not a surface, on a beam", "true"
    for name, (x, y, z) in link.stress.points.items():
        key, length = f"stress.points.{name}", link.geometry.length
        if not 0.0 <= x <= length:
            yield key, f"x within the length, 0 … {length:g} m", f"{x:g} m"
        shape = link.shapes[int(np.searchsorted(link.geometry.breakpoints[1:-1], x, side="right"))]
        if not contains(shape, y, z):
            yield key, f"y, z within the section, a {shape.shape}, at x = {x:g} m", f"{y:g}, {z:g} m"


def _shape(link: SolidLink) -> Slips:
    geometry = link.geometry
    yield from _one_of("geometry", geometry, "section", "file")
    yield from _section(geometry.section)
    tip = geometry.tip_section
    if tip is not None and (
        not isinstance(tip, RectangleSection)
        or not isinstance(geometry.section, RectangleSection)
        or tip.wall is not None
        or geometry.section.wall is not None
    ):
        yield "geometry.tip_section", "a taper between two rectangles without wall", "another shape"
    if geometry.file is not None and geometry.hole:
        yield "geometry.hole", "no holes if geometry.file names a part", len(geometry.hole)
    sizes = np.linalg.norm(geometry.x_axis) * np.linalg.norm(geometry.y_axis)
    if np.linalg.norm(np.cross(geometry.x_axis, geometry.y_axis)) <= 1e-6 * sizes:
        yield "geometry.y_axis", f"a direction across x_axis, {list(geometry.x_axis)}", list(geometry.y_axis)


def _holes(geometry: SolidGeometry) -> Slips:
    """Holes stay within the outline of the side view; that of a taper is taken at the narrower side of each hole."""
    heights = [extents(section)[0] for section in (geometry.section, geometry.tip_section or geometry.section)]
    for hole in geometry.hole:
        radius = hole.diameter / 2
        begin, end = hole.position - radius, hole.position + radius
        if begin <= 0 or end >= geometry.length:
            expected = f"holes within the length, 0 … {geometry.length:g} m"
            yield "geometry.hole.position", expected, f"{begin:g} … {end:g}"
        height = min(np.interp([begin, end], [0.0, geometry.length], heights))
        low, high = hole.offset - radius, hole.offset + radius
        if max(-low, high) >= height / 2:
            expected = f"holes within ±{height / 2:g} m of the axis"
            yield "geometry.hole.diameter", expected, f"{low:g} … {high:g}"


def _solid_mesh(link: SolidLink) -> Slips:
    geometry, mesh = link.geometry, link.mesh
    yield from _one_of("mesh", mesh, "size", "divisions", needed=False)
    plain = isinstance(geometry.section, RectangleSection) and geometry.section.wall is None and not geometry.hole
    if mesh.divisions is not None and not plain:
        yield "mesh.divisions", "a box, of one section or tapered, for a structured mesh", "another shape"
    if mesh.cell == "hexahedron" and not plain:
        yield "mesh.cell", '"tetrahedron", since hexahedra are made in boxes only', '"hexahedron"'
    if mesh.divisions is not None and link.surface_patch is not None:
        yield "mesh.divisions", "size in its place, where patches are outlined in the mesh", "both"


def _solid_interfaces(link: SolidLink) -> Slips:
    for interface in link.interface:
        key = f"interface.{{}} of {interface.name}"
        is_end = interface.name in ("root", "tip")
        yield from _one_of(key.format("position"), interface, "group", "position", needed=not is_end)
        if interface.normal is not None and not isinstance(interface.position, tuple):
            yield key.format("normal"), "it only with a position of three numbers", interface.position
        if isinstance(interface.position, tuple) and interface.normal is None:
            yield key.format("normal"), "the outward normal of the face at position", "none"
        if isinstance(interface.position, float) and interface.coupling == "rigid":
            yield key.format("coupling"), '"mean" for a cross section inside the part', '"rigid"'
        is_supported = interface.name == "root" or (interface.name == "tip" and not link.reference.holds_root)
        if is_supported and interface.coupling == "mean" and link.coupling == "rigid":
            expected = '"rigid", or coupling = "mean" in [reference], which holds this face'
            yield key.format("coupling"), expected, '"mean"'


def _solid_materials(link: SolidLink) -> Slips:
    for key, material in [("material", link.material), *((f"region {r.group}", r.material) for r in link.region)]:
        if isinstance(material, Material) and material.poissons_ratio is None:
            yield f"{key}.poissons_ratio", "a value: solids need it", "none"
        if isinstance(material, OrthotropicMaterial) and not is_stable(material):
            yield f"{key}.poissons_ratio", "ratios that leave the energy positive", material.poissons_ratio
    if link.region and link.geometry.file is None:
        yield "region", "geometry.file, a mesh with that physical volume group", "a generated shape"


def _surface_patches(link: SolidLink) -> Slips:
    patches = link.surface_patch
    if patches is None:
        return
    yield from _one_of("surface_patch", patches, "count", "centers")
    section = link.geometry.section
    if not isinstance(section, RectangleSection) or link.geometry.tip_section is not None:
        yield "surface_patch", "a rectangular section without taper to lie on", "another shape"
        return
    if patches.width > section.width and not isclose(patches.width, section.width):
        yield "surface_patch.width", f"at most the width of the section, {section.width}", patches.width
    edges = sorted(patches.edges(link.geometry.length))
    slack = 1e-9 * link.geometry.length
    if edges[0][0] < -slack or edges[-1][1] > link.geometry.length + slack:
        yield "surface_patch", f"patches within the link, 0 … {link.geometry.length:g} m", edges
    if any(after[0] < before[1] - slack for before, after in pairwise(edges)):
        yield "surface_patch", "patches that do not overlap", edges


def _one_of(key: str, record: Record, first: str, second: str, words: str = "", needed: bool = True) -> Slips:
    """Both of two keys, the second of which may have other `words`, or neither where one is `needed`."""
    given = [getattr(record, name) is not None for name in (first, second)]
    if all(given) or (needed and not any(given)):
        yield key, f"either {first} or {words or second}", "both" if all(given) else "neither"
