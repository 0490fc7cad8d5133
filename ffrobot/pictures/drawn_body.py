"""The bodies of an analysis as planar pictures draw them: outlines that move, deformed as far as asked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array, Indices
from ..common.errors import InputError
from ..common.plane import rotated
from ..mbs.fields.field_types import GROUND
from ..results.file import Results
from .motion import MovingBody, moving_bodies
from .outline import Outline, body_outline, points_outline


@dataclass(frozen=True)
class DrawnBody:
    """A body over T outputs, its outline, and how it moves along with those it hangs from (`motion.carried`)."""

    motion: MovingBody
    outline: Outline
    shift: Array

    def corners(self, k: int, scale: float = 1.0) -> Array:
        """The outline (m, 2) at output k in global axes (m), deformations `scale` times as large."""
        return self._placed(k, scale, self.outline.at + scale * self.outline.modes @ self.outline.p[k])

    def joints(self, k: int, scale: float = 1.0) -> Array:
        """The points of the body (j, 2), but its middle, in the same way."""
        kept = [i for i, name in enumerate(self.motion.point_names) if not name.endswith(".mid")]
        return self._placed(k, scale, (self.motion.points + scale * self.motion.deflection[k])[kept])

    def _placed(self, k: int, scale: float, at: Array) -> Array:
        moved: Array = self.motion.position[k] + (scale - 1.0) * self.shift[k] + rotated(self.motion.orientation[k], at)
        return moved


def drawn_bodies(results: Results, analysis: str, frames: Indices, notes: list[str]) -> list[DrawnBody]:
    """Those of an analysis at the outputs `frames`; `notes` are told what could not be drawn as it is."""
    bodies, shift = moving_bodies(results, analysis, frames)
    return [DrawnBody(body, outline(results, body, notes), of) for body, of in zip(bodies, shift, strict=True)]


def outline(results: Results, motion: MovingBody, notes: list[str]) -> Outline:
    """From the body's modal body, or from its points where it has none or that is not found."""
    if motion.modal is not None:
        try:
            return body_outline(results.modal_body(motion.name), motion.modal)
        except InputError as error:
            notes.append(f"{motion.name} is drawn through its points only: {error}")
    names = [label.removeprefix(f"{motion.name}.") for label in motion.point_names]
    return points_outline(names, motion.points, motion.deflection)


def ground_points(scenes: Iterable[Mapping[str, Any]]) -> list[tuple[float, float]]:
    """Where joints of any of the scenes sit on the ground, each place once, in m."""
    joints = [joint for scene in scenes for joint in scene.get("joint", []) if GROUND in joint["between"]]
    return list(dict.fromkeys(tuple(joint.get("at", (0.0, 0.0))) for joint in joints))


def box(bodies: Sequence[DrawnBody], scale: float = 1.0) -> Array:
    """(2, 2) lower left and upper right corner of all that the bodies cover over all outputs, in m."""
    outputs = range(len(bodies[0].motion.orientation))
    corners = [body.corners(k, scale) for body in bodies for k in outputs]
    everything = np.concatenate([part for part in corners if part.size])
    return np.array([np.nanmin(everything, axis=0), np.nanmax(everything, axis=0)])
