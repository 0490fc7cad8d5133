"""Mode shapes of the links: a chart for each family of a link, over its axis; and the surface of the link.

Surfaces are coarse enough for a page, with their modes as 16-bit numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.arrays import Array, Integers
from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ..figures.shared import file_name
from ..projection import UP, VIEWER
from ..shapes import AMPLITUDE, body_surface, coarsened, drawn_mode, triangles_of
from .charts import Chart, encoded, shades
from .runs import Run

# What a mode of a family does most: the translation or rotation of which axis, and how the chart calls it.
MOTION = {
    "in-plane-bending": ("translation", 1, "y"),
    "out-of-plane-bending": ("translation", 2, "z"),
    "axial": ("translation", 0, "x"),
    "torsion": ("rotation", 0, "twist"),
}

CURVE_POINTS = 201
MAX_TRIANGLES = 8000  # of a link
MODES = 12  # of a link at most, on its surface: each costs 6 bytes a point
FINEST = 32767  # a displacement of 1


@dataclass(frozen=True)
class LinkModes:
    """A modal body of the page, with the labels of the bodies that it serves."""

    labels: tuple[str, ...]
    body: ModalBody
    charts: tuple[Chart, ...]

    @property
    def rows(self) -> list[tuple[Any, ...]]:
        """Number, family, frequency (Hz) and damping ratio of each mode."""
        body = self.body
        return [(k + 1, body.family[k], body.frequency[k], body.damping_ratio[k]) for k in range(body.mode_count)]


def link_modes(runs: Sequence[Run]) -> list[LinkModes]:
    """The modal bodies behind the runs, each once; those whose file is not found are left out."""
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
        LinkModes(tuple(dict.fromkeys(users[key])), body, tuple(_charts(body, f"modes{k}")))
        for k, (key, body) in enumerate(bodies.items())
    ]


def _charts(body: ModalBody, prefix: str) -> list[Chart]:
    charts = []
    x = np.linspace(body.stations.position[0, 0], body.stations.position[-1, 0], CURVE_POINTS)
    places = [body.interpolate(at) for at in x]
    for family in dict.fromkeys(body.family):
        kind, axis, label = MOTION.get(family, ("translation", 1, "y"))
        shapes = np.array([getattr(place, kind) for place in places])
        members = [k for k, other in enumerate(body.family) if other == family]
        chart = Chart(file_name(prefix, family), f"{body.name}: {family}", f"{label}, largest = 1", x_label="x (m)")
        for k, color in zip(members, shades(len(members)), strict=True):
            shape = shapes[:, axis, k]
            largest = float(np.max(np.abs(shape)))
            line = {"color": color, "width": 1.5}
            label = f"mode {k + 1}: {body.frequency[k]:.4g} Hz"
            chart.add(label, x, shape / (largest or 1.0), line=line)
        charts.append(chart)
    return charts


def surface_modes(links: Sequence[LinkModes]) -> dict[str, Any]:
    """What the script of the page draws; links whose surface is not known are left out."""
    surfaces = [(link, body_surface(link.body)) for link in links]
    entries = [
        _entry(link, mesh.points, triangles_of(mesh.cells), mesh.mode_shapes)
        for link, mesh in surfaces
        if mesh.cells.shape[1] > 2
    ]
    return {"links": entries, "up": UP.tolist(), "viewer": VIEWER.tolist()}


def _entry(link: LinkModes, points: Array, triangles: Integers, shapes: Array) -> dict[str, Any]:
    """Points (p, 3) in m, triangles (t, 3), and modes (m, p, 3) of which the largest displacement is 1."""
    body, (kept, triangles) = link.body, coarsened(points, triangles, MAX_TRIANGLES)
    count = min(body.mode_count, MODES)
    # Scaled on all points, so that a mode does not depend on which of them are kept.
    modes = [drawn_mode(shapes[:, :, k], 1.0).displacement[kept] / AMPLITUDE for k in range(count)]
    return {
        "label": ", ".join(link.labels),
        "points": encoded(points[kept]),
        "triangles": encoded(triangles, "i4"),
        "modes": encoded(np.round(FINEST * np.array(modes)), "i2"),
        "names": [_name(body, k) for k in range(count)],
        "amplitude": AMPLITUDE * body.length / FINEST,
    }


def _name(body: ModalBody, k: int) -> str:
    return f"{k + 1}: {body.frequency[k]:.5g} Hz, {body.family[k]}"
