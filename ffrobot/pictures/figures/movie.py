"""Movies of an analysis by matplotlib: the bodies in motion, as deformed as can be seen, with the paths of points."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import cast

import matplotlib
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure

from ...common.arrays import Array, Indices
from ...results.file import Results
from ..motion import (
    Marker,
    PointTarget,
    ground_places,
    joint_markers,
    largest_deflection,
    moving_bodies,
    size_of,
    targets,
    tool_marker,
    tool_markers,
    visible_exaggeration,
)
from ..movie_file import Frame, MovieOptions, make_movie
from ..projection import AXIS_LENGTH, COLORS, PLANE, SPACE, TOOL_COLORS, TOOL_LENGTH
from ..shapes import coarse_surface, numbered_cells
from .style import SceneAxes, lit, literal, normals, projected, style

SIZE, DPI = (8.0, 4.8), 120  # inches; 960 x 576 pixels
FACE, AXIS, GROUND, WANTED = "#8fb8d4", "#30465c", "#8b95a3", "black"
TAKEN = COLORS[3]  # no color of a tool


def write_motion(results_path: Path, path: Path, options: MovieOptions | None = None) -> list[str]:
    """Write a movie of a results file by matplotlib; return notes on simplifications (`make_movie`)."""
    with style():
        return make_movie(results_path, path, options, _Frames)


def _ends(markers: Sequence[Marker], scale: float, reach: tuple[float, float], outputs: int) -> Array:
    """(T, a, 2, 3) of lines along all directions of markers, from one distance (m) to the other."""
    lines = [
        marker.exaggerated(scale)[:, None, None] + np.array(reach)[:, None] * marker.directions[:, :, None]
        for marker in markers
    ]
    return np.concatenate([np.zeros((outputs, 0, 2, 3)), *lines], axis=1)


class _Frames:
    """Frames: axes on which a scene is painted anew for every frame, over a background that is drawn once.

    Exaggerated positions at T outputs, m, global axes: `points` (T, p, 3) of all surfaces with `triangles` (t, 3),
    `joints` (T, j, 3), ends of `axes_of_joints` (T, a, 2, 3) and of axes of sections that follow paths, `tools`
    (T, 3 k, 2, 3). `places` (T, 3): true positions of points with paths.
    """

    def __init__(
        self, results: Results, analysis: str, outputs: Indices, scale: float | None, notes: list[str]
    ) -> None:
        self.time, self.view = results.time(analysis)[outputs], PLANE if results.space.is_plane else SPACE
        bodies = moving_bodies(results, analysis, outputs)
        self.size = size_of(bodies)
        if scale is None:
            scale = visible_exaggeration(self.size, largest_deflection(bodies))
        shapes = [coarse_surface(results, body, self.size, 3000, notes) for body in bodies]
        self.points = np.concatenate([shape.placed(scale) for shape in shapes], axis=1)
        self.triangles = np.concatenate(numbered_cells(shapes))
        joints, T, reach = joint_markers(results.scene, bodies), len(outputs), AXIS_LENGTH * self.size
        self.joints = np.stack([joint.exaggerated(scale) for joint in joints], 1) if joints else np.zeros((T, 0, 3))
        self.axes_of_joints = _ends(joints, scale, (-reach, reach), T)
        wanted = targets(results, analysis)
        self.tools = _ends(tool_markers(wanted, bodies), scale, (0.0, TOOL_LENGTH * self.size), T)
        self.places = [tool_marker(target.point, bodies).position for target in wanted]

        figure = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        self.canvas, self.axes = FigureCanvasAgg(figure), figure.subplots()
        exaggerated = "" if scale == 1.0 else f", deformations × {scale:g}"
        self.axes.set_title(f"{results.name}: {analysis}{exaggerated}", loc="left")
        self._draw_still(results, wanted)
        literal(figure)
        self.canvas.draw()  # also lays the figure out, once
        self.background = self.canvas.copy_from_bbox(figure.bbox)
        self.clock = self.axes.set_title("", loc="right")
        self.surface = PolyCollection([], linewidths=0.3)
        self.lines = LineCollection([], linewidths=1.0)
        self.marks = self.axes.plot([], [], "o", color=AXIS, markersize=3)[0]
        self.taken = [self.axes.plot([], [], color=TAKEN, linewidth=1.0)[0] for _ in wanted]
        for collection in (self.surface, self.lines):
            self.axes.add_collection(collection, autolim=False)

    def _draw_still(self, results: Results, paths: Sequence[PointTarget]) -> None:
        """The ground, the paths wanted, room for all that moves; labels of x and y, or directions."""
        scene = SceneAxes(self.axes, self.view)
        scene.plot(ground_places([results.scene]), "^", color=GROUND, markersize=10)
        for target in paths:
            if target.columns == results.space.translations:
                scene.plot(target.places, color=WANTED, linestyle="--", linewidth=0.8)
        for places in (self.points, self.axes_of_joints, self.tools):
            scene.drawn.append(projected(places, self.view).reshape(-1, 2))
        self.axes.margins(0.06)  # of the size of what is seen
        scene.finish()

    def __iter__(self) -> Iterator[Frame]:
        return map(self._at, range(len(self.time)))

    def _at(self, k: int) -> Frame:
        """The frame of output k: triangles that face away are left out, far ones are painted first."""
        points, view = self.points[k], self.view
        triangles = self.triangles[normals(points, self.triangles) @ view.viewer > 0.0]
        colors = lit(points, triangles, np.array(matplotlib.colors.to_rgb(FACE)), view)
        order = np.argsort((points @ view.viewer)[triangles].mean(axis=1), kind="stable")
        # An array is drawn faster than the list of corners that Matplotlib's types ask for.
        self.surface.set_verts(cast(Sequence[Array], projected(points, view)[triangles[order]]))
        self.surface.set(facecolors=colors[order], edgecolors=colors[order])
        axes, tools = self.axes_of_joints[k], self.tools[k]
        self.lines.set_segments(list(projected(np.concatenate([axes, tools]), view)))
        self.lines.set_colors([AXIS] * len(axes) + [TOOL_COLORS[j % 3] for j in range(len(tools))])
        self.marks.set_data(*projected(self.joints[k], view).T)
        for line, places in zip(self.taken, self.places, strict=True):
            line.set_data(*projected(places[: k + 1], view).T)
        self.clock.set_text(f"t = {self.time[k]:.3f} s")
        self.canvas.restore_region(self.background)
        for artist in (self.surface, *self.taken, self.lines, self.marks, self.clock):
            self.axes.draw_artist(artist)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()
