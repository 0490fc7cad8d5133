"""The tables of a link file that say what a link looks like: geometry, mesh, places. No mesh library is loaded.

A stepped beam gives `[[geometry.segment]]` tables in place of `section`: each with the `section` that holds from the
end of the segment before (from the root, for the first) to `until` (m from the root); the last one ends at `length`.
`[mesh] nodes = [0.0, …, length]` sets the element boundaries of a beam one by one in place of `elements`.

A solid has a `section` as a beam has, drawn out along x, or comes from a `file`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from ..common.names import Name, Title
from ..common.numbers import NotNegative, Positive, Vector3
from ..common.validation import InputFile, Record

MOST_ELEMENTS = 100_000  # of a beam
MOST_DIVISIONS = 10_000  # of a solid along an axis
Division = Annotated[int, Field(ge=1, le=MOST_DIVISIONS)]


class RectangleSection(Record):
    """Rectangle; hollow where `wall` is given (solids only)."""

    shape: Literal["rectangle"]
    height: Positive  # along y, m
    width: Positive  # along z, m
    wall: Positive | None = None  # thickness, m


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

    elements: Annotated[int, Field(ge=1, le=MOST_ELEMENTS)] | None = None
    nodes: Annotated[tuple[float, ...], Field(min_length=2)] | None = None  # m from the root


class Hole(Record):
    """A round hole along z, through the whole width of a solid."""

    position: Positive  # of its centre, m from the root
    diameter: Positive  # m
    offset: float = 0.0  # y of its centre, m


class SolidGeometry(Record):
    """A section drawn out along x, or a part from a file (`.step`, or a mesh: `.msh`, `.inp`, `.bdf`, `.vtk` …)."""

    kind: Literal["solid"]
    length: Positive  # m
    section: SectionRecord | None = None
    tip_section: SectionRecord | None = None  # the section then changes linearly from root to tip
    hole: tuple[Hole, ...] = ()
    file: InputFile | None = None
    unit: Literal["m", "mm", "in"] = "m"  # of the file's coordinates
    # Where the link's frame stands in the file's axes: origin in the file's unit, directions of any length.
    origin: Vector3 = (0.0, 0.0, 0.0)
    x_axis: Vector3 = (1.0, 0.0, 0.0)
    y_axis: Vector3 = (0.0, 1.0, 0.0)


class SolidMeshRecord(Record):
    """How a solid is meshed; a part that comes as a mesh takes `order` alone.

    `size` is the wanted edge length; `divisions` (along x, y, z) makes a structured mesh, of boxes only. `order` is the
    polynomial order of the displacements; curved faces get curved elements.
    """

    cell: Literal["tetrahedron", "hexahedron"] | None = None
    order: Annotated[int, Field(ge=1, le=3)] | None = None
    size: Positive | None = None  # m
    divisions: tuple[Division, Division, Division] | None = None


class PlaceRecord(Record):
    """A place on a link: where an interface is.

    A beam's `position` is a number, m from the root. A solid's place is a face: that of a physical `group` of the
    mesh file, or the one nearest to the point `position` (m, link frame) that faces along `normal`; a number as
    `position` is the cross section at that distance from the root. The faces of `root` and `tip` need no table: they
    are the plane faces at x = 0 and x = length, unless a table of that name says otherwise.
    """

    name: Name
    position: NotNegative | Vector3 | None = None
    normal: Vector3 | None = None  # outward
    group: Title | None = None


@dataclass(frozen=True)
class Outlines:
    """Rectangles to outline in the mesh of a solid, on the faces at its largest or smallest y, about z = 0.

    Attributes:
        edges: begin and end of each along x, m from the root.
        width: of all along z, m.
        faces: "top" at the largest y, "bottom" at the smallest.
    """

    edges: tuple[tuple[float, float], ...]
    width: float
    faces: Literal["top", "bottom", "both"] = "both"
