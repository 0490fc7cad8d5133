"""Style of figures, and parallel projection on plain axes: matplotlib's third dimension squeezes thin bodies."""

import re
import textwrap
from contextlib import AbstractContextManager
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import ScalarFormatter

from ...common.arrays import Array, Integers
from ..projection import COLORS, View

SIZE = (3.5, 2.7)  # inches: one column of a journal page

MARKERS = ("s", "^", "o", "D", "v", "P", "X")
DASHES = ("-", "--", "-.", ":")
LEGEND_CHARACTERS = 60  # in a line of a figure as wide as SIZE; 6 stand for the sample of a curve
ORDERED = "viridis"  # for series with an order: patches along a link, configurations over time

SETTINGS: dict[str, Any] = {
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.grid": True,
    "axes.formatter.limits": (-3, 5),
    "axes.spines.top": False,
    "axes.spines.right": False,
    "grid.alpha": 0.3,
    "grid.linewidth": 0.5,
    "lines.linewidth": 1.0,
    "lines.markersize": 3.5,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "savefig.dpi": 200,
    "pdf.fonttype": 42,
    "svg.hashsalt": "ffrobot",  # the same figure gives the same file
}


SUPERSCRIPTS = str.maketrans("−0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Ticks(ScalarFormatter):
    """Labels of ticks as plain text, which is faster to draw."""

    def get_offset(self) -> str:
        """Return the power of ten of all labels, "×10⁻⁵"."""
        return re.sub(r"1e([−\d]+)$", lambda power: "×10" + power[1].translate(SUPERSCRIPTS), super().get_offset())


def style() -> AbstractContextManager[None]:
    """Return the context with matplotlib's settings for drawing and writing figures."""
    return matplotlib.rc_context(SETTINGS)


def new_axes(title: str) -> tuple[Figure, Axes]:
    """Return an empty figure with titled axes."""
    figure = Figure(figsize=SIZE, layout="constrained")
    axes = figure.subplots()
    lines = [title] if "$" in title else textwrap.wrap(title, 52)  # no line ends within a formula
    axes.set_title("\n".join(lines), loc="left")
    axes.locator_params(axis="x", nbins=6)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(Ticks())
    return figure, axes


def line_style(k: int, points: int, *, alone: bool = False) -> dict[str, Any]:
    """Return the style of curve k with so many `points`: sparse markers and dashes distinguish equal curves.

    A curve that is `alone` has none, as they look like samples.
    """
    if alone and points > 1:
        return {"color": COLORS[k % len(COLORS)]}
    every = max(1, points // 14)  # so many markers
    return {
        "color": COLORS[k % len(COLORS)],
        "linestyle": DASHES[k % len(DASHES)],
        "marker": MARKERS[k % len(MARKERS)],
        "markevery": ((k * every // 3) % every, every),
        "markerfacecolor": "white",
    }


def shades(count: int) -> list[Any]:
    """Return colors of `count` ordered series, dark to light."""
    colormap = matplotlib.colormaps[ORDERED]
    return [colormap(0.9 * k / max(1, count - 1)) for k in range(count)]


def literal(figure: Figure) -> Figure:
    """Return the figure with `$`, `_`, `^` and backslashes of its texts drawn as they are."""
    for axes in figure.axes:
        titles = (axes.title, axes._left_title, axes._right_title, axes.xaxis.label, axes.yaxis.label)  # type: ignore[attr-defined]
        legends = [one for one in (axes.get_legend(), *figure.legends) if one is not None]
        for text in (*titles, *axes.texts, *(text for one in legends for text in one.get_texts())):
            text.set_parse_math(False)
    return figure


def legend(axes: Axes) -> None:
    """Draw a legend below the axes, in as many columns as fit; none of a single curve."""
    handles, labels = axes.get_legend_handles_labels()
    figure = axes.get_figure(root=True)
    if figure is not None and len(labels) > 1:
        room = LEGEND_CHARACTERS * figure.get_figwidth() / SIZE[0]
        columns = max(1, min(len(labels), int(room) // (max(map(len, labels)) + 6)))
        look: dict[str, Any] = {"ncols": columns, "handlelength": 1.8, "columnspacing": 1.0}
        figure.legend(handles, labels, loc="outside lower center", **look)


BAR = 0.25  # of the width: about the length of the scale bar
EDGE = "#30465c"
DARKEST = 0.6  # how bright a cell is that the light passes along


def projected(points: Array, view: View) -> Array:
    """Return page coordinates (…, 2) of points (…, 3), both m, in parallel projection."""
    return np.stack([points @ view.right, points @ view.up], axis=-1)


def normals(points: Array, cells: Integers) -> Array:
    """Return unit normals (c, 3) of triangles or quadrilaterals `cells` (c, v) on points (p, 3), m; 0 without area."""
    first = points[cells[:, 0]]
    areas = np.cross(points[cells[:, 1]] - first, points[cells[:, -1]] - first)
    return areas / np.maximum(np.linalg.norm(areas, axis=1, keepdims=True), 1e-300)


def sides(cells: Integers) -> Integers:
    """Return the sides (c v, 2) of all cells (c, v) as pairs of points; shared sides appear twice."""
    return np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)


def lit(points: Array, cells: Integers, colors: Array, view: View) -> Array:
    """Return `colors` (c, 3), red, green, blue from 0 to 1, of cells (c, v) in light from above the viewer.

    `points` (p, 3) in m. Normals of cells may point either way.
    """
    light = (view.viewer + view.up) / np.linalg.norm(view.viewer + view.up)
    return colors * (DARKEST + (1.0 - DARKEST) * np.abs(normals(points, cells) @ light))[:, None]


def directions(axes: Axes, size: float, view: View) -> None:
    """Draw arrows of `size` (m) along x, y and z below the picture, and a bar of a round length along x."""
    (left, right), bottom = axes.get_xlim(), axes.get_ylim()[0]
    x, y = left + 0.05 * (right - left), bottom - 2.0 * size
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        dx, dy = size * projected(axis, view)
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops={"arrowstyle": "->", "linewidth": 0.6, "shrinkB": 0})
        axes.annotate(name, (x + 1.35 * dx, y + 1.35 * dy), ha="center", va="center", fontsize=7)
    longest = BAR * (right - left)
    power = 10.0 ** np.floor(np.log10(longest))
    length = float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= longest * (1.0 + 1e-9)))
    bar = np.array([x + 3.0 * size, y]) + np.array([[0.0, 0.0], length * projected(np.eye(3)[0], view)])
    axes.plot(*bar.T, color=EDGE, linewidth=1.5, solid_capstyle="butt")
    axes.annotate(f" {length:g} m", bar[1], va="center", fontsize=7)
    axes.update_datalim([(x - 0.6 * size, y - 0.6 * size), *bar])
    axes.autoscale_view()


FACING = 1e-3  # least component of a drawn cell's unit normal towards the viewer


class SceneAxes:
    """Axes for points (…, 3), m, global axes, in parallel projection.

    Views along a coordinate axis have scales of the other two, other views arrows of all three. `finish` sets the
    ranges, after everything is drawn.
    """

    def __init__(self, axes: Axes, view: View) -> None:
        self.axes, self.view = axes, view
        self.drawn: list[Array] = []

    def plot(self, points: Array, *style: str, **options: Any) -> None:
        """Draw a line through points (n, 3), m, global axes, or markers."""
        self.drawn.append(seen := projected(points, self.view))
        self.axes.plot(*seen.T, *style, **options)

    def body(self, points: Array, cells: Integers, color: Any, width: float = 1.5) -> None:
        """Draw cells (c, v) on points (p, 3), m, global axes: lines (v = 2), or an opaque surface."""
        self.drawn.append(seen := projected(points, self.view))
        if cells.shape[1] == 2:
            self._lines(seen[cells], color, width)
        elif cells.shape[1] > 2:
            front = cells[normals(points, cells) @ self.view.viewer > FACING]
            # One path around all faces fills neighbors once, without a line between them.
            count, corners = front.shape
            codes = np.tile([Path.MOVETO, *[Path.LINETO] * (corners - 1), Path.CLOSEPOLY], count)
            covered = Path(seen[np.column_stack([front, front[:, :1]])].reshape(-1, 2), codes)
            self.axes.add_artist(PathPatch(covered, color=color, alpha=0.2, linewidth=0))
            self._lines(seen[_ends(front)], color, 0.5 * width)

    def _lines(self, ends: Array, color: Any, width: float) -> None:
        lines = LineCollection(list(ends), colors=[color], linewidths=width, capstyle="round")
        self.axes.add_collection(lines)

    def finish(self, label_size: float | None = None, *, is_equal: bool = True) -> None:
        """Set ranges around all points, and labels; unless `is_equal`, the scales of the two directions may differ."""
        points = np.concatenate([part for part in self.drawn if len(part)] or [np.zeros((1, 2))])
        self.axes.update_datalim(points)
        if is_equal:
            self.axes.set_aspect("equal", adjustable="datalim")
        self.axes.autoscale_view()
        if np.any(np.abs(self.view.viewer) == 1.0):
            right, up = ("xyz"[int(np.argmax(np.abs(one)))] for one in (self.view.right, self.view.up))
            self.axes.set_xlabel(f"{right} (m)", fontsize=label_size)
            self.axes.set_ylabel(f"{up} (m)", fontsize=label_size)
            self.axes.tick_params(labelsize=label_size)
        else:
            self.axes.set_axis_off()
            directions(self.axes, 0.07 * float(np.ptp(points, axis=0).max()), self.view)


def _ends(cells: Integers) -> Integers:
    """(e, 2) the edges that one cell alone has: around what cells cover, and around their openings."""
    edges, number = sides(cells), int(cells.max(initial=0)) + 1
    return edges[~np.isin(edges @ [number, 1], edges @ [1, number])]
