"""Pictures of a map: each quantity over the grid in color, with the robot in its worst and in its best pose."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.files import write_atomically
from ...map.map_file import Quantity, quantities
from ...map.pose_map import PoseMap
from ...mbs.solve.workspace import GridAxis
from ..figures.style import ORDERED, SIZE, style

WORST, BEST = "#c22f2f", "#1f5fa8"
WIDE = (2 * SIZE[0], 1.3 * SIZE[1])  # inches
LABELS = ("worst", "best")
ALPHA = {2: 1.0, 3: 0.5}  # of places, by the number of their coordinates
ZOOM = 0.8  # leaves room for the labels of 3D axes


def draw_map(found: PoseMap) -> list[Path]:
    """A picture of each quantity in the folder of the map; their files."""
    files = []
    with style():
        for name, quantity in quantities(found).items():
            if not np.isfinite(quantity.values).any():
                continue
            content, path = io.BytesIO(), found.plan.folder / f"{name}.png"
            _draw(found, quantity).savefig(content, format="png")
            write_atomically(path, content.getvalue(), "picture", ours=True)
            files.append(path)
    return files


def _draw(found: PoseMap, quantity: Quantity) -> Figure:
    """Over the grid where it has one or two axes, and over the places of the point, with the robot."""
    grid = found.plan.axes
    long = [axis for axis in grid if len(axis.values) > 1] or list(grid[:1])
    figure = Figure(figsize=WIDE if len(long) < 3 else (WIDE[1], WIDE[1]), layout="constrained")
    figure.suptitle(quantity.title, fontsize=9)
    if len(long) == 2:
        _heat_map(figure.add_subplot(1, 2, 1), found, quantity, long)
    elif len(long) == 1:
        _curve(figure.add_subplot(1, 2, 1), found, quantity, long[0])
    position = (1, 2, 2) if len(long) < 3 else (1, 1, 1)
    projection = "3d" if found.values["place"].shape[1] == 3 else None
    _workspace(figure.add_subplot(*position, projection=projection), found, quantity, has_bar=len(long) > 2)
    return figure


def _heat_map(axes: Axes, found: PoseMap, quantity: Quantity, long: list[GridAxis]) -> None:
    values = quantity.values.reshape(found.plan.shape).squeeze()
    mesh = axes.pcolormesh(*(_in_units(axis) for axis in long), values.T, cmap=ORDERED, shading="nearest")
    axes.grid(False)
    axes.figure.colorbar(mesh, ax=axes)
    grid = [_in_units(axis) for axis in found.plan.axes]
    for number, color, marker in _marks(quantity):
        place = np.unravel_index(number, found.plan.shape)
        at = [values[k] for axis, values, k in zip(found.plan.axes, grid, place, strict=True) if axis in long]
        axes.plot(*at, marker, color=color, markeredgecolor="white", markersize=7)
    axes.set_xlabel(_label(long[0]))
    axes.set_ylabel(_label(long[1]))
    if long[0].is_place:
        axes.set_aspect("equal")


def _curve(axes: Axes, found: PoseMap, quantity: Quantity, axis: GridAxis) -> None:
    x = _in_units(axis)
    axes.plot(x, quantity.values)
    for number, color, marker in _marks(quantity):
        axes.plot(x[number], quantity.values[number], marker, color=color, markersize=7)
    axes.set_xlabel(_label(axis))


def _workspace(axes: Any, found: PoseMap, quantity: Quantity, *, has_bar: bool) -> None:  # noqa: ANN401 (2D or 3D)
    """Places of the point in color, and the robot before them."""
    place, size = found.values["place"], found.values["place"].shape[1]
    cloud = axes.scatter(*place.T, c=quantity.values, cmap=ORDERED, s=6, alpha=ALPHA[size], linewidths=0)
    for (number, color, marker), label in zip(_marks(quantity), LABELS, strict=True):
        for line in found.values["robot"][number]:
            axes.plot(*line[:, :size].T, color=color, linewidth=2.0, solid_capstyle="round", zorder=5)
        axes.plot(*place[number][:, None], marker, color=color, markersize=6, label=label, zorder=5)
    axes.set_aspect("equal", adjustable="datalim")
    if size == 3:
        axes.computed_zorder = False
        axes.set_box_aspect(None, zoom=ZOOM)
    for name in "xyz"[:size]:
        getattr(axes, f"set_{name}label")(f"{name} (m)")
    axes.legend(loc="best")
    if has_bar:
        axes.figure.colorbar(cloud, ax=axes, shrink=0.6)


def _marks(quantity: Quantity) -> Iterator[tuple[int, str, str]]:
    """Number, color and marker of the worst and the best pose."""
    yield quantity.worst, WORST, "v"
    yield quantity.best, BEST, "^"


def _in_units(axis: GridAxis) -> Array:
    return axis.values if axis.unit == "m" else np.degrees(axis.values)


def _label(axis: GridAxis) -> str:
    return f"{axis.name} ({'m' if axis.unit == 'm' else '°'})"
