"""The named faces of a part: which facets of its boundary are `root`, `tip`, an interface, the bed of a patch.

All sources are treated alike: the facets that only one cell has, their normals, and the smooth faces that they form.
"""

from dataclasses import replace
from functools import cached_property
from typing import NoReturn

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from ..common.arrays import Array, Integers
from ..common.errors import InputError, did_you_mean, quoted
from ..common.structs import struct
from .part_mesh import PartMesh, boundary_facets, facet_geometry, facet_keys, show
from .records import PartTables, PlaceRecord, RectangleSection, SolidGeometry, SurfacePatches
from .source import Source

# A facet lies in a plane when its corners are closer to it than this, relative to the length of the link: files carry
# as few as five digits.
IN_PLANE = 1e-5
# Neighboring facets belong to one smooth face when their normals are closer than this; a circle may have 8 edges.
_SMOOTH = float(np.cos(np.radians(50)))
_ALONG = float(np.cos(np.radians(30)))
# How far from a face, relative to its size, the point may lie that is to pick it.
_NEAR = 0.02
_LISTED = 12
AREA = 1e-9  # of the bed of a patch, relative, that may be off


@struct
class PartBoundary:
    """The boundary of a part, p points, b facets; SI units."""

    points: Array  # (p, 3) of the part, m
    facets: Integers  # (b, 3 or 4) corners, counter-clockwise seen from outside
    centroid: Array  # (b, 3) of the facets, m
    normal: Array  # (b, 3) unit vectors that point outward
    area: Array  # (b,) in m², of the straight facets

    @classmethod
    def of(cls, part: PartMesh) -> "PartBoundary":
        """The boundary of `part`, whose cells are right-handed."""
        facets, _ = boundary_facets(part)
        return cls(part.points, facets, *facet_geometry(part.points, facets))

    @cached_property
    def smooth_faces(self) -> "list[SmoothFace]":
        """Facets joined across edges that are not sharp, largest face first."""
        count, sides = self.facets.shape
        pairs = np.stack([self.facets, np.roll(self.facets, -1, axis=1)], axis=2).reshape(-1, 2)
        pairs.sort(axis=1)
        order = np.lexsort(pairs.T)
        same = np.all(pairs[order][1:] == pairs[order][:-1], axis=1)
        first, second = order[:-1][same] // sides, order[1:][same] // sides
        smooth = np.einsum("fi,fi->f", self.normal[first], self.normal[second]) > _SMOOTH
        links = (np.ones(smooth.sum(), dtype=np.int8), (first[smooth], second[smooth]))
        faces, number = connected_components(sp.coo_matrix(links, shape=(count, count)), directed=False)
        return sorted((SmoothFace.of(self, np.flatnonzero(number == k)) for k in range(faces)), key=lambda of: -of.area)


@struct
class SmoothFace:
    """A smooth face: numbers `facets` (k,) on the boundary, `center` (3,), m, `area`, m², mean outward `normal` (3,).

    The mean normal of a bore or shaft vanishes; its `axis` (3,), a unit vector perpendicular to all normals, takes its
    place. Other faces have the `axis` None.
    """

    facets: Integers
    center: Array
    area: float
    normal: Array
    axis: Array | None

    @classmethod
    def of(cls, boundary: PartBoundary, facets: Integers) -> "SmoothFace":
        """Make a face of the facets with the numbers `facets` (k,) on the `boundary`."""
        weights = boundary.area[facets] / boundary.area[facets].sum()
        normals = boundary.normal[facets]
        normal = weights @ normals
        # Directions of the normals: a cylinder's lie in one plane (coarse triangles on it: nearly), all round in it.
        spread, directions = np.linalg.eigh(normals.T @ (weights[:, None] * normals))
        around = spread[0] < 0.06 and spread[1] > 0.15 and np.linalg.norm(normal) < 0.3
        axis = directions[:, 0] * np.sign(directions[np.argmax(np.abs(directions[:, 0])), 0]) if around else None
        center = weights @ boundary.centroid[facets]
        return cls(facets, center, float(boundary.area[facets].sum()), normal, axis)

    def faces_along(self, direction: Array) -> bool:
        """Whether its outward normal, or its axis in either sense, is (nearly) `direction` (3,), a unit vector."""
        if self.axis is not None:
            return abs(float(self.axis @ direction)) > _ALONG
        size = float(np.linalg.norm(self.normal))
        return size > 0.5 and bool(self.normal @ direction > _ALONG * size)

    def distance(self, boundary: PartBoundary, position: Array) -> float:
        """Approximate distance, m, from `position` (3,), m, to the nearest facet; of a bore or shaft to its center."""
        if self.axis is not None:
            return float(np.linalg.norm(self.center - position))
        normals, centroids = boundary.normal[self.facets], boundary.centroid[self.facets]
        off = position - centroids
        above = np.abs(np.einsum("fi,fi->f", off, normals))
        aside = np.linalg.norm(off - np.einsum("fi,fi->f", off, normals)[:, None] * normals, axis=1)
        reach = np.linalg.norm(boundary.points[boundary.facets[self.facets]] - centroids[:, None], axis=2).max(axis=1)
        return float(np.min(np.hypot(above, np.maximum(aside - reach, 0.0))))

    def __str__(self) -> str:
        facing, direction = ("normal", self.normal) if self.axis is None else ("axis", self.axis)
        return f"center {show(self.center)} m, {facing} {show(np.round(direction, 2))}, {self.area:.4g} m²"


def named_faces(source: Source, tables: PartTables) -> PartMesh:
    """The part of `source`, in the link's frame, with tags of root, tip and the faces that `tables` name.

    Raises `InputError`, with the faces that the part has, if a face is missing or two overlap.
    """
    part, geometry = source.part, tables.geometry
    boundary = PartBoundary.of(part)
    chosen: dict[str, Integers] = {}
    by_name = {item.name: item for item in tables.places}
    for name, x, outward in (("root", 0.0, -1.0), ("tip", geometry.length, 1.0)):
        table = by_name.get(name)
        if table is None or (table.group is None and table.position is None):
            chosen[name] = _end_face(boundary, name, x, outward, geometry.length)
    for table in tables.places:
        if table.group is not None:
            chosen[table.name] = _group(source, boundary, table.group, f"interface.group of {table.name}")
        elif isinstance(table.position, tuple):
            chosen[table.name] = _nearest(boundary, table)
    if tables.patches is not None:
        chosen |= _patch_beds(boundary, geometry, tables.patches)
    return _tagged(part, boundary, chosen)


def _end_face(boundary: PartBoundary, name: str, x: float, outward: float, length: float) -> Integers:
    corners = boundary.points[boundary.facets, 0]
    flat = np.all(np.abs(corners - x) <= IN_PLANE * length, axis=1)
    facets = np.flatnonzero(flat & (outward * boundary.normal[:, 0] > 0.99))
    if facets.size:
        return facets
    sign = "-" if outward < 0 else "+"
    expected = f"a plane face at x = {x:g} with the outward normal {sign}x, or an [[interface]] table of that name"
    _reject(name, expected, "none", boundary)


def _group(source: Source, boundary: PartBoundary, group: str, where: str) -> Integers:
    """The boundary facets of a group of facets, or those whose corners are all in a group of points."""
    if group in source.facet_groups:
        wanted = facet_keys(source.facet_groups[group], len(boundary.points))
        own = facet_keys(boundary.facets, len(boundary.points))
        outside = int(np.sum(~np.isin(wanted, own) | np.any(source.facet_groups[group] < 0, axis=1)))
        if outside:
            raise InputError(
                f"{where}: expected a face on the boundary of the part",
                f"{outside} of the {wanted.size} facets of the group elsewhere: not connected to the volume, or inside",
            )
        return np.flatnonzero(np.isin(own, wanted))
    if group in source.point_groups:
        facets = np.flatnonzero(np.all(np.isin(boundary.facets, source.point_groups[group]), axis=1))
        if facets.size:
            return facets
        number = source.point_groups[group].size
        raise InputError(f"{where}: expected nodes that make up a face", f"{number} nodes and no facet among them")
    known = sorted({*source.facet_groups, *source.point_groups})
    raise InputError(
        f"{where}: expected one of the groups of faces or nodes {quoted(known)}",
        f'"{group}"{did_you_mean(group, known)}',
    )


def _nearest(boundary: PartBoundary, table: PlaceRecord) -> Integers:
    position, normal = np.array(table.position, dtype=np.float64), np.array(table.normal, dtype=np.float64)
    where = f"interface.position of {table.name}"
    magnitude = np.linalg.norm(normal)
    if magnitude == 0:
        raise InputError(f"interface.normal of {table.name}: expected a direction", table.normal)
    facing = [face for face in boundary.smooth_faces if face.faces_along(normal / magnitude)]
    distances = np.array([face.distance(boundary, position) for face in facing])
    wanted = f"a face near {show(position)} m with the outward normal (of a bore: the axis) {show(normal / magnitude)}"
    if not facing:
        _reject(where, wanted, "none", boundary)
    best = int(np.argmin(distances))
    size = np.sqrt(facing[best].area)
    # A point given for a face lies on it; for a bore, somewhere inside.
    if distances[best] > (0.25 if facing[best].axis is not None else _NEAR) * size:
        _reject(where, wanted, f"none nearer than {distances[best]:.4g} m", boundary)
    rivals = np.flatnonzero(distances <= distances[best] + 1e-3 * size)
    if rivals.size > 1:
        _reject(where, wanted, f"{rivals.size} that are equally near", boundary)
    return facing[best].facets


def _patch_beds(boundary: PartBoundary, geometry: SolidGeometry, patches: SurfacePatches) -> dict[str, Integers]:
    """The facets under each patch, whose area is that of the patch."""
    assert isinstance(geometry.section, RectangleSection)
    slack = IN_PLANE * geometry.length
    corners = boundary.points[boundary.facets]
    across = np.all(np.abs(corners[..., 2]) <= patches.width / 2 + slack, axis=1)
    beds: dict[str, Integers] = {}
    for name, y in (("top", geometry.section.height / 2), ("bottom", -geometry.section.height / 2)):
        if patches.faces not in (name, "both"):
            continue
        level = across & np.all(np.abs(corners[..., 1] - y) <= slack, axis=1)
        for k, (begin, end) in enumerate(patches.edges(geometry.length)):
            along = np.all((corners[..., 0] >= begin - slack) & (corners[..., 0] <= end + slack), axis=1)
            bed = np.flatnonzero(level & along)
            area, expected = boundary.area[bed].sum(), (end - begin) * patches.width
            if abs(area - expected) > AREA * expected:
                raise InputError(
                    f"surface_patch: expected {expected:.6g} m² of free surface under patch {k + 1} ({name})",
                    f"{area:.6g} m²",
                )
            beds[f"patch/{k}/{name}"] = bed
    return beds


def _tagged(part: PartMesh, boundary: PartBoundary, chosen: dict[str, Integers]) -> PartMesh:
    """One tag for each face; names that chose the same facets share one."""
    tag = np.zeros(len(boundary.facets), dtype=np.int32)
    faces: dict[str, int] = {}
    for name, facets in chosen.items():
        met = np.unique(tag[facets])
        if met.size == 1 and met[0] > 0 and np.sum(tag == met[0]) == facets.size:
            faces[name] = int(met[0])
            continue
        if met.any():
            others = quoted(other for other, number in faces.items() if number in met)
            raise InputError(f"interface {name}: expected faces that do not overlap", f"it to meet {others}")
        faces[name] = int(tag.max(initial=0)) + 1
        tag[facets] = faces[name]
    on_faces = np.flatnonzero(tag)
    return replace(part, facets=boundary.facets[on_faces], facet_tag=tag[on_faces], faces=faces)


def _reject(where: str, expected: str, given: str, boundary: PartBoundary) -> NoReturn:
    faces = boundary.smooth_faces
    listed = "".join(f"\n  {face}" for face in faces[:_LISTED])
    more = f"\n  and {len(faces) - _LISTED} smaller ones" if len(faces) > _LISTED else ""
    raise InputError(f"{where}: expected {expected}", f"{given}. The part's faces:{listed}{more}")
