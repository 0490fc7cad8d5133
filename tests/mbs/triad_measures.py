"""Rows between two triads in 3D, joints made of them, and where each body's coordinates are.

A row is a scalar measure of triad b on triad a. It says its value, the wrenches on_a, on_b (6,) (force, moment) that a
unit force along it puts on a and b, so that its rate is on_a·(ṙ_a, Ω_a) + on_b·(ṙ_b, Ω_b), and `extra`, what of its
second derivative is neither v̇ nor the triads' own bias. x, y, z (0, 1, 2) are columns of a triad; joint axes are z.
"""

from dataclasses import dataclass, field

import numpy as np

X, Y, Z = 0, 1, 2
UNIT = np.eye(3)


@dataclass(frozen=True)
class Section:
    """A triad B (columns, axes of the section) on a section of a body; "" is the body's frame.

    One that is `still` is moved by modes, but not turned.
    """

    body: str
    point: str
    triad: np.ndarray = field(default_factory=lambda: np.eye(3))
    still: bool = False


@dataclass(frozen=True)
class Ground:
    """A triad that stands still, at `position` in m."""

    position: np.ndarray = field(default_factory=lambda: np.zeros(3))
    triad: np.ndarray = field(default_factory=lambda: np.eye(3))
    body = None


@dataclass
class Found:
    """What a row says of itself at a state; `axis_turns` (3,): the rate of its axis, where a rotor spins about it."""

    value: float
    on_a: np.ndarray
    on_b: np.ndarray
    extra: float = 0.0
    axis_turns: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass
class RowState:
    value: float
    rate: float
    gradient: np.ndarray
    bias: float
    axis_turns: np.ndarray


def wrench(force=None, moment=None):
    return np.concatenate([np.zeros(3) if part is None else part for part in (force, moment)])


@dataclass(frozen=True)
class Row:
    a: object
    b: object


@dataclass(frozen=True)
class Along(Row):
    """The way of b from a along a fixed `direction` in global axes."""

    direction: np.ndarray

    def between(self, a, b):
        e = np.asarray(self.direction, dtype=float)
        return Found(e @ (b.r - a.r), wrench(-e), wrench(e))


@dataclass(frozen=True)
class Dot(Row):
    """f·g with f of a, g of b (dot1 of the formulation)."""

    f: int
    g: int

    def between(self, a, b):
        f, g, (Omega_a, Omega_b) = a.F[:, self.f], b.F[:, self.g], (a.velocity[3:], b.velocity[3:])
        k = np.cross(f, g)
        k_dot = np.cross(np.cross(Omega_a, f), g) + np.cross(f, np.cross(Omega_b, g))
        return Found(f @ g, wrench(None, k), wrench(None, -k), (Omega_a - Omega_b) @ k_dot)


@dataclass(frozen=True)
class Way(Row):
    """f·d: how far b is from a along axis f of a (dot2 of the formulation)."""

    f: int

    def between(self, a, b):
        f, d, d_dot, Omega = a.F[:, self.f], b.r - a.r, b.velocity[:3] - a.velocity[:3], a.velocity[3:]
        f_dot = np.cross(Omega, f)
        extra = f_dot @ d_dot + Omega @ (np.cross(f_dot, d) + np.cross(f, d_dot))
        return Found(f @ d, wrench(-f, np.cross(f, d)), wrench(f), extra)


@dataclass(frozen=True)
class Turn(Row):
    """The angle of b on a about axis f of a, rad, −π … π; the other axes are its neighbours in cyclic order."""

    f: int = Z

    def between(self, a, b):
        i, j = (self.f + 1) % 3, (self.f + 2) % 3
        f = a.F[:, self.f]
        value = np.arctan2(b.F[:, i] @ a.F[:, j], b.F[:, i] @ a.F[:, i])
        extra = np.cross(a.velocity[3:], f) @ (b.velocity[3:] - a.velocity[3:])
        return Found(value, wrench(None, -f), wrench(None, f), extra)


class FirstAngle(Row):
    """α of a universal joint, about x of a: b = a R_x(α) R_y(β)."""

    def between(self, a, b):
        found = Turn(self.a, self.b, X).between(a, b)
        y = b.F[:, Y]
        found.value = np.arctan2(y @ a.F[:, Z], y @ a.F[:, Y])
        return found


class SecondAngle(Row):
    """β of a universal joint, about y of b."""

    def between(self, a, b):
        f, x = b.F[:, Y], a.F[:, X]
        extra = np.cross(b.velocity[3:], f) @ (b.velocity[3:] - a.velocity[3:])
        return Found(np.arctan2(x @ b.F[:, Z], x @ b.F[:, X]), wrench(None, -f), wrench(None, f), extra)


@dataclass(frozen=True)
class Lead(Row):
    """z·d − hα of a screw, h = lead/2π in m/rad."""

    h: float

    def between(self, a, b):
        way, turn = Way(self.a, self.b, Z).between(a, b), Turn(self.a, self.b).between(a, b)
        return Found(
            way.value - self.h * turn.value,
            way.on_a - self.h * turn.on_a,
            way.on_b - self.h * turn.on_b,
            way.extra - self.h * turn.extra,
        )


@dataclass(frozen=True)
class Spinning(Row):
    """N Ω_b − (N − 1) Ω_a along z of a: the spin of a rotor that sits on a behind a gear of ratio N."""

    ratio: float

    def between(self, a, b):
        f, N, Omega_a, Omega_b = a.F[:, Z], self.ratio, a.velocity[3:], b.velocity[3:]
        f_dot = np.cross(Omega_a, f)
        extra = f_dot @ (N * Omega_b - (N - 1) * Omega_a)
        return Found(0.0, wrench(None, -(N - 1) * f), wrench(None, N * f), extra, f_dot)


@dataclass(frozen=True)
class Spin(Row):
    """Along axis f of b, the angular velocity of b less that of a: its rate; there is no such coordinate."""

    f: int

    def between(self, a, b):
        f, Omega = b.F[:, self.f], b.velocity[3:] - a.velocity[3:]
        return Found(0.0, wrench(None, -f), wrench(None, f), np.cross(b.velocity[3:], f) @ Omega)


@dataclass(frozen=True)
class Joint:
    """A joint of a type of the scene file between triads a and b, h = lead/2π of a screw (m/rad)."""

    name: str
    type: str
    a: object
    b: object
    h: float = 0.0

    def rows(self):
        a, b = self.a, self.b
        point = [Along(a, b, e) for e in UNIT]
        aligned = [Dot(a, b, X, Z), Dot(a, b, Y, Z)]
        guided = [Way(a, b, X), Way(a, b, Y), *aligned]
        return {
            "spherical": point,
            "universal": [*point, Dot(a, b, X, Y)],
            "revolute": [*point, *aligned],
            "cylindrical": guided,
            "prismatic": [*guided, Dot(a, b, X, Y)],
            "screw": [*guided, Lead(a, b, self.h)],
            "planar": [Way(a, b, Z), *aligned],
            "weld": [*point, Dot(a, b, X, Y), Dot(a, b, Y, Z), Dot(a, b, Z, X)],
            "free": [],
        }[self.type]

    def coordinates(self):
        """Rows whose values are the joint's coordinates; of spherical and free joints some have rates alone."""
        a, b = self.a, self.b
        spins, ways = [Spin(a, b, f) for f in (X, Y, Z)], [Way(a, b, f) for f in (X, Y, Z)]
        return {
            "universal": [FirstAngle(a, b), SecondAngle(a, b)],
            "revolute": [Turn(a, b)],
            "cylindrical": [Turn(a, b), ways[Z]],
            "prismatic": [ways[Z]],
            "screw": [Turn(a, b)],
            "planar": [*ways[:2], Turn(a, b)],
            "spherical": spins,
            "free": [*ways, *spins],
        }.get(self.type, [])


class Coordinates:
    """Where R, e, p of each body are in q, and Ṙ, ω̄, ṗ in v; bodies are (name, modes)."""

    def __init__(self, bodies):
        self.names = [name for name, _ in bodies]
        self._modes = dict(bodies)
        self._first_q = dict(zip(self.names, np.cumsum([0] + [7 + n for _, n in bodies]), strict=False))
        self._first_v = dict(zip(self.names, np.cumsum([0] + [6 + n for _, n in bodies]), strict=False))
        self.n_q, self.n_v = sum(7 + n for _, n in bodies), sum(6 + n for _, n in bodies)

    def columns(self, name):
        """Slice of a body in v."""
        return slice(self._first_v[name], self._first_v[name] + 6 + self._modes[name])

    def parts(self, q, name):
        """R, e, p: views of q."""
        i, n = self._first_q[name], self._modes[name]
        return q[i : i + 3], q[i + 3 : i + 7], q[i + 7 : i + 7 + n]

    def rates(self, v, name):
        """Ṙ, ω̄, ṗ: views of v."""
        own = v[self.columns(name)]
        return own[:3], own[3:6], own[6:]
