"""The mechanism in motion: what the page needs to draw every body at any output, as deformed as asked."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...common.arrays import Indices
from ..drawn_body import ground_points, outline
from ..figures.palette import COLORS
from ..motion import MovingBody, moving_bodies, topology, visible_exaggeration
from ..outline import Outline
from ..path_targets import Target, targets
from .charts import encoded, plain
from .runs import Run

MAX_FRAMES = 2000
PLAYING_SECONDS = 8.0
SLOWEST = 1e-3  # the slider's end


@dataclass(frozen=True)
class Mechanism:
    """What the script of the page draws, and notes on what could not be drawn as it is."""

    data: dict[str, Any]
    notes: list[str]


def mechanism(runs: Sequence[Run]) -> Mechanism:
    """The moving picture of several runs, each in a colour of its own."""
    notes: list[str] = []
    entries, corners, deflections, end = [], [], [0.0], 0.0
    for k, run in enumerate(runs):
        time = run.results.time(run.analysis)
        frames = np.unique(np.linspace(0, len(time) - 1, min(len(time), MAX_FRAMES)).astype(np.intp))
        bodies, _ = moving_bodies(run.results, run.analysis, frames)
        entries.append(
            {
                "label": plain(run.label),
                "color": COLORS[k % len(COLORS)],
                "visible": run.analysis == run.results.analyses[0],
                "time": encoded(time[frames]),
                "bodies": [_body_data(run, body, bodies, outline(run.results, body, notes)) for body in bodies],
                "paths": [_path_data(target, bodies, frames) for target in targets(run.results, run.analysis)],
            }
        )
        if run.analysis != run.results.analyses[0]:
            continue  # hidden at first: does not set the scale
        corners += [np.array([p.min((0, 1)), p.max((0, 1))]) for body in bodies if (p := body.global_points).size]
        deflections += [float(np.abs(body.deflection).max(initial=0.0)) for body in bodies]
        end = max(end, float(time[-1]))
    box = np.array([np.min(corners, axis=(0, 1)), np.max(corners, axis=(0, 1))])
    size = float(np.max(box[1] - box[0]))
    margin = 0.1 * size
    data = {
        "runs": entries,
        "exaggeration": visible_exaggeration(size, max(deflections)),
        "speed": max(end / PLAYING_SECONDS, SLOWEST),
        "range": [[box[0, i] - margin, box[1, i] + margin] for i in range(2)],
        "ground": ground_points([run.results.scene for run in runs]),
    }
    return Mechanism(data, list(dict.fromkeys(notes)))


def _body_data(run: Run, body: MovingBody, bodies: Sequence[MovingBody], shape: Outline) -> dict[str, Any]:
    data: dict[str, Any] = {
        "name": body.name,
        "position": encoded(body.position),
        "angle": encoded(body.orientation),
        "outline": encoded(shape.at),
        "modes": encoded(shape.modes),
        "p": encoded(shape.p),
        "filled": shape.filled,
        "points": encoded(body.points),
        "names": body.point_names,
        "deflection": encoded(body.deflection),
    }
    carrier = topology(run.results.scene).carriers[body.name]
    if carrier is not None and carrier.own in body.point_names:
        data["hangs"] = {"own": body.point_names.index(carrier.own), "from": _index(carrier.other, bodies)}
    return data


def _path_data(target: Target, bodies: Sequence[MovingBody], frames: Indices) -> dict[str, Any]:
    """A point to be followed, and the path it should take where both components are specified."""
    data: dict[str, Any] = {"name": plain(target.point), "point": _index(target.point, bodies)}
    if target.columns == (0, 1):
        data["target"] = encoded(target.wanted[frames[frames < len(target.wanted)]])
    return data


def _index(point: str, bodies: Sequence[MovingBody]) -> list[int] | None:
    """Numbers of the body and of its point; None for the ground."""
    return next(([i, b.point_names.index(point)] for i, b in enumerate(bodies) if point in b.point_names), None)
