"""A tree of bodies: where they are and how they move by joint coordinates and modes.

State q: of each body in the order of the tree the q of its joint, then its p; v likewise, with the joint's freedoms.
It is the core's. All functions take states (…, n_q) at once; what comes out is in global axes, SI units.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, as_floats
from ...common.rotations import exponential, left_jacobian, of_quaternion, quaternions, skew
from ...common.structs import struct
from ..fields.field_types import GROUND
from ..joints.free import FreeJoint
from ..joints.joint import JointRecord
from ..joints.planar_joint import PlanarJoint
from ..joints.twist_spring import TwistSpring
from ..scene.topology import Topology
from .body import Body, bent_section, rigid_body

AXES = np.eye(3)
AXES.setflags(write=False)


class Section(NamedTuple):
    """A triad (3, 3), columns, on a section of body number `body`, or standing at `position` (m) on the ground (−1).

    `still`: about its z it turns with the frame of the body, not with the section.
    """

    body: int
    point: str
    triad: Array
    position: Array
    still: bool = False

    def turned(self, rotation: Array) -> Array:
        """What modes turn it by, of rotations (…, 3, n) of the section, or (…, 3) with a last axis of length one."""
        if not self.still:
            return rotation
        z = self.triad[:, 2]
        return rotation - z[:, None] * np.einsum("i,...ij->...j", z, rotation)[..., None, :]


class Pose(NamedTuple):
    """Of a triad: place r (…, 3) and axes F (…, 3, 3)."""

    r: Array
    F: Array


class Motion(NamedTuple):
    """Of a triad: place r (…, 3), axes F (…, 3, 3), and L (…, 6, n_v): velocity and angular velocity by v."""

    r: Array
    F: Array
    L: Array


@struct
class Node:
    """A body on the joint that carries it."""

    body: Body  # its constants
    # that carries it; where the scene has none a free one at the origin, in planar scenes a planar one
    joint: JointRecord
    backwards: bool  # whether the joint's first side is on this body
    inner: Section  # the joint's triad on what carries it
    outer: Section  # its triad on this body
    q: slice  # where the joint's coordinates stand in q
    p_q: slice  # and those of the modes
    v: slice  # likewise in v
    p_v: slice

    @property
    def sign(self) -> float:
        """−1 where the tree has the joint's coordinates the other way round."""
        return -1.0 if self.backwards else 1.0

    def coordinates(self, q: Array) -> Array:
        """Those of the joint (…, k) as the scene counts them, at q (…, n_q)."""
        found = self.joint.coordinates(q[..., self.q])
        return self.joint.turned_around(found) if self.backwards else found


class CompliantGear(NamedTuple):
    """A compliant gear: `spring`, and damper `damping` c (N·m·s/rad), behind a motor of the tree.

    The twist δ is that of `motor`, whose coordinate is θ_m, against `joint`, whose coordinate is `sign` γ: δ = θ_m − γ.
    """

    motor: Node
    joint: Node
    sign: float
    spring: TwistSpring
    damping: float

    def twist(self, q: Array, v: Array) -> tuple[Array, Array]:
        """δ and δ̇ (…,) at q (…, n_q), v (…, n_v)."""
        a, b = self.motor, self.joint
        way, rate = q[..., a.q.start] - self.sign * q[..., b.q.start], v[..., a.v.start] - self.sign * v[..., b.v.start]
        return way, rate


class KinematicTree:
    """Bodies on the joints of a spanning forest; `loops` are the joints beside it, in the scene's order.

    `tools` are the points "BODY.POINT" with axes of their own, (3, 3) columns in those of the body. `gears` are between
    its joints: none where they are taken for rigid (see `gears.with_compliance`).
    `on_frames` names joints whose angles are those of frames (see `frames_3d`).
    """

    gears: tuple[CompliantGear, ...] = ()
    on_frames: frozenset[str] = frozenset()

    def __init__(
        self,
        bodies: Sequence[Body],
        joints: Sequence[JointRecord],
        topology: Topology,
        floating: type[FreeJoint | PlanarJoint] = FreeJoint,
    ) -> None:
        """`floating`: the type of joint, at the origin, of bodies that no joint carries."""
        by_name = {body.name: body for body in bodies}
        self.tools = {
            f"{body.name}.{label}": at.triad for body in bodies for label, at in body.points.items() if at.is_turned
        }
        self.index = {name: number for number, name in enumerate(topology.carriers)}
        nodes, q, v = [], 0, 0
        for number, (name, carrier) in enumerate(topology.carriers.items()):
            body = by_name[name]
            joint = _at_origin(name, floating) if carrier is None else joints[carrier.joint]
            backwards = carrier is not None and joint.between[0] == carrier.own
            inner, outer = self.section(GROUND), Section(number, "", AXES, np.zeros(3))
            if carrier is not None:
                triads = joint.outward_triads(backwards)
                inner = self.section(carrier.other, triads[0], joint.at)
                outer = self.section(carrier.own, triads[1])
            p_q, p_v, n = q + joint.q_count, v + joint.freedoms, body.n_modes
            nodes.append(
                Node(body, joint, backwards, inner, outer, slice(q, p_q), slice(p_q, p_q + n), slice(v, p_v),
                     slice(p_v, p_v + n))
            )  # fmt: skip
            q, v = p_q + n, p_v + n
        self.nodes = tuple(nodes)
        self.n_q, self.n_v = q, v
        self.loops = tuple(joints[number] for number in topology.loop_joints)
        self.carried = {node.joint.name: number for number, node in enumerate(nodes)}

    def section(self, side: str, triad: Array = AXES, at: Sequence[float] = (0.0, 0.0, 0.0)) -> Section:
        """The triad, in the axes of what it is on: "BODY.POINT", the frame of "BODY" or "ground" `at` (m)."""
        if side == GROUND:
            return Section(-1, "", triad, np.array(at, dtype=float))
        body, _, point = side.partition(".")
        own = self.tools[side] @ triad if side in self.tools else triad
        return Section(self.index[body], point, own, np.zeros(3))

    def with_outputs(self, outputs: Sequence[tuple[JointRecord, str, Section]]) -> KinematicTree:
        """The tree with a body without inertia, of a label, on each joint with a rotor and one coordinate.

        They turn or slide on the sections `inner` as the outputs of the rotors' gears do, and stand after all others.
        """
        found, nodes = copy.copy(self), list(self.nodes)
        for joint, label, inner in outputs:
            q, v, outer = found.n_q, found.n_v, Section(len(nodes), "", np.eye(3), np.zeros(3))
            body = rigid_body(label, 0.0, np.zeros(3), np.zeros((3, 3)), {})
            found.n_q, found.n_v = q + 1, v + 1
            no_modes = slice(found.n_q, found.n_q), slice(found.n_v, found.n_v)
            nodes.append(
                Node(body, joint, False, inner, outer, slice(q, q + 1), no_modes[0], slice(v, v + 1), no_modes[1])
            )
        found.nodes = tuple(nodes)
        found.index = {node.body.name: number for number, node in enumerate(nodes)}
        found.carried = {node.joint.name: number for number, node in enumerate(nodes)}
        return found

    def with_bodies(self, bodies: Sequence[Body]) -> KinematicTree:
        """The tree with other bodies of the same names, modes and points, in its order."""
        found = copy.copy(self)
        found.nodes = tuple(replace(node, body=body) for node, body in zip(self.nodes, bodies, strict=True))
        return found

    @property
    def cut_joints(self) -> tuple[JointRecord, ...]:
        """The joints at which loops are cut that have no coordinates here."""
        return tuple(joint for joint in self.loops if joint.name not in self.carried)

    @property
    def joint_columns(self) -> Booleans:
        """(n_v,) which of v belong to joints, not to modes."""
        found = np.ones(self.n_v, dtype=bool)
        for node in self.nodes:
            found[node.p_v] = False
        return found

    def at_rest(self, guesses: Mapping[str, Array]) -> Array:
        """Q (n_q,) of undeformed links, with joint coordinates in the scene's order by name, else 0."""
        q = np.zeros(self.n_q)
        for node in self.nodes:
            numbers = len(node.joint.guess_units or node.joint.units)
            given = np.array(guesses.get(node.joint.name, np.zeros(numbers)), dtype=float)
            q[node.q] = node.joint.state(node.joint.turned_around(given) if node.backwards else given)
        return q

    def integrate(self, q: Array, dv: Array) -> Array:
        """Q moved by a small step dv (…, n_v): quaternions along the exponential."""
        moved = np.broadcast_to(q, (*dv.shape[:-1], self.n_q)).copy()
        for node in self.nodes:
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

    def poses(self, q: Array) -> list[Pose]:
        """Place and axes of each body's frame."""
        found: list[Pose] = []
        for node in self.nodes:
            inner, place = self.pose(node.inner, q, found), node.joint.place(q[..., node.q])
            u, E = _bent(node.body, node.outer, q[..., node.p_q])
            A = inner.F @ place.C @ np.swapaxes(E @ node.outer.triad, -1, -2)
            found.append(Pose(inner.r + _turned(inner.F, place.d) - _turned(A, u), A))
        return found

    def frames(self, q: Array, poses: Sequence[Pose] | None = None) -> list[Motion]:
        """Motion of each body's frame, of which `poses` may be known; L is of (Ṙ, Ω)."""
        found: list[Motion] = []
        for node, (r, A) in zip(self.nodes, poses or self.poses(q), strict=True):
            inner, S = self.motion(node.inner, q, found), node.joint.motion(q[..., node.q])
            d = _turned(inner.F, node.joint.place(q[..., node.q]).d)
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

    def pose(self, section: Section, q: Array, frames: Sequence[Pose | Motion]) -> Pose:
        """Of a section's triad, for less than its motion."""
        if section.body < 0:
            shape = q.shape[:-1]
            return Pose(np.broadcast_to(section.position, (*shape, 3)), np.broadcast_to(section.triad, (*shape, 3, 3)))
        arm, F = self._from_frame(section, q, frames)
        return Pose(frames[section.body].r + arm, F)

    def _from_frame(self, section: Section, q: Array, frames: Sequence[Pose | Motion]) -> tuple[Array, Array]:
        """From the origin of its body's frame to a section, (…, 3), and the axes (…, 3, 3) of its triad."""
        node, A = self.nodes[section.body], frames[section.body].F
        u, E = _bent(node.body, section, q[..., node.p_q])
        return _turned(A, u), A @ E @ section.triad

    def motion(self, section: Section, q: Array, frames: Sequence[Motion]) -> Motion:
        """Of a section's triad."""
        if section.body < 0:
            return Motion(*self.pose(section, q, frames), np.zeros((*q.shape[:-1], 6, self.n_v)))
        node, frame = self.nodes[section.body], frames[section.body]
        arm, F = self._from_frame(section, q, frames)
        Phi, turning = _by_modes(node.body, section, q[..., node.p_q])
        L = frame.L.copy()
        L[..., :3, :] -= skew(arm) @ frame.L[..., 3:, :]
        L[..., :3, node.p_v] += frame.F @ Phi
        L[..., 3:, node.p_v] += frame.F @ turning
        return Motion(frame.r + arm, F, L)


def _turned(A: Array, vectors: Array) -> Array:
    """A (…, 3, 3) times vectors (…, 3)."""
    return as_floats(np.einsum("...ij,...j->...i", A, vectors))


def _bent(body: Body, section: Section, p: Array) -> tuple[Array, Array]:
    """In body axes: u (…, 3) and E (…, 3, 3) = exp φ~."""
    if not section.point or not body.n_modes:
        u, shape = body.points[section.point].position if section.point else np.zeros(3), (*p.shape[:-1], 3)
        return np.broadcast_to(u, shape), np.broadcast_to(np.eye(3), (*shape, 3))
    at = bent_section(body, section.point, p)
    return at.u, exponential(section.turned(at.phi[..., None])[..., 0])


def _by_modes(body: Body, section: Section, p: Array) -> tuple[Array, Array]:
    """In body axes: Φ (…, 3, n), and J_l Φ_r (…, 3, n), which gives the spin by ṗ."""
    if not section.point or not body.n_modes:
        none = np.zeros((3, body.n_modes))
        return none, none
    at = bent_section(body, section.point, p)
    phi = section.turned(at.phi[..., None])[..., 0]
    return at.u_p, left_jacobian(phi) @ section.turned(at.phi_p)


def _at_origin(body: str, floating: type[FreeJoint | PlanarJoint]) -> JointRecord:
    kind = "free" if floating is FreeJoint else "planar"
    return floating.model_construct(name=body, type=kind, between=(GROUND, f"{body}.frame"))
