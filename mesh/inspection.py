"""What a part's file holds, before there is a link file: size, likely unit, plane faces, bores and shafts.

The faces are those that interfaces of a link choose from (`faces.PartBoundary.smooth_faces`).
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from ..common.arrays import Array, Integers
from ..common.errors import InputError, naming
from ..common.structs import struct
from .cells import volume_and_center
from .checks import METRES, check_sound, oriented, straightened
from .faces import PartBoundary, SmoothFace
from .part import is_step, source_of_file
from .records import SolidMeshRecord
from .source import PointMass

Unit = Literal["m", "mm", "in"]
LONGEST = 5.0  # m of a link: a larger number is in mm
FLAT = 1e-4  # how far normals of a plane face are from their mean, and points of a bore from its radius, relative


@struct
class PartFace:
    """A smooth face in the axes of the file, m."""

    # plane, bore (hollow) and shaft (solid) for closed cylinders, else curved
    kind: Literal["plane", "bore", "shaft", "curved"]
    center: Array  # (3,) m
    # (3,), m, by which an interface finds it: the center of a bore or shaft, else a place on it near its center
    point: Array
    # (3,) unit vector: outward normal of a plane face, axis of a bore or shaft, mean normal of others (zero if none)
    direction: Array
    area: float  # m², of flat facets
    radius: float | None  # of a bore or shaft, m; None of others


@struct
class Inspection:
    """A part as its file has it; lengths in m, axes of the file."""

    unit: Unit  # of the file's numbers
    is_declared: bool  # whether the file says so; else it is a guess by the size
    # low, high: (3,) corners of the bounding box
    low: Array
    high: Array
    volume: float  # m³, of the mesh, whose cells may be curved
    center: Array  # (3,) of the volume
    faces: Sequence[PartFace]  # largest first
    # points, facets: (p, 3), (b, 3 or 4) of the boundary; `face_of` (b,) is the number of each facet's face
    points: Array
    facets: Integers
    face_of: Integers
    groups: Sequence[str]  # names of volumes, faces and sets of nodes in the file
    remarks: Sequence[str]  # on what the file holds besides
    masses: Sequence[PointMass] = ()  # concentrated masses, in the file's unit, their points in m


def inspect_part(file: Path, unit: Unit | None = None) -> Inspection:
    """Read or mesh the part in `file`, whose coordinates are in `unit`; None: as declared, or guessed by the size.

    Raises `InputError` for a file that is missing or cannot be read or meshed, and for an unsound mesh.
    """
    if not file.is_file():
        raise InputError(f"{file}: expected a STEP file or a mesh", "no such file")
    declared: Unit | None = None
    if is_step(file):
        from .gmsh_parts import declared_unit

        units: dict[float, Unit] = {1.0: "mm", 25.4: "in", 1000.0: "m"}
        millimeters = declared_unit(file.read_text(encoding="latin-1"))
        if (declared := units.get(millimeters)) is None:
            raise InputError(f"{file}: expected a part drawn in m, mm or in", f"a unit of {millimeters:g} mm")
    known = unit or declared
    with naming(file):
        source = source_of_file(file, SolidMeshRecord(), METRES[known or "m"])
        part = straightened(oriented(source.part))
        check_sound(part)
    if known is None:
        known = "mm" if np.ptp(part.points, axis=0).max() > LONGEST else "m"
    part = part.moved(METRES[known] * part.points)
    boundary = PartBoundary.of(part)
    faces, face_of = boundary.smooth_faces, np.zeros(len(boundary.facets), dtype=np.int64)
    for k, face in enumerate(faces):
        face_of[face.facets] = k
    volume, center = volume_and_center(part.points[part.cells], part.cell, part.degree)
    return Inspection(
        unit=known,
        is_declared=unit is not None or declared is not None,
        low=part.points.min(axis=0),
        high=part.points.max(axis=0),
        volume=volume,
        center=center,
        faces=[_part_face(boundary, face) for face in faces],
        points=boundary.points,
        facets=boundary.facets,
        face_of=face_of,
        groups=[*part.regions, *source.facet_groups, *source.point_groups],
        remarks=part.remarks,
        masses=[replace(mass, point=METRES[known] * mass.point) for mass in source.masses],
    )


def _part_face(boundary: PartBoundary, face: SmoothFace) -> PartFace:
    normals = boundary.normal[face.facets]
    if face.axis is not None:
        fit = _cylinder(boundary.points[np.unique(boundary.facets[face.facets])], face)
        if fit is not None:
            center, axis, radius = fit
            outward = np.einsum("fi,fi->f", boundary.centroid[face.facets] - center, normals)
            kind: Literal["bore", "shaft"] = "bore" if outward.mean() < 0 else "shaft"
            return PartFace(kind, center, center, axis, face.area, radius)
    size = float(np.linalg.norm(face.normal))
    direction = face.normal / size if size > FLAT else np.zeros(3)
    is_plane = bool(np.all(np.linalg.norm(normals - direction, axis=1) < FLAT))
    centroids = boundary.centroid[face.facets]
    nearest = centroids[np.linalg.norm(centroids - face.center, axis=1).argmin()]
    is_on_it = is_plane and face.distance(boundary, face.center) < FLAT * np.sqrt(face.area)
    point = face.center if is_on_it else nearest
    return PartFace("plane" if is_plane else "curved", face.center, point, direction, face.area, None)


def _cylinder(points: Array, face: SmoothFace) -> tuple[Array, Array, float] | None:
    """Center (3,), axis (3,) and radius of the cylinder nearest to `points` (k, 3); None where they are on none."""
    assert face.axis is not None
    across = np.linalg.svd(face.axis[None])[2][1:]  # (2, 3), square to the axis as far as it is known
    size = float(np.ptp(points, axis=0).max())

    def axis_of(tilt: Array) -> Array:
        axis = face.axis + tilt @ across
        return axis / np.linalg.norm(axis)

    def distances(x: Array) -> Array:
        off, axis = points - (face.center + size * x[2:4] @ across), axis_of(x[:2])
        return np.linalg.norm(off - np.outer(off @ axis, axis), axis=1)

    fit = least_squares(lambda x: distances(x) / size - x[4], [0.0, 0.0, 0.0, 0.0, 0.5], xtol=1e-15, ftol=1e-15)
    axis, radius = axis_of(fit.x[:2]), float(size * fit.x[4])
    if radius <= 0 or np.abs(distances(fit.x) - radius).max() > FLAT * radius:
        return None
    on_axis = face.center + size * fit.x[2:4] @ across
    along = (points - on_axis) @ axis
    return on_axis + (along.min() + along.max()) / 2 * axis, axis, radius
