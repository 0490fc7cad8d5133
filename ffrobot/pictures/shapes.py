"""Shapes of bodies in their frames: the surface, the line of stations, or lines between points."""

import logging
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.arrays import Array, Indices, Integers
from ..common.errors import InputError
from ..common.libraries import scipy
from ..common.rotations import of_rpy, smallest_turn
from ..common.structs import struct
from ..common.tables import shown
from ..fe_models.modal_body import ModalBody, PictureMesh
from ..mbs.scene.bodies import PRIMITIVES
from ..mesh.skins import loaded_skin, primitive_skin
from ..results.file import Results
from .motion import MovingBody

if TYPE_CHECKING:
    import trimesh

logger = logging.getLogger(__name__)

AMPLITUDE = 0.1  # of the length: the largest displacement of a mode as drawn


def drawn_mode(shape: Array, length: float) -> tuple[Array, Array]:
    """Return a mode shape for pictures: displacements (p, 3), m, scaled to the body's `length` (m), and sizes (p,).

    `shape` (p, 3), any unit, at p points. Sizes are relative to the largest, no unit.
    """
    size = np.linalg.norm(shape, axis=1)
    largest = float(size.max()) or 1.0
    return AMPLITUDE * length / largest * shape, size / largest


def body_surface(body: ModalBody) -> PictureMesh:
    """Return the surface in the file of a solid; of a beam the section swept along the axis, or its axis."""
    return body.mesh if body.stations.outline is None or body.mesh.cells.shape[1] > 2 else _swept(body)


def _swept(body: ModalBody) -> PictureMesh:
    """Rings of the section's corners, joined by quadrilaterals and closed by caps; two rings at a step of the section.

    Cross sections stay plane: the corner at a = (0, y, z) of the section moves by Φ + θ × a.
    """
    stations, outline = body.stations, body.stations.outline
    assert outline is not None
    k, q = outline.shape[:2]
    step = np.any(outline[1:-1] != outline[:-2], axis=(1, 2))
    at = np.sort(np.concatenate([np.arange(k), 1 + np.flatnonzero(step)]))
    # Of two rings at a station the first closes what lies before; the section there is that of the station before.
    first = np.append(at[1:] == at[:-1], False) | (at == k - 1)
    arm = np.zeros((len(at), q, 3))
    arm[:, :, 1:] = outline[np.where(first, at - 1, at)]
    points = stations.position[at, None] + arm
    turn = np.cross(stations.rotation[at].swapaxes(1, 2)[:, None], arm[:, :, None]).swapaxes(2, 3)
    shapes = stations.translation[at, None] + turn
    return PictureMesh(points.reshape(-1, 3), _tube(len(at), q), shapes.reshape(-1, 3, body.mode_count))


def _tube(rings: int, q: int) -> Integers:
    """(c, 4) quadrilaterals, normals outwards, of so many rings of q points, q even, each ordered about +x."""
    ring, corner = np.arange(rings - 1)[:, None] * q, np.arange(q)
    after = (corner + 1) % q
    sides = np.stack([ring + corner, ring + after, ring + q + after, ring + q + corner], axis=2).reshape(-1, 4)
    fan = np.array([[0, j, j + 1, j + 2] for j in range(1, q - 1, 2)])
    return np.concatenate([fan[:, ::-1], sides, (rings - 1) * q + fan]).astype(np.int64)


LAYERS = 4  # least number of clusters in each dimension of a link


def triangles_of(cells: Integers) -> Integers:
    """Return triangles (t, 3) of cells (c, 3) or (c, 4); quadrilaterals are split in two."""
    return cells if cells.shape[1] == 3 else np.concatenate([cells[:, [0, 1, 2]], cells[:, [0, 2, 3]]])


def coarsened(points: Array, triangles: Integers, limit: int) -> tuple[Indices, Integers]:
    """Reduce a surface of points (p, 3), m: return indices (k,) of those kept and at most `limit` triangles (t, 3).

    Points in the same box of a grid become the one nearest to their mean (vertex clustering: Rossignac & Borrel, 1993)
    and keep their exact displacements.
    """
    used, inverse = np.unique(triangles, return_inverse=True)
    if len(triangles) <= limit:
        return used, inverse.reshape(-1, 3)
    seen, triangles = points[used], inverse.reshape(-1, 3)
    largest = np.ptp(seen, axis=0) / LAYERS
    low, high = 0.0, LAYERS * float(largest.max())
    kept, coarse = _clustered(seen, triangles, largest)
    for _ in range(12):
        size = 0.5 * (low + high)
        trial = _clustered(seen, triangles, np.minimum(size, largest))
        if len(trial[1]) > limit:
            low = size
        else:
            high, (kept, coarse) = size, trial
    return used[kept], coarse


def _clustered(points: Array, triangles: Integers, size: Array) -> tuple[Indices, Integers]:
    """Points that remain with boxes of `size` (3,), and the triangles whose corners stay apart."""
    box = np.floor((points - points.min(axis=0)) / np.where(size > 0.0, size, 1.0)).astype(np.int64)
    cluster = np.unique(box, axis=0, return_inverse=True)[1].ravel()
    mean = np.stack([np.bincount(cluster, column) for column in points.T], axis=1) / np.bincount(cluster)[:, None]
    order = np.lexsort((np.linalg.norm(points - mean[cluster], axis=1), cluster))
    kept = order[np.unique(cluster[order], return_index=True)[1]]
    mapped = cluster[triangles]
    apart = np.all(mapped != np.roll(mapped, 1, axis=1), axis=1)
    _, first = np.unique(np.sort(mapped[apart], axis=1), axis=0, return_index=True)
    return kept, mapped[apart][np.sort(first)]


def _visual_shape(results: Results, body: MovingBody, notes: list[str]) -> "Shape | None":
    """None without visual shapes, and, with a line in `notes`, where one cannot be drawn."""
    keys = next(entry for entry in results.scene["body"] if entry["name"] == body.name)
    entries = keys.get("rigid", {}).get("visual", ())
    if not entries:
        return None
    try:
        from trimesh.util import concatenate

        skin = concatenate([_skin(entry, results.path.parent) for entry in entries])
    except ModuleNotFoundError:
        notes.append("bodies are drawn without their meshes, which need trimesh: pip install trimesh pycollada")
        return None
    except InputError as error:
        logger.warning("mesh of %s", body.name, exc_info=error)
        notes.append(f"{body.name} is drawn without its mesh: {shown(str(error))}")
        return None
    points, no_modes = np.array(skin.vertices), np.zeros((len(body.position), 0))
    return Shape(body, points, np.zeros((*points.shape, 0)), no_modes, np.array(skin.faces))


def _skin(entry: Mapping[str, Any], folder: Path) -> "trimesh.Trimesh":
    d, C = np.array(entry.get("at", (0.0, 0.0, 0.0))), of_rpy(*entry.get("rpy", (0.0, 0.0, 0.0)))
    if "mesh" in entry:
        return loaded_skin(folder / entry["mesh"], entry.get("scale", (1.0, 1.0, 1.0)), d, C)
    shape = next(key for key in PRIMITIVES if key in entry)
    return primitive_skin(shape, np.atleast_1d(entry[shape]).tolist(), d, C)


SIDES = 8  # of bars that stand for lines
OCTAHEDRON = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]])


@struct
class Shape:
    """The k points of a `body`, moved by coordinates p and exaggeration s: x + s Φ p."""

    body: MovingBody
    points: Array  # (k, 3) x, in the frame, in m
    shapes: Array  # (k, 3, n) Φ, displacement in m per unit of coordinate
    coordinates: Array  # (T, n) over the outputs, m·√kg of modes, else m
    cells: Integers  # (c, v) points that make a line (v = 2) or a facet

    @property
    def deflection(self) -> Array:
        """Return the deflection Φ p of all points (T, k, 3), m, in global axes."""
        return self.body.turned(np.einsum("pin,tn->tpi", self.shapes, self.coordinates, optimize=True))

    def placed(self, s: float = 1.0) -> Array:
        """Return positions of the points (T, k, 3), m, global axes, with deflections times s and closed joints."""
        rest = self.body.placed(np.broadcast_to(self.points, (len(self.coordinates), *self.points.shape)))
        return rest + s * self.deflection + (s - 1.0) * self.body.shift[:, None]


def surface_shape(results: Results, body: MovingBody, notes: list[str]) -> Shape:
    """Return the surface of a flexible body, the visual shapes of a rigid one; else lines between points.

    Adds to `notes` the files that cannot be drawn.
    """
    if body.modal is None and (visual := _visual_shape(results, body, notes)) is not None:
        return visual
    link = _modal_body(results, body, notes)
    if link is None or body.modal is None:
        return point_shape(body)
    mesh = body_surface(link)
    return Shape(body, mesh.points, mesh.mode_shapes, body.modal, mesh.cells)


def coarse_surface(results: Results, body: MovingBody, size: float, limit: int, notes: list[str]) -> Shape:
    """Return `surface_shape` in at most `limit` triangles, lines as bars that suit a robot of `size` (m)."""
    shape = thickened(surface_shape(results, body, notes), 0.008 * size)
    kept, triangles = coarsened(shape.points, triangles_of(shape.cells), limit)
    return replace(shape, points=shape.points[kept], shapes=shape.shapes[kept], cells=triangles)


def numbered_cells(shapes: Sequence[Shape]) -> list[Integers]:
    """Return the cells (c, v) of each shape, with numbers of points in one common list of all shapes."""
    first = np.cumsum([0, *(len(shape.points) for shape in shapes[:-1])])
    return [shape.cells + start for shape, start in zip(shapes, first, strict=True)]


def line_shape(results: Results, body: MovingBody, notes: list[str]) -> Shape:
    """Return the line through the stations of a flexible body; without its file, `point_shape` and one of `notes`."""
    link = _modal_body(results, body, notes)
    if link is None or body.modal is None:
        return point_shape(body)
    stations, k = link.stations, len(link.stations.position)
    cells = np.stack([np.arange(k - 1), np.arange(1, k)], 1)
    return Shape(body, stations.position, stations.translation, body.modal, cells)


def point_shape(body: MovingBody) -> Shape:
    """Return the shortest lines that connect all points of a body; a single point is drawn as such."""
    k = len(body.points)
    shapes = np.eye(3 * k).reshape(k, 3, 3 * k)
    cells = np.zeros((k, 1), dtype=np.int64)
    if k > 1:
        distance = np.linalg.norm(body.points[:, None] - body.points, axis=2)
        # 0 would be no edge: points may be one
        tree = scipy.sparse.csgraph.minimum_spanning_tree(1.0 + distance / max(distance.max(), 1e-300))
        cells = np.array(tree.nonzero(), dtype=np.int64).T
    return Shape(body, body.points, shapes, body.deflection.reshape(len(body.position), 3 * k), cells)


def thickened(shape: Shape, radius: float) -> Shape:
    """Return lines as bars of `radius` (m) with `SIDES` sides, in triangles; single points as octahedra."""
    if shape.cells.shape[1] > 2:
        return shape
    if shape.cells.shape[1] == 1:
        offsets = 2 * radius * np.concatenate([np.eye(3), -np.eye(3)])
        points, shapes = shape.points + offsets, np.repeat(shape.shapes, 6, axis=0)
        return replace(shape, points=points, shapes=shapes, cells=OCTAHEDRON)
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    rings, bar = [], triangles_of(_tube(2, SIDES))
    for first, last in shape.cells:
        across = smallest_turn(shape.points[last] - shape.points[first])[:, :2]
        ring = radius * (np.outer(np.cos(angle), across[:, 0]) + np.outer(np.sin(angle), across[:, 1]))
        rings += [shape.points[first] + ring, shape.points[last] + ring]
    return replace(
        shape,
        points=np.concatenate(rings),
        shapes=shape.shapes[np.repeat(shape.cells.ravel(), SIDES)],
        cells=np.concatenate([bar + 2 * SIDES * k for k in range(len(shape.cells))]),
    )


def _modal_body(results: Results, body: MovingBody, notes: list[str]) -> ModalBody | None:
    if body.modal is None:
        return None
    try:
        return results.modal_body(body.name)
    except InputError as error:
        notes.append(f"{body.name} is drawn through its points only: {error}")
        return None
