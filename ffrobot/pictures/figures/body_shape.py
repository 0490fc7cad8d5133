"""Pictures of a modal body: its mesh, and its lowest modes deformed over the undeformed shape.

Drawn in parallel projection on plain axes: true proportions of long thin links, which matplotlib's own third dimension
squeezes into a cube.
"""

from __future__ import annotations

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from ...common.arrays import Array, Integers
from ...fe_models.modal_body import ModalBody
from ..body_surface import AMPLITUDE, body_surface, drawn_mode
from ..projection import RIGHT, UP, VIEWER
from .palette import COLORS
from .style import ORDERED

WIDTH = 7.0  # inches: both columns of a page
BEAM_HEIGHT, SOLID_HEIGHT = 2.3, 3.0  # inches, of a view of a mesh
MODES = 6  # that are drawn at most
COLUMNS = 2
CLOSE_UP = 5.0  # heights of the section that the second view of a mesh shows
FOLD = np.cos(np.radians(30.0))  # cells that meet at more than this show their edge
BAR = 0.25  # of the width: about the length of the scale bar
FACE, EDGE, GHOST = "#cfdce8", "#30465c", "#9a9a9a"
LIGHT = (VIEWER + UP) / np.linalg.norm(VIEWER + UP)


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
                at = _projected(interface.position)
                axes.plot(*at, "o", color=COLORS[(j + 1) % len(COLORS)], markersize=4.5, label=name)
        axes.legend(loc="lower right", ncols=len(body.interfaces), bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0)
        _directions(axes, 0.06 * np.ptp(points[shown, 0]))
    return figure


def draw_modes(body: ModalBody) -> Figure:
    """The lowest modes, each scaled to the same largest displacement, whose size is the colour."""
    mesh = body_surface(body)
    points, cells = mesh.points, mesh.cells
    count = min(body.mode_count, MODES)
    rows = -(-count // COLUMNS)
    figure = Figure(figsize=(WIDTH, 1.9 * rows), layout="constrained")
    outline = _projected(points)[_outline(points, cells)]
    margin = AMPLITUDE * body.length * np.array([[0.0, 1.0, 1.0], [0.0, -1.0, -1.0]])
    frame = _projected((points[:, None] + margin).reshape(-1, 3))
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
        _directions(axes, 0.1 * body.length)
    return figure


def _view(figure: Figure, place: tuple[int, int, int], title: str) -> Axes:
    axes = figure.add_subplot(*place)
    axes.set_title(title, loc="left")
    axes.set_aspect("equal")
    axes.set_axis_off()
    return axes


def _projected(points: Array) -> Array:
    """(…, 2) where points (…, 3) in m are on the page."""
    return np.stack([points @ RIGHT, points @ UP], axis=-1)


def _draw_cells(axes: Axes, points: Array, cells: Integers, colors: Array, edges: Integers | None = None) -> None:
    """Cells of two points as lines, larger ones as polygons; colours (c, 3). Far ones first: near ones hide them."""
    if cells.shape[1] == 2:
        lines = list(_projected(points[cells]))
        axes.add_collection(LineCollection(lines, colors=colors if edges is None else COLORS[0], linewidths=2.0))
        if edges is not None:
            axes.plot(*_projected(points[np.unique(cells)]).T, "|", color=EDGE, markersize=6, markeredgewidth=0.8)
    else:
        # Which way the normals of the cells point is unknown, and hidden cells are painted over.
        faces = colors * (0.6 + 0.4 * np.abs(_normals(points, cells) @ LIGHT))[:, None]
        polygons, depth = list(_projected(points[cells])), points[cells].mean(axis=1) @ VIEWER
        if edges is not None:  # lines are polygons of two corners, sorted in just before their cells
            edges, nearest = _edge_depth(cells, depth, edges)
            polygons, depth = polygons + list(_projected(points[edges])), np.append(depth, nearest)
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


def _directions(axes: Axes, size: float) -> None:
    """Arrows of `size` (m) along x, y and z below the picture, and a bar of a round length along x."""
    (left, right), bottom = axes.get_xlim(), axes.get_ylim()[0]
    x, y = left + 0.05 * (right - left), bottom - 2.0 * size
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        dx, dy = size * _projected(axis)
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops={"arrowstyle": "->", "linewidth": 0.6, "shrinkB": 0})
        axes.annotate(name, (x + 1.35 * dx, y + 1.35 * dy), ha="center", va="center", fontsize=7)
    length = round_below(BAR * (right - left))
    bar = np.array([x + 3.0 * size, y]) + np.array([[0.0, 0.0], length * _projected(np.eye(3)[0])])
    axes.plot(*bar.T, color=EDGE, linewidth=1.5, solid_capstyle="butt")
    axes.annotate(f" {length:g} m", bar[1], va="center", fontsize=7)
    axes.update_datalim([(x - 0.6 * size, y - 0.6 * size), *bar])
    axes.autoscale_view()


def round_below(value: float) -> float:
    """The next of …, 0.1, 0.2, 0.5, 1, … not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9)))


def _normals(points: Array, cells: Integers) -> Array:
    """(c, 3) unit normals of triangles or quadrilaterals; zero where a cell has no area."""
    first = points[cells[:, 0]]
    normals = np.cross(points[cells[:, 1]] - first, points[cells[:, -1]] - first)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def _sides(cells: Integers) -> Integers:
    """(c v, 2) the sides of all cells, ascending in each: those that two cells share are listed twice."""
    sides = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.asarray(np.sort(sides, axis=1), dtype=np.int64)


def _outline(points: Array, cells: Integers) -> Integers:
    """(e, 2) the edges along which a surface folds or ends; of a line, all of it."""
    corners = cells.shape[1]
    if corners == 2:
        return cells
    normals = _normals(points, cells)
    edges = _sides(cells)
    owner = np.repeat(np.arange(len(cells)), corners)
    order = np.lexsort(edges.T)
    edges, owner = edges[order], owner[order]
    paired = np.flatnonzero(np.all(edges[1:] == edges[:-1], axis=1))
    smooth = np.abs(np.einsum("ei,ei->e", normals[owner[paired]], normals[owner[paired + 1]])) > FOLD
    inner = np.zeros(len(edges), dtype=bool)
    inner[paired[smooth]] = inner[paired[smooth] + 1] = True
    # A fold is listed by both of its cells; once is enough.
    return np.asarray(np.unique(edges[~inner], axis=0), dtype=np.int64)
