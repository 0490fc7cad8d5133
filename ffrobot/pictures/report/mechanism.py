"""The mechanism in motion: what the page needs to draw every body at any output, as deformed as asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.arrays import Array, Indices
from ..motion import (
    Marker,
    MovingBody,
    Target,
    ground_places,
    joint_markers,
    moving_bodies,
    targets,
    tool_markers,
    visible_exaggeration,
)
from ..projection import AXIS_LENGTH, COLORS, PLANE, SPACE, TOOL_COLORS, TOOL_LENGTH
from ..shapes import coarsened, surface_shape, thickened, triangles_of
from .charts import encoded, plain
from .runs import Run

MAX_FRAMES = 2000
ABOVE = 0.1  # of the mechanism's size: how far before the bodies of a planar scene its joints and paths are drawn
MAX_TRIANGLES = 4000  # of a body
BAR = 0.008  # of the mechanism's size: radius of bars that stand for rigid bodies
PLAYING_SECONDS = 8.0
SLOWEST = 1e-3  # the slider's end


@dataclass(frozen=True)
class Mechanism:
    """What the script of the page draws, and notes on what could not be drawn as it is."""

    data: dict[str, Any]
    notes: list[str]


def mechanism(runs: Sequence[Run]) -> Mechanism:
    """The moving picture of several runs, each in a colour of its own; planar scenes are seen along z."""
    notes: list[str] = []
    moved = [moving_bodies(run.results, run.analysis, _frames(run)) for run in runs]
    shown = [k for k, run in enumerate(runs) if run.analysis == run.results.analyses[0]]  # others are hidden at first
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
            **_run_data(run, *moved[k], size, notes),
        }
        for k, run in enumerate(runs)
    ]
    end = max(float(runs[k].results.time(runs[k].analysis)[-1]) for k in shown)
    margin = np.maximum(0.06 * size, 0.12 * size - 0.5 * (high - low))
    is_plane = runs[0].results.space.is_plane
    data = {
        "runs": entries,
        "exaggeration": visible_exaggeration(size, max(deflections, default=0.0)),
        "speed": max(end / PLAYING_SECONDS, SLOWEST),
        "range": [[float(low[i] - margin[i]), float(high[i] + margin[i])] for i in range(3)],
        "size": size,
        "is_plane": is_plane,
        "view": {name: axis.tolist() for name, axis in (PLANE if is_plane else SPACE)._asdict().items()},
        "axis_length": AXIS_LENGTH * size,
        "tool_length": TOOL_LENGTH * size,
        "tool_colors": TOOL_COLORS,
        "above": ABOVE * size if is_plane else 0.0,
        "ground": ground_places(run.results.scene for run in runs).tolist(),
    }
    return Mechanism(data, list(dict.fromkeys(notes)))


def _frames(run: Run) -> Indices:
    outputs = len(run.results.time(run.analysis))
    return np.unique(np.linspace(0, outputs - 1, min(outputs, MAX_FRAMES)).astype(np.intp))


def _run_data(run: Run, bodies: list[MovingBody], shift: list[Array], size: float, notes: list[str]) -> dict[str, Any]:
    scene = run.results.scene
    wanted = targets(run.results, run.analysis)
    return {
        "bodies": [_body_data(run, body, s, BAR * size, notes) for body, s in zip(bodies, shift, strict=True)],
        "joints": [_marker_data(marker) for marker in joint_markers(scene, bodies, shift)],
        "tools": [_marker_data(marker) for marker in tool_markers(wanted, bodies, shift)],
        "paths": [_path_data(run, target) for target in wanted],
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


def _path_data(run: Run, target: Target) -> dict[str, Any]:
    """A point to be followed, and the path it should take where all components are specified."""
    data: dict[str, Any] = {"name": plain(target.point)}
    if target.columns == run.results.space.translations:
        frames = _frames(run)
        data["target"] = encoded(target.places[frames[frames < len(target.wanted)]])
    return data
