"""Joints and tool frames as pictures have them: where they are, along which directions they move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.rotations import in_3d
from ..mbs.fields.field_types import GROUND
from ..results.file import Results
from .motion import MovingBody, section_axes

PLACES = ("x", "y", "z")  # components of trajectories that are places


@dataclass(frozen=True)
class Target:
    """Where a point should be: the `columns` (0 for x, 1 for y, 2 for z) of its position, (T, m) in m."""

    trajectory: str
    point: str
    columns: tuple[int, ...]
    wanted: Array

    @property
    def places(self) -> Array:
        """(T, 3) m, zero where it specifies nothing."""
        found = np.zeros((len(self.wanted), 3))
        found[:, self.columns] = self.wanted
        return found


def targets(results: Results, analysis: str) -> list[Target]:
    """The target of every trajectory of a point, over the first outputs of the analysis.

    A forward analysis does not hold trajectories: its targets are those of the analysis its actuation comes from.
    """
    found = []
    time = results.time(analysis)
    holders = (analysis, str(results.attributes(analysis).get("actuation", "")))
    for trajectory in results.scene.get("trajectory", []):
        groups = {holder: f"{holder}/trajectories/{trajectory['name']}" for holder in holders}
        holder = next((h for h, group in groups.items() if results.has(f"{group}/target")), None)
        if holder is None or "point" not in trajectory:
            continue
        wanted, common = results.data(f"{groups[holder]}/target"), min(len(results.time(holder)), len(time))
        if np.allclose(time[:common], results.time(holder)[:common], rtol=0, atol=1e-12):
            components = [str(c) for c in results.attributes(groups[holder])["components"]]
            columns = tuple(PLACES.index(c) for c in components if c in PLACES)
            found.append(Target(trajectory["name"], trajectory["point"], columns, wanted[:common, : len(columns)]))
    return found


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
