"""The mechanism in motion: what the page needs to draw every body at any output, deformed as much as asked for.

r = R + A (x + s Φ p) with the exaggeration s (formulation.md, section 1). Exaggerated bodies would come apart at their
joints: each is moved with the point it hangs from, along a tree of joints that starts at the ground.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..figures.palette import COLORS
from ..results_file import Array
from .charts import encoded, plain
from .outline import Outline, body_outline, points_outline
from .runs import Run, Target, targets

Indices = NDArray[np.intp]

MAX_FRAMES = 2000
GROUND = "ground"
VISIBLE_DEFORMATION = 0.05  # of the mechanism's size: what the slider starts at
PLAYING_SECONDS = 8.0
SLOWEST = 1e-3  # the slider's end


@dataclass(frozen=True)
class BodyMotion:
    """A body over T outputs: frame, outline, and its points at (k, 2) with their deflection (T, k, 2), in m."""

    name: str
    position: Array
    angle: Array
    outline: Outline
    point_names: tuple[str, ...]
    points: Array
    deflection: Array

    @property
    def global_points(self) -> Array:
        """Where the points are in global axes (T, k, 2), m."""
        return self.position[:, None] + _rotated(self.angle, self.points + self.deflection)


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
        bodies = [_motion(run, name, frames, notes) for name in _ordered_bodies(run)]
        entries.append(
            {
                "label": plain(run.label),
                "color": COLORS[k % len(COLORS)],
                "visible": run.analysis == run.results.analyses[0],
                "time": encoded(time[frames]),
                "bodies": [_body_data(run, body, bodies) for body in bodies],
                "paths": [_path_data(target, bodies, frames) for target in targets(run)],
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
        "exaggeration": _round_down(VISIBLE_DEFORMATION * size, max(deflections)),
        "speed": max(end / PLAYING_SECONDS, SLOWEST),
        "range": [[box[0, i] - margin, box[1, i] + margin] for i in range(2)],
        "ground": _ground_points(runs),
    }
    return Mechanism(data, list(dict.fromkeys(notes)))


def _motion(run: Run, name: str, frames: Indices, notes: list[str]) -> BodyMotion:
    """A body at the outputs `frames`; its outline from its modal body, or from its points where that is not found."""
    results, group = run.results, f"{run.analysis}/bodies/{name}"
    position, angle = results[f"{group}/position"][frames], results[f"{group}/angle"][frames]
    points = f"{run.analysis}/points"
    labels = [label for label in results.names(points) if label.startswith(f"{name}.")]
    deflection = _stacked([results[f"{points}/{label}/deflection"][frames] for label in labels], len(frames))
    reached = _stacked([results[f"{points}/{label}/position"][frames] for label in labels], len(frames))
    at = (_rotated(-angle[:1], reached[:1] - position[:1, None]) - deflection[:1])[0]
    along = np.argsort(at[:, 0], kind="stable")
    labels, at, deflection = [labels[i] for i in along], at[along], deflection[:, along]
    names = [label.removeprefix(f"{name}.") for label in labels]
    outline = points_outline(names, at, deflection)
    if name in results.modal_files:
        try:
            outline = body_outline(results.modal_body(name), results.modal(run.analysis, name)[frames])
        except InputError as error:
            notes.append(f"{name} is drawn through its points only: {error}")
    return BodyMotion(name, position, angle, outline, tuple(labels), at, deflection)


def _ordered_bodies(run: Run) -> list[str]:
    """Bodies in an order in which each comes after the one it hangs from."""
    names = [body["name"] for body in run.results.scene["body"]]
    tree = hanging(run.results.scene)
    return [*tree, *(name for name in names if name not in tree)]


def hanging(scene: dict[str, Any]) -> dict[str, tuple[str, str]]:
    """For each body the joint's (own point, point or ground it hangs from), nearest to the ground first."""
    tree: dict[str, tuple[str, str]] = {}
    reached, joints = {GROUND}, list(scene.get("joint", []))
    while True:
        found = [
            (own, other)
            for joint in joints
            for own, other in (joint["between"], joint["between"][::-1])
            if _body(other) in reached and _body(own) not in reached
        ]
        if not found:
            return tree
        own, other = found[0]
        tree[_body(own)] = (own, other)
        reached.add(_body(own))


def _body(side: str) -> str:
    return side.partition(".")[0]


def _body_data(run: Run, body: BodyMotion, bodies: Sequence[BodyMotion]) -> dict[str, Any]:
    outline = body.outline
    data: dict[str, Any] = {
        "name": body.name,
        "position": encoded(body.position),
        "angle": encoded(body.angle),
        "outline": encoded(outline.at),
        "modes": encoded(outline.modes),
        "p": encoded(outline.p),
        "filled": outline.filled,
        "points": encoded(body.points),
        "names": body.point_names,
        "deflection": encoded(body.deflection),
    }
    own, other = hanging(run.results.scene).get(body.name, ("", ""))
    if own in body.point_names:
        data["hangs"] = {"own": body.point_names.index(own), "from": _index(other, bodies)}
    return data


def _path_data(target: Target, bodies: Sequence[BodyMotion], frames: Indices) -> dict[str, Any]:
    """A point to be followed, and the path it should take where both components are specified."""
    data: dict[str, Any] = {"name": plain(target.point), "point": _index(target.point, bodies)}
    if target.columns == (0, 1):
        data["target"] = encoded(target.wanted[frames[frames < len(target.wanted)]])
    return data


def _index(point: str, bodies: Sequence[BodyMotion]) -> list[int] | None:
    """Numbers of the body and of its point; None for the ground."""
    return next(([i, b.point_names.index(point)] for i, b in enumerate(bodies) if point in b.point_names), None)


def _ground_points(runs: Sequence[Run]) -> list[tuple[float, float]]:
    """Where joints sit on the ground, in m."""
    joints = [joint for run in runs for joint in run.results.scene.get("joint", []) if GROUND in joint["between"]]
    return list(dict.fromkeys(tuple(joint.get("at", (0.0, 0.0))) for joint in joints))


def _stacked(arrays: Sequence[Array], outputs: int) -> Array:
    """Arrays (T, 2) side by side: (T, k, 2), also for none."""
    return np.stack(arrays, axis=1) if arrays else np.zeros((outputs, 0, 2))


def _rotated(angle: Array, vectors: Array) -> Array:
    """A(θ) times vectors (T, k, 2), for θ (T,)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _round_down(wanted: float, deflection: float) -> float:
    """The largest of 1, 2, 5, 10, … 1000 that exaggerates `deflection` to no more than `wanted`."""
    steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    return max((s for s in steps if s * deflection <= wanted), default=1.0)
