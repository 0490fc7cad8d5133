"""The mechanism in space in motion: what the page needs to draw every body at any output, as deformed as asked."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...common.arrays import Array, Indices
from ..coarse_surface import coarsened, triangles_of
from ..drawn_3d.joints import Marker, ground_places, joint_markers, tool_marker
from ..drawn_3d.marks import AXIS_LENGTH, TOOL_COLORS, TOOL_LENGTH
from ..drawn_3d.shapes import surface_shape, thickened
from ..figures.palette import COLORS
from ..motion import MovingBody, moving_bodies, visible_exaggeration
from ..path_targets import Target, targets
from ..projection import SPACE
from .charts import encoded, plain
from .mechanism import PLAYING_SECONDS, SLOWEST, Mechanism
from .runs import Run

MAX_FRAMES = 1000
MAX_TRIANGLES = 4000  # of a body
BAR = 0.008  # of the mechanism's size: radius of bars that stand for rigid bodies


def mechanism_data(runs: Sequence[Run]) -> Mechanism:
    """The moving picture of several runs in space, each in a colour of its own."""
    notes: list[str] = []
    moved = [moving_bodies(run.results, run.analysis, _frames(run)) for run in runs]
    shown = [k for k, run in enumerate(runs) if run.analysis == run.results.analyses[0]]
    corners = np.concatenate([body.global_points.reshape(-1, 3) for k in shown for body in moved[k][0]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float((high - low).max()) or 1.0
    deflections = [float(np.abs(body.deflection).max(initial=0.0)) for k in shown for body in moved[k][0]]
    entries = [
        {
            "label": plain(run.label),
            "color": COLORS[k % len(COLORS)],
            "visible": k in shown,
            "time": encoded(run.results.time(run.analysis)[_frames(run)]),
            **_run_data(run, *moved[k], BAR * size, notes),
        }
        for k, run in enumerate(runs)
    ]
    end = max(float(runs[k].results.time(runs[k].analysis)[-1]) for k in shown)
    exaggeration = visible_exaggeration(size, max(deflections, default=0.0))
    margin = np.maximum(0.06 * size, 0.12 * size - 0.5 * (high - low))
    data = {
        "runs": entries,
        "exaggeration": exaggeration,
        "speed": max(end / PLAYING_SECONDS, SLOWEST),
        "range": [[float(low[i] - margin[i]), float(high[i] + margin[i])] for i in range(3)],
        "size": size,
        "viewer": SPACE.viewer.tolist(),
        "axis_length": AXIS_LENGTH * size,
        "tool_length": TOOL_LENGTH * size,
        "tool_colors": TOOL_COLORS,
        "ground": ground_places(run.results.scene for run in runs).tolist(),
    }
    return Mechanism(data, list(dict.fromkeys(notes)))


def _frames(run: Run) -> Indices:
    outputs = len(run.results.time(run.analysis))
    return np.unique(np.linspace(0, outputs - 1, min(outputs, MAX_FRAMES)).astype(np.intp))


def _run_data(run: Run, bodies: list[MovingBody], shift: list[Array], bar: float, notes: list[str]) -> dict[str, Any]:
    scene = run.results.scene
    wanted = targets(run.results, run.analysis)
    points = dict.fromkeys(target.point for target in wanted)
    return {
        "bodies": [_body_data(run, body, s, bar, notes) for body, s in zip(bodies, shift, strict=True)],
        "joints": [_marker_data(marker) for marker in joint_markers(scene, bodies, shift)],
        "tools": [_marker_data(tool_marker(point, bodies, shift)) for point in points],
        "paths": [_path_data(target, _frames(run)) for target in wanted],
    }


def _body_data(run: Run, body: MovingBody, shift: Array, bar: float, notes: list[str]) -> dict[str, Any]:
    """Surface points x (p, 3), their displacements Φ (p, 3, n), and the motion R, e, p of the body with its shift."""
    shape = thickened(surface_shape(run.results, body, notes), bar)
    kept, triangles = coarsened(shape.points, triangles_of(shape.cells), MAX_TRIANGLES)
    return {
        "name": plain(body.name),
        "position": encoded(body.position),
        "quaternion": encoded(body.orientation),
        "shift": encoded(shift),
        "points": encoded(shape.points[kept]),
        "shapes": encoded(shape.shapes[kept].reshape(len(kept), -1)),
        "p": encoded(shape.coordinates),
        "triangles": encoded(triangles, "i4"),
    }


def _marker_data(marker: Marker) -> dict[str, Any]:
    """Position, exaggeration (T, 3) and k directions (T, 3 k)."""
    count = marker.directions.shape[1]
    return {
        "name": plain(marker.name),
        "position": encoded(marker.position),
        "exaggeration": encoded(marker.exaggeration),
        "directions": encoded(marker.directions.reshape(len(marker.position), 3 * count)),
        "count": count,
    }


def _path_data(target: Target, frames: Indices) -> dict[str, Any]:
    """A point to be followed, and the path it should take where all three components are specified."""
    data: dict[str, Any] = {"name": plain(target.point)}
    if target.columns == (0, 1, 2):
        data["target"] = encoded(target.wanted[frames[frames < len(target.wanted)]])
    return data
