"""Axes x, y of planar scenes and x, y, z of 3D ones, seen in parallel projection: one metre is as long on each."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

from ...common.arrays import Array, Integers
from ...mbs.scene.space import Space
from ..projection import PLANE
from .parallel import normals

VIEW = (25.0, -55.0)  # degrees: elevation and azimuth of the viewer of 3D scenes
MARGIN = 0.04  # of the largest extent, around the robot
ZOOM = 0.86  # leaves room for the labels of the axes, which the layout of figures does not know of
FACING = 1e-3  # component of a unit normal towards the viewer from which on a cell is drawn
FILL = 0.2  # opacity of bodies: what they cover stays visible


class SceneAxes:
    """Axes at a `place` of a picture for what a scene in `space` has: points (…, 3), m, global axes.

    `finish` sets the ranges, after everything is drawn.
    """

    def __init__(self, picture: Figure, space: Space, place: tuple[int, int, int] = (1, 1, 1)) -> None:
        self.is_plane, self.columns = space.is_plane, list(space.translations)
        options: dict[str, Any] = {} if space.is_plane else {"projection": "3d", "computed_zorder": False}
        self.axes: Any = picture.add_subplot(*place, **options)
        self.drawn: list[Array] = []

    def plot(self, points: Array, *style: str, **options: Any) -> None:  # noqa: ANN401 (those of matplotlib's lines)
        """A line through points (n, 3), or markers."""
        self.axes.plot(*points[:, self.columns].T, *style, **options)
        self.drawn.append(points)

    def body(self, points: Array, cells: Integers, color: Any, width: float = 1.5) -> None:  # noqa: ANN401
        """Points (p, 3) and cells on them: lines, or in planar scenes a surface, which shows what it covers."""
        self.drawn.append(points)
        if cells.shape[1] == 2:
            self._lines(points[cells], color, width)
        elif cells.shape[1] > 2:
            front = cells[normals(points, cells) @ PLANE.viewer > FACING]
            self.axes.add_patch(
                PathPatch(_covered(points[front][..., self.columns]), color=color, alpha=FILL, linewidth=0)
            )
            self._lines(points[_ends(front)], color, 0.5 * width)

    def _lines(self, ends: Array, color: Any, width: float) -> None:  # noqa: ANN401
        kind = LineCollection if self.is_plane else Line3DCollection
        add = self.axes.add_collection if self.is_plane else self.axes.add_collection3d
        add(kind(list(ends[..., self.columns]), colors=[color], linewidths=width))

    def finish(self, label_size: float | None = None, *, is_equal: bool = True) -> None:
        """Ranges that hold all points, and labels; unless `is_equal` the scales of x and y of a plane may differ."""
        points = np.concatenate([part for part in self.drawn if len(part)] or [np.zeros((1, 3))])[:, self.columns]
        for name in "xyz"[: len(self.columns)]:
            pad = {} if self.is_plane else {"labelpad": 5.0}
            getattr(self.axes, f"set_{name}label")(f"{name} (m)", fontsize=label_size, **pad)
        if self.is_plane:
            self.axes.update_datalim(points)
            if is_equal:
                self.axes.set_aspect("equal", adjustable="datalim")
            self.axes.autoscale_view()
        else:
            _equal_axes(self.axes, points)
        if label_size is not None:
            self.axes.tick_params(labelsize=label_size)


def _covered(faces: Array) -> Path:
    """One path around all faces (c, v, 2), so that neighbors are filled once, without a line between them."""
    count, corners = faces.shape[:2]
    codes = np.tile([Path.MOVETO, *[Path.LINETO] * (corners - 1), Path.CLOSEPOLY], count)
    return Path(np.concatenate([faces, faces[:, :1]], axis=1).reshape(-1, 2), codes)


def _ends(cells: Integers) -> Integers:
    """(e, 2) the edges that one cell alone has: around what cells cover, and around their openings."""
    edges = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    number = int(cells.max(initial=0)) + 1
    return np.asarray(edges[~np.isin(edges @ [number, 1], edges @ [1, number])], dtype=np.int64)


def _equal_axes(axes: Any, points: Array) -> None:  # noqa: ANN401
    """Ranges that hold all points, a box as long as they are."""
    low, high = points.min(axis=0), points.max(axis=0)
    margin = MARGIN * max(float((high - low).max()), 1e-9)
    # an axis along which nothing is has a tenth of the largest extent, so that its box can be seen
    half = np.maximum(0.5 * (high - low) + margin, 0.1 * float((high - low).max()) + margin)
    middle = 0.5 * (low + high)
    for name, center, way in zip("xyz", middle, half, strict=True):
        getattr(axes, f"set_{name}lim")(center - way, center + way)
        axes.tick_params(axis=name, labelsize=7, pad=0)
        axes.locator_params(axis=name, nbins=max(2, int(5 * way / half.max())))
    axes.set_box_aspect(half, zoom=ZOOM)
    axes.set_proj_type("ortho")
    axes.view_init(*VIEW)
