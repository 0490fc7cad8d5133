"""A link file's part as a mesh with its faces named: which source makes it, and what is checked. Runs on one process."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from .cells import Floats
from .part_mesh import PartMesh, boundary_facets, facet_geometry
from .records import InterfaceRecord, RectangleSection, SolidGeometry, SolidMeshRecord, SurfacePatches
from .structured import structured_box

Progress = Callable[[str], None]


def part_mesh(
    geometry: SolidGeometry,
    record: SolidMeshRecord,
    interfaces: Sequence[InterfaceRecord],
    patches: SurfacePatches | None,
    path: Path,
    progress: Progress,
) -> PartMesh:
    section = geometry.section
    assert isinstance(section, RectangleSection)
    tip = geometry.tip_section or section
    ends = [(s.height, s.width) for s in (section, tip)]
    divisions = record.divisions or (36, 1, 1)
    part = structured_box(geometry.length, ends[0], ends[1], divisions, record.cell or "tetrahedron")
    facets, _ = boundary_facets(part)
    centroid, normal, _ = facet_geometry(part.points, facets)
    root = np.abs(centroid[:, 0]) < 1e-9
    tip_ = np.abs(centroid[:, 0] - geometry.length) < 1e-9
    return replace(
        part,
        facets=np.concatenate([facets[root], facets[tip_]]),
        facet_tag=np.repeat(np.array([1, 2], dtype=np.int32), [root.sum(), tip_.sum()]),
        faces={"root": 1, "tip": 2},
    )
