"""How the bodies of a scene in space move, as a results file has it: r = R + A (x + s Φ p), exaggeration s."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, Indices
from ...common.rotations import of_quaternion
from ...results.file import Results
from ..motion import carried, ordered_bodies


@dataclass(frozen=True)
class SpatialBodyMotion:
    """A body over T outputs.

    Attributes:
        name: in the scene.
        position: (T, 3) R, origin of its frame, in m, global axes.
        quaternion: (T, 4) of its frame, scalar first.
        modal: (T, n) its modal coordinates; None of a rigid body.
        point_names: of its k points, as in the results: `fore.tip`; in the order of x.
        points: (k, 3) where they are in the frame, undeformed, in m.
        deflection: (T, k, 3) their Φ p, in the frame, in m.
        sections: (T, k, 4) quaternions of the sections there, global axes.
    """

    name: str
    position: Array
    quaternion: Array
    modal: Array | None
    point_names: tuple[str, ...]
    points: Array
    deflection: Array
    sections: Array

    @property
    def axes(self) -> Array:
        """A (T, 3, 3), columns the axes of the frame."""
        return of_quaternion(self.quaternion)

    @property
    def global_points(self) -> Array:
        """Where the points are in global axes (T, k, 3), m."""
        return placed(self, self.points + self.deflection)

    def global_deflection(self, point: str) -> Array:
        """A Φ p of a point (T, 3), in m: how much a unit of s moves it in global axes."""
        return turned(self, self.deflection[:, self.point_names.index(point)])


def turned(body: SpatialBodyMotion, vectors: Array) -> Array:
    """A times vectors (T, …, 3) of the frame: in global axes."""
    found: Array = np.einsum("tij,t...j->t...i", body.axes, np.broadcast_to(vectors, vectors.shape))
    return found


def placed(body: SpatialBodyMotion, places: Array) -> Array:
    """R + A x of places x (T, k, 3) in the frame, m: in global axes."""
    return body.position[:, None] + turned(body, places)


def spatial_body_motion(results: Results, analysis: str, name: str, frames: Indices) -> SpatialBodyMotion:
    """Body `name` of an analysis at the outputs `frames`."""
    group, points = f"{analysis}/bodies/{name}", f"{analysis}/points"
    position, quaternion = results[f"{group}/position"][frames], results[f"{group}/quaternion"][frames]
    labels = [label for label in results.names(points) if label.startswith(f"{name}.")]

    def of_all(dataset: str, columns: int) -> Array:
        found = [results[f"{points}/{label}/{dataset}"][frames] for label in labels]
        return np.stack(found, axis=1) if found else np.zeros((len(frames), 0, columns))

    deflection, reached = of_all("deflection", 3), of_all("position", 3)
    # x = Aᵀ (r − R) − Φ p, the same at all outputs
    at = (reached[0] - position[0]) @ of_quaternion(quaternion[0]) - deflection[0]
    along = np.argsort(at[:, 0], kind="stable")
    modal = results.modal(analysis, name)[frames] if name in results.modal_files else None
    return SpatialBodyMotion(
        name, position, quaternion, modal, tuple(labels[i] for i in along), at[along], deflection[:, along],
        of_all("quaternion", 4)[:, along],
    )  # fmt: skip


def spatial_motions(results: Results, analysis: str, frames: Indices) -> tuple[list[SpatialBodyMotion], list[Array]]:
    """All bodies, each after the one it hangs from; and how much a unit of s moves each as a whole (T, 3), m."""
    bodies = [spatial_body_motion(results, analysis, name, frames) for name in ordered_bodies(results.scene)]
    shift = carried(bodies, results.scene)
    return bodies, [shift[body.name] for body in bodies]


def section_axes(bodies: Sequence[SpatialBodyMotion], side: str, outputs: int) -> Array:
    """(T, 3, 3) the axes of the section on a `side` of a joint, "BODY.POINT"; of the ground the global ones."""
    for body in bodies:
        if side in body.point_names:
            return of_quaternion(body.sections[:, body.point_names.index(side)])
    return np.broadcast_to(np.eye(3), (outputs, 3, 3))
