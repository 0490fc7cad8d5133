"""Movies of an analysis by matplotlib: the bodies in motion, as deformed as can be seen, with the paths of points."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import PathPatch

from ...common.arrays import Array, Indices
from ...results.file import Results
from ..drawn_body import DrawnBody, box, drawn_bodies, ground_points
from ..motion import visible_exaggeration
from ..movie_file import Frame, MovieOptions, check_movie, movie_outputs, moving_analysis, write_movie
from ..path_targets import Target, targets
from .filled import closed_path
from .movie_3d import Picture3D, moving_scene
from .palette import COLORS
from .style import literal, style

SIZE, DPI = (8.0, 4.8), 120  # inches; 960 x 576 pixels
MARGIN = 0.06  # of the size of what is seen
GROUND, WANTED = "#8b95a3", "black"


def write_motion(results_path: Path, path: Path, options: MovieOptions | None = None) -> list[str]:
    """Write a movie (.gif, .mp4) of a results file. Returns notes on what could not be drawn as it is.

    Raises `InputError` where the results cannot be read, have no such analysis or none that goes through time, or for
    another suffix; `SolveError` where the movie cannot be made or written.
    """
    options = options or MovieOptions()
    notes: list[str] = []
    check_movie(path)
    with Results(results_path) as results, style():
        analysis = moving_analysis(results, options.analysis)
        frames_of = frames_3d if results.is_spatial else motion_frames
        write_movie(path, frames_of(results, analysis, options, notes))
    return list(dict.fromkeys(notes))


def motion_frames(results: Results, analysis: str, options: MovieOptions, notes: list[str]) -> Iterator[Frame]:
    """The frames of a scene in the plane, one after the other."""
    outputs = movie_outputs(results.time(analysis), options.seconds)
    frames, shown = np.unique(outputs, return_inverse=True)
    bodies = drawn_bodies(results, analysis, frames, notes)
    scale = options.scale
    if scale is None:
        size = float(np.ptp(box(bodies), axis=0).max())
        scale = visible_exaggeration(size, max(float(np.abs(b.motion.deflection).max(initial=0.0)) for b in bodies))
    picture = _Picture(results, analysis, bodies, frames, scale)
    for k in shown:
        yield picture.at(int(k))


def frames_3d(results: Results, analysis: str, options: MovieOptions, notes: list[str]) -> Iterator[Frame]:
    """The frames of a scene in space, seen from a corner."""
    time = results.time(analysis)
    frames, shown = np.unique(movie_outputs(time, options.seconds), return_inverse=True)
    scene = moving_scene(results, analysis, frames, options.scale, notes)
    title = _title(results, analysis, scene.scale)
    picture = Picture3D(results, title, time[frames], scene, _figure())
    for k in shown:
        yield picture.at(int(k))


def _figure() -> Figure:
    return Figure(figsize=SIZE, dpi=DPI, layout="constrained")


def _title(results: Results, analysis: str, scale: float) -> str:
    return f"{results.name}: {analysis}" + ("" if scale == 1.0 else f", deformation × {scale:g}")


class _Picture:
    """Axes on which bodies are moved from frame to frame, over a background that is drawn once."""

    def __init__(
        self, results: Results, analysis: str, bodies: Sequence[DrawnBody], frames: Indices, scale: float
    ) -> None:
        self.bodies, self.scale, self.time = bodies, scale, results.time(analysis)[frames]
        figure = _figure()
        self.canvas, self.axes = FigureCanvasAgg(figure), figure.subplots()
        self.axes.set_title(_title(results, analysis, scale), loc="left")
        self._draw_still(results, targets(results, analysis))
        literal(figure)
        self.canvas.draw()  # also lays the figure out, once
        self.background = self.canvas.copy_from_bbox(figure.bbox)
        self.clock = self.axes.set_title("", loc="right")
        self.patches = [_patch(self.axes, body, COLORS[0]) for body in bodies]
        (self.joints,) = self.axes.plot([], [], "o", color=COLORS[0], markersize=5, markerfacecolor="white")

    def _draw_still(self, results: Results, paths: Sequence[Target]) -> None:
        """What does not move: the ground and the paths wanted; and everything that the axes have to show."""
        ground = np.array(ground_points([results.scene])).reshape(-1, 2)
        in_plane = [target for target in paths if target.columns == (0, 1)]
        self.axes.plot(*ground.T, "^", color=GROUND, markersize=13)
        for target in in_plane:
            self.axes.plot(*target.wanted.T, color=WANTED, linestyle="--", linewidth=0.8)
        self.taken = [(_line(self.axes), _taken(self.bodies, target.point)) for target in in_plane]
        self.axes.update_datalim(box(self.bodies, self.scale))
        self.axes.margins(MARGIN)
        self.axes.set_aspect("equal", adjustable="datalim")
        self.axes.autoscale_view()
        self.axes.set_xlabel("x (m)")
        self.axes.set_ylabel("y (m)")

    def at(self, k: int) -> Frame:
        """The frame of output k."""
        for body, patch in zip(self.bodies, self.patches, strict=True):
            patch.set_path(closed_path(body.corners(k, self.scale)))
        joints = np.concatenate([body.joints(k, self.scale) for body in self.bodies])
        self.joints.set_data(*joints.T)
        for line, places in self.taken:
            line.set_data(*places[: k + 1].T)
        self.clock.set_text(f"t = {self.time[k]:.3f} s")
        self.canvas.restore_region(self.background)
        for artist in (*(line for line, _ in self.taken), *self.patches, self.joints, self.clock):
            self.axes.draw_artist(artist)
        return np.asarray(self.canvas.buffer_rgba())[..., :3].copy()


def _patch(axes: Axes, body: DrawnBody, color: str) -> PathPatch:
    face = f"{color}55" if body.outline.filled else "none"
    patch = PathPatch(closed_path(body.corners(0)), facecolor=face, edgecolor=color, linewidth=1.5, zorder=3)
    axes.add_patch(patch)
    return patch


def _line(axes: Axes) -> Line2D:
    return axes.plot([], [], color=COLORS[1], linewidth=1.0)[0]


def _taken(bodies: Sequence[DrawnBody], point: str) -> Array:
    """Where a point is at all outputs (T, 2), m, in truth."""
    body = next(body.motion for body in bodies if point in body.motion.point_names)
    return body.global_points[:, body.point_names.index(point)]
