"""How a tree moves and what its rows measure, in NumPy: an oracle of the core, which shares nothing with it.

States q (T, n_q); what comes out is in global axes, SI units.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ffrobot.common.rotations import about, exponential, left_jacobian, logarithm, of_quaternion, quaternions, skew
from ffrobot.mbs.model.body import bent_section

STEP = 0.005  # of the fastest coordinate, m, rad or √kg·m
WEIGHTS = (6 / 7, -15 / 56, 5 / 63, -1 / 56, 1 / 385, -1 / 5544)  # of central differences of order twelve


class Pose(NamedTuple):
    """Place r (T, 3) and axes F (T, 3, 3) of a triad."""

    r: np.ndarray
    F: np.ndarray


class Motion(NamedTuple):
    """Place r (T, 3), axes F (T, 3, 3), and L (T, 6, n_v) of a triad: velocity and angular velocity by v."""

    r: np.ndarray
    F: np.ndarray
    L: np.ndarray


def place(joint, q):
    """Way d (T, 3) and axes C (T, 3, 3) of the outer triad on the inner one, in axes of that."""
    zero = np.zeros((*q.shape[:-1], 3))
    if joint.type == "free":
        return q[..., :3], of_quaternion(q[..., 3:])
    if joint.type == "spherical":
        return zero, of_quaternion(q)
    if joint.type == "universal":
        return zero, about(0, q[..., 0]) @ about(1, q[..., 1])
    moved = q @ subspace(joint, q).T
    return moved[..., :3], about(2, moved[..., 5])


def subspace(joint, q):
    """S (6, freedoms) of joints that move alike everywhere: along all axes, about z."""
    if joint.type == "screw":
        return np.array([[0.0, 0.0, joint.rise, 0.0, 0.0, 1.0]]).T
    return np.eye(6)[:, list(joint.axes)]


def motion_of_joint(joint, q):
    """(T, 6, freedoms): velocity and angular velocity of the outer triad by v, in axes of the inner one."""
    if joint.type not in ("free", "spherical", "universal"):
        return np.broadcast_to(subspace(joint, q), (*q.shape[:-1], 6, joint.freedoms))
    found = np.zeros((*q.shape[:-1], 6, joint.freedoms))
    if joint.type == "universal":
        found[..., 3, 0] = 1.0
        found[..., 4, 1], found[..., 5, 1] = np.cos(q[..., 0]), np.sin(q[..., 0])
    else:
        found[..., 3:, -3:] = of_quaternion(q[..., -4:])
        found[..., :3, :-3] = np.eye(3)[:, : joint.freedoms - 3]
    return found


def action(joint, q):
    """(T, 6, freedoms): force and moment of motors on the outer side by forces along v, in axes of the inner triad."""
    if joint.type == "screw":
        return np.broadcast_to(np.eye(6)[:, 5:], (*q.shape[:-1], 6, 1))
    return motion_of_joint(joint, q)


def integrate(tree, q, dv):
    """Q moved by a small step dv (T, n_v): quaternions along the exponential."""
    moved = np.broadcast_to(q, (*dv.shape[:-1], tree.n_q)).copy()
    for node in tree.nodes:
        moved[..., node.p_q] += dv[..., node.p_v]
        own, step, straight = moved[..., node.q], dv[..., node.v], max(0, node.joint.q_count - 4)
        if node.joint.q_count == node.joint.freedoms:
            own += step
            continue
        own[..., :straight] += step[..., :straight]
        turned = of_quaternion(own[..., straight:]) @ exponential(step[..., straight:])
        e = quaternions(turned)
        same = np.sum(e * own[..., straight:], axis=-1, keepdims=True) >= 0
        own[..., straight:] = np.where(same, e, -e)
    return moved


def rate(f, tree, q, v):
    """d/dt of f(q, t) at t = 0, where q goes on with v: by differences, exact but for rounding."""
    step = STEP / max(1.0, np.abs(v).max(initial=0.0))
    steps = [(weight / step, k * step) for k, weight in enumerate(WEIGHTS, 1)]
    return sum(w * (f(integrate(tree, q, t * v), t) - f(integrate(tree, q, -t * v), -t)) for w, t in steps)


def poses(tree, q):
    """Place and axes of the frame of each body."""
    found = []
    for node in tree.nodes:
        inner, (d, C) = pose(tree, node.inner, q, found), place(node.joint, q[..., node.q])
        u, E = _bent(node.body, node.outer, q[..., node.p_q])
        A = inner.F @ C @ np.swapaxes(E @ node.outer.triad, -1, -2)
        found.append(Pose(inner.r + _turned(inner.F, d) - _turned(A, u), A))
    return found


def frames(tree, q):
    """Motion of the frame of each body."""
    found = []
    for node, (r, A) in zip(tree.nodes, poses(tree, q), strict=True):
        inner, S = motion(tree, node.inner, q, found), motion_of_joint(node.joint, q[..., node.q])
        d = _turned(inner.F, place(node.joint, q[..., node.q])[0])
        L = inner.L.copy()
        L[..., :3, :] -= skew(d) @ inner.L[..., 3:, :]
        L[..., :3, node.v] += inner.F @ S[..., :3, :]
        L[..., 3:, node.v] += inner.F @ S[..., 3:, :]
        if node.outer.point:  # from the section at the joint to the frame
            Phi, turning = _by_modes(node.body, node.outer, q[..., node.p_q])
            L[..., 3:, node.p_v] -= A @ turning
            L[..., :3, :] += skew(inner.r + d - r) @ L[..., 3:, :]
            L[..., :3, node.p_v] -= A @ Phi
        found.append(Motion(r, A, L))
    return found


def pose(tree, section, q, frames):
    """Of the triad of a section."""
    if section.body < 0:
        shape = q.shape[:-1]
        return Pose(np.broadcast_to(section.position, (*shape, 3)), np.broadcast_to(section.triad, (*shape, 3, 3)))
    arm, F = _from_frame(tree, section, q, frames)
    return Pose(frames[section.body].r + arm, F)


def _from_frame(tree, section, q, frames):
    """From the origin of its body to a section, (T, 3), and the axes (T, 3, 3) of its triad."""
    node, A = tree.nodes[section.body], frames[section.body].F
    u, E = _bent(node.body, section, q[..., node.p_q])
    return _turned(A, u), A @ E @ section.triad


def motion(tree, section, q, frames):
    """Of the triad of a section."""
    if section.body < 0:
        return Motion(*pose(tree, section, q, frames), np.zeros((*q.shape[:-1], 6, tree.n_v)))
    node, frame = tree.nodes[section.body], frames[section.body]
    arm, F = _from_frame(tree, section, q, frames)
    Phi, turning = _by_modes(node.body, section, q[..., node.p_q])
    L = frame.L.copy()
    L[..., :3, :] -= skew(arm) @ frame.L[..., 3:, :]
    L[..., :3, node.p_v] += frame.F @ Phi
    L[..., 3:, node.p_v] += frame.F @ turning
    return Motion(frame.r + arm, F, L)


def _turned(A, vectors):
    """A (…, 3, 3) times vectors (…, 3)."""
    return np.einsum("...ij,...j->...i", A, vectors)


def _bent(body, section, p):
    """In body axes: u (…, 3) and E (…, 3, 3) = exp φ~."""
    if not section.point or not body.n_modes:
        u, shape = body.points[section.point].position if section.point else np.zeros(3), (*p.shape[:-1], 3)
        return np.broadcast_to(u, shape), np.broadcast_to(np.eye(3), (*shape, 3))
    at = bent_section(body, section.point, p)
    return at.u, exponential(section.turned(at.phi[..., None])[..., 0])


def _by_modes(body, section, p):
    """In body axes: Φ (…, 3, n), and J_l Φ_r (…, 3, n), which gives the spin by ṗ."""
    if not section.point or not body.n_modes:
        none = np.zeros((3, body.n_modes))
        return none, none
    at, phi = body.points[section.point], bent_section(body, section.point, p).phi
    K = np.zeros((6, body.n_modes, body.n_modes)) if body.stiffening is None else body.stiffening.at(section.point)
    u_p, phi_p = np.split(np.vstack([at.translation, at.rotation]) - np.einsum("kmn,...n->...km", K, p), 2, axis=-2)
    return u_p, left_jacobian(section.turned(phi[..., None])[..., 0]) @ section.turned(phi_p)


def of_coordinate(tree, coordinate):
    """The node whose joint has v[coordinate], which is a number's rate, and the index of that number in q."""
    node = next(node for node in tree.nodes if node.v.start <= coordinate < node.v.stop)
    return node, node.q.start + coordinate - node.v.start


def value_and_gradient(tree, row, a, b, q, times):
    """C (T,) at q (T, n_q) and `times` (T,), and its derivative C_v (T, n_v), from the motions of its sections."""
    value, gradient = _measured(tree, row, a, b, q, times)
    if row.target is not None:
        value = value - row.target.sample(times)[0]
    if row.kind in ("turn", "slide") and row.coordinate >= 0:
        value = value - q[:, of_coordinate(tree, row.coordinate)[1]]
        gradient[:, row.coordinate] -= 1.0
    return value - 2 * np.pi * np.round(value / (2 * np.pi)) if row.kind == "turn" else value, gradient


def _measured(tree, row, a, b, q, times):
    """Without its target, and the coordinate that is taken off."""
    if row.kind == "coordinate":
        gradient = np.zeros((len(q), a.L.shape[-1]))
        gradient[:, row.coordinate] = row.sign
        return row.sign * q[:, of_coordinate(tree, row.coordinate)[1]], gradient
    turning = b.L[:, 3:] - a.L[:, 3:]
    if row.kind == "rotation":
        assert row.law is not None
        residual = logarithm(b.F @ np.swapaxes(row.law.sample(times), -1, -2))
        return residual @ row.f, np.einsum("i,tij->tj", row.f, b.L[:, 3:])
    if row.kind == "turn":
        return turned_by(row, a, b), np.einsum("ti,tij->tj", turning_axis(row, a, b), turning)
    if row.kind == "dot":
        f = np.einsum("tij,j->ti", a.F, row.f)
        g = b.F @ row.g if row.law is None else row.law.sample(times)[:, :, 2]
        return np.sum(f * g, axis=-1), -np.einsum("ti,tij->tj", np.cross(f, g), turning)
    f = np.einsum("tij,j->ti", a.F, row.f) if row.kind == "slide" else np.broadcast_to(row.f, a.r.shape)
    d = b.r - a.r
    gradient = np.einsum("ti,tij->tj", f, b.L[:, :3] - a.L[:, :3])
    if row.kind == "slide":
        gradient = gradient + np.einsum("ti,tij->tj", np.cross(f, d), a.L[:, 3:])
    return np.sum(f * d, axis=-1), gradient


def turned_by(row, a, b):
    """The angle (T,) of a "turn" row, within ±π: that of b's g about a's f, from a's g on."""
    axis, zero, turned = a.F @ row.f, a.F @ row.g, b.F @ row.g
    return np.arctan2(np.sum(np.cross(axis, zero) * turned, axis=-1), np.sum(zero * turned, axis=-1))


def turning_axis(row, a, b):
    """Its rate (T, 3) by the angular velocity of b against a; core/recursion/constrained_aba/constraints.h."""
    axis, turned = a.F @ row.f, b.F @ row.g
    along = np.sum(axis * turned, axis=-1, keepdims=True)
    return axis - along / (1.0 - along**2) * (turned - along * axis)


def row_values(model, q, times):
    """C (T, rows) at q (T, n_q) and `times` (T,), and its Jacobian C_v (T, rows, n_v)."""
    at, values, gradients = frames(model.tree, q), [], np.zeros((len(q), len(model.rows), model.tree.n_v))
    for k, row in enumerate(model.rows):
        a, b = (motion(model.tree, section, q, at) for section in (row.a, row.b))
        value, gradients[:, k] = value_and_gradient(model.tree, row, a, b, q, times)
        values.append(value)
    return np.reshape(values, (len(model.rows), len(q))).T, gradients


def target_rates(model, q, times):
    """What C_v v has to be (T, rows), for Ċ = 0."""
    found = np.zeros((len(q), len(model.rows)))
    for k, row in enumerate(model.rows):
        if row.target is not None:
            found[:, k] = row.target.sample(times)[1]
        elif row.law is not None:
            omega = row.law.in_core.sample(times)[1]
            if row.kind == "rotation":
                found[:, k] = omega @ row.f
            else:  # f·g with g turning by ω
                f = np.einsum("tij,j->ti", pose(model.tree, row.a, q, poses(model.tree, q)).F, row.f)
                found[:, k] = -np.sum(f * np.cross(omega, row.law.sample(times)[:, :, 2]), axis=-1)
    return found


def cut_coordinates(model, q):
    """Coordinates γ (T, cut) of joints at which loops are cut, angles within ±π, and G (T, cut, n_v)."""
    rows = tuple(replace(one.row, sign=1.0) for one in model.cut)
    values, gradients = row_values(replace(model, rows=rows), q, np.zeros(len(q)))
    signs = np.array([one.row.sign for one in model.cut])
    return signs * values, signs[:, None] * gradients
