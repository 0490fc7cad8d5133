"""The link file: what stage 1 reads, checked key by key.

A stepped beam gives `[[geometry.segment]]` tables in place of `section`: each with the `section` that holds from the
end of the segment before (from the root, for the first) to `until` (m from the root); the last one ends at `length`.
`[mesh] nodes = [0.0, …, length]` sets the element boundaries one by one in place of `elements`.
"""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal, NoReturn

from pydantic import Field

from ..errors import InputError
from ..validation import Record, load_toml, validate
from .section import Section, rectangle, tube

Positive = Annotated[float, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0)]
Family = Literal["in-plane-bending", "out-of-plane-bending", "axial", "torsion"]

FAMILIES: tuple[Family, ...] = ("in-plane-bending", "out-of-plane-bending", "axial", "torsion")


class Material(Record):
    """Linear elastic, isotropic."""

    youngs_modulus: Positive  # Pa
    density: Positive  # kg/m³
    # Needed for torsion and shear only.
    poissons_ratio: Annotated[float, Field(gt=-1, lt=0.5)] | None = None


class RectangleSection(Record):
    """Solid rectangle."""

    shape: Literal["rectangle"]
    height: Positive  # along y, m
    width: Positive  # along z, m


class CircleSection(Record):
    """Solid circle."""

    shape: Literal["circle"]
    diameter: Positive  # m


class TubeSection(Record):
    """Circular tube."""

    shape: Literal["tube"]
    outer: Positive  # diameter, m
    inner: Positive  # diameter, m


SectionRecord = Annotated[RectangleSection | CircleSection | TubeSection, Field(discriminator="shape")]


class Segment(Record):
    """A stretch of constant section."""

    until: Positive  # m from the root
    section: SectionRecord


class BeamGeometry(Record):
    """A straight beam along x, of one section or of several in a row."""

    kind: Literal["beam"]
    length: Positive  # m
    section: SectionRecord | None = None
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)] | None = None

    @property
    def breakpoints(self) -> list[float]:
        """Ends of the stretches of constant section, m from the root: 0, …, length."""
        if self.segment is None:
            return [0.0, self.length]
        return [0.0, *(segment.until for segment in self.segment)]


class BeamMesh(Record):
    """Element boundaries: `elements` of them as equal as the steps of the section allow, or the list of `nodes`."""

    elements: Annotated[int, Field(ge=1, le=100_000)] | None = None
    nodes: Annotated[tuple[float, ...], Field(min_length=2)] | None = None  # m from the root


class BeamModel(Record):
    """Which beam theory."""

    theory: Literal["euler-bernoulli", "timoshenko"] = "euler-bernoulli"


class Reference(Record):
    """How the link's frame is held to it (formulation.md, section 2)."""

    condition: Literal["cantilever", "simply-supported"]
    # A beam's section moves as a plate in any case: for beams both words mean the same.
    coupling: Literal["mean", "rigid"] | None = None


class Modes(Record):
    """The lowest `count` modes of a family, or those numbered `indices` (1 is the lowest)."""

    count: Annotated[int, Field(ge=1)] | None = None
    indices: Annotated[tuple[Annotated[int, Field(ge=1)], ...], Field(min_length=1)] | None = None
    family: Family | Literal["all"] = "all"


class Damping(Record):
    """Modal damping ratios: one for all modes or one each, or ζ = a/(2ω) + bω/2 of D = aM + bK."""

    ratio: NotNegative | tuple[NotNegative, ...] | None = None
    rayleigh: tuple[NotNegative, NotNegative] | None = None


class NamedInterface(Record):
    """A point of the axis where joints and loads attach, besides root and tip."""

    name: Annotated[str, Field(pattern=r"^[A-Za-z_][A-Za-z0-9_-]*$")]
    position: NotNegative  # m from the root
    coupling: Literal["mean", "rigid"] | None = None


class BeamLink(Record):
    """A whole link file with `geometry.kind = "beam"`."""

    name: Annotated[str, Field(min_length=1)]
    material: Material
    geometry: BeamGeometry
    mesh: BeamMesh
    model: BeamModel = BeamModel()
    reference: Reference
    modes: Modes
    damping: Damping = Damping()
    interface: tuple[NamedInterface, ...] = ()

    @property
    def families(self) -> tuple[Family, ...]:
        """The mode families asked for."""
        return FAMILIES if self.modes.family == "all" else (self.modes.family,)

    @property
    def sections(self) -> list[Section]:
        """Section properties of each segment. Without Poisson's ratio, J and k belong to ν = 0: nothing uses them."""
        nu = self.material.poissons_ratio or 0.0
        records = [segment.section for segment in self.geometry.segment or ()]
        if self.geometry.section is not None:
            records.append(self.geometry.section)
        return [_properties(record, nu) for record in records]


# A solid link adds its record here: `kind` picks what the whole file must look like, mesh and model included.
_RECORDS: dict[str, type[BeamLink]] = {"beam": BeamLink}


def read_link(path: Path) -> BeamLink:
    """Read and check the link file at `path`.

    Raises:
        InputError: the file cannot be read, a key is unknown or missing, or a value is wrong; names file and key.
    """
    data = load_toml(path, "link file")
    geometry = data.get("geometry")
    kind = geometry.get("kind", "beam") if isinstance(geometry, dict) else "beam"
    if kind == "solid":
        raise InputError(f'{path}: geometry.kind: solid links are not available yet, expected "beam", found "solid"')
    link = validate(_RECORDS.get(kind, BeamLink) if isinstance(kind, str) else BeamLink, data, path)
    for check in (_check_geometry, _check_mesh, _check_interfaces, _check_modes, _check_material):
        check(link, path)
    return link


def _check_geometry(link: BeamLink, path: Path) -> None:
    geometry = link.geometry
    if (geometry.section is None) == (geometry.segment is None):
        _reject(path, "geometry", "either section or [[geometry.segment]]", _both_or_neither(geometry.section))
    ends = [segment.until for segment in geometry.segment or ()]
    if any(after - before <= 1e-9 * geometry.length for before, after in pairwise([0.0, *ends])):
        _reject(path, "geometry.segment", "ascending values of until, apart by more than 1e-9 of the length", ends)
    if ends and ends[-1] != geometry.length:
        _reject(path, "geometry.segment", f"the last until at the length, {geometry.length}", ends[-1])
    for record in [geometry.section, *(segment.section for segment in geometry.segment or ())]:
        if isinstance(record, TubeSection) and record.inner >= record.outer:
            _reject(path, "geometry.section.inner", f"less than outer, {record.outer}", record.inner)


def _check_mesh(link: BeamLink, path: Path) -> None:
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


def _check_interfaces(link: BeamLink, path: Path) -> None:
    # `mid` is the name under which results give the point at exactly half length.
    taken = {"root", "tip", "mid"}
    for interface in link.interface:
        if interface.name in taken:
            _reject(path, "interface.name", f"a name besides {', '.join(sorted(taken))}", interface.name)
        if interface.position > link.geometry.length:
            expected = f"within the length, {link.geometry.length}"
            _reject(path, f"interface.position of {interface.name}", expected, interface.position)
        taken.add(interface.name)


def _check_modes(link: BeamLink, path: Path) -> None:
    modes, damping = link.modes, link.damping
    if (modes.count is None) == (modes.indices is None):
        _reject(path, "modes", "either count or indices", _both_or_neither(modes.count))
    if modes.indices and sorted(set(modes.indices)) != list(modes.indices):
        _reject(path, "modes.indices", "ascending numbers, each once", modes.indices)
    if damping.ratio is not None and damping.rayleigh is not None:
        _reject(path, "damping", "either ratio or rayleigh", "both")
    number = modes.count or len(modes.indices or ())
    if isinstance(damping.ratio, tuple) and len(damping.ratio) != number:
        _reject(path, "damping.ratio", f"one number, or one for each of the {number} modes", len(damping.ratio))


def _check_material(link: BeamLink, path: Path) -> None:
    bends = any(family.endswith("bending") for family in link.families)
    shear = bends and link.model.theory == "timoshenko"
    use = "torsion" if "torsion" in link.families else "shear" if shear else None
    if use and link.material.poissons_ratio is None:
        _reject(path, "material.poissons_ratio", f"a value, for {use} (modes.family = {link.modes.family!r})", "none")


def _properties(record: RectangleSection | CircleSection | TubeSection, nu: float) -> Section:
    if isinstance(record, RectangleSection):
        return rectangle(record.height, record.width, nu)
    if isinstance(record, CircleSection):
        return tube(record.diameter, 0.0, nu)
    return tube(record.outer, record.inner, nu)


def _both_or_neither(value: object) -> str:
    return "neither" if value is None else "both"


def _reject(path: Path, key: str, expected: str, found: object) -> NoReturn:
    raise InputError(f"{path}: {key}: expected {expected}, found {found}")
