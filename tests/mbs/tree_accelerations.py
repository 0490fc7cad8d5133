"""Accelerations of a tree in 3D at given q, v and v̇, of frames, sections and rows: an oracle of the core.

Arrays are over states
(T, …), in global axes, SI units. With ω = A ω̄, u = x + Φp in axes of the body and a section's turning φ = Φ_r p:
r̈ = R̈ + ω̇ × Au + ω × (ω × Au) + 2ω × AΦṗ + AΦp̈ and Ω̇ = ω̇ + A(J_l φ̈ + J̇_l φ̇) + ω × A J_l φ̇.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ffrobot.common.arrays import Array, as_floats
from ffrobot.common.rotations import left_jacobian, left_jacobian_rate
from ffrobot.mbs.model.body import bent_section
from ffrobot.mbs.model.model import Model, by_section
from ffrobot.mbs.model.rows import ConstraintRow
from ffrobot.mbs.model.tree import KinematicTree, Motion, Node, Section


class Acceleration(NamedTuple):
    """Of a triad: r̈ and Ω̇ (T, 3)."""

    r: Array
    Omega: Array


class _Bent(NamedTuple):
    """A u, A Φṗ, A Φp̈, A J_l φ̇, A (J_l φ̈ + J̇_l φ̇): (T, 3) each."""

    arm: Array
    rate: Array
    change: Array
    spin: Array
    spin_rate: Array


@dataclass(frozen=True)
class Accelerated:
    """States q (T, n_q), v and a (T, n_v) of a tree, with the motion of its frames."""

    tree: KinematicTree
    q: Array
    v: Array
    a: Array
    frames: Sequence[Motion]

    def velocity(self, at: Motion) -> tuple[Array, Array]:
        """ṙ and Ω (T, 3) of a triad."""
        both = np.einsum("tij,tj->ti", at.L, self.v)
        return both[:, :3], both[:, 3:]

    def of_frames(self) -> list[Acceleration]:
        """Of each body's frame, in the order of the tree."""
        found: list[Acceleration] = []
        for node in self.tree.nodes:
            found.append(self._of_frame(node, self._of_outer(node, found)))
        return found

    def of_section(self, section: Section, frames: Sequence[Acceleration]) -> Acceleration:
        """Of a section's triad, from those of the frames."""
        if section.body < 0:
            zero = np.zeros((len(self.q), 3))
            return Acceleration(zero, zero)
        node, frame, of_frame = self.tree.nodes[section.body], self.frames[section.body], frames[section.body]
        omega = self.velocity(frame)[1]
        bent = self._bent(node, section, frame.F)
        r = of_frame.r + np.cross(of_frame.Omega, bent.arm) + _swept(omega, bent)
        return Acceleration(r, of_frame.Omega + bent.spin_rate + np.cross(omega, bent.spin))

    def _of_outer(self, node: Node, frames: Sequence[Acceleration]) -> Acceleration:
        """Of the joint's triad on the body that it carries, from the inner one."""
        inner = self.tree.motion(node.inner, self.q, self.frames)
        of_inner, Omega = self.of_section(node.inner, frames), self.velocity(inner)[1]
        q, v, v_dot = self.q[:, node.q], self.v[:, node.v], self.a[:, node.v]
        S = node.joint.motion(q)
        d = np.einsum("tij,tj->ti", inner.F, node.joint.place(q).d)
        relative = np.einsum("tij,tj->ti", S, v)
        change = np.einsum("tij,tj->ti", S, v_dot) + motion_rate(node.joint, q, v)
        way, turn, way_rate, turn_rate = (
            np.einsum("tij,tj->ti", inner.F, x[:, part])
            for x in (relative, change)
            for part in (slice(0, 3), slice(3, 6))
        )
        r = of_inner.r + np.cross(of_inner.Omega, d) + np.cross(Omega, np.cross(Omega, d) + 2 * way) + way_rate
        return Acceleration(r, of_inner.Omega + np.cross(Omega, turn) + turn_rate)

    def _of_frame(self, node: Node, outer: Acceleration) -> Acceleration:
        """Of the body's frame, from its section at the joint."""
        frame = self.frames[self.tree.index[node.body.name]]
        omega, bent = self.velocity(frame)[1], self._bent(node, node.outer, frame.F)
        Omega = outer.Omega - bent.spin_rate - np.cross(omega, bent.spin)
        return Acceleration(outer.r - np.cross(Omega, bent.arm) - _swept(omega, bent), Omega)

    def _bent(self, node: Node, section: Section, A: Array) -> _Bent:
        """What the modes do at a section, in global axes."""
        p, p_dot, p_2dot = self.q[:, node.p_q], self.v[:, node.p_v], self.a[:, node.p_v]
        if not section.point:
            return _Bent(*np.zeros((5, len(p), 3)))
        at, (bending, turning) = bent_section(node.body, section.point, p), curvature(node.body, section.point, p_dot)
        u_dot, phi_dot = _times(at.u_p, p_dot), _times(at.phi_p, p_dot)
        u_2dot, phi_2dot = _times(at.u_p, p_2dot) - bending, _times(at.phi_p, p_2dot) - turning
        J_l = left_jacobian(at.phi)
        spin = np.einsum("tij,tj->ti", J_l, phi_dot)
        spin_rate = np.einsum("tij,tj->ti", J_l, phi_2dot) + left_jacobian_rate(at.phi, phi_dot)
        return _Bent(*(np.einsum("tij,tj->ti", A, x) for x in (at.u, u_dot, u_2dot, spin, spin_rate)))


def motion_rate(joint, q: Array, v: Array) -> Array:
    """(…, 6): Ṡ v in axes of the inner triad: of universal joints α̇ β̇ along the change of the second axis."""
    found = np.zeros((*q.shape[:-1], 6))
    if joint.type == "universal":
        found[..., 4], found[..., 5] = -np.sin(q[..., 0]), np.cos(q[..., 0])
        found *= (v[..., 0] * v[..., 1])[..., None]
    return found


def curvature(body, point: str, p_dot: Array) -> tuple[Array, Array]:
    """ṗᵀK ṗ (T, 3) along and about the axes, which leave ü and φ̈."""
    if body.stiffening is None:
        zero = np.zeros((len(p_dot), 3))
        return zero, zero
    found = np.einsum("tm,kmn,tn->tk", p_dot, body.stiffening.at(point), p_dot)
    return found[:, :3], found[:, 3:]


def _times(by_modes: Array, x: Array) -> Array:
    """Rows (3, n) or (T, 3, n) times x (T, n)."""
    found: Array = np.einsum("...in,...n->...i", by_modes, x)
    return found


def _swept(omega: Array, bent: _Bent) -> Array:
    """R̈ of a section less that of its frame, but for the part of ω̇."""
    found: Array = np.cross(omega, np.cross(omega, bent.arm) + 2 * bent.rate) + bent.change
    return found


def row_accelerations(model: Model, state: Accelerated, times: Array) -> Array:
    """C̈ (T, rows) at `times` (T,), less what their targets ask for: 0 where the motion keeps to the constraints."""
    frames = state.of_frames()
    found = np.zeros((len(times), len(model.rows)))
    motion = by_section(
        lambda section: (state.tree.motion(section, state.q, state.frames), state.of_section(section, frames))
    )
    for k, row in enumerate(model.rows):
        found[:, k] = _row(row, state, motion, times)
    return found


def _row(
    row: ConstraintRow, state: Accelerated, motion: Callable[[Section], tuple[Motion, Acceleration]], times: Array
) -> Array:
    target = 0.0 if row.target is None else row.target.sample(times)[2]
    if row.kind == "coordinate":
        found: Array = row.sign * state.a[:, row.coordinate] - target
        return found
    (a, of_a), (b, of_b) = motion(row.a), motion(row.b)
    if row.kind == "rotation":
        assert row.law is not None
        found = (of_b.Omega - row.law.rates(times)[1]) @ row.f
        return found
    (v_a, w_a), (v_b, w_b) = state.velocity(a), state.velocity(b)
    if row.kind == "point":
        found = (of_b.r - of_a.r) @ row.f - target
        return found
    f = np.einsum("tij,j->ti", a.F, row.f)
    if row.kind == "turn":
        return (
            _angle_rate(a.F @ row.g, np.cross(f, a.F @ row.g), b.F @ row.g, (w_a, of_a.Omega), (w_b, of_b.Omega))
            - target
        )
    if row.kind == "slide":
        return _product_rate(f, w_a, of_a.Omega, b.r - a.r, v_b - v_a, of_b.r - of_a.r) - target
    if row.law is None:
        g, turning, change = b.F @ row.g, w_b, of_b.Omega
    else:
        g, (turning, change) = row.law.sample(times)[:, :, 2], row.law.rates(times)
    g_dot = as_floats(np.cross(turning, g))
    g_2dot = as_floats(np.cross(change, g) + np.cross(turning, g_dot))
    return _product_rate(f, w_a, of_a.Omega, g, g_dot, g_2dot)


def _product_rate(f: Array, omega: Array, alpha: Array, d: Array, d_dot: Array, d_2dot: Array) -> Array:
    """d²/dt² of f·d (T,), where f turns with ω, ω̇."""
    f_dot = np.cross(omega, f)
    f_2dot = np.cross(alpha, f) + np.cross(omega, f_dot)
    found: Array = np.sum(f_2dot * d + 2 * f_dot * d_dot + f * d_2dot, axis=-1)
    return found


def _angle_rate(x: Array, y: Array, g: Array, of_a: tuple[Array, Array], of_b: tuple[Array, Array]) -> Array:
    """d²/dt² of atan2(y·g, x·g) (T,), where x and y turn with a and g with b, each by ω and ω̇."""
    (w_a, alpha_a), (w_b, alpha_b) = of_a, of_b
    g_dot = np.cross(w_b, g)
    g_2dot = np.cross(alpha_b, g) + np.cross(w_b, g_dot)
    (c, c_dot, c_2dot), (s, s_dot, s_2dot) = (
        (
            np.sum(e * g, axis=-1),
            np.sum(np.cross(w_a, e) * g + e * g_dot, axis=-1),
            _product_rate(e, w_a, alpha_a, g, g_dot, g_2dot),
        )
        for e in (x, y)
    )
    found: Array = (c * s_2dot - s * c_2dot) / (c**2 + s**2)
    return found - 2 * (c * c_dot + s * s_dot) * (c * s_dot - s * c_dot) / (c**2 + s**2) ** 2
