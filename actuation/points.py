"""Keys of actuation points of planar scenes."""

from __future__ import annotations

from collections.abc import Iterator

from ..common.validation import Record
from ..mbs.fields.references import Reference
from .spatial_points import Place, PointForces
from .spatial_points import SpatialPointSet as PointSet

__all__ = ["ActuationPoints", "PointForces", "PointSet"]


class ActuationPoints(Record):
    """Components of force on one body, equivalent to its generalized driving forces (Shabana 2022, sec. 4).

    `axial` and `transverse` list the points of components along x or y of the body's frame. Without both, ffrobot
    chooses as many components as the body has coordinates.
    """

    body: str
    """Body with these forces."""
    axial: tuple[Place, ...] = ()
    """Points (m from the root, or a name) at which a force along the body's x axis acts."""
    transverse: tuple[Place, ...] = ()
    """Points at which a force along the body's y axis acts."""

    @property
    def is_automatic(self) -> bool:
        """Whether the components are left to the program."""
        return not (self.axial or self.transverse)

    def references(self) -> Iterator[Reference]:
        """The body, and the places on it that are named."""
        yield Reference("body", self.body)
        for place in (*self.axial, *self.transverse):
            if isinstance(place, str):
                yield Reference("", f"{self.body}.{place}")
