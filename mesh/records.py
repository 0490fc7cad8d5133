"""Tables of a link file for geometry, mesh and places, SI units. No mesh library is loaded."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from ..common.keys import MOST_PATCHES, Name, NotNegative, PatchCount, Positive, Title, Vector3
from ..common.structs import struct
from ..common.validation import InputFile, Record
from .cells import CellName

MOST_ELEMENTS = 100_000  # of a beam
MOST_DIVISIONS = 10_000  # of a solid along an axis
Division = Annotated[int, Field(ge=1, le=MOST_DIVISIONS)]


class RectangleSection(Record):
    """Rectangle; hollow with `wall` (solids only)."""

    shape: Literal["rectangle"]
    height: Positive
    """Height along y, m."""
    width: Positive
    """Width along z, m."""
    wall: Positive | None = None
    """Wall thickness of a hollow section, m; default: full (solids only)."""


class CircleSection(Record):
    """Solid circle."""

    shape: Literal["circle"]
    diameter: Positive
    """Diameter, m."""

    @property
    def outer(self) -> float:
        """The diameter, m, as of a tube."""
        return self.diameter

    @property
    def inner(self) -> float:
        """Inner diameter, m: 0."""
        return 0.0


class TubeSection(Record):
    """Circular tube."""

    shape: Literal["tube"]
    outer: Positive
    """Outer diameter, m."""
    inner: Positive
    """Inner diameter, m."""


SectionRecord = Annotated[RectangleSection | CircleSection | TubeSection, Field(discriminator="shape")]


def extents(section: SectionRecord | None) -> tuple[float, float]:
    """Extents of a section along y and z, m; 0 without section."""
    if isinstance(section, RectangleSection):
        return section.height, section.width
    return (section.outer, section.outer) if section else (0.0, 0.0)


class Segment(Record):
    """A segment of a beam with constant section."""

    until: Positive
    """End, m from the root; a segment begins at the end of the previous one, and the last ends at `length`."""
    section: SectionRecord
    """Cross section."""


class BeamGeometry(Record):
    """A straight beam along x, of one section or of several in a row."""

    kind: Literal["beam"]
    length: Positive
    """Length from root to tip, m."""
    section: SectionRecord | None = None
    """Cross section of the whole beam; alternative: `segment`."""
    segment: Annotated[tuple[Segment, ...], Field(min_length=1)] | None = None
    """Segments of constant section from root to tip, instead of `section`."""

    @property
    def breakpoints(self) -> list[float]:
        """Ends of the stretches of constant section, m from the root: 0, …, length."""
        if self.segment is None:
            return [0.0, self.length]
        return [0.0, *(segment.until for segment in self.segment)]


class BeamMesh(Record):
    """Element boundaries: `elements`, of equal length between steps of the section, or the list of `nodes`."""

    elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] | None = None
    """Number of elements, of equal length between steps of the section; alternative to `nodes`."""
    nodes: Annotated[tuple[float, ...], Field(min_length=2)] | None = None
    """Element boundaries, m from the root: 0 first, `length` last."""


class Hole(Record):
    """A round hole along z, through the whole width of a solid."""

    position: Positive
    """Position of the center, m from the root along x."""
    diameter: Positive
    """Diameter, m."""
    offset: float = 0.0
    """Offset of the center along y, m."""


class SolidGeometry(Record):
    """An extruded section along x, or a part from a file (`.step`, or a mesh: `.msh`, `.inp`, `.bdf`, `.vtk` …)."""

    kind: Literal["solid"]
    length: Positive
    """Length from root to tip along x, m."""
    section: SectionRecord | None = None
    """Cross section, extruded along x; alternative: `file`."""
    tip_section: SectionRecord | None = None
    """Cross section at the tip: from root to tip it changes linearly."""
    hole: tuple[Hole, ...] = ()
    """Round holes along z."""
    file: InputFile | None = None
    """STEP file or mesh (.msh, .inp, .bdf, .vtk …) instead of `section`."""
    unit: Literal["m", "mm", "in"] = "m"
    """Unit of the coordinates in `file`."""
    origin: Vector3 = (0.0, 0.0, 0.0)
    """Root of the link in the axes of `file`, in its unit."""
    x_axis: Vector3 = (1.0, 0.0, 0.0)
    """Direction of the link's x axis in the axes of `file`, of any length."""
    y_axis: Vector3 = (0.0, 1.0, 0.0)
    """Direction of the link's y axis in the axes of `file`, of any length."""


class SolidMeshRecord(Record):
    """Mesh of a solid; for a part from a mesh file `order` only.

    Curved faces get curved elements.
    """

    cell: Literal["tetrahedron", "hexahedron"] | None = None
    """Shape of the cells; by default hexahedra with `divisions`, else tetrahedra."""
    order: Annotated[int, Field(ge=1, le=3)] | None = None
    """Polynomial order of the displacements."""
    size: Positive | None = None
    """Requested edge length of cells, m; by default chosen for the part."""
    divisions: tuple[Division, Division, Division] | None = None
    """Number of cells along x, y, z: a structured mesh, of boxes only."""


class PlaceRecord(Record):
    """A place on a link: where an interface is.

    Without tables `root` and `tip` are the plane faces at x = 0 and x = length.
    """

    name: Name
    """Name of the interface; joints and loads refer to it as "BODY.NAME"."""
    position: NotNegative | Vector3 | None = None
    """Position, m from the root (solids: cross section there), or a point (m, link axes) whose nearest face is the
    interface."""
    normal: Vector3 | None = None
    """Outward direction of the face nearest to `position`, link axes (solids)."""
    group: Title | None = None
    """Physical surface group of the mesh file with the face (solids)."""


class SurfacePatches(Record):
    """Piezoelectric patches outlined in the mesh of a solid.

    Keys are as in a scene's `[[pzt]]`: centers at (k − ½)·length of link / count, k = 1 … count, or `centers`.
    """

    count: PatchCount | None = None
    """Number of patches, evenly spaced; alternative: `centers`."""
    centers: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=MOST_PATCHES)] | None = None
    """Centers, m from the root."""
    length: Positive
    """Length of a patch along x, m."""
    width: Positive
    """Width of a patch along z, m."""
    faces: Literal["top", "bottom", "both"] = "both"
    """Faces with patches: at the largest y, the smallest y, or both."""

    def edges(self, length: float) -> list[tuple[float, float]]:
        """Begin and end of each patch on a link of `length`, m from the root."""
        count = self.count or 1
        centers = self.centers or [(k + 0.5) * length / count for k in range(count)]
        return [(center - self.length / 2, center + self.length / 2) for center in centers]


@struct
class PartTables:
    """Tables of a link file that determine the mesh of a part."""

    path: Path  # of the link file: messages name it
    geometry: SolidGeometry
    mesh: SolidMeshRecord = SolidMeshRecord.model_construct()
    places: Sequence[PlaceRecord] = ()  # tables `interface`
    patches: SurfacePatches | None = None  # to outline in the mesh


# Elements along a full circle of a curved face, and along that of a solid bar: there, where a cell has two edges on the
# circle, it cannot follow it between them. With these a bar lacks 0.03 % of its volume, a part with holes 0.002 %.
CIRCLE = 12
# How much larger an element may be at unit distance from a curved face.
GROWTH = 0.4

# Wanted edge length in hydraulic diameters, by order of the displacements.
_SIZE = {1: 0.25, 2: 0.6, 3: 1.5}


def default_order(cell: CellName) -> int:
    """Default polynomial order of the displacements in cells of this shape."""
    return 3 if cell == "tetrahedron" else 2


def default_size(volume: float, surface: float, order: int) -> float:
    """Default edge length, m, for a part of `volume` (m³) and `surface` (m²) and displacements of this order.

    It is in proportion to the hydraulic diameter 4 V/A: about the smaller side of a solid bar's section, twice the
    thickness of a wall.
    """
    return _SIZE[order] * 4 * volume / surface
