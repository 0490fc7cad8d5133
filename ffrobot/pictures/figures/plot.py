"""From a results file, or a modal body file, to a folder of figures."""

import fnmatch
import warnings
from collections.abc import Collection, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.image import NonUniformImage

from ...common.arrays import Array, Integers
from ...common.errors import InputError, did_you_mean, of_file, quoted
from ...common.files import check_folder, write_atomically
from ...fe_models.modal_body import ModalBody
from ...fe_models.modal_body_file import is_modal_body_file, read_modal_body
from ...mesh.inspection import Inspection
from ...results.file import Results
from ..projection import COLORS, LIMIT, LINK, View
from ..shapes import AMPLITUDE, body_surface, drawn_mode
from .configurations import draw_bode, draw_configurations, draw_path, draw_robot_modes
from .shared import Curve, FigureRecord, check_part, curve_points, load_figures, motor_limits, read_points
from .standard import main_figures, standard_figures
from .style import (
    DASHES,
    EDGE,
    ORDERED,
    directions,
    legend,
    line_style,
    lit,
    literal,
    new_axes,
    normals,
    projected,
    shades,
    sides,
    style,
)

WIDTH = 7.0  # inches: both columns of a page
BEAM_HEIGHT, SOLID_HEIGHT = 2.3, 3.0  # inches, of a view of a mesh
MODES = 6  # that are drawn at most
COLUMNS = 2
CLOSE_UP = 5.0  # heights of the section that the second view of a mesh shows
FOLD = np.cos(np.radians(30.0))  # cells that meet at more than this show their edge
FACE, GHOST = "#cfdce8", "#9a9a9a"


def draw_mesh(body: ModalBody) -> Figure:
    """Draw the mesh with its interfaces, and of a solid a close-up of the end at the root."""
    points, cells = body.mesh.points, body.mesh.cells
    edges = body.mesh.edges if body.mesh.edges is not None else np.sort(sides(cells), axis=1)
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
    """Draw the boundary of a part from two sides, its faces in colors; the first `listed` ones have their numbers."""
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
    """Draw the lowest modes, scaled to the same largest displacement; color shows the size of displacements."""
    mesh = body_surface(body)
    points, cells, count = mesh.points, mesh.cells, min(body.mode_count, MODES)
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
    """Draw cells of two points as lines, larger ones as polygons, far ones first; colors (c, 3)."""
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
    keys, place = np.unique(np.sort(sides(cells), axis=1) @ [size, 1], return_inverse=True)
    nearest = np.full(len(keys), -np.inf)
    np.maximum.at(nearest, place, np.repeat(depth, cells.shape[1]))
    inside = edges[np.isin(np.sort(edges, axis=1) @ [size, 1], keys)]
    return inside, nearest[np.searchsorted(keys, np.sort(inside, axis=1) @ [size, 1])]


def _outline(points: Array, cells: Integers, viewer: Array) -> Integers:
    """(e, 2) the edges along which a surface folds or ends, or turns away from a viewer; of a line, all of it."""
    if cells.shape[1] == 2:
        return cells
    normal = normals(points, cells)
    edges, number = np.unique(np.sort(sides(cells), axis=1), axis=0, return_inverse=True)
    number = number.ravel()
    order = np.argsort(number, kind="stable")  # cells with the same edge follow each other
    owner, number = order // cells.shape[1], number[order]
    paired = np.flatnonzero(number[1:] == number[:-1])
    one, other = normal[owner[paired]], normal[owner[paired + 1]]
    smooth = np.abs(np.einsum("ei,ei->e", one, other)) > FOLD
    smooth &= (one @ viewer > 0.0) == (other @ viewer > 0.0)
    return np.delete(edges, number[paired[smooth]], axis=0)


MANY, OFTEN = 4, 0.2  # columns, and part of the time at limits, above which lines hide each other
NEAR = 1e-3  # of a limit: how close values are that are at it
NAMED = 6  # columns: of more, the legend has the first and the last


def draw_time_history(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw the curves of `figure` over time, columns of a curve in different shades; times at a limit are shaded."""
    for k, curve in enumerate(figure.curves):
        if curve.file is not None:
            time, values = read_points(curve.file, curve.data)
            (points,) = axes.plot(time, figure.scale * values, "x", color="black", markersize=5, label=curve.label)
            points.set(zorder=4, clip_on=figure.x_range is not None)
        else:
            _draw_columns(axes, curve, k, figure, results)
    axes.set_xlabel(figure.x_label)
    if not axes.images:
        for k, limit in enumerate(figure.limits):
            axes.axhline(limit, color=LIMIT, linestyle="--", label="limit" if k == 0 else None)
        axes.set_ylabel(figure.y_label)
        legend(axes)


def _draw_columns(axes: Axes, curve: Curve, k: int, figure: FigureRecord, results: Results) -> None:
    time, values = curve_points(results, curve, figure.scale)
    axes.margins(x=0)
    count, at_limit = values.shape[1], _is_at_limit(values, figure.limits)
    if count > MANY and at_limit.mean() > OFTEN:  # the last line would hide the others
        _draw_map(axes, time, values, curve.label, figure)
        return
    if len(time) > 1 and at_limit.any():
        label = None if axes.collections else "at a limit"
        look: dict[str, Any] = {"color": LIMIT, "alpha": 0.25, "linewidth": 0, "label": label}
        axes.fill_between(time, 0.0, 1.0, where=at_limit.any(axis=1), transform=axes.get_xaxis_transform(), **look)
    if count == 1:
        _draw_line(axes, curve, k, figure, time, values)
        return
    for column, color in enumerate(shades(count)):
        label = f"{curve.label} {column + 1}" if count <= NAMED or column in (0, count - 1) else None
        dashes = DASHES[column % len(DASHES)] if count <= MANY else "-"
        axes.plot(time, values[:, column], color=color, linestyle=dashes, linewidth=0.7, label=label)


def _draw_line(axes: Axes, curve: Curve, k: int, figure: FigureRecord, x: Array, values: Array) -> None:
    look = line_style(k, len(x), alone=len(figure.curves) == 1)
    axes.plot(x, values[:, 0], label=curve.label, **look)


def _is_at_limit(values: Array, limits: tuple[float, ...]) -> Array:
    """(T, n) whether values are at one of the limits; of values beyond all limits none is."""
    near = np.isclose(values[..., None], limits or np.inf, rtol=NEAR, atol=0.0)
    is_within = np.abs(values).max(initial=0.0) <= (1.0 + NEAR) * np.abs(limits).max(initial=0.0)
    return near.any(axis=-1) & is_within


def _draw_map(axes: Axes, time: Array, values: Array, label: str, figure: FigureRecord) -> None:
    """A row for each column, in the color of its value: red at the upper limit, blue at the lower one."""
    count, limit = values.shape[1], max(map(abs, figure.limits))
    picture = NonUniformImage(axes, cmap="RdBu_r", extent=(time[0], time[-1], 0.5, count + 0.5))
    picture.set_data(time, np.arange(1, count + 1), values.T)
    picture.set_clim(-limit, limit)
    axes.add_image(picture)
    axes.set(xlim=(time[0], time[-1]), ylim=(0.5, count + 0.5), yticks=range(1, count + 1), ylabel=label)
    axes.grid(visible=False)
    axes.figure.colorbar(picture, ax=axes, label=figure.y_label)


def _draw_torque_speed(axes: Axes, figure: FigureRecord, results: Results) -> None:
    for k, curve in enumerate(figure.curves):
        _draw_line(axes, curve, k, figure, *curve_points(results, curve, figure.scale))
    if len(limits := motor_limits(results, figure)):
        axes.plot(*limits.T, color=LIMIT, linestyle="--", label="limits")
    axes.set(xlabel=figure.x_label, ylabel=figure.y_label)
    legend(axes)


def _draw_placement(axes: Axes, figure: FigureRecord, results: Results) -> None:
    """Draw the reach of a patch along the link by mode; below, the patches found and evenly spaced ones."""
    group = f"{figure.analysis}/placement"
    check_part(results, figure, "placement", 'an analysis of kind = "placement"')
    body = results.attributes(group)["body"]
    length = next(layout["length"] for layout in results.scene["pzt"] if layout["body"] == body)
    centers, frequency = results[f"{group}/candidates"], results[f"{group}/frequency"]
    for reach, f, color in zip(results[f"{group}/candidate_reach"], frequency, shades(len(frequency)), strict=True):
        axes.plot(centers, reach, color=color, label=f"{f:.4g} Hz")
    for k, (key, label) in enumerate((("best", "found"), ("even", "evenly spaced"))):
        places = [(x - length / 2, length) for x in results[f"{group}/{key}/centers"]]
        axes.broken_barh(places, (-0.12 * (k + 1), 0.08), facecolor=COLORS[k], edgecolor="white", label=label)
    x_label, y_label = f"distance along {body} (m)", "controllability by one patch"
    axes.set(yticks=np.linspace(0.0, 1.0, 5), xlabel=x_label, ylabel=y_label)
    legend(axes)


DRAW = {"time": draw_time_history, "placement": _draw_placement, "torque-speed": _draw_torque_speed}
DRAW_WHOLE = {  # with axes of their own
    "path": draw_path,
    "configurations": draw_configurations,
    "bode": draw_bode,
    "modes": draw_robot_modes,
}

# No dates and no versions: the same results give the same files.
METADATA = {
    "png": {"Software": None},
    "pdf": {"CreationDate": None, "Producer": None, "Creator": None},
    "svg": {"Date": None, "Creator": None},
}
FORMATS = ("png", "pdf")  # unless asked for otherwise


def plot_file(path: Path, folder: Path, formats: Sequence[str] = FORMATS, only: Sequence[str] = ()) -> list[Path]:
    """Draw the figures of a results file, or mesh and modes of a modal body file, into `folder`; returns the files.

    A file `figures.toml` next to the results describes the figures; without one, the main standard
    figures are drawn. `only`: names of figures, or patterns such as "moment_*", or "*" for all. Each figure is written
    in all `formats`: "png", "pdf", "svg".

    Raises:
        InputError: a file cannot be read or names what is not there; no such format or figure.
    """
    check_folder(folder)
    if not formats or not set(formats) <= set(METADATA):
        raise InputError(f"format: expected one or several of {', '.join(METADATA)}", f'"{",".join(formats)}"')
    figure_file, written = path.parent / "figures.toml", list[Path]()
    if is_modal_body_file(path):
        body, drawings = read_modal_body(path), {"mesh": draw_mesh, "modes": draw_modes}
        with style():
            for name in _chosen(drawings, only):
                written += write_figure(literal(drawings[name](body)), folder, name, formats)
        return written
    with Results(path) as results, style():
        is_own, standard = figure_file.is_file(), standard_figures if only else main_figures
        records = load_figures(figure_file).figure if is_own else standard(results)
        names = _chosen(dict.fromkeys(record.name for record in records), only)
        for record in (each for each in records if each.name in names):
            label = f'{figure_file if is_own else path}: figure "{record.name}"'
            try:
                with of_file(label):
                    picture = draw(record, results)
                    written += write_figure(picture if is_own else literal(picture), folder, record.name, formats)
            except ValueError as error:  # of matplotlib: a formula between `$` that is none, a range
                if not is_own:
                    raise
                raise InputError(f"{label}: {str(error).strip().splitlines()[0]}") from None
    return written


def _chosen(names: Collection[str], only: Sequence[str]) -> list[str]:
    fitting = set[str]()
    for pattern in only:
        fitting.update(found := fnmatch.filter(names, pattern))
        if not found:
            raise InputError(
                f"--only: expected the name of a figure, or a pattern that fits one ({quoted(names)})",
                f'"{pattern}"{did_you_mean(pattern, names)}',
            )
    return [name for name in names if not only or name in fitting]


def draw(record: FigureRecord, results: Results) -> Figure:
    """Return the figure that `record` describes."""
    if record.kind in DRAW_WHOLE:
        picture = DRAW_WHOLE[record.kind](record, results)
    else:
        picture, axes = new_axes(record.title)
        DRAW[record.kind](axes, record, results)
    if record.x_range is not None:
        picture.axes[0].set_xlim(*record.x_range)
    if record.y_range is not None:
        picture.axes[0].set_ylim(*record.y_range)
    return picture


def write_figure(picture: Figure, folder: Path, name: str, formats: Sequence[str] = FORMATS) -> list[Path]:
    """Write a picture as DIR/NAME.FORMAT in all formats; returns the files."""
    paths = [folder / f"{name}.{extension}" for extension in formats]
    for path in paths:
        write_atomically(path, image_of(picture, path.suffix[1:]), "figure", make_folder=True)
        picture.set_layout_engine(None)  # other formats take the layout of the first: two of four drawings less
    return paths


def image_of(picture: Figure, extension: str) -> bytes:
    """Return the content of a file with a picture; `extension`: "png", "pdf" or "svg"."""
    stream = BytesIO()
    with warnings.catch_warnings():  # of characters that the font lacks: a box stands for them
        warnings.filterwarnings("ignore", message="Glyph .* missing from")
        warnings.filterwarnings("ignore", message="constrained_layout not applied")  # texts longer than the figure
        picture.savefig(stream, format=extension, metadata=METADATA[extension])
    return stream.getvalue()
