"""Mechanisms that move in a plane, as the core solves them there: with the same q, v and forces along them.

All joints turn about its normal or slide in it, bodies bend in it. What is across it does no work then: offsets of
points and masses, forces, and rows that close loops, which hold there by themselves. Joints carry it all the same:
reactions (`quantities/reactions.py`) follow from the motion, with the masses where they are in space.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Integers, as_floats
from .. import _core
from .kinematics import CutPlace, ModelParts
from .projection import EXACT, AcrossError, axes_across, axes_of_triad, planar_data, planar_marker

PLANAR = {
    _core.JointKind.revolute: _core.JointKind.revolute,
    _core.JointKind.prismatic: _core.JointKind.prismatic,
    _core.JointKind.weld: _core.JointKind.weld,
    _core.JointKind.planar: _core.JointKind.free,
}
SHARED = ("name", "parent", "parent_marker", "inboard_marker", "rotor_inertia", "gear_ratio", "driven", "of_section")
"""What bodies are in the plane and in space alike."""


class Plane(NamedTuple):
    """A mechanism of the core in the plane."""

    model: _core.PlanarModel  # of it
    axes: Array  # (3, 3) rows: its axes x and y and its normal, global axes
    followed: Integers  # by its rows: which row of the mechanism in space says what they follow
    # (rows in space, its rows) multipliers of the rows in space by its own; 0 of those that do nothing in it
    spread: Array
    # joints at which loops are cut, with axes of planar markers: of angles the component along the normal
    cut: tuple[CutPlace, ...]

    def shares(self, component: int) -> list[tuple[int, float]]:
        """Return components and shares of a planar wrench for a global force (0, 1, 2) or moment (3, 4, 5)."""
        along = self.axes[:, component % 3]
        parts = [(2, along[2])] if component >= 3 else [(0, along[0]), (1, along[1])]
        return [(k, float(share)) for k, share in parts if abs(share) > EXACT]


def in_plane(parts: ModelParts, is_path: Booleans) -> Plane | None:
    """Return the mechanism in its plane; None without one. `is_path` (rows,): rows that must be kept."""
    if any(marker.turns for marker in parts.ground) or not all(body.joint in PLANAR for body in parts.bodies):
        return None
    frames = _frames(parts)
    turning = (_core.JointKind.revolute, _core.JointKind.planar)
    axes = [frame.carrier[:, 2] for body, frame in zip(parts.bodies, frames, strict=True) if body.joint in turning]
    for normal in axes[:1] or np.eye(3)[::-1]:  # the first axis that turns, else those of the global planes
        try:
            return _Reduction(parts, frames, normal).plane(is_path)
        except AcrossError:
            continue
    return None


class _Frame(NamedTuple):
    """Of a body where all coordinates are zero: place r (3,), axes R (3, 3), columns; the triad that carries it."""

    r: Array
    R: Array
    carrier: Array


def _frames(parts: ModelParts) -> list[_Frame]:
    frames = list[_Frame]()
    for body in parts.bodies:
        markers = parts.ground if body.parent < 0 else parts.bodies[body.parent].data.markers
        inner, outer = markers[body.parent_marker], body.data.markers[body.inboard_marker]
        r, R = (np.zeros(3), np.eye(3)) if body.parent < 0 else frames[body.parent][:2]
        carrier = R @ inner.triad
        own = carrier @ outer.triad.T
        frames.append(_Frame(r + R @ inner.position - own @ outer.position, own, carrier))
    return frames


def _ends(row: _core.ConstraintModel) -> tuple[int, int, int, int]:
    return row.a.body, row.a.marker, row.b.body, row.b.marker


def _like(row: _core.ConstraintModel, f: Array) -> _core.ConstraintModel:
    """The same between the same markers, along f."""
    made = _core.ConstraintModel()
    made.name, made.kind, made.a, made.b, made.coordinate = row.name, row.kind, row.a, row.b, row.coordinate
    made.f = f
    return made


def _is_mixed(f: Array) -> bool:
    """Whether it has components in the plane and across it."""
    return bool(np.linalg.norm(f[:2]) > EXACT and abs(f[2]) > EXACT)


class _Reduction:
    """To the plane across `normal` (3,), global axes; raises `AcrossError` for what does not move in it."""

    def __init__(self, parts: ModelParts, frames: Sequence[_Frame], normal: Array) -> None:
        self._parts = parts
        self._ground = axes_across(normal)
        self._axes = [axes_across(frame.R.T @ normal) for frame in frames]
        self._frames, self._normal = frames, normal
        self._shifted: list[_core.PlanarMarker] = []

    def plane(self, is_path: Booleans) -> Plane:
        bodies = [self._body(number) for number in range(len(self._parts.bodies))]
        rows, followed, spread = self._rows(is_path)
        ground = [planar_marker(marker, self._ground) for marker in self._parts.ground]
        gravity = np.ascontiguousarray(self._ground[:2] @ self._parts.gravity)
        model = _core.PlanarModel(bodies, ground + self._shifted, rows, self._parts.wrenches, gravity)
        cut = []
        for place in self._parts.cut:
            axis = self._of_marker(self._parts.wrenches[place.a]) @ place.axis
            axis[slice(0, 2) if place.turns else 2] = 0.0
            cut.append(place._replace(axis=axis))
        return Plane(model, self._ground, np.array(followed, dtype=int), np.column_stack(spread), tuple(cut))

    def _rows(self, is_path: Booleans) -> tuple[list[_core.ConstraintModel], list[int], list[Array]]:
        """Rows of the plane, which ones in space they follow, and columns of `spread`."""
        rows = self._parts.rows
        spread: list[Array] = [np.zeros((len(rows), 0))]
        kept, followed, unit = [], [], np.eye(len(rows))
        for k, row in enumerate(rows):
            group = [] if is_path[k] else self._oblique(k)
            if not group:
                in_plane = self._row(row)
                if in_plane is None and is_path[k]:
                    raise AcrossError
                of_row = [] if in_plane is None else [(in_plane, unit[k])]
            else:
                of_row = list(self._together(group)) if group[0] == k else []
            for in_plane, column in of_row:
                kept.append(in_plane)
                followed.append(k)
                spread.append(column)
        return kept, followed, spread

    def _oblique(self, k: int) -> list[int]:
        """Rows of a loop that hold one way in several directions, k among them, where the plane is oblique to these."""
        rows, ends = self._parts.rows, _ends(self._parts.rows[k])
        ways = (_core.ConstraintKind.point, _core.ConstraintKind.slide)
        same = [  # none that rotors follow
            i
            for i, row in enumerate(rows)
            if row.kind in ways and row.coordinate < 0 and row.kind == rows[k].kind and _ends(row) == ends
        ]
        return same if k in same and any(_is_mixed(self._direction(rows[i])) for i in same) else []

    def _together(self, group: Sequence[int]) -> Iterator[tuple[_core.ConstraintModel, Array]]:
        """The rows of such a group in the plane, and their columns of `spread`; the normal is one of what they hold."""
        rows = self._parts.rows
        F = np.array([self._direction(rows[i]) for i in group])
        if abs(float(F[:, 2] @ F[:, 2]) - 1.0) > EXACT:
            raise AcrossError
        enforced, directions = np.linalg.eigh(F[:, :2].T @ F[:, :2])
        for size, direction in zip(enforced, directions.T, strict=True):
            if size > 0.5:  # 1: enforced, 0: left free
                column = np.zeros(len(rows))
                column[list(group)] = F[:, :2] @ direction
                yield _like(rows[group[0]], np.array([*direction, 0.0])), column

    def _direction(self, row: _core.ConstraintModel) -> Array:
        """Its f in axes of the plane, or of its planar marker a."""
        axes = self._ground if row.kind == _core.ConstraintKind.point else self._of_marker(row.a)
        return as_floats(axes @ row.f)

    def _body(self, number: int) -> _core.PlanarBody:
        body, axes = self._parts.bodies[number], self._axes[number]
        normal = self._normal @ self._frames[number].carrier  # in axes of the joint
        off = abs(normal[2]) if body.joint == _core.JointKind.prismatic else np.linalg.norm(normal - np.eye(3)[2])
        if off > EXACT and body.joint != _core.JointKind.weld:
            raise AcrossError
        planar = _core.PlanarBody()
        for key in SHARED:
            setattr(planar, key, getattr(body, key))
        planar.joint, planar.data = PLANAR[body.joint], planar_data(body.data, axes)
        return planar

    def _row(self, row: _core.ConstraintModel) -> _core.ConstraintModel | None:
        """In axes of planar markers; None where it does nothing in the plane."""
        planar = _like(row, row.f)
        if row.kind == _core.ConstraintKind.coordinate:
            return planar
        if row.kind == _core.ConstraintKind.turn:
            return self._turn(planar, row)
        f = self._direction(row)
        g = self._of_marker(row.b) @ row.g if row.kind == _core.ConstraintKind.dot else row.g
        if np.linalg.norm(f[:2]) <= EXACT or (row.kind == _core.ConstraintKind.dot and np.linalg.norm(g[:2]) <= EXACT):
            return None
        if row.kind != _core.ConstraintKind.dot:
            if _is_mixed(f):
                planar.a = self._shifted_for(row, f)
            f[2] = 0.0
        planar.f, planar.g = f, g
        return planar

    def _turn(self, flat: _core.ConstraintModel, row: _core.ConstraintModel) -> _core.ConstraintModel:
        """The difference of angles of planar markers, in which directions are those of their x: see `axes_of_triad`."""
        a, b = self._of_marker(row.a), self._of_marker(row.b)
        f = a @ row.f
        if np.linalg.norm(f[:2]) > EXACT:
            raise AcrossError
        (x_a, y_a, _), (x_b, y_b, _) = a @ row.g, b @ row.g
        turned = float(np.arctan2(x_a * y_b - y_a * x_b, x_a * x_b + y_a * y_b))
        flat.kind, flat.f = _core.ConstraintKind.rotation, np.array([0.0, 0.0, np.sign(f[2])])
        if abs(turned) > EXACT:
            if row.a.body >= 0:
                raise AcrossError
            marker = planar_marker(self._parts.ground[row.a.marker], self._ground)
            marker.angle -= turned
            flat.a = self._added(marker)
        return flat

    def _added(self, marker: _core.PlanarMarker) -> _core.MarkerAt:
        self._shifted.append(marker)
        return _core.MarkerAt(-1, len(self._parts.ground) + len(self._shifted) - 1)

    def _shifted_for(self, row: _core.ConstraintModel, f: Array) -> _core.MarkerAt:
        """A point of the ground from which f in the plane measures what it does in space: d_n is a constant."""
        if row.kind != _core.ConstraintKind.point or row.a.body >= 0:
            raise AcrossError
        a, b = self._ground @ self._parts.ground[row.a.marker].position, row.b.body
        r, R = (np.zeros(3), np.eye(3)) if b < 0 else self._frames[b][:2]
        height = self._normal @ (r + R @ self._marker(row.b).position)  # over the plane through the origin: b keeps it
        marker = _core.PlanarMarker()
        marker.position = a[:2] - f[:2] * (f[2] * (height - a[2]) / (f[:2] @ f[:2]))
        marker.Phi = np.zeros((3, 0))
        return self._added(marker)

    def _marker(self, at: _core.MarkerAt) -> _core.SpatialMarker:
        return (self._parts.ground if at.body < 0 else self._parts.bodies[at.body].data.markers)[at.marker]

    def _of_marker(self, at: _core.MarkerAt) -> Array:
        """(3, 3) rows: axes of a planar marker in those of its triad."""
        normal = self._normal if at.body < 0 else self._axes[at.body][2]
        return axes_of_triad(self._marker(at).triad.T @ normal)
