"""Motion of bodies in a results file, from which all moving pictures are drawn; SI units.

r = R + A (x + s Φ p) with the exaggeration s (docs/theory.md, Kinematics). To keep joints closed, exaggerated bodies
move with the point that carries them, along a tree of joints from the ground on. Planar scenes move in z = 0.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..common.arrays import Array, Indices
from ..common.rotations import in_3d, of_quaternion
from ..common.structs import struct
from ..mbs.fields.field_types import GROUND
from ..mbs.scene.topology import Edge, spanning_forest
from ..results.file import Results
from ..results.joints import joint_type

VISIBLE_DEFORMATION, INVISIBLE = 0.05, 1e-3  # of the mechanism's size


@struct
class MovingBody:
    """Motion of a body with k points at T outputs, in global axes unless stated otherwise."""

    name: str
    position: Array  # (T, 3) R, origin of its frame, m
    orientation: Array  # (T, 4) quaternions of its frame, scalar first
    modal: Array | None  # (T, n) modal coordinates p, m·√kg; None for a rigid body
    point_names: tuple[str, ...]  # names of the points, as in results: `link2.tip`; in the order of x
    points: Array  # (k, 3) undeformed positions of the points in the frame, m
    deflection: Array  # (T, k, 3) deflections Φ p of the points in the frame, m
    # (T, k, 4) quaternions of the sections there; (T, 0, 4) in planar scenes, whose files have none
    sections: Array
    # (T, 3) displacement of the body per unit of exaggeration s, which keeps joints closed, m; global axes
    shift: Array

    @property
    def axes(self) -> Array:
        """A (T, 3, 3), whose columns are the unit axes of the frame, in global axes."""
        return of_quaternion(self.orientation)

    def turned(self, vectors: Array) -> Array:
        """Return `vectors` (T, …, 3), any unit, which are in axes of the frame, in global axes."""
        return np.einsum("tij,t...j->t...i", self.axes, vectors)

    def placed(self, places: Array) -> Array:
        """Return positions (T, k, 3), m, global axes, of `places` (T, k, 3), m, in the frame."""
        return self.position[:, None] + self.turned(places)

    @property
    def global_points(self) -> Array:
        """Return positions of the points (T, k, 3), m, global axes."""
        return self.placed(self.points + self.deflection)

    def exaggerated(self, s: float) -> Array:
        """Return positions of the points (T, k, 3), m, global axes, with deflections times s and closed joints."""
        return self.placed(self.points + s * self.deflection) + (s - 1.0) * self.shift[:, None]

    def global_deflection(self, point: str) -> Array:
        """Return the deflection of a point (T, 3), m, in global axes."""
        return self.turned(self.deflection[:, self.point_names.index(point)])


def moving_bodies(results: Results, analysis: str, frames: Indices) -> list[MovingBody]:
    """Return all bodies at the outputs `frames` (T,), each after the one that carries it."""
    joints = results.scene.get("joint", [])
    edges = [Edge(tuple(joint["between"]), int(not joint_type(joint).locates)) for joint in joints]
    names = [body["name"] for body in results.scene["body"]]
    bodies: dict[str, MovingBody] = {}
    for name, carrier in spanning_forest(names, edges).carriers.items():
        body = _moving_body(results, analysis, name, frames)
        shift = body.shift
        if carrier is not None and carrier.own in body.point_names:
            shift = shift - body.global_deflection(carrier.own)
        parent = None if carrier is None else bodies.get(carrier.parent)
        if carrier is not None and parent is not None and carrier.other in parent.point_names:
            shift = shift + parent.shift + parent.global_deflection(carrier.other)
        bodies[name] = replace(body, shift=shift)
    return list(bodies.values())


def chosen_frames(results: Results, analysis: str, count: int) -> Indices:
    """Return indices (T,) of at most `count` outputs equally far apart, one moved to the largest deflection."""
    time = results.time(analysis)
    frames = np.linspace(0, len(time) - 1, min(len(time), count)).round().astype(np.intp)
    points = [f"{analysis}/points/{point}/deflection" for point in results.names(f"{analysis}/points")]
    peaks = [results.peak(name) for name in points if results.has(name)]
    if peaks and max(peaks)[0] > 0.0:
        peak = int(np.abs(time - max(peaks)[1]).argmin())
        frames[np.abs(frames - peak).argmin()] = peak
    return np.unique(frames)


def _moving_body(results: Results, analysis: str, name: str, frames: Indices) -> MovingBody:
    group, points = f"{analysis}/bodies/{name}", f"{analysis}/points"
    position = in_3d(results[f"{group}/position"][frames])
    if results.has(f"{group}/quaternion"):
        orientation = results[f"{group}/quaternion"][frames]
    else:  # in a plane, of the angle θ
        half, zero = 0.5 * results[f"{group}/angle"][frames], np.zeros(len(frames))
        orientation = np.stack([np.cos(half), zero, zero, np.sin(half)], axis=-1)
    labels = [label for label in results.names(points) if label.startswith(f"{name}.")]

    def of_all(dataset: str, columns: int) -> Array:
        names = (f"{points}/{label}/{dataset}" for label in labels)
        histories = [in_3d(results[name][frames]) for name in names if results.has(name)]
        return np.stack(histories, axis=1) if histories else np.zeros((len(frames), 0, columns))

    deflection, reached, sections = of_all("deflection", 3), of_all("position", 3), of_all("quaternion", 4)
    # x = Aᵀ (r − R) − Φ p, the same at all outputs
    at = (reached[0] - position[0]) @ of_quaternion(orientation[0]) - deflection[0]
    along = np.argsort(at[:, 0], kind="stable")
    return MovingBody(
        name=name,
        position=position,
        orientation=orientation,
        modal=results.modal(analysis, name)[frames] if name in results.modal_files else None,
        point_names=tuple(labels[i] for i in along),
        points=at[along],
        deflection=deflection[:, along],
        sections=sections[:, along] if sections.size else sections,
        shift=np.zeros_like(position),
    )


def section_axes(bodies: Sequence[MovingBody], side: str, outputs: int) -> Array:
    """Axes (T, 3, 3), unit columns, global axes, of the section at `side` "BODY.POINT"; else of the body's frame.

    On the ground they are the global axes; `outputs`: T.
    """
    for body in bodies:
        if side in body.point_names:
            return of_quaternion(body.sections[:, body.point_names.index(side)]) if body.sections.size else body.axes
    return np.broadcast_to(np.eye(3), (outputs, 3, 3))


def size_of(bodies: Sequence[MovingBody]) -> float:
    """Return the largest extent, m, of the points of all bodies over all outputs; 1 if all coincide."""
    points = [body.global_points.reshape(-1, 3) for body in bodies]
    return float(np.ptp(np.concatenate(points), axis=0).max(initial=0.0)) or 1.0


def largest_deflection(bodies: Iterable[MovingBody]) -> float:
    """Return the largest deflection component of all points and outputs, m."""
    return max((float(np.abs(body.deflection).max(initial=0.0)) for body in bodies), default=0.0)


def visible_exaggeration(size: float, deflection: float) -> float:
    """Return the largest of 1, 2, 5, … 1000 for which `deflection` (m) is at most 5 % of the mechanism's `size` (m).

    1 if even 1000 times the deflection is invisible.
    """
    steps = [] if 1000.0 * deflection < INVISIBLE * size else [2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0]
    return max((s for s in steps if s * deflection <= VISIBLE_DEFORMATION * size), default=1.0)


@struct
class PointTarget:
    """Prescribed positions of a point at T outputs: `wanted` (T, c), m, of the global axes number `columns` (c)."""

    trajectory: str
    point: str
    columns: tuple[int, ...]
    wanted: Array

    @property
    def places(self) -> Array:
        """Return prescribed positions (T, 3), m, global axes; zero in components that are not prescribed."""
        places = np.zeros((len(self.wanted), 3))
        places[:, self.columns] = self.wanted
        return places


def targets(results: Results, analysis: str) -> list[PointTarget]:
    """Return the target of every trajectory of a point, at the first outputs, as far as it is known.

    Targets of a forward analysis are those of the analysis from which its actuation comes.
    """
    followed = []
    time = results.time(analysis)
    holders = (analysis, str(results.attributes(analysis).get("actuation", "")))
    for trajectory in results.scene.get("trajectory", []):
        groups = {holder: f"{holder}/trajectories/{trajectory['name']}" for holder in holders}
        holder = next((h for h, group in groups.items() if results.has(f"{group}/target")), None)
        if holder is None or "point" not in trajectory:
            continue
        wanted, common = results.data(f"{groups[holder]}/target"), min(len(results.time(holder)), len(time))
        if np.allclose(time[:common], results.time(holder)[:common], rtol=0, atol=1e-12):
            components = map(str, results.attributes(groups[holder])["components"])
            columns = tuple("xyz".index(c) for c in components if c in "xyz")  # not mx, my, mz
            wanted = wanted[:common, : len(columns)]
            followed.append(PointTarget(trajectory["name"], trajectory["point"], columns, wanted))
    return followed


@struct
class Marker:
    """A moving position with k directions, such as a joint with its axes, at T outputs."""

    name: str  # of the joint, or of the point
    position: Array  # (T, 3) m, global axes
    exaggeration: Array  # (T, 3) displacement per unit of exaggeration, m, global axes
    directions: Array  # (T, k, 3) unit vectors in global axes

    def exaggerated(self, s: float) -> Array:
        """Return the position (T, 3), m, global axes, with deflections times s."""
        return self.position + (s - 1.0) * self.exaggeration


def joint_markers(scene: Mapping[str, Any], bodies: Sequence[MovingBody]) -> list[Marker]:
    """Return joints at their second side, unless it is the ground, with one axis, two (universal joints) or none."""
    markers = []
    for keys in scene.get("joint", []):
        first, second = keys["between"]
        position, exaggeration = _place(second if second != GROUND else first, bodies)
        directions = [
            section_axes(bodies, of, len(position)) @ in_3d(np.array(keys[key]) / np.linalg.norm(keys[key]))
            for key, of in (("axis", first), ("second_axis", second))
            if key in keys
        ]
        axes = np.stack(directions, 1) if directions else np.zeros((len(position), 0, 3))
        markers.append(Marker(keys["name"], position, exaggeration, axes))
    return markers


def tool_marker(point: str, bodies: Sequence[MovingBody]) -> Marker:
    """Return the section at `point` "BODY.POINT" with its axes x, y, z; without axes in planar scenes."""
    position, exaggeration = _place(point, bodies)
    axes = section_axes(bodies, point, len(position)).swapaxes(1, 2)
    is_known = any(body.sections.size for body in bodies)
    return Marker(point, position, exaggeration, axes if is_known else axes[:, :0])


def tool_markers(targets: Iterable[PointTarget], bodies: Sequence[MovingBody]) -> list[Marker]:
    """Return a marker for each point that follows a path."""
    return [tool_marker(point, bodies) for point in dict.fromkeys(target.point for target in targets)]


def _place(side: str, bodies: Sequence[MovingBody]) -> tuple[Array, Array]:
    body = next(body for body in bodies if side in body.point_names)
    return body.global_points[:, body.point_names.index(side)], body.global_deflection(side) + body.shift


def ground_places(scenes: Iterable[Mapping[str, Any]]) -> Array:
    """Return positions (g, 3), m, global axes, of joints on the ground in any of the scenes, each once."""
    joints = [joint for scene in scenes for joint in scene.get("joint", []) if GROUND in joint["between"]]
    places = [in_3d(np.array(joint.get("at", (0.0, 0.0)), dtype=float)) for joint in joints]
    return np.array(list(dict.fromkeys(map(tuple, places)))).reshape(-1, 3)
