"""The tables of a link file that say what is attached to a link: masses at its interfaces, patches on its surface."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from ...common.numbers import MOST_PATCHES, NotNegative, PatchCount, Positive
from ...common.validation import Record
from ...mesh.records import Outlines, PlaceRecord

Coupling = Literal["mean", "rigid"]


class InterfaceRecord(PlaceRecord):
    """An interface for joints and loads, with the inertia that is fixed to it: a hub, a gripper."""

    coupling: Coupling | None = None
    """Coupling of a solid's face to the interface: mean motion, or rigid. Default: that of [reference], and "mean" for
    cross sections inside and for a free tip."""
    mass: NotNegative = 0.0
    """Point mass at the interface, kg."""
    inertia: tuple[NotNegative, NotNegative, NotNegative] = (0.0, 0.0, 0.0)
    """Moments of inertia of that mass about x, y, z through the interface, kg·m²."""


class SurfacePatches(Record):
    """Piezoelectric patches outlined in the mesh of a solid, on the faces at its largest or smallest y.

    Same meaning of the keys as in a scene's `[[pzt]]`: centers at (k − ½)·length of link / count, or `centers`.
    """

    count: PatchCount | None = None
    """Number of patches, evenly spaced; alternative: `centers`."""
    # m from the root
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

    def outlines(self, length: float) -> Outlines:
        """What the mesh of a solid of `length` (m) outlines for them."""
        return Outlines(tuple(self.edges(length)), self.width, self.faces)
