"""Pictures of a map: each quantity over the grid in color, with the robot in its worst and in its best pose."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ...common.arrays import Array
from ...common.files import write_atomically
from ...common.rotations import in_3d
from ...map.map_file import CONDITIONS, Quantity, quantities
from ...map.pose_map import PoseMap
from ...mbs.posture.workspace import GridAxis
from ..figures.plot import image_of
from ..figures.style import ORDERED, SIZE, SceneAxes, legend, new_axes, projected, style
from ..projection import FRONT, PLANE, SIDE, SPACE

WORST, BEST = "#c22f2f", "#1f5fa8"
WIDE = (2 * SIZE[0], 1.3 * SIZE[1])  # inches
LABELS = ("worst", "best")
FLAT = 1e-9  # of the largest extent: no extent


def draw_map(pose_map: PoseMap) -> list[Path]:
    """Write a picture of each quantity that varies over the grid into the folder of the map; returns the files."""
    files = []
    with style():
        shown = {name: one for name, one in quantities(pose_map).items() if not one.everywhere}
        maps = ((name, _draw(pose_map, one)) for name, one in shown.items() if np.isfinite(one.values).any())
        for name, figure in (*maps, *_lobes(pose_map)):
            files.append(pose_map.plan.folder / f"{name}.png")
            write_atomically(files[-1], image_of(figure, "png"), "picture", ours=True)
    return files


def _lobes(pose_map: PoseMap) -> Iterator[tuple[str, Figure]]:
    """Stable depths over the spindle speed in the worst and in the best pose."""
    milling, table = pose_map.plan.milling, quantities(pose_map)
    for condition in CONDITIONS if milling is not None and len(milling.speeds) > 1 else ():
        lobes, name = pose_map.values.get(f"joints_{condition}/milling_lobes"), f"milling_{condition}"
        if milling is None or lobes is None or not np.isfinite(lobes).any():
            continue
        order, label = np.argsort(milling.speeds), "at any speed"
        figure, axes = new_axes(f"depth of cut with chatter above, {CONDITIONS[condition]}")
        for (number, color, _), pose in zip(_marks(table[name]), LABELS, strict=True):
            depth, least = 1e3 * lobes[number], table[name].values[number]
            depth[~np.isfinite(depth)] = np.nan
            axes.plot(np.array(milling.speeds)[order], depth[order], color=color, label=f"{pose} pose")
            if np.isfinite(least):
                axes.axhline(least, color=color, linestyle=":", label=label)
                label = ""
        axes.set_ylim(bottom=0.0)
        axes.set(xlabel="spindle speed (rev/min)", ylabel="depth of cut (mm)")
        legend(axes)
        yield f"lobes_{condition}", figure


def _draw(pose_map: PoseMap, quantity: Quantity) -> Figure:
    """Over the grid where it has one or two axes, and over the places of the point, with the robot."""
    grid = pose_map.plan.axes
    long = [axis for axis in grid if len(axis.values) > 1] or list(grid[:1])
    figure = Figure(figsize=WIDE if len(long) < 3 else (WIDE[1], WIDE[1]), layout="constrained")
    figure.suptitle(quantity.title, fontsize=9)
    if len(long) == 2:
        _heat_map(figure.add_subplot(1, 2, 1), pose_map, quantity, long)
    elif len(long) == 1:
        _curve(figure.add_subplot(1, 2, 1), quantity, long[0])
    axes = figure.add_subplot(1, 2, 2) if len(long) < 3 else figure.subplots()
    _workspace(axes, pose_map, quantity, has_bar=len(long) > 2)
    return figure


def _heat_map(axes: Axes, pose_map: PoseMap, quantity: Quantity, long: list[GridAxis]) -> None:
    values = quantity.values.reshape(pose_map.plan.shape).squeeze()
    mesh = axes.pcolormesh(*(_in_units(axis) for axis in long), values.T, cmap=ORDERED, shading="nearest")
    axes.grid(False)
    axes.figure.colorbar(mesh, ax=axes)
    grid = [_in_units(axis) for axis in pose_map.plan.axes]
    for number, color, marker in _marks(quantity):
        place = np.unravel_index(number, pose_map.plan.shape)
        at = [values[k] for axis, values, k in zip(pose_map.plan.axes, grid, place, strict=True) if axis in long]
        axes.plot(*at, marker, color=color, markeredgecolor="white", markersize=7)
    axes.set(xlabel=_label(long[0]), ylabel=_label(long[1]))
    if all(axis.is_place and axis.unit == "m" for axis in long):
        axes.set_aspect("equal")


def _curve(axes: Axes, quantity: Quantity, axis: GridAxis) -> None:
    x = _in_units(axis)
    axes.plot(x, quantity.values)
    for number, color, marker in _marks(quantity):
        axes.plot(x[number], quantity.values[number], marker, color=color, markersize=7)
    axes.set_xlabel(_label(axis))


def _workspace(axes: Axes, pose_map: PoseMap, quantity: Quantity, *, has_bar: bool) -> None:
    """Places of the point in color, and the robot; a robot that stays in a plane is seen against it."""
    place, robots = in_3d(pose_map.values["place"]), pose_map.values["robot"]
    known = np.isfinite(place).all(axis=1)
    seen = np.vstack([place[known], *(robots[number].reshape(-1, 3) for number, *_ in _marks(quantity))])
    extent = np.ptp(seen, axis=0)
    flat = [view for view, size in zip((SIDE, FRONT, PLANE), extent, strict=True) if size <= FLAT * extent.max()]
    scene = SceneAxes(axes, [*flat, SPACE][0])
    scene.drawn.append(cloud := projected(place[known], scene.view))
    colors = axes.scatter(cloud[:, 0], cloud[:, 1], c=quantity.values[known], cmap=ORDERED, s=6, linewidths=0)
    for (number, color, marker), label in zip(_marks(quantity), LABELS, strict=True):
        for line in robots[number]:
            scene.plot(line, color=color, linewidth=2.0, solid_capstyle="round")
        scene.plot(place[number][None], marker, color=color, markersize=6, label=label)
    scene.finish()
    legend(axes)
    if has_bar:
        axes.figure.colorbar(colors, ax=axes, shrink=0.6)


def _marks(quantity: Quantity) -> Iterator[tuple[int, str, str]]:
    return zip(quantity.extremes, (WORST, BEST), "v^", strict=True)


def _in_units(axis: GridAxis) -> Array:
    return axis.values if axis.unit == "m" else np.degrees(axis.values)


def _label(axis: GridAxis) -> str:
    return f"{axis.name} ({'m' if axis.unit == 'm' else '°'})"
