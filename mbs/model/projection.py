"""Bodies of planar scenes, projected on the plane z = 0 of their frames; mechanisms that move in a plane.

Displacements of modes across the plane keep their share of m_ff = 1. Masses have only affine displacements that keep
shapes: translations along x and y, an expansion (x, y) and a rotation (−y, x). A body gets the integrals of a mass that
is as wide along x as along y about its center, which has no others: then geometric stiffening is the same in 3D.

Mechanisms whose joints turn about the normal of a plane or slide in it, and whose bodies bend in it, are solved in
the plane. They keep q, v and forces along them. Offsets, forces and loop equations across it do no work. Reactions
(`quantities/reactions.py`) follow from the motion in space.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Integers
from .. import _core
from .body import Body, BodyPoint, transformed
from .kinematics import CutPlace, ModelParts

IMMOBILE = 1e-12  # of m_ff = 1: a mode that moves less of it in the plane does so by round-off
ALONG = np.array([1.0, 1.0, 0.0])
PLANE, TURN = np.diag(ALONG), np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def projected(body: Body) -> Body:
    """A body without motion across the plane z = 0 of its frame, and without modes that move only so."""
    moving = np.flatnonzero(np.einsum("kknn->n", body.S_bar_kl[:2, :2]) > IMMOBILE)
    kept = transformed(body, np.eye(body.n_modes)[:, moving], body.stiffness[moving])
    center = kept.first_moment * ALONG / kept.mass
    S_bar, S_bar_kl = ALONG[:, None] * kept.S_bar, _keeping_shapes(kept.S_bar_kl)
    about_center = np.trace(kept.second_moment[:2, :2]) - kept.mass * center @ center
    points = {
        label: BodyPoint(
            at.position * ALONG, ALONG[:, None] * at.translation, (1.0 - ALONG)[:, None] * at.rotation, at.triad
        )
        for label, at in kept.points.items()
    }
    planar = replace(
        kept, first_moment=kept.mass * center, S_bar=S_bar, S_bar_kl=S_bar_kl, points=MappingProxyType(points),
        second_moment=kept.mass * np.outer(center, center) + 0.5 * about_center * np.eye(3),
        I_bar=_about(center, S_bar, kept.I_bar), J_spin=0.0, h_spin=0.0 * kept.h_spin, S_spin=0.0 * kept.S_spin,
        attachment_modes=int(np.sum(moving >= body.n_eigenmodes)),
    )  # fmt: skip
    if kept.stiffening is None:
        return planar
    K_s = ALONG[:, None, None] * kept.stiffening.K_s
    K_points = {
        point: np.concatenate([ALONG, 1.0 - ALONG])[:, None, None] * K for point, K in kept.stiffening.K_points.items()
    }
    stiffening = replace(
        kept.stiffening,
        K_s=K_s,
        K_x=_about(center, K_s, kept.stiffening.K_x),
        K_points=MappingProxyType(K_points),
        S_turned=_keeping_shapes(kept.stiffening.S_turned),
    )
    return replace(planar, stiffening=stiffening)


def vanishing_in_plane(body: Body) -> tuple[str, ...]:
    """Names of terms (D_ff, j, S_tilde) that are round-off in planar equations of a body; none if rigid."""
    if not body.n_modes:
        return ()
    size = np.sqrt(body.mass) * max((float(np.linalg.norm(at.position)) for at in body.points.values()), default=0.0)
    terms = {
        "D_ff": (body.damping, 0.0),
        "j": (body.I_bar[0, 0] + body.I_bar[1, 1], IMMOBILE * size),
        "S_tilde": (body.spin_slope[2], IMMOBILE),
    }
    return tuple(name for name, (array, limit) in terms.items() if np.abs(array).max(initial=0.0) <= limit)


def _about(center: Array, S: Array, I: Array) -> Array:  # noqa: E741
    """∫ρ x_k u_l dV (3, 3, …) that keep shapes about the center, of S = ∫ρ u_l dV (3, …) and those of all fields."""
    moved = np.multiply.outer(center, S)
    return moved + _keeping_shapes(I - moved)


def _keeping_shapes(I: Array) -> Array:  # noqa: E741
    """Of tensors (3, 3, …) the part in the plane that stretch and turn have."""
    stretch, turn = 0.5 * (I[0, 0] + I[1, 1]), 0.5 * (I[0, 1] - I[1, 0])
    return np.multiply.outer(PLANE, stretch) + np.multiply.outer(TURN, turn)


EXACT = 1e-12  # round-off of unit vectors, and of shapes relative to the largest
UPRIGHT = 0.437  # of the normal along z of a triad: below it z is nearer to the plane


class AcrossError(Exception):
    """Something moves across the plane."""


def axes_across(normal: Array) -> Array:
    """Unit axes (3, 3), rows x, y and the unit `normal` (3,); x is kept if the normal is across it."""
    x = np.eye(3)[0 if abs(normal[0]) < 0.9 else 1]
    x = x - normal * (normal @ x)
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal])


def axes_of_triad(normal: Array) -> Array:
    """Axes (3, 3) of a planar marker, rows x, y and the unit `normal` (3,), in axes of its triad in space.

    Triads of revolute and planar joints have z along the normal; z of prismatic ones, along which they slide, is x.
    """
    if abs(normal[2]) >= UPRIGHT:
        return axes_across(normal)
    z = np.eye(3)[2] - normal * normal[2]
    z /= np.linalg.norm(z)
    return np.array([z, np.cross(normal, z), normal])


def _is_small(across: Array, whole: Array) -> bool:
    return bool(np.abs(across).max(initial=0.0) <= EXACT * np.abs(whole).max(initial=0.0))


def planar_marker(marker: _core.SpatialMarker, axes: Array) -> _core.PlanarMarker:
    """The marker in 2D; unit `axes` (3, 3): rows x, y of the plane and its normal, body axes.

    Raises `AcrossError` if modes move it out of the plane.
    """
    planar, Phi, Phi_r = _core.PlanarMarker(), axes @ marker.Phi[:3], axes @ marker.Phi[3:]
    if not (_is_small(Phi[2], Phi) and _is_small(Phi_r[:2], Phi_r)):
        raise AcrossError
    x = axes @ marker.triad @ axes_of_triad(marker.triad.T @ axes[2])[0]
    planar.position, planar.angle = np.ascontiguousarray((axes @ marker.position)[:2]), float(np.arctan2(x[1], x[0]))
    planar.Phi = np.vstack([Phi[:2], Phi_r[2:]])
    if len(marker.K):
        K = np.einsum("skl,slmn->skmn", np.array([axes, axes]), np.reshape(marker.K, (2, 3, *marker.K[0].shape)))
        if not (_is_small(K[0, 2], K[0]) and _is_small(K[1, :2], K[1])):
            raise AcrossError
        planar.K = [K[0, 0], K[0, 1], K[1, 2]]
    return planar


def planar_data(data: _core.SpatialData, axes: Array) -> _core.PlanarData:
    """Constants of a body in the plane of the first two unit `axes` (3, 3), rows.

    Raises `AcrossError` if it bends out of the plane or twists.
    """
    planar, normal = _core.PlanarData(), axes[2]
    along = float(normal @ data.spin_axis)
    planar.mass, planar.first_moment = data.mass, np.ascontiguousarray(axes[:2] @ data.first_moment)
    planar.inertia = float(np.trace(data.J2) - normal @ data.J2 @ normal + data.J_spin * along**2)
    if len(data.stiffness):
        if np.any(data.h_spin) or np.any(data.S_spin):
            raise AcrossError
        n = len(data.stiffness)
        S = _turned(np.array(data.S_bar_kl).reshape(3, 3, n, n), axes)
        # ∫ρ u_n² dV of modes with ∫ρ u² dV = 1
        if np.diag(S[2, 2]).max() > EXACT or not _is_small(normal @ data.S_bar, data.S_bar):
            raise AcrossError
        I_bar = _turned(data.I_bar.reshape(3, 3, n), axes)
        planar.stiffness, planar.damping = data.stiffness, data.damping
        planar.S_bar = np.ascontiguousarray(axes[:2] @ data.S_bar)
        planar.h, planar.j = I_bar[0, 1] - I_bar[1, 0], I_bar[0, 0] + I_bar[1, 1]
        planar.S_tilde, planar.m_xy = S[0, 1] - S[1, 0], S[0, 0] + S[1, 1]
        if data.K_s:
            K_s = np.einsum("kl,lmn->kmn", axes, np.array(data.K_s))
            K_x = _turned(np.array(data.K_x).reshape(3, 3, n, n), axes)
            if not (_is_small(K_s[2], K_s) and _is_small(K_x[:, 2], K_x)):
                raise AcrossError
            planar.K = [K_s[0], K_s[1], K_x[0, 0] + K_x[1, 1], K_x[0, 1] - K_x[1, 0]]
            S, J2 = axes[:2] @ data.first_moment, axes[:2] @ data.J2 @ axes[:2].T
            N = np.block([[np.array([[data.mass]]), S[None]], [S[:, None], J2]])
            for moved, by_place in ((planar.S_bar, I_bar[:2, :2]), (K_s[:2], K_x[:2, :2])):
                _check_shapes(N, np.concatenate([moved[None], by_place]).reshape(3, 2, -1))
    planar.markers = [planar_marker(marker, axes) for marker in data.markers]
    return planar


def _check_shapes(N: Array, F: Array) -> None:
    """Raise `AcrossError` unless fields of displacement keep shapes: the core has no others of them in the plane.

    N (3, 3) and F (3, 2, fields): integrals of 1, x, y times 1, x, y, and times displacements along x and y.
    """
    (m, x, y), J = N[0], N[1, 1] + N[2, 2]
    by_shape = np.array([[m, 0, x, -y], [0, m, y, x], [x, y, J, 0], [-y, x, 0, J]])
    along_x, along_y, stretch, turn = np.linalg.solve(
        by_shape, np.array([F[0, 0], F[0, 1], F[1, 0] + F[2, 1], F[1, 1] - F[2, 0]])
    )
    fields = np.array([[along_x, along_y], [stretch, turn], [-turn, stretch]])
    if not _is_small(F - np.einsum("ij,jkn->ikn", N, fields), F):
        raise AcrossError


def _turned(tensor: Array, axes: Array) -> Array:
    return np.einsum("ik,jl,kl...->ij...", axes, axes, tensor)


UNTURNED = (_core.JointKind.prismatic, _core.JointKind.weld)  # z of their triads may lie in the plane
SHARED = ("name", "parent", "parent_marker", "inboard_marker", "rotor_inertia", "gear_ratio", "driven", "of_section")
"""What bodies are in the plane and in space alike."""


class Plane(NamedTuple):
    """A mechanism of the core in the plane; SI units."""

    model: _core.PlanarModel
    axes: Array  # (3, 3) rows: axes x and y of the plane and its normal, global axes
    followed: Integers  # of each constraint equation in the plane: index of that in space with its target
    # (equations in space, equations in the plane) from multipliers in the plane to those in space
    spread: Array
    # joints at which loops are cut, with axes of planar markers: of angles the component along the normal
    cut: tuple[CutPlace, ...]

    def shares(self, component: int) -> list[tuple[int, float]]:
        """Planar components (0, 1: force, 2: moment), with shares, of a global force (0–2) or moment (3–5)."""
        along = self.axes[:, component % 3]
        parts = [(2, along[2])] if component >= 3 else [(0, along[0]), (1, along[1])]
        return [(k, float(share)) for k, share in parts if abs(share) > EXACT]


def in_plane(parts: ModelParts, is_path: Booleans) -> Plane | None:
    """The mechanism in its plane; None without one. `is_path` (rows,): equations that must be kept."""
    if any(marker.turns for marker in parts.ground) or not all(body.joint.is_planar for body in parts.bodies):
        return None
    frames = _frames(parts)
    axes = [frame.carrier[:, 2] for body, frame in zip(parts.bodies, frames, strict=True) if body.joint not in UNTURNED]
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
        return axes @ row.f

    def _body(self, number: int) -> _core.PlanarBody:
        body, axes = self._parts.bodies[number], self._axes[number]
        normal = self._normal @ self._frames[number].carrier  # in axes of the joint
        off = abs(normal[2]) if body.joint == _core.JointKind.prismatic else np.linalg.norm(normal - np.eye(3)[2])
        if off > EXACT and body.joint != _core.JointKind.weld:
            raise AcrossError
        planar = _core.PlanarBody()
        for key in SHARED:
            setattr(planar, key, getattr(body, key))
        planar.joint, planar.data = body.joint, planar_data(body.data, axes)
        return planar

    def _row(self, row: _core.ConstraintModel) -> _core.ConstraintModel | None:
        """In axes of planar markers; None where it does nothing in the plane."""
        planar = _like(row, row.f)
        if row.kind == _core.ConstraintKind.coordinate:
            return planar
        if row.kind == _core.ConstraintKind.turn:
            return self._turn(planar, row)
        f, is_dot = self._direction(row), row.kind == _core.ConstraintKind.dot
        g = self._of_marker(row.b) @ row.g if is_dot else row.g
        if np.linalg.norm(f[:2]) <= EXACT or (is_dot and np.linalg.norm(g[:2]) <= EXACT):
            return None
        if not is_dot:
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
        if abs(turned) > EXACT:  # no markers of their own for that: it is rare, and right in space
            raise AcrossError
        flat.kind, flat.f = _core.ConstraintKind.rotation, np.array([0.0, 0.0, np.sign(f[2])])
        return flat

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
        self._shifted.append(marker)
        return _core.MarkerAt(-1, len(self._parts.ground) + len(self._shifted) - 1)

    def _marker(self, at: _core.MarkerAt) -> _core.SpatialMarker:
        return (self._parts.ground if at.body < 0 else self._parts.bodies[at.body].data.markers)[at.marker]

    def _of_marker(self, at: _core.MarkerAt) -> Array:
        """(3, 3) rows: axes of a planar marker in those of its triad."""
        normal = self._normal if at.body < 0 else self._axes[at.body][2]
        return axes_of_triad(self._marker(at).triad.T @ normal)
