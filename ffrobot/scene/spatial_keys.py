"""A scene file in 3D as a whole, and a planar one in the same records; its tables are records of their own."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from ..actuation.patches.spatial_records import SpatialPztLayout
from ..actuation.spatial_points import SpatialActuationPoints
from ..mbs.fields.field_types import NotEmpty
from ..mbs.fields.references import Reference, under
from ..mbs.scene.spatial.mechanism import SpatialMechanismKeys
from .kinds import Analysis


class SpatialSceneKeys(SpatialMechanismKeys):
    """Keys of a 3D scene file."""

    pzt: tuple[SpatialPztLayout, ...] = ()
    """Layouts of piezoelectric patches; names distinguish several on one body."""
    actuation_points: tuple[SpatialActuationPoints, ...] = ()
    """Points of forces that replace the driving forces."""
    analysis: Annotated[tuple[Analysis, ...], NotEmpty]
    """Analyses, in this order."""

    @property
    def read_joints(self) -> frozenset[str]:
        """Names of joints with sensors or controllers."""
        named = (reference for analysis in self.analysis for reference in analysis.references())
        return frozenset(reference.name for reference in named if reference.kind == "joint")

    def references(self) -> Iterator[Reference]:
        """All that records of the scene refer to, with their full keys."""
        yield from super().references()
        for layout in self.pzt:
            yield from under(f'pzt "{layout.label}"', layout.references())
        for points in self.actuation_points:
            yield from under(f'actuation_points "{points.body}"', points.references())
        for analysis in self.analysis:
            yield from under(f'analysis "{analysis.name}"', analysis.references())
