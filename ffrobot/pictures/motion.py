"""How the bodies of a scene move, as a results file has it: what every moving picture is drawn from.

r = R + A (x + s Φ p) with the exaggeration s (formulation.md, section 1). Exaggerated bodies would come apart at their
joints: each is moved with the point it hangs from, along a tree of joints that starts at the ground.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array, Indices
from ..results.file import Results

GROUND = "ground"
VISIBLE_DEFORMATION = 0.05  # of the mechanism's size


@dataclass(frozen=True)
class BodyMotion:
    """A body over T outputs.

    Attributes:
        name: in the scene.
        position: (T, 2) R, origin of its frame, in m.
        angle: (T,) θ of its frame, in rad.
        modal: (T, n) its modal coordinates; None of a rigid body.
        point_names: of its k points, as in the results: `link2.tip`; in the order of x.
        points: (k, 2) where they are in the frame, undeformed, in m.
        deflection: (T, k, 2) their Φ p, in the frame, in m.
    """

    name: str
    position: Array
    angle: Array
    modal: Array | None
    point_names: tuple[str, ...]
    points: Array
    deflection: Array

    @property
    def global_points(self) -> Array:
        """Where the points are in global axes (T, k, 2), m."""
        return self.position[:, None] + rotated(self.angle, self.points + self.deflection)

    def global_deflection(self, point: str) -> Array:
        """A Φ p of a point (T, 2), in m: how much a unit of s moves it in global axes."""
        k = self.point_names.index(point)
        return rotated(self.angle, self.deflection[:, k : k + 1])[:, 0]


def body_motion(results: Results, analysis: str, name: str, frames: Indices) -> BodyMotion:
    """Body `name` of an analysis at the outputs `frames`."""
    group, points = f"{analysis}/bodies/{name}", f"{analysis}/points"
    position, angle = results[f"{group}/position"][frames], results[f"{group}/angle"][frames]
    labels = [label for label in results.names(points) if label.startswith(f"{name}.")]
    deflection = _stacked([results[f"{points}/{label}/deflection"][frames] for label in labels], len(frames))
    reached = _stacked([results[f"{points}/{label}/position"][frames] for label in labels], len(frames))
    at = (rotated(-angle[:1], reached[:1] - position[:1, None]) - deflection[:1])[0]
    along = np.argsort(at[:, 0], kind="stable")
    modal = results.modal(analysis, name)[frames] if name in results.modal_files else None
    return BodyMotion(name, position, angle, modal, tuple(labels[i] for i in along), at[along], deflection[:, along])


def ordered_bodies(scene: Mapping[str, Any]) -> list[str]:
    """Bodies in an order in which each comes after the one it hangs from."""
    tree = hanging(scene)
    return [*tree, *(body["name"] for body in scene["body"] if body["name"] not in tree)]


def hanging(scene: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
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


def carried(bodies: Sequence[BodyMotion], scene: Mapping[str, Any]) -> dict[str, Array]:
    """For each body (T, 2), m: how much a unit of s moves it as a whole, so that joints stay shut.

    `bodies` are all those of the scene, as `ordered_bodies` has them.
    """
    by_name, tree = {body.name: body for body in bodies}, hanging(scene)
    shift: dict[str, Array] = {}
    for body in bodies:
        own, other = tree.get(body.name, ("", GROUND))
        shift[body.name] = np.zeros_like(body.position)
        if own in body.point_names:
            shift[body.name] -= body.global_deflection(own)
        if other in (parent := by_name.get(_body(other), body)).point_names:
            shift[body.name] += shift[parent.name] + parent.global_deflection(other)
    return shift


def visible_exaggeration(size: float, deflection: float) -> float:
    """The largest of 1, 2, 5, 10, … 1000 that keeps `deflection` to a visible part of the mechanism's `size`, in m."""
    steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    return max((s for s in steps if s * deflection <= VISIBLE_DEFORMATION * size), default=1.0)


def rotated(angle: Array, vectors: Array) -> Array:
    """A(θ) times vectors (T, k, 2), for θ (T,)."""
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = vectors[..., 0], vectors[..., 1]
    return np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)


def _body(side: str) -> str:
    return side.partition(".")[0]


def _stacked(arrays: Sequence[Array], outputs: int) -> Array:
    """Arrays (T, 2) side by side: (T, k, 2), also for none."""
    return np.stack(arrays, axis=1) if arrays else np.zeros((outputs, 0, 2))
