"""Mechanisms in 3D as what they are, material points: d'Alembert's principle without any invariant or recursion.

Positions of all points follow from the coordinates by their definitions; time derivatives are exact (Taylor series of
degree 2), and so are gradients. Coordinates of a joint, of sections against one another: mbs/core/recursion/joint.
"""

from dataclasses import dataclass, field

import numpy as np
from rotations import rotation

from ffrobot.mbs import _core

r = _core
J = r.JointKind


class Series:
    """c0 + c1 t + c2 t² of arrays: `c` (3, …)."""

    def __init__(self, c):
        self.c = np.asarray(c, dtype=float)

    @staticmethod
    def constant(x):
        x = np.asarray(x, dtype=float)
        return Series(np.stack([x, np.zeros_like(x), np.zeros_like(x)]))

    def __add__(self, other):
        return Series(self.c + as_series(other).c)

    def __sub__(self, other):
        return Series(self.c - as_series(other).c)

    def _times(self, other, product):
        a, b = self.c, as_series(other).c
        return Series(
            [product(a[0], b[0]), product(a[0], b[1]) + product(a[1], b[0]),
             product(a[0], b[2]) + product(a[1], b[1]) + product(a[2], b[0])]
        )  # fmt: skip

    def __mul__(self, other):
        return self._times(other, np.multiply)

    def __matmul__(self, other):
        return self._times(other, np.matmul)

    def __getitem__(self, index):
        return Series(self.c[(slice(None), *(index if isinstance(index, tuple) else (index,)))])

    @property
    def T(self):
        return Series(np.swapaxes(self.c, -1, -2))


def as_series(x):
    return x if isinstance(x, Series) else Series.constant(x)


def sine_and_cosine(x):
    s, c = np.sin(x.c[0]), np.cos(x.c[0])
    half = x.c[1] ** 2 / 2
    return Series([s, c * x.c[1], c * x.c[2] - s * half]), Series([c, -s * x.c[1], -s * x.c[2] - c * half])


def stacked(rows):
    return Series(np.stack([as_series(x).c for x in rows], axis=1))


def tilde(x):
    return Series(np.cross(x.c[:, None], np.eye(3), axisa=-1).swapaxes(1, 2))


def exponential(x):
    """exp of a rotation vector, by its series."""
    term = total = Series.constant(np.eye(3))
    turn = tilde(x)
    for k in range(1, 25):
        term = Series((term @ turn).c / k)
        total = Series(total.c + term.c)
    return total


def about(axis, angle):
    """R_x, R_y or R_z."""
    s, c = sine_and_cosine(angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R = np.zeros((3, 3, 3))
    R[0, axis, axis] = 1
    R[:, i, i] = R[:, j, j] = c.c
    R[:, i, j], R[:, j, i] = -s.c, s.c
    return Series(R)


@dataclass
class Body:
    """Points (mass (k,), x (k, 3), Phi (k, 3, n)), markers, the joint; quantities as `Body` has them.

    With G (4, 3, n, n), points move by −½ pᵀ(G_0 + x G_1 + y G_2 + z G_3) p besides, and markers by −½ pᵀK p.
    """

    mass: np.ndarray
    x: np.ndarray
    Phi: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    markers: list  # (position, triad, Phi (6, n))
    joint: object = J.revolute
    parent: int = -1
    parent_marker: int = 0
    inboard_marker: int = 0
    lead: float = 0.0
    G: np.ndarray | None = None
    K: list | None = None  # (6, n, n) by marker

    @property
    def n(self):
        return len(self.stiffness)

    @property
    def G_at_points(self):
        fields = np.hstack([np.ones((len(self.x), 1)), self.x])
        return np.einsum("if,flmn->ilmn", fields, self.G)

    def marker(self, number, p, still=False):
        """Where a marker is in the body's frame, and its axes; `still`: as if modes left it alone."""
        position, triad, Phi = self.markers[number]
        if not self.n or still:
            return as_series(position), as_series(triad)
        K = np.zeros((6, self.n, self.n)) if self.K is None else self.K[number]
        moved = Phi_times(Phi, p) + curvature(K, p)
        return moved[:3] + position, exponential(moved[3:]) @ triad

    def core(self, name):
        m, x, Phi, n = self.mass, self.x, self.Phi, self.n
        data = r.SpatialData()
        data.mass, data.first_moment = m.sum(), m @ x
        data.J2 = np.einsum("i,ik,il->kl", m, x, x)
        data.stiffness, data.damping = self.stiffness, self.damping
        data.S_bar = np.einsum("i,ikn->kn", m, Phi)
        data.I_bar = np.einsum("i,ik,iln->kln", m, x, Phi).reshape(9, n)
        data.S_bar_kl = list(np.einsum("i,ikm,iln->klmn", m, Phi, Phi).reshape(9, n, n))
        if self.G is not None:
            data.K_s = list(np.einsum("i,ilmn->lmn", m, self.G_at_points))
            data.K_x = list(np.einsum("i,ik,ilmn->klmn", m, x, self.G_at_points).reshape(9, n, n))
        markers = []
        for k, (position, triad, rows) in enumerate(self.markers):
            marker = r.SpatialMarker()
            marker.position, marker.triad, marker.Phi = position, triad, rows
            marker.K = [] if self.K is None else list(self.K[k])
            markers.append(marker)
        data.markers = markers
        body = r.SpatialBody()
        body.name, body.joint, body.lead, body.data = name, self.joint, self.lead, data
        body.parent, body.parent_marker, body.inboard_marker = self.parent, self.parent_marker, self.inboard_marker
        return body


@dataclass
class Mechanism:
    bodies: list
    ground: list  # (position, triad)
    gravity: np.ndarray
    rows: list = field(default_factory=list)  # ConstraintModel
    row_sides: list = field(default_factory=list)  # ((body, marker), (body, marker)) of these
    wrenches: list = field(default_factory=list)  # (body, marker)

    def model(self):
        ground = []
        for position, triad in self.ground:
            marker = r.SpatialMarker()
            marker.position, marker.triad = position, triad
            ground.append(marker)
        bodies = [body.core(f"b{i}") for i, body in enumerate(self.bodies)]
        wrenches = [r.MarkerAt(*at) for at in self.wrenches]
        return r.SpatialModel(bodies, ground, self.rows, wrenches, self.gravity)

    def motion(self, model, q, z):
        """Sections and points for coordinates z (n_v) from q on: series along t.

        z is a list of scalar series; in place of quaternions, rotation vectors in axes of the outer section.
        """
        frames, points = [], []
        for i, body in enumerate(self.bodies):
            joint_q, p_q, joint_v, p_v = model.first[i]
            R, at = self.section(frames, body.parent, body.parent_marker)
            turn, way = self.place(body, q[joint_q:p_q], z[joint_v:p_v])
            at = at + (R @ way if way is not None else 0.0)
            R = R @ turn
            p = stacked([z[p_v + k] + q[p_q + k] for k in range(body.n)]) if body.n else None
            # Coordinates of a free body are those of its frame where nothing asks for those of the section.
            position, local = body.marker(body.inboard_marker, p, still=body.joint == J.free)
            frame = R @ local.T
            origin = at - frame @ position
            frames.append((frame, origin, p))
            u = as_series(body.x)
            if body.n:
                u = u + Series([np.tensordot(body.Phi, c, 1) for c in p.c])
            if body.G is not None:
                u = u + curvature(body.G_at_points, p)
            points.append(u @ frame.T + Series(origin.c[:, None]))
        return frames, points

    def section(self, frames, body, marker):
        """Axes and position of a section."""
        if body < 0:
            position, triad = self.ground[marker]
            return Series.constant(triad), Series.constant(position)
        frame, origin, p = frames[body]
        position, triad = self.bodies[body].marker(marker, p)
        return frame @ triad, origin + frame @ position

    def place(self, body, q, z):
        """Rotation and way of a joint."""
        kind, zero = body.joint, Series.constant(0.0)
        turn, way = Series.constant(np.eye(3)), None
        if kind in (J.spherical, J.free):
            linear = 3 if kind == J.free else 0
            turn = Series.constant(rotation(q[linear:])) @ exponential(stacked(z[linear : linear + 3]))
            if linear:
                way = stacked([z[k] + q[k] for k in range(3)])
        else:
            x = [z[k] + q[k] for k in range(len(z))]
            if kind == J.revolute:
                turn = about(2, x[0])
            elif kind == J.prismatic:
                way = stacked([zero, zero, x[0]])
            elif kind == J.screw:
                turn, way = about(2, x[0]), stacked([zero, zero, x[0] * body.lead])
            elif kind == J.cylindrical:
                turn, way = about(2, x[1]), stacked([zero, zero, x[0]])
            elif kind == J.universal:
                turn = about(0, x[0]) @ about(1, x[1])
            elif kind == J.planar:
                turn, way = about(2, x[2]), stacked([x[0], x[1], zero])
            else:
                assert kind == J.weld, f"expected a case for {kind}"
        return turn, way

    def row(self, k, frames):
        """Rate (c1) and half the second derivative (c2) of row k along t, as (c1, 2 c2)."""
        row, ((body_a, a), (body_b, b)) = self.rows[k], self.row_sides[k]
        (R_a, r_a), (R_b, r_b) = self.section(frames, body_a, a), self.section(frames, body_b, b)
        f, g = np.array(row.f), np.array(row.g)
        if row.kind == r.ConstraintKind.rotation:
            total = np.zeros(2)
            for sign, R in ((1, R_b), (-1, R_a)):
                rate, change = R.c[1] @ R.c[0].T, 2 * R.c[2] @ R.c[0].T
                for i, W in enumerate((rate, (change - change.T) / 2)):
                    total[i] += sign * f @ [W[2, 1], W[0, 2], W[1, 0]]
            return total
        if row.kind == r.ConstraintKind.dot:
            value = (R_a @ f) * (R_b @ g)
        elif row.kind == r.ConstraintKind.slide:
            value = (R_a @ f) * (r_b - r_a)
        else:
            value = (r_b - r_a) * f
        c = value.c.sum(axis=-1)
        return np.array([c[1], 2 * c[2]])

    def directions(self, model, q):
        """`motion` along each coordinate in turn."""
        return [self.motion(model, q, [Series([0.0, x, 0.0]) for x in unit]) for unit in np.eye(model.n_v)]

    def forces(self, model, along, q, v, a, lambda_, force=None, wrench=None):
        """Forces along v that this motion takes beside the given ones, the size of their terms, and what rows do.

        `along` are the directions at q.
        """
        n_v, bodies = model.n_v, self.bodies
        z = [Series([0.0, v[k], a[k] / 2]) for k in range(n_v)]
        frames, points = self.motion(model, q, z)
        Q = np.zeros(n_v) if force is None else -force.copy()
        for i, body in enumerate(bodies):
            _, p_q, _, p_v = model.first[i]
            here = slice(p_v, p_v + body.n)
            Q[here] += body.stiffness * q[p_q : p_q + body.n] + body.damping @ v[here]
        size = np.abs(Q).max()
        for k, (there, moved) in enumerate(along):
            for body, at, change in zip(bodies, points, moved, strict=True):
                terms = body.mass[:, None] * (2 * at.c[2] - self.gravity) * change.c[1]
                Q[k] += terms.sum()
                size = max(size, np.abs(terms).max())
            for i in range(len(self.rows)):
                Q[k] += lambda_[i] * self.row(i, there)[0]
            for i, at in enumerate(self.wrenches):
                R, position = self.section(there, *at)
                W = R.c[1] @ R.c[0].T
                load = wrench[6 * i : 6 * i + 6]
                Q[k] -= load[:3] @ position.c[1] + load[3:] @ [W[2, 1], W[0, 2], W[1, 0]]
        accelerations = np.array([self.row(i, frames)[1] for i in range(len(self.rows))])
        return Q, size, accelerations


def Phi_times(Phi, p):
    return Series([Phi @ c for c in p.c])


def curvature(K, p):
    """−½ pᵀK p, K (…, n, n)."""
    square = p[:, None] * p[None]
    return Series([-0.5 * np.tensordot(K, c, 2) for c in square.c])
