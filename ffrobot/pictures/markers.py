"""Joints and tool frames as pictures have them: where they are, along which directions they move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.rotations import in_3d
from ..mbs.fields.field_types import GROUND
from .motion import MovingBody, section_axes
from .path_targets import Target


@dataclass(frozen=True)
class Marker:
    """A place that moves, with directions.

    Attributes:
        name: of the joint, or of the point.
        position: (T, 3) m, global axes.
        exaggeration: (T, 3) m, by which it moves when deflections are made larger by one.
        directions: (T, k, 3) unit vectors in global axes.
    """

    name: str
    position: Array
    exaggeration: Array
    directions: Array

    def exaggerated(self, s: float) -> Array:
        """Where it is (T, 3), m, with deflections s times as large."""
        found: Array = self.position + (s - 1.0) * self.exaggeration
        return found


def joint_markers(scene: Mapping[str, Any], bodies: Sequence[MovingBody], shift: Sequence[Array]) -> list[Marker]:
    """Every joint at its second side, with the axes that it has: one, two of universal joints, none of others."""
    return [_joint(keys, bodies, shift) for keys in scene.get("joint", [])]


def tool_marker(point: str, bodies: Sequence[MovingBody], shift: Sequence[Array]) -> Marker:
    """The section "BODY.POINT" with its axes x, y, z, without them in planar scenes."""
    position, exaggeration = _place(point, bodies, shift)
    T, is_known = len(position), any(body.sections.size for body in bodies)
    axes = section_axes(bodies, point, T).swapaxes(1, 2) if is_known else np.zeros((T, 0, 3))
    return Marker(point, position, exaggeration, axes)


def tool_markers(targets: Iterable[Target], bodies: Sequence[MovingBody], shift: Sequence[Array]) -> list[Marker]:
    """Of each point that follows a path, once."""
    return [tool_marker(point, bodies, shift) for point in dict.fromkeys(target.point for target in targets)]


def _joint(keys: Mapping[str, Any], bodies: Sequence[MovingBody], shift: Sequence[Array]) -> Marker:
    first, second = keys["between"]
    side = second if second != GROUND else first
    position, exaggeration = _place(side, bodies, shift)
    T = len(position)
    directions = [
        section_axes(bodies, of, T) @ in_3d(np.array(keys[key]) / np.linalg.norm(keys[key]))
        for key, of in (("axis", first), ("second_axis", second))
        if key in keys
    ]
    return Marker(keys["name"], position, exaggeration, np.stack(directions, 1) if directions else np.zeros((T, 0, 3)))


def _place(side: str, bodies: Sequence[MovingBody], shift: Sequence[Array]) -> tuple[Array, Array]:
    for body, carried in zip(bodies, shift, strict=True):
        if side in body.point_names:
            k = body.point_names.index(side)
            return body.global_points[:, k], body.global_deflection(side) + carried
    raise KeyError(side)


def ground_places(scenes: Iterable[Mapping[str, Any]]) -> Array:
    """(g, 3) where joints of any of the scenes sit on the ground, each place once, in m."""
    joints = [joint for scene in scenes for joint in scene.get("joint", []) if GROUND in joint["between"]]
    places = [in_3d(np.array(joint.get("at", (0.0, 0.0)), dtype=float)) for joint in joints]
    return np.array(list(dict.fromkeys(map(tuple, places)))).reshape(-1, 3)
