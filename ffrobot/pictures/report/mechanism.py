"""Data with which the page draws bodies at any output and exaggeration, and links in their modes."""

from collections.abc import Iterator, Sequence
from itertools import count
from typing import Any

import numpy as np

from ...common.arrays import Indices
from ...common.errors import InputError
from ...common.structs import struct
from ...fe_models.modal_body import ModalBody
from ..figures.shared import file_name
from ..motion import (
    Marker,
    MovingBody,
    chosen_frames,
    ground_places,
    joint_markers,
    largest_deflection,
    moving_bodies,
    targets,
    tool_markers,
    visible_exaggeration,
)
from ..projection import AXIS_LENGTH, COLORS, LINK, PLANE, SPACE, TOOL_COLORS, TOOL_LENGTH
from ..shapes import AMPLITUDE, body_surface, coarse_surface, coarsened, drawn_mode, triangles_of
from .charts import AnalysisRun, Chart, encoded, plain, shades

ABOVE = 0.1  # of the mechanism's size: distance of joints and paths in front of a planar scene's bodies
MAX_TRIANGLES = 4000  # of a body


def mechanism(runs: Sequence[AnalysisRun]) -> tuple[dict[str, Any], list[str]]:
    """Return the moving bodies of several runs as data for the page's script, and notes on missing parts.

    Each run has its own color; planar scenes are seen along z.
    """
    notes: list[str] = []
    moved = [moving_bodies(run.results, run.analysis, _frames(run)) for run in runs]
    first = {id(run.results): run.analysis for run in reversed(runs) if len(run.results.time(run.analysis)) > 1}
    opened = [first.get(id(run.results), run.results.analyses[0]) for run in runs]
    shown = [k for k, run in enumerate(runs) if run.analysis == opened[k]]  # others are hidden at first
    seen = [body for k in shown for body in moved[k]]
    corners = np.concatenate([body.global_points.reshape(-1, 3) for body in seen])
    low, high = corners.min(axis=0), corners.max(axis=0)
    size = float((high - low).max()) or 1.0
    entries = [
        {"color": COLORS[k % len(COLORS)], "visible": k in shown, **_run_data(run, moved[k], size, notes)}
        for k, run in enumerate(runs)
    ]
    end = max(float(runs[k].results.time(runs[k].analysis)[-1]) for k in shown)
    margin = np.maximum(0.06 * size, 0.12 * size - 0.5 * (high - low))
    is_plane = runs[0].results.space.is_plane
    data = {
        "runs": entries,
        "exaggeration": visible_exaggeration(size, largest_deflection(seen)),
        "speed": max(end / 8.0, 1e-3),  # plays for 8 s; the slider's end
        "range": np.stack([low - margin, high + margin], axis=1).tolist(),
        "size": size,
        "is_plane": is_plane,
        "view": {name: axis.tolist() for name, axis in (PLANE if is_plane else SPACE)._asdict().items()},
        "axis_length": AXIS_LENGTH * size,
        "tool_length": TOOL_LENGTH * size,
        "tool_colors": TOOL_COLORS,
        "above": ABOVE * size if is_plane else 0.0,
        "ground": ground_places(run.results.scene for run in runs).tolist(),
    }
    return data, list(dict.fromkeys(notes))


def _frames(run: AnalysisRun) -> Indices:
    return chosen_frames(run.results, run.analysis, 2000)


def _run_data(run: AnalysisRun, bodies: list[MovingBody], size: float, notes: list[str]) -> dict[str, Any]:
    wanted, frames = targets(run.results, run.analysis), _frames(run)
    shapes = [coarse_surface(run.results, body, size, MAX_TRIANGLES, notes) for body in bodies]
    paths = list[dict[str, Any]]()
    for target in wanted:
        paths.append({"name": plain(target.point)})
        if target.columns == run.results.space.translations:
            paths[-1]["target"] = encoded(target.places[frames[frames < len(target.wanted)]])
    return {
        "label": plain(run.label),
        "time": encoded(run.results.time(run.analysis)[frames]),
        "bodies": [
            {
                "name": plain(body.name),
                "position": encoded(body.position),
                "quaternion": encoded(body.orientation),
                "shift": encoded(body.shift),
                "points": encoded(shape.points),
                "shapes": encoded(shape.shapes.reshape(len(shape.points), -1)),
                "p": encoded(shape.coordinates),
                "triangles": encoded(shape.cells, "i4"),
            }
            for body, shape in zip(bodies, shapes, strict=True)
        ],
        "joints": [_marker_data(marker) for marker in joint_markers(run.results.scene, bodies)],
        "tools": [_marker_data(marker) for marker in tool_markers(wanted, bodies)],
        "paths": paths,
    }


def _marker_data(marker: Marker) -> dict[str, Any]:
    """Position, exaggeration (T, 3) and k directions (T, 3 k)."""
    number = marker.directions.shape[1]
    return {
        "name": plain(marker.name),
        "position": encoded(marker.position),
        "exaggeration": encoded(marker.exaggeration),
        "directions": encoded(marker.directions.reshape(len(marker.position), 3 * number)),
        "count": number,
    }


# Main motion of a family's modes: translation (0) or rotation (1), its axis, and its name in charts.
MOTION = {
    "in-plane-bending": (0, 1, "y"),
    "out-of-plane-bending": (0, 2, "z"),
    "axial": (0, 0, "x"),
    "torsion": (1, 0, "twist"),
}

FINEST = 32767  # a displacement of 1


@struct
class ModesOnPage:
    """A modal body on the page: charts of its modes, labels of the bodies that have it."""

    labels: tuple[str, ...]
    body: ModalBody
    charts: tuple[Chart, ...]

    @property
    def rows(self) -> Iterator[tuple[Any, ...]]:
        """Return number, family, frequency (Hz) and damping ratio of each mode."""
        return zip(count(1), self.body.family, self.body.frequency, self.body.damping_ratio)


def link_modes(runs: Sequence[AnalysisRun]) -> list[ModesOnPage]:
    """Return the modal bodies of all runs, each once; those whose files are missing are omitted."""
    users: dict[str, list[str]] = {}
    bodies: dict[str, ModalBody] = {}
    for run in runs:
        for name, file in run.results.modal_files.items():
            try:
                bodies.setdefault(file.sha256, run.results.modal_body(name))
            except InputError:
                continue  # the mechanism's notes say so
            users.setdefault(file.sha256, []).append(f"{run.source}: {name}" if run.source else name)
    return [
        ModesOnPage(tuple(dict.fromkeys(users[key])), body, tuple(_charts(body, f"modes{k}")))
        for k, (key, body) in enumerate(bodies.items())
    ]


def _charts(body: ModalBody, prefix: str) -> list[Chart]:
    charts = []
    x = np.linspace(body.stations.position[0, 0], body.stations.position[-1, 0], 201)
    _, *motions = body.along_axis(x)
    for family in dict.fromkeys(body.family):
        kind, axis, label = MOTION.get(family, (0, 1, "y"))
        shapes = motions[kind]
        members = [k for k, other in enumerate(body.family) if other == family]
        chart = Chart(file_name(prefix, family), f"{body.name}: {family}", f"{label}, largest = 1", x_label="x (m)")
        for k, color in zip(members, shades(len(members)), strict=True):
            shape, label = shapes[:, axis, k], f"mode {k + 1}: {body.frequency[k]:.5g} Hz"
            chart.add(label, x, shape / (np.abs(shape).max() or 1.0), line={"color": color, "width": 1.5})
        charts.append(chart)
    return charts


def surface_modes(links: Sequence[ModesOnPage]) -> dict[str, Any]:
    """Return surfaces with mode shapes as data for the page's script; links without known surface are omitted.

    Each link has, in base64, `points` (p, 3), m, of a coarsened surface, its `triangles` (t, 3), and up to twelve
    `modes` (k, p, 3): integers up to `FINEST`, times `amplitude` m.
    """
    entries = []
    for link in links:
        body, mesh = link.body, body_surface(link.body)
        if mesh.cells.shape[1] == 2:
            continue
        kept, triangles = coarsened(mesh.points, triangles_of(mesh.cells), 8000)
        shown = min(body.mode_count, 12)  # each costs 6 bytes a point
        # Scaled on all points, so that a mode does not depend on which of them are kept.
        modes = [drawn_mode(mesh.mode_shapes[:, :, k], 1.0)[0][kept] / AMPLITUDE for k in range(shown)]
        entries.append(
            {
                "label": ", ".join(link.labels),
                "points": encoded(mesh.points[kept]),
                "triangles": encoded(triangles, "i4"),
                "modes": encoded(np.round(FINEST * np.array(modes)), "i2"),
                "names": [f"{k + 1}: {body.frequency[k]:.5g} Hz, {body.family[k]}" for k in range(shown)],
                "amplitude": AMPLITUDE * body.length / FINEST,
            }
        )
    return {"links": entries, "up": LINK.up.tolist(), "viewer": LINK.viewer.tolist()}
