"""A link file as records, SI units: what stage 1 reads, checked key by key. `geometry.kind` picks beam or solid."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Discriminator, Field, Tag, model_validator

from ...common.keys import MOST_MODES, ModeCount, Name, NotNegative, Positive, Title, Vector3
from ...common.validation import Record
from ...mesh.records import (
    BeamGeometry,
    BeamMesh,
    PartTables,
    PlaceRecord,
    RectangleSection,
    SectionRecord,
    SolidGeometry,
    SolidMeshRecord,
    SurfacePatches,
)
from .families import FAMILIES, HOLDING_ROOT, Family
from .measured import Measured
from .section import Section, rectangle, tube

Coupling = Literal["mean", "rigid"]
Solver = Literal["slepc", "block-lanczos"]


class InterfaceRecord(PlaceRecord):
    """An interface for joints and loads, with the inertia that is fixed to it: a hub, a gripper."""

    coupling: Coupling | None = None
    """Coupling of a solid's face to the interface: mean motion, or rigid. Default: that of [reference], and "mean" for
    cross sections inside and for a free tip."""
    mass: NotNegative = 0.0
    """Point mass at the interface, kg."""
    inertia: tuple[NotNegative, NotNegative, NotNegative] = (0.0, 0.0, 0.0)
    """Moments of inertia of that mass about x, y, z through the interface, kg·m²."""


Poisson = Annotated[float, Field(gt=-1, lt=0.5)]


class Material(Record):
    """Linear elastic, isotropic."""

    youngs_modulus: Positive
    """Young's modulus E, Pa."""
    density: Positive
    """Density ρ, kg/m³."""
    poissons_ratio: Poisson | None = None
    """Poisson's ratio ν; beams need it for torsion and shear only, solids always. G is E/(2(1 + ν)): carbon fibers
    along a tube have less, which a solid with three moduli describes."""


class OrthotropicMaterial(Record):
    """Linear elastic, with three planes of symmetry along the axes of the link (solids only)."""

    youngs_modulus: tuple[Positive, Positive, Positive]
    """Young's moduli E_x, E_y, E_z, Pa."""
    poissons_ratio: Vector3
    """Poisson's ratios ν_xy, ν_yz, ν_xz: contraction along the second axis under tension along the first."""
    shear_modulus: tuple[Positive, Positive, Positive]
    """Shear moduli G_xy, G_yz, G_xz, Pa."""
    density: Positive
    """Density ρ, kg/m³."""


def _symmetry(material: object) -> str:
    """Return which record a material table is: three Young's moduli make it orthotropic."""
    moduli = (
        material.get("youngs_modulus") if isinstance(material, Mapping) else getattr(material, "youngs_modulus", None)
    )
    return "orthotropic" if isinstance(moduli, list | tuple) else "isotropic"


SolidMaterial = Annotated[
    Annotated[Material, Tag("isotropic")] | Annotated[OrthotropicMaterial, Tag("orthotropic")], Discriminator(_symmetry)
]


class Region(Record):
    """The part of a solid inside a physical volume `group` of its mesh file, of another material."""

    group: Title
    """Name of the physical volume, element set or property in the mesh file; if two overlap, the smaller counts."""
    material: SolidMaterial
    """Material."""


class BeamModel(Record):
    """Beam theory."""

    theory: Literal["euler-bernoulli", "timoshenko"] = "euler-bernoulli"
    """Beam theory: without shear, or with shear and rotary inertia of the sections."""


class Reference(Record):
    """Reference conditions of the link's frame (docs/theory.md, Reference conditions).

    Sections of beams stay plane, so that both kinds of `coupling` are the same there.
    """

    condition: Literal["cantilever", "simply-supported", "craig-bampton"]
    """Reference condition: "cantilever" fixes the frame to the section at the root, "simply-supported" its x axis to
    root and tip. "craig-bampton" fixes it to the root, with fixed-interface modes and constraint modes."""
    coupling: Coupling | None = None
    """Coupling of a solid's end faces, and default of [[interface]]; by default mean for simply-supported, else rigid.
    """

    @property
    def holds_root(self) -> bool:
        """Whether the frame moves with the root's section: the root is clamped."""
        return self.condition in HOLDING_ROOT


class Modes(Record):
    """The lowest `count` eigenmodes of one or several families, or those numbered `indices` (1 is the lowest)."""

    count: ModeCount | None = None
    """Number of the lowest eigenmodes; alternative: `indices`. Default with `attachment_modes`: six of each bending
    family, one axial, one of torsion."""
    indices: Annotated[tuple[ModeCount, ...], Field(min_length=1, max_length=MOST_MODES)] | None = None
    """Numbers of the eigenmodes, 1 the lowest."""
    family: Annotated[tuple[Family, ...], Field(min_length=1)] | Family | Literal["all"] = "all"
    """Family or families of the eigenmodes."""
    attachment_modes: bool = True
    """Addition of static shapes of loads at interfaces, and of torques along a bent link, to the eigenmodes."""
    solver: Solver = "slepc"
    """Solver of the eigenproblem: SLEPc's Krylov–Schur or, of solids, block Lanczos, faster for fine meshes."""


class Damping(Record):
    """Modal damping ratios: one for all modes or one each, or ζ = a/(2ω) + bω/2 of D = aM + bK.

    `of` "robot": one ratio for the vibrations of the assembled robot in its initial posture, motors free.
    """

    ratio: NotNegative | tuple[NotNegative, ...] | None = None
    """Damping ratio ζ of all modes, or of each."""
    rayleigh: tuple[NotNegative, NotNegative] | None = None
    """Rayleigh coefficients a (1/s) and b (s) of D = aM + bK, instead of `ratio`."""
    of: Literal["link", "robot"] = "link"
    """Vibrations that `ratio` applies to: of the link under its reference condition, or of the assembled robot."""


class StressRecovery(Record):
    """Stress output at named `points` (m, link frame), and on the whole `surface` of a solid.

    The modal body file has the stresses of modes and the static ones of unit loads (docs/theory.md, Stresses).
    """

    points: dict[Name, Vector3] = Field(default_factory=dict)
    """Points (m, link axes) by name for stress output."""
    surface: bool = False
    """Stress output on the whole surface of a solid."""


class _Link(Record):
    name: Title
    """Name of the link; in a scene by default that of its body."""
    reference: Reference
    """Reference condition of the link's frame."""
    modes: Modes = Modes.model_construct()
    """Modes of the link; by default six of each bending family, one axial, one of torsion."""
    damping: Damping = Damping.model_construct()
    """Damping of the modes."""
    measured: Measured | None = None
    """Measured natural frequencies and damping ratios instead of computed ones."""
    interface: tuple[InterfaceRecord, ...] = ()
    """Interfaces for joints and loads in addition to `root` and `tip`."""
    stress: StressRecovery = StressRecovery.model_construct()
    """Points and surfaces for stress output."""

    @model_validator(mode="after")
    def _has_constraint_modes(self) -> Self:
        if self.reference.condition == "craig-bampton" and not self.modes.attachment_modes:
            raise ValueError(
                'modes.attachment_modes: expected true, or nothing, with condition = "craig-bampton", whose constraint'
                " modes replace them, found false"
            )
        return self

    @property
    def families(self) -> tuple[Family, ...]:
        """The mode families asked for."""
        wanted = (self.modes.family,) if isinstance(self.modes.family, str) else self.modes.family
        return tuple(family for family in FAMILIES if family in wanted or "all" in wanted)


class BeamLink(_Link):
    """A whole link file with `geometry.kind = "beam"`."""

    material: Material
    """Material."""
    geometry: BeamGeometry
    """Length and cross section."""
    mesh: BeamMesh
    """Finite elements."""
    model: BeamModel = BeamModel.model_construct()
    """Beam theory."""

    @property
    def shapes(self) -> list[SectionRecord]:
        """The cross section of each segment, from root to tip."""
        records = [segment.section for segment in self.geometry.segment or ()]
        return records if self.geometry.section is None else [*records, self.geometry.section]

    @property
    def sections(self) -> list[Section]:
        """Section properties of each segment. Without Poisson's ratio, `torsion` and `shear`, unused, are for ν = 0."""
        nu = self.material.poissons_ratio or 0.0
        return [
            rectangle(record.height, record.width, nu)
            if isinstance(record, RectangleSection)
            else tube(record.outer, record.inner, nu)
            for record in self.shapes
        ]

    @property
    def places(self) -> dict[str, float]:
        """Position of every interface, root and tip too, by name: m from the root."""
        named = {item.name: item.position for item in self.interface if isinstance(item.position, float)}
        return {"root": 0.0, "tip": self.geometry.length} | named


class SolidLink(_Link):
    """A whole link file with `geometry.kind = "solid"`."""

    material: SolidMaterial
    """Material."""
    region: tuple[Region, ...] = ()
    """Parts of another material."""
    geometry: SolidGeometry
    """Shape, extruded along x or from a file."""
    mesh: SolidMeshRecord = SolidMeshRecord.model_construct()
    """Mesh; by default chosen for the part."""
    surface_patch: SurfacePatches | None = None
    """Outlines of piezoelectric patches in the mesh."""

    @property
    def coupling(self) -> Coupling:
        """Coupling of the end faces to the supports of the reference condition, "rigid" or "mean"."""
        return self.reference.coupling or ("rigid" if self.reference.holds_root else "mean")

    def part(self, path: Path) -> PartTables:
        """The tables that determine the mesh; `path` is the link file."""
        return PartTables(path, self.geometry, self.mesh, self.interface, self.surface_patch)

    @property
    def couplings(self) -> dict[str, Coupling]:
        """Coupling, "rigid" or "mean", of each interface to its face; of interior cross sections always "mean".

        By default it is that of [reference]; of a tip without support "mean".
        """
        tip: Coupling = "mean" if self.reference.holds_root else self.coupling
        couplings: dict[str, Coupling] = {"root": self.coupling, "tip": tip}
        for record in self.interface:
            inside = isinstance(record.position, float)
            couplings[record.name] = "mean" if inside else record.coupling or couplings.get(record.name, self.coupling)
        return couplings


Link = BeamLink | SolidLink
LinkInScene = str | Link
"""Of a body: a link file, or its keys."""
