"""Pictures of grids by PyVista; `main` runs in a separate process (`view.draw_pictures`)."""

import pickle
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyvista
from vtkmodules.vtkCommonCore import vtkLogger
from vtkmodules.vtkIOHDF import vtkHDFReader

from ...common.arrays import Array
from ..projection import AXIS_LENGTH, LINK, SPACE, TOOL_COLORS, TOOL_LENGTH, View
from ..shapes import drawn_mode
from .view import Picture

SIZE, MOVIE_SIZE = (1400, 800), (960, 576)  # pixels, at most so wide
PANEL = (700, 360)  # pixels, of a mode
COLUMNS = 2
MODES = 6  # that are drawn at most
MARGIN = 1.15  # how much larger than the link or robot the picture is
COLORS = "viridis"
GHOST, METAL, BARE = "#9a9a9a", "#4a5563", "#c9ced6"
FOLD = 30.0  # degrees: an edge at which a surface bends by more is shown
ROD, PIN, STAND = 0.006, 0.009, 0.06  # of the size of the robot: radius of lines and of pins, height of the ground
AXIS = 0.003  # of the size of the robot: radius of axes
ROUND = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])  # ends of color bars, times a power of ten
SHOWN = {"deflection": ("deflection (mm)", 1e3), "von_mises": ("von Mises stress (MPa)", 1e-6)}
BAR = {
    "vertical": False,
    "height": 0.05,
    "width": 0.4,
    "position_x": 0.3,
    "position_y": 0.02,
    "fmt": "%.4g",
    "color": "black",
    "title_font_size": 16,
    "label_font_size": 14,
    "n_labels": 5,
}
BAR_ROOM = 0.12  # of the height, at the bottom
CORNER = (0.82, 0.0, 1.0, 0.18)  # of the picture, where the directions are: most robots stand on its left
LINE, VERTEX = 3, 1  # VTK's numbers of cells
_, Y, Z = np.eye(3)


def main() -> None:
    """Draw the list of `Picture` that the standard input contains (pickled)."""
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it tells of every way to OpenGL that it tries
    for picture in pickle.load(sys.stdin.buffer):
        _draw_modes(picture) if picture.scale is None else _draw_motion(picture, picture.scale)


def _draw_motion(picture: Picture, scale: float) -> None:
    """Draw bodies in true positions, pale, and exaggerated, colored; all frames have one view and one color scale."""
    name, unit = SHOWN[picture.color]
    grids = []  # as it was, and exaggerated with what it is colored by
    for step in picture.steps:
        grid = _read(picture.grid, step)
        shown = grid.copy()
        shown.points = grid.points + (scale - 1.0) * grid["exaggeration"]
        values = grid[picture.color]
        shown[name] = unit * (np.linalg.norm(values, axis=1) if values.ndim == 2 else values)
        grids.append((grid, shown))
    everything = np.concatenate([shown.points for _, shown in grids])
    largest = max(float(np.nanmax(shown[name], initial=0.0)) for _, shown in grids)
    # The next round number, of a few digits that quarters of it have too; 1 for zero.
    power = 10.0 ** np.floor(np.log10(largest)) if largest > 0.0 else 1.0
    limit = float(power * ROUND[np.searchsorted(ROUND, largest / power * (1.0 - 1e-9))])
    bar = BAR | {"title": f"{name}\n"} if largest > 0.0 else None
    for _, shown in grids:
        shown[name] = np.where(_is_bare(grids, name), np.nan, shown[name])
    size = float(np.ptp(everything, axis=0).max()) or 1.0
    view = SPACE if picture.in_space else LINK
    widest, height = MOVIE_SIZE if picture.movie else SIZE
    wide, high, _ = np.ptp(everything @ np.stack(view, axis=1), axis=0)
    needed = (1.0 - BAR_ROOM) * wide / max(high, 1e-9 * wide, 1e-300)
    window = 2 * round(0.5 * min(widest, max(1.1, needed) * height)), height  # no wider than what is seen needs
    for k, (grid, shown) in enumerate(grids):
        plotter = pyvista.Plotter(off_screen=True, window_size=window)
        if scale != 1.0 and not picture.movie:
            _add_ghost(plotter, grid)
        _add(plotter, shown, name, limit, ROD * size, bar)
        depth = 0.0 if picture.in_space else 1.2 * float(np.ptp(everything[:, 2])) + 3.0 * PIN * size
        _add_marks(plotter, picture, k, size, depth)
        _finish(plotter, picture.titles[k], everything, view, BAR_ROOM)
        plotter.screenshot(str(Path(picture.path) / f"{k:05d}.png") if picture.movie else picture.path)
        plotter.close()


def _is_bare(grids: Sequence[tuple[Any, Any]], name: str) -> Array:
    """(p,) whether a point is on a body that is zero everywhere at all steps (rigid): it has no color."""
    grid = grids[0][0]
    owner = np.zeros(grid.n_points, dtype=np.int64)
    owner[grid.cell_connectivity] = np.repeat(grid.cell_data["body"], np.diff(grid.offset))
    largest = np.zeros(int(owner.max(initial=0)) + 1)
    for _, shown in grids:
        np.fmax.at(largest, owner, shown[name])
    return largest[owner] == 0.0


def _draw_modes(picture: Picture) -> None:
    grid = _read(picture.grid, 0)
    names = sorted(name for name in grid.point_data if name.startswith("mode "))[:MODES]
    columns, rows = min(COLUMNS, len(names)), -(-len(names) // COLUMNS)
    plotter = pyvista.Plotter(off_screen=True, shape=(rows, columns), window_size=(PANEL[0] * columns, PANEL[1] * rows))
    for k, name in enumerate(names):
        plotter.subplot(k // columns, k % columns)
        displacement, size = drawn_mode(grid[name], picture.length)
        shown = grid.copy()
        shown.points = grid.points + displacement
        shown["size"] = size
        _add_ghost(plotter, grid)
        _add(plotter, shown, "size", 1.0, ROD * picture.length, None)
        _finish(plotter, name, shown.points, LINK)
    plotter.screenshot(picture.path)
    plotter.close()


def _read(path: str, step: int) -> Any:
    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.SetStep(step)
    reader.Update()
    return pyvista.wrap(reader.GetOutputDataObject(0))


def _add(plotter: Any, grid: Any, scalars: str, limit: float, rod: float, bar: dict[str, Any] | None) -> None:
    """Surfaces, smooth but at their folds; lines as rods, single points as balls."""
    kinds = grid.celltypes
    look = {
        "scalars": scalars, "cmap": COLORS, "clim": [0.0, limit], "nan_color": BARE, "ambient": 0.45, "diffuse": 0.7,
        "show_scalar_bar": bar is not None, "scalar_bar_args": bar,
    }  # fmt: skip
    for chosen in (kinds == LINE, kinds == VERTEX, (kinds != LINE) & (kinds != VERTEX)):
        if not chosen.any():
            continue
        part = grid.extract_cells(np.flatnonzero(chosen)).extract_surface(algorithm="dataset_surface")
        if kinds[chosen][0] == LINE:
            plotter.add_mesh(part.tube(radius=rod), smooth_shading=True, **look)
        elif kinds[chosen][0] == VERTEX:
            plotter.add_mesh(part, render_points_as_spheres=True, point_size=40, **look)
        else:
            plotter.add_mesh(part, smooth_shading=True, split_sharp_edges=True, feature_angle=FOLD, **look)


def _add_ghost(plotter: Any, grid: Any) -> None:
    edges = grid.extract_feature_edges(FOLD)
    plotter.add_mesh(grid, color=GHOST, opacity=0.25, line_width=2)
    plotter.add_mesh(edges if edges.n_points else grid, style="wireframe", color=GHOST, line_width=2)


def _add_marks(plotter: Any, picture: Picture, k: int, size: float, depth: float) -> None:
    """Joints with their axes, the axes x, y, z of what follows paths, what stands on the ground.

    Joints are balls, or in planar scenes, with a `depth`, pins through the robot.
    """
    scale = picture.scale or 1.0
    for joint in picture.joints:
        at = joint.exaggerated(scale)[k]
        if depth:
            _add_bar(plotter, at, Z, PIN * size, depth, METAL)
        else:
            plotter.add_mesh(pyvista.Sphere(PIN * size, at), color=METAL, smooth_shading=True, ambient=0.3)
        for axis in joint.directions[k]:
            _add_bar(plotter, at, axis, AXIS * size, 2.0 * AXIS_LENGTH * size, METAL)
    for tool in picture.tools:
        for axis, color in zip(tool.directions[k], TOOL_COLORS, strict=False):  # in planar scenes none
            middle = tool.exaggerated(scale)[k] + 0.5 * TOOL_LENGTH * size * axis
            _add_bar(plotter, middle, axis, AXIS * size, TOOL_LENGTH * size, color)
    up = Z if picture.in_space else Y
    for at in picture.ground:
        foot = at - 0.5 * STAND * size * up
        stand = pyvista.Cone(foot, up, height=STAND * size, radius=0.5 * STAND * size, resolution=4)
        plotter.add_mesh(stand, color=METAL, ambient=0.3)


def _add_bar(plotter: Any, at: Array, along: Array, radius: float, length: float, color: str) -> None:
    bar = pyvista.Cylinder(at, along, radius=radius, height=length)
    plotter.add_mesh(bar, color=color, smooth_shading=True, split_sharp_edges=True, ambient=0.3)


def _finish(plotter: Any, title: str, points: Array, view: View, room: float = 0.0) -> None:
    """Title, directions, and the view of the other pictures; `room` for a color bar is a part of the height."""
    plotter.set_background("white")
    plotter.add_text(title, font_size=9, color="black", position="upper_left")
    plotter.add_axes(color="black", viewport=CORNER)
    plotter.enable_parallel_projection()
    plotter.view_vector(view.viewer, view.up)
    corners = points @ np.stack(view, axis=1)
    low, high = corners.min(axis=0), corners.max(axis=0)
    width, height = plotter.renderer.GetSize()
    half = 0.5 * MARGIN * max((high - low)[1] / (1.0 - room), (high - low)[0] * height / width)
    middle = 0.5 * (low + high) - np.array([0.0, room * half, 0.0])
    plotter.camera.focal_point = middle @ view
    plotter.camera.position = (middle + np.array([0.0, 0.0, 10.0 * half])) @ view
    plotter.camera.parallel_scale = half
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
