"""Parallel projection on plain axes: where points are on the page, how bright surfaces are, which way the axes go.

True proportions of long thin bodies, which matplotlib's own third dimension squeezes into a cube.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from ...common.arrays import Array, Integers
from ..projection import View

BAR = 0.25  # of the width: about the length of the scale bar
EDGE = "#30465c"
DARKEST = 0.6  # how bright a cell is that the light passes along


def projected(points: Array, view: View) -> Array:
    """(…, 2) where points (…, 3) in m are on the page."""
    return np.stack([points @ view.right, points @ view.up], axis=-1)


def normals(points: Array, cells: Integers) -> Array:
    """(c, 3) unit normals of triangles or quadrilaterals; zero where a cell has no area."""
    first = points[cells[:, 0]]
    found = np.cross(points[cells[:, 1]] - first, points[cells[:, -1]] - first)
    return np.asarray(found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-300))


def lit(points: Array, cells: Integers, colors: Array, view: View) -> Array:
    """(c, 3) colours (c, 3) of cells in a light that comes from above the viewer.

    Which way the normals of the cells point is unknown, and hidden cells are painted over.
    """
    light = (view.viewer + view.up) / np.linalg.norm(view.viewer + view.up)
    return np.asarray(colors * (DARKEST + (1.0 - DARKEST) * np.abs(normals(points, cells) @ light))[:, None])


def directions(axes: Axes, size: float, view: View) -> None:
    """Arrows of `size` (m) along x, y and z below the picture, and a bar of a round length along x."""
    (left, right), bottom = axes.get_xlim(), axes.get_ylim()[0]
    x, y = left + 0.05 * (right - left), bottom - 2.0 * size
    for axis, name in zip(np.eye(3), "xyz", strict=True):
        dx, dy = size * projected(axis, view)
        axes.annotate("", (x + dx, y + dy), (x, y), arrowprops={"arrowstyle": "->", "linewidth": 0.6, "shrinkB": 0})
        axes.annotate(name, (x + 1.35 * dx, y + 1.35 * dy), ha="center", va="center", fontsize=7)
    length = round_below(BAR * (right - left))
    bar = np.array([x + 3.0 * size, y]) + np.array([[0.0, 0.0], length * projected(np.eye(3)[0], view)])
    axes.plot(*bar.T, color=EDGE, linewidth=1.5, solid_capstyle="butt")
    axes.annotate(f" {length:g} m", bar[1], va="center", fontsize=7)
    axes.update_datalim([(x - 0.6 * size, y - 0.6 * size), *bar])
    axes.autoscale_view()


def round_below(value: float) -> float:
    """The next of …, 0.1, 0.2, 0.5, 1, … not above a positive value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9)))
