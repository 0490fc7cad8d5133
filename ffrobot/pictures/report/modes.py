"""Mode shapes of the links: one chart for each family of a link, over its axis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.errors import InputError
from ...fe_models.modal_body import ModalBody
from ..figures.shared import file_name
from .charts import Chart, shades
from .runs import Run

# What a mode of a family does most: the translation or rotation of which axis, and how the chart calls it.
MOTION = {
    "in-plane-bending": ("translation", 1, "y"),
    "out-of-plane-bending": ("translation", 2, "z"),
    "axial": ("translation", 0, "x"),
    "torsion": ("rotation", 0, "twist"),
}

CURVE_POINTS = 201


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
