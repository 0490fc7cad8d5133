"""How the bodies of a scene move, as a results file has it: what every moving picture is drawn from.

r = R + A (x + s Φ p) with the exaggeration s (docs/theory.md, Kinematics). Exaggerated bodies would come apart at their
joints: each is moved with the point it hangs from, along a tree of joints that starts at the ground.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from ..common.arrays import Array, Indices
from ..common.plane import rotated
from ..mbs.scene.topology import Edge, Topology, spanning_forest
from ..results.file import Results
from ..results.joints import joint_type

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
        return self.position[:, None] + rotated(self.angle[:, None], self.points + self.deflection)

    def global_deflection(self, point: str) -> Array:
        """A Φ p of a point (T, 2), in m: how much a unit of s moves it in global axes."""
        k = self.point_names.index(point)
        return rotated(self.angle, self.deflection[:, k])


def body_motion(results: Results, analysis: str, name: str, frames: Indices) -> BodyMotion:
    """Body `name` of an analysis at the outputs `frames`."""
    group, points = f"{analysis}/bodies/{name}", f"{analysis}/points"
    position, angle = results[f"{group}/position"][frames], results[f"{group}/angle"][frames]
    labels = [label for label in results.names(points) if label.startswith(f"{name}.")]
    deflection = _stacked([results[f"{points}/{label}/deflection"][frames] for label in labels], len(frames))
    reached = _stacked([results[f"{points}/{label}/position"][frames] for label in labels], len(frames))
    at = (rotated(-angle[:1, None], reached[:1] - position[:1, None]) - deflection[:1])[0]
    along = np.argsort(at[:, 0], kind="stable")
    modal = results.modal(analysis, name)[frames] if name in results.modal_files else None
    return BodyMotion(name, position, angle, modal, tuple(labels[i] for i in along), at[along], deflection[:, along])


def ordered_bodies(scene: Mapping[str, Any]) -> list[str]:
    """Bodies in an order in which each comes after the one it hangs from."""
    return list(topology(scene).carriers)


def topology(scene: Mapping[str, Any]) -> Topology:
    """Which joint carries which body, of a scene as a results file has it."""
    joints = scene.get("joint", [])
    edges = [Edge(tuple(joint["between"]), int(not joint_type(scene, joint).locates)) for joint in joints]
    return spanning_forest([body["name"] for body in scene["body"]], edges)


class Moving(Protocol):
    """What `carried` has to know of a body, in the plane (d = 2) or in space (d = 3)."""

    @property
    def name(self) -> str:
        """In the scene."""

    @property
    def position(self) -> Array:
        """(T, d) of its frame, m."""

    @property
    def point_names(self) -> tuple[str, ...]:
        """Of its points, as in the results."""

    def global_deflection(self, point: str) -> Array:
        """A Φ p of a point (T, d), m."""


def carried(bodies: Sequence[Moving], scene: Mapping[str, Any]) -> dict[str, Array]:
    """For each body (T, d), m: how much a unit of s moves it as a whole, so that joints stay shut.

    `bodies` are all those of the scene, as `ordered_bodies` has them.
    """
    by_name, carriers = {body.name: body for body in bodies}, topology(scene).carriers
    shift: dict[str, Array] = {}
    for body in bodies:
        shift[body.name] = np.zeros_like(body.position)
        if (carrier := carriers[body.name]) is None:
            continue
        if carrier.own in body.point_names:
            shift[body.name] -= body.global_deflection(carrier.own)
        parent = by_name.get(carrier.parent)
        if parent is not None and carrier.other in parent.point_names:
            shift[body.name] += shift[parent.name] + parent.global_deflection(carrier.other)
    return shift


def visible_exaggeration(size: float, deflection: float) -> float:
    """The largest of 1, 2, 5, 10, … 1000 that keeps `deflection` to a visible part of the mechanism's `size`, in m."""
    steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    return max((s for s in steps if s * deflection <= VISIBLE_DEFORMATION * size), default=1.0)


def _stacked(arrays: Sequence[Array], outputs: int) -> Array:
    """Arrays (T, 2) side by side: (T, k, 2), also for none."""
    return np.stack(arrays, axis=1) if arrays else np.zeros((outputs, 0, 2))
