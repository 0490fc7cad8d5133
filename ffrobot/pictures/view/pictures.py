"""Pictures of grids by PyVista, without a window; in a process of its own, which VTK ends where OpenGL is missing."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np

from ...common.arrays import Array
from ...common.errors import SolveError
from ..body_surface import drawn_mode
from ..projection import LINK, SPACE, View

SECONDS = 300.0  # after which a machine that cannot draw is given up
SIZE = (1400, 800)  # pixels
PANEL = (700, 360)  # pixels, of a mode
COLUMNS = 2
MODES = 6  # that are drawn at most
MARGIN = 1.25  # how much larger than the link or robot the picture is
COLORS = "viridis"
GHOST = "#9a9a9a"
FOLD = 30.0  # degrees: an edge at which a surface bends by more is shown
BAR = {
    "vertical": False, "height": 0.05, "width": 0.4, "position_x": 0.3, "position_y": 0.02, "fmt": "%.3g",
    "color": "black", "title_font_size": 16, "label_font_size": 14, "n_labels": 4,
}  # fmt: skip


@dataclass(frozen=True)
class Picture:
    """A picture to be drawn.

    Attributes:
        title: above it.
        grid: the .vtkhdf file.
        path: of the PNG.
        step: of the grid's time steps.
        scale: of deflections; None for a modal body, whose modes are drawn.
        length: of a modal body, in m.
        in_space: whether z goes up, as in scenes in space.
    """

    title: str
    grid: str = ""
    path: str = ""
    step: int = 0
    scale: float | None = None
    length: float = 0.0
    in_space: bool = False


def draw_pictures(pictures: Sequence[Picture]) -> None:
    """Draw into PNG files. Raises `SolveError` where PyVista is not installed or cannot draw on this machine."""
    if find_spec("pyvista") is None:
        raise SolveError(
            "pictures need PyVista, which is not installed: pip install pyvista (with 'numpy<2' beside Debian's)"
        )
    jobs = json.dumps([asdict(picture) for picture in pictures])
    command = [sys.executable, "-c", f"from {__name__} import main; main()", jobs]
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=SECONDS)
    except subprocess.TimeoutExpired:
        raise SolveError(f"PyVista did not finish its pictures within {SECONDS:g} s") from None
    if done.returncode < 0:
        raise SolveError(
            "PyVista cannot draw on this machine: expected OpenGL through EGL, OSMesa or an X server, found none that"
            " works (Debian: apt install libegl1 libgl1-mesa-dri)"
        )
    if done.returncode:
        reason = (done.stderr.strip().splitlines() or ["no reason given"])[-1]
        raise SolveError(f"PyVista failed: {reason}")


def main() -> None:
    """Draw the pictures of the JSON list in the first argument; this is the process of its own."""
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)  # it tells of every way to OpenGL that it tries
    for job in json.loads(sys.argv[1]):
        picture = Picture(**job)
        plotter = _modes(picture) if picture.scale is None else _snapshot(picture, picture.scale)
        plotter.screenshot(picture.path)
        plotter.close()


def _snapshot(picture: Picture, scale: float) -> Any:  # noqa: ANN401 (PyVista's objects, here and below)
    """Bodies where they were, in outline, and as exaggerated, coloured by how much they are deformed."""
    import pyvista

    grid = _read(picture.grid, picture.step)
    plotter = pyvista.Plotter(off_screen=True, window_size=SIZE)
    shown = grid.copy()
    shown.points = grid.points + (scale - 1.0) * grid["exaggeration"]
    shown["deflection (mm)"] = 1e3 * np.linalg.norm(grid["deflection"], axis=1)
    if scale != 1.0:
        _add_outline(plotter, grid)
    _add(plotter, shown, "deflection (mm)", BAR)
    _finish(plotter, picture.title, shown.points, SPACE if picture.in_space else LINK)
    return plotter


def _modes(picture: Picture) -> Any:  # noqa: ANN401
    """The lowest modes, each as large as the others, over the undeformed link."""
    import pyvista

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
        _add_outline(plotter, grid)
        _add(plotter, shown, "size", None)
        _finish(plotter, name, shown.points, LINK)
    return plotter


def _read(path: str, step: int) -> Any:  # noqa: ANN401
    import pyvista
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(path)
    reader.UpdateInformation()
    reader.SetStep(step)
    reader.Update()
    return pyvista.wrap(reader.GetOutputDataObject(0))


def _add(plotter: Any, grid: Any, scalars: str, bar: dict[str, Any] | None) -> None:  # noqa: ANN401
    plotter.add_mesh(
        grid, scalars=scalars, cmap=COLORS, clim=[0.0, float(grid[scalars].max()) or 1.0], line_width=10, point_size=60,
        render_points_as_spheres=True, show_scalar_bar=bar is not None, scalar_bar_args=bar,
    )  # fmt: skip


def _add_outline(plotter: Any, grid: Any) -> None:  # noqa: ANN401
    """The edges of surfaces, thin; all of what is a line."""
    edges = grid.extract_feature_edges(FOLD)
    plotter.add_mesh(edges if edges.n_points else grid, style="wireframe", color=GHOST, line_width=1)


def _finish(plotter: Any, title: str, points: Array, view: View) -> None:  # noqa: ANN401
    """Title, directions, and the view of the other pictures."""
    plotter.set_background("white")
    plotter.add_text(title, font_size=9, color="black", position="upper_left")
    plotter.add_axes(color="black")
    plotter.enable_parallel_projection()
    plotter.view_vector(view.viewer, view.up)
    across, up = np.ptp(points @ view.right), np.ptp(points @ view.up)
    width, height = plotter.renderer.GetSize()
    plotter.camera.parallel_scale = 0.5 * MARGIN * max(up, across * height / width)
    plotter.enable_anti_aliasing("ssaa")
