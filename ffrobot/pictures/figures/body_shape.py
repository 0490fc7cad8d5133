"""Pictures of a modal body: its mesh, and its lowest modes deformed over the undeformed shape."""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from ...common.arrays import Array, Integers
from ...fe_models.modal_body import ModalBody
from ...mesh.inspection import Inspection
from ..projection import COLORS, LINK, View
from ..shapes import AMPLITUDE, body_surface, drawn_mode
from .style import EDGE, ORDERED, directions, lit, normals, projected

WIDTH = 7.0  # inches: both columns of a page
BEAM_HEIGHT, SOLID_HEIGHT = 2.3, 3.0  # inches, of a view of a mesh
MODES = 6  # that are drawn at most
COLUMNS = 2
CLOSE_UP = 5.0  # heights of the section that the second view of a mesh shows
FOLD = np.cos(np.radians(30.0))  # cells that meet at more than this show their edge
FACE, GHOST = "#cfdce8", "#9a9a9a"


def draw_mesh(body: ModalBody) -> Figure:
    """The mesh with its interfaces, and of a solid a close-up of the end at the root."""
    points, cells = body.mesh.points, body.mesh.cells
    edges = body.mesh.edges if body.mesh.edges is not None else _sides(cells)
    views = [(cells, f"{body.name}: mesh")]
    near = cells[np.all(points[cells, 0] <= CLOSE_UP * body.stations.height.max(), axis=1)]
    if cells.shape[1] > 2 and 0 < len(near) < len(cells) and np.ptp(points[near, 0]) > 0.0:
        views.append((near, f"{body.name} at the root"))
    height = BEAM_HEIGHT if cells.shape[1] == 2 else SOLID_HEIGHT
    figure = Figure(figsize=(WIDTH, height * len(views)), layout="constrained")
    for k, (shown, title) in enumerate(views):
        axes = _view(figure, (len(views), 1, k + 1), title)
        last = points[shown, 0].max()
        colors = np.tile(matplotlib.colors.to_rgb(FACE), (len(shown), 1))
        _draw_cells(axes, points, shown, colors, edges[np.all(points[edges, 0] <= last, axis=1)])
        for j, (name, interface) in enumerate(body.interfaces.items()):
            if interface.position[0] <= last:
                at = projected(interface.position, LINK)
                axes.plot(*at, "o", color=COLORS[(j + 1) % len(COLORS)], markersize=4.5, label=name)
        axes.legend(loc="lower right", ncols=len(body.interfaces), bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)
        directions(axes, 0.06 * np.ptp(points[shown, 0]), LINK)
    return figure


def draw_part(part: Inspection, listed: int) -> Figure:
    """The boundary of a part seen from two sides, its faces in colors; the first `listed` ones have their numbers."""
    figure = Figure(figsize=(WIDTH, 2 * SOLID_HEIGHT), layout="constrained")
    palette = np.array([matplotlib.colors.to_rgb(color) for color in COLORS])
    colors = palette[part.face_of % len(palette)]
    behind = View(viewer=-LINK.viewer, right=-LINK.right, up=LINK.up)
    for k, (view, title) in enumerate(((LINK, "from the side of +z"), (behind, "from the other side"))):
        axes = _view(figure, (2, 1, k + 1), title)
        _draw_cells(axes, part.points, part.facets, colors, view=view)
        facing = normals(part.points, part.facets) @ view.viewer > 0
        for number, face in enumerate(part.faces[:listed]):
            of_face = part.face_of == number
            if np.any(facing & of_face):
                x, y = projected(face.point, view)
                box = {"boxstyle": "circle", "fc": "w", "lw": 0.3, "pad": 0.1}
                axes.annotate(str(number + 1), (x, y), fontsize=7, bbox=box)
        directions(axes, 0.06 * float(np.ptp(part.points, axis=0).max()), view)
    return figure


def draw_modes(body: ModalBody) -> Figure:
    """The lowest modes, each scaled to the same largest displacement, whose size is the color."""
    mesh = body_surface(body)
    points, cells = mesh.points, mesh.cells
    count = min(body.mode_count, MODES)
    rows = -(-count // COLUMNS)
    figure = Figure(figsize=(WIDTH, 1.9 * rows), layout="constrained")
    outline = projected(points, LINK)[_outline(points, cells, LINK.viewer)]
    margin = AMPLITUDE * body.length * np.array([[0.0, 1.0, 1.0], [0.0, -1.0, -1.0]])
    frame = projected((points[:, None] + margin).reshape(-1, 3), LINK)
    for k in range(count):
        axes = _view(figure, (rows, COLUMNS, k + 1), f"{k + 1}: {body.frequency[k]:.5g} Hz, {body.family[k]}")
        axes.add_collection(LineCollection(list(outline), colors=GHOST, linewidths=0.5, zorder=0))
        displacement, size = drawn_mode(mesh.mode_shapes[:, :, k], body.length)
        if np.any(size):
            colors = matplotlib.colormaps[ORDERED](size[cells].mean(axis=1))[:, :3]
            _draw_cells(axes, points + displacement, cells, colors)
        else:
            axes.text(0.5, 0.1, "the axis does not move", transform=axes.transAxes, ha="center")
        axes.update_datalim(frame)
        axes.autoscale_view()
        directions(axes, 0.1 * body.length, LINK)
    return figure


def _view(figure: Figure, place: tuple[int, int, int], title: str) -> Axes:
    axes = figure.add_subplot(*place)
    axes.set_title(title, loc="left")
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def _draw_cells(
    axes: Axes, points: Array, cells: Integers, colors: Array, edges: Integers | None = None, view: View = LINK
) -> None:
    """Cells of two points as lines, larger ones as polygons; colors (c, 3). Far ones first: near ones hide them."""
    if cells.shape[1] == 2:
        lines = list(projected(points[cells], view))
        axes.add_collection(LineCollection(lines, colors=colors if edges is None else COLORS[0], linewidths=2.0))
        if edges is not None:
            axes.plot(*projected(points[np.unique(cells)], view).T, "|", color=EDGE, markersize=6, markeredgewidth=0.8)
    else:
        faces = lit(points, cells, colors, view)
        polygons, depth = list(projected(points[cells], view)), points[cells].mean(axis=1) @ view.viewer
        if edges is not None:  # lines are polygons of two corners, sorted in just before their cells
            edges, nearest = _edge_depth(cells, depth, edges)
            polygons, depth = polygons + list(projected(points[edges], view)), np.append(depth, nearest)
            faces = np.concatenate([faces, np.tile(matplotlib.colors.to_rgb(EDGE), (len(edges), 1))])
        order = np.argsort(depth, kind="stable")
        polygons, faces = [polygons[k] for k in order], faces[order]
        axes.add_collection(PolyCollection(polygons, facecolors=faces, edgecolors=faces, linewidths=0.3))
    axes.autoscale_view()


def _edge_depth(cells: Integers, depth: Array, edges: Integers) -> tuple[Integers, Array]:
    """Those of `edges` (e, 2) that are sides of cells, and the depth of the nearer of the cells with that side."""
    size = cells.max() + 1
    keys, place = np.unique(_sides(cells) @ [size, 1], return_inverse=True)
    nearest = np.full(len(keys), -np.inf)
    np.maximum.at(nearest, place, np.repeat(depth, cells.shape[1]))
    inside = edges[np.isin(np.sort(edges, axis=1) @ [size, 1], keys)]
    return inside, nearest[np.searchsorted(keys, np.sort(inside, axis=1) @ [size, 1])]


def _sides(cells: Integers) -> Integers:
    """(c v, 2) the sides of all cells, ascending in each: those that two cells share are listed twice."""
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.asarray(np.sort(sides, axis=1), dtype=np.int64)


def _outline(points: Array, cells: Integers, viewer: Array) -> Integers:
    """(e, 2) the edges along which a surface folds or ends, or turns away from a viewer; of a line, all of it."""
    corners = cells.shape[1]
    if corners == 2:
        return cells
    normal = normals(points, cells)
    edges = _sides(cells)
    owner = np.repeat(np.arange(len(cells)), corners)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    paired = np.flatnonzero(np.all(edges[1:] == edges[:-1], axis=1))
    one, other = normal[owner[paired]], normal[owner[paired + 1]]
    smooth = np.abs(np.einsum("ei,ei->e", one, other)) > FOLD
    smooth &= (one @ viewer > 0.0) == (other @ viewer > 0.0)
    inner = np.zeros(len(edges), dtype=bool)
    inner[paired[smooth]] = inner[paired[smooth] + 1] = True
    # A fold is listed by both of its cells; once is enough.
    return np.asarray(np.unique(edges[~inner], axis=0), dtype=np.int64)
