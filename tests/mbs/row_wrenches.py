"""What constraint equations of trees in 3D do on sections and bodies, in NumPy: an oracle of the core."""

import numpy as np
import tree_oracle
from tree_oracle import turning_axis

from ffrobot.common.rotations import left_jacobian
from ffrobot.mbs.model.known_motion import Wrench


def along_joint(tree, node, force, q, frames):
    """What `force` (T, freedoms) along the joint that carries a body does on its outer side, about where that is."""
    F, acting = (
        tree_oracle.pose(tree, node.inner, q, frames).F,
        np.einsum("tij,tj->ti", tree_oracle.action(node.joint, q[:, node.q]), force),
    )
    return Wrench(*(np.einsum("tij,tj->ti", F, part) for part in (acting[:, :3], acting[:, 3:])))


def row_wrenches(tree, row, size, q, times, frames):
    """What a row does on sections a and b with a force `size` (T,) along it, moments about the global origin.

    At q (T, n_q) and `times` (T,), with the `frames` there.
    """
    zero = np.zeros((len(times), 3))
    a, b = (tree_oracle.motion(tree, section, q, frames) for section in (row.a, row.b))
    if row.kind == "coordinate":
        on_b = along_joint(tree, tree.nodes[row.b.body], row.sign * size[:, None], q, frames).seen_from(b.r)
    elif row.kind in ("point", "slide"):
        f = np.einsum("tij,j->ti", a.F, row.f) if row.kind == "slide" else np.broadcast_to(row.f, a.r.shape)
        on_b = Wrench(size[:, None] * f, zero).seen_from(b.r)
    elif row.kind == "turn":
        on_b = Wrench(zero, size[:, None] * turning_axis(row, a, b))
    elif row.kind == "rotation":
        on_b = Wrench(zero, size[:, None] * row.f)
    else:
        f = np.einsum("tij,j->ti", a.F, row.f)
        g = b.F @ row.g if row.law is None else row.law.sample(times)[:, :, 2]
        on_b = Wrench(zero, -size[:, None] * np.cross(f, g))
    return Wrench(-on_b.force, -on_b.moment), on_b


def on_body(model, q, frames, section, wrench):
    """(T, 6 + n) of a wrench on a section, moments about the global origin: on frame and modes of its body."""
    node, frame, at = (
        model.tree.nodes[section.body],
        frames[section.body],
        tree_oracle.motion(model.tree, section, q, frames),
    )
    on_frame = [np.einsum("tji,tj->ti", frame.F, x) for x in wrench.seen_from(-frame.r)]
    on_modes = np.einsum("ti,tij->tj", wrench.seen_from(-at.r).moment, spin_of_modes(model, q, frames, section))
    if section.point:
        on_modes += on_frame[0] @ node.body.points[section.point].translation
    return np.hstack([*on_frame, on_modes])


def spin_of_modes(model, q, frames, section):
    """A J_l Φ_r (T, 3, n): the section's angular velocity by ṗ."""
    node = model.tree.nodes[section.body]
    Phi_r = node.body.points[section.point].rotation if section.point else np.zeros((3, node.body.n_modes))
    return frames[section.body].F @ left_jacobian(q[:, node.p_q] @ Phi_r.T) @ Phi_r
