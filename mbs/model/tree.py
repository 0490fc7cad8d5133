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

from ...common.arrays import Array, Booleans
from ..fields.field_types import GROUND
from ..joints.free import FreeJoint
from ..joints.joint import JointRecord
from ..joints.planar_joint import PlanarJoint
from ..joints.twist_spring import TwistSpring
from ..scene.topology import Topology
from .body import Body, rigid_body
from .kinematics import Kinematics, Places
from .nodes import Node, Section

AXES = np.eye(3)
AXES.setflags(write=False)


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
    `on_frames` names joints whose angles are those of frames (see `model.with_coordinates_of_frames`).
    """

    gears: tuple[CompliantGear, ...] = ()
    on_frames: frozenset[str] = frozenset()
    _known: Kinematics | None = None

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

    def places(self, q: Array, v: Array | None = None) -> Places:
        """Where all frames and sections are at states q (T, n_q), and how they move with v (T, n_v), else at rest."""
        return self._moving.places(q, v)

    def integrate(self, q: Array, dv: Array) -> Array:
        """Q (…, n_q) moved by a small step dv (…, n_v): quaternions along the exponential."""
        shape = dv.shape[:-1]
        at, count = np.broadcast_to(q, (*shape, self.n_q)), int(np.prod(shape))
        moved = self._moving.core.moved(at.reshape(count, self.n_q), dv.reshape(count, self.n_v))
        return moved.reshape(*shape, self.n_q)

    @property
    def _moving(self) -> Kinematics:
        """Made for these nodes, of which copies of a tree have others."""
        if self._known is None or self._known.nodes is not self.nodes:
            self._known = Kinematics.of_points(self.nodes)
        return self._known


def _at_origin(body: str, floating: type[FreeJoint | PlanarJoint]) -> JointRecord:
    kind = "free" if floating is FreeJoint else "planar"
    return floating.model_construct(name=body, type=kind, between=(GROUND, f"{body}.frame"))
