"""A tree of bodies, and the joints at which its loops are cut.

State q has, for each body in the order of the tree, the q of its joint, then its p; v likewise; so in the core. All
functions evaluate states (…, n_q) at once; results are in global axes, SI units.

The tree has no coordinate γ of a joint at which a loop is cut, γ̇ = G v: a force f along it, as of friction or a load,
is Gᵀf. The output of a rotor there is a massless body of the tree with the coordinate γ, by a constraint equation: all
that acts along the joint acts on it.
"""

import copy
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans
from ...common.errors import InputError, quoted
from .._core import TimeFunction
from ..fields.field_types import GROUND
from ..joints.joint import Friction, JointRecord, TwistSpring
from ..joints.joints import FreeJoint, PlanarJoint
from ..scene.mechanism import MechanismScene
from ..scene.topology import Topology
from .body import Body, rigid_body
from .kinematics import Kinematics, Places
from .nodes import ConstraintRow, Node, Section

AXES = np.eye(3)
AXES.setflags(write=False)


class CompliantGear(NamedTuple):
    """A compliant gear: `spring` and `damping` (N·m·s/rad or N·s/m) behind a motor of the tree.

    Its twist is δ = θ_m − γ with the coordinate θ_m of `motor`, and `sign` γ of `joint`.
    """

    motor: Node
    joint: Node
    sign: float
    spring: TwistSpring
    damping: float

    def twist(self, q: Array, v: Array) -> tuple[Array, Array]:
        """The twist δ (…,), rad or m, and its rate δ̇, rad/s or m/s, at q (…, n_q), v (…, n_v), SI."""
        a, b = self.motor, self.joint
        return q[..., a.q.start] - self.sign * q[..., b.q.start], v[..., a.v.start] - self.sign * v[..., b.v.start]

    def round_off(self, q: Array) -> float:
        """The round-off of the spring's torque, relative to the largest at q (T, n_q), rad and m.

        0 where all torque is round-off.
        """
        angle, twist = (
            float(np.abs(of).max(initial=0.0))
            for of in (q[:, self.motor.q], q[:, self.motor.q.start] - self.sign * q[:, self.joint.q.start])
        )
        noise = float(np.finfo(float).eps) * angle * max(self.spring.slopes)
        largest = float(self.spring.moment(np.array(twist)))
        return noise / largest if largest > 2.0 * noise else 0.0


class KinematicTree:
    """Spanning forest of bodies on their joints, SI units; `loops`: the loop-closing joints, in the scene's order.

    `tools` are points "BODY.POINT" with their own axes (3, 3), unit columns, in those of the body. `gears` are
    compliant gears, none where all are rigid (see `gears.with_compliance`). `on_frames` names joints whose angles are
    between frames (see `build.with_coordinates_of_frames`).
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
            if carrier is None:
                kind = "free" if floating is FreeJoint else "planar"
                joint: JointRecord = floating.model_construct(name=name, type=kind, between=(GROUND, f"{name}.frame"))
            else:
                joint = joints[carrier.joint]
            backwards = carrier is not None and joint.between[0] == carrier.own
            inner, outer = self.section(GROUND), Section(number, "", AXES, np.zeros(3))
            if carrier is not None:
                inner, outer = self.sides(joint)
            if backwards:
                inner, outer = (side._replace(triad=side.triad @ joint.exchanged) for side in (outer, inner))
            nodes.append(_node_at(q, v, body, joint, inner, outer, backwards=backwards))
            q, v = nodes[-1].p_q.stop, nodes[-1].p_v.stop
        self.nodes = tuple(nodes)
        self.n_q, self.n_v = q, v
        self.loops = tuple(joints[number] for number in topology.loop_joints)
        self.carried = {node.joint.name: number for number, node in enumerate(nodes)}

    def section(self, side: str, triad: Array = AXES, at: Sequence[float] = (0.0, 0.0, 0.0)) -> Section:
        """Section "BODY.POINT", frame of "BODY", or "ground" `at` (3,), m; `triad` (3, 3): columns of axes."""
        if side == GROUND:
            return Section(-1, "", triad, np.array(at, dtype=float))
        body, _, point = side.partition(".")
        own = self.tools[side] @ triad if side in self.tools else triad
        return Section(self.index[body], point, own, np.zeros(3))

    def sides(self, joint: JointRecord) -> tuple[Section, Section]:
        """The sections of the first and the second side of a joint."""
        first, second = zip(joint.between, joint.triads(), strict=True)
        return self.section(*first, joint.at), self.section(*second, joint.at)

    def with_outputs(self, outputs: Sequence[tuple[JointRecord, str, Section]]) -> "KinematicTree":
        """The tree with the output of a rotor's gear for each (joint, output's name, section).

        It is a massless body that moves on this section as the joint does. Outputs come after all bodies.
        """
        tree, nodes = copy.copy(self), list(self.nodes)
        for joint, label, inner in outputs:
            outer = Section(len(nodes), "", np.eye(3), np.zeros(3))
            body = rigid_body(label, 0.0, np.zeros(3), np.zeros((3, 3)), {})
            nodes.append(_node_at(tree.n_q, tree.n_v, body, joint, inner, outer))
            tree.n_q, tree.n_v = tree.n_q + 1, tree.n_v + 1
        tree.nodes = tuple(nodes)
        tree.index = {node.body.name: number for number, node in enumerate(nodes)}
        tree.carried = {node.joint.name: number for number, node in enumerate(nodes)}
        return tree

    def with_bodies(self, bodies: Sequence[Body]) -> "KinematicTree":
        """The tree with `bodies` in place of its own, in its order, with the same names, modes and points."""
        tree = copy.copy(self)
        tree.nodes = tuple(replace(node, body=body) for node, body in zip(self.nodes, bodies, strict=True))
        return tree

    @property
    def cut_joints(self) -> tuple[JointRecord, ...]:
        """The joints at which loops are cut that have no coordinates here."""
        return tuple(joint for joint in self.loops if joint.name not in self.carried)

    @property
    def joint_columns(self) -> Booleans:
        """Whether entries (n_v,) of v belong to joints, not to modes."""
        is_joint = np.ones(self.n_v, dtype=bool)
        for node in self.nodes:
            is_joint[node.p_v] = False
        return is_joint

    @property
    def is_rigid(self) -> bool:
        """Whether no body has modes."""
        return bool(self.joint_columns.all())

    def at_rest(self, guesses: Mapping[str, Array]) -> Array:
        """Return q (n_q,), rad and m, of straight links; joints have `guesses` (k,) by name, in scene order, else 0."""
        q = np.zeros(self.n_q)
        for node in self.nodes:
            numbers = len(node.joint.guess_units or node.joint.units)
            given = np.array(guesses.get(node.joint.name, np.zeros(numbers)), dtype=float)
            q[node.q] = node.joint.state(node.joint.turned_around(given) if node.backwards else given)
        return q

    def places(self, q: Array, v: Array | None = None) -> Places:
        """Positions, m, velocities, m/s, rad/s, of frames and sections at q (T, n_q), v (T, n_v) or 0, SI."""
        return self._moving.places(q, v)

    def integrate(self, q: Array, dv: Array) -> Array:
        """Return q (…, n_q) moved by a small step dv (…, n_v), SI: quaternions by the exponential map."""
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


def _node_at(
    q: int, v: int, body: Body, joint: JointRecord, inner: Section, outer: Section, *, backwards: bool = False
) -> Node:
    """The node whose joint's coordinates begin at q and v, before its modes."""
    p_q, p_v, n = q + joint.q_count, v + joint.freedoms, body.n_modes
    along = {"q": slice(q, p_q), "p_q": slice(p_q, p_q + n), "v": slice(v, p_v), "p_v": slice(p_v, p_v + n)}
    return Node(body, joint, backwards, inner, outer, **along)


class CutCoordinate(NamedTuple):
    """A coordinate of a joint at which a loop is cut, rad or m."""

    joint: JointRecord
    number: int  # index among the joint's coordinates
    row: ConstraintRow  # measures `row.sign` times the coordinate
    friction: Friction | None  # along the coordinate
    loads: tuple[TimeFunction, ...]  # given forces over time along it, N·m or N
    guess: float  # of its first value, from [initial], else 0

    def resistance(self, rate: Array) -> Array:
        """The negative friction (T,), N·m or N, at the coordinate's rate (T,), rad/s or m/s."""
        return np.zeros_like(rate) if self.friction is None else self.friction.resistance(rate)


def with_auxiliary_rotors(tree: KinematicTree) -> tuple[KinematicTree, list[ConstraintRow]]:
    """The tree with massless outputs of rotors on first sides of cut joints; equations: these move as the joints do."""
    cut = [joint for joint in tree.loops if getattr(joint, "rotor_inertia", 0.0)]
    rows = [cut_row(tree, joint) for joint in cut]
    longer = tree.with_outputs([(joint, f"{joint.name}/rotor", row.a) for joint, row in zip(cut, rows, strict=True)])
    nodes = longer.nodes[len(tree.nodes) :]
    return longer, [replace(row, coordinate=node.v.start) for row, node in zip(rows, nodes, strict=True)]


def cut_coordinates(scene: MechanismScene, tree: KinematicTree) -> Iterator[CutCoordinate]:
    """Yield coordinates of cut loop joints that the tree does not contain."""
    for joint in tree.cut_joints:
        frictions = joint.frictions or (None,) * len(joint.along)
        guesses = np.array(scene.initial.joints.get(joint.name, ()), dtype=float).ravel()
        for number, friction in enumerate(frictions):
            loads = tuple(load.moments[number] for load in scene.load if load.joint == joint.name)
            guess = float(guesses[number]) if guesses.size else 0.0
            yield CutCoordinate(joint, number, cut_row(tree, joint, number), friction, loads, guess)


def cut_row(tree: KinematicTree, joint: JointRecord, number: int = 0) -> ConstraintRow:
    """The equation of coordinate `number` of a cut joint, second side on first, times the equation's `sign`."""
    along = joint.along[number]
    sides = tree.sides(joint)
    if joint.name in tree.on_frames:
        sides = sides[0]._replace(still=True), sides[1]._replace(still=True)
    a, b = sides[::-1] if along.of_outer else sides
    f, g = np.eye(3)[[along.f, along.g]]
    sign = -1.0 if along.of_outer else 1.0  # of the first side on the second
    return ConstraintRow(joint.name, along.kind, a, b, f, g, is_trajectory=False, sign=sign)


def loop_rows(scene: MechanismScene, tree: KinematicTree, joint: JointRecord) -> Iterator[ConstraintRow]:
    """Yield the equations by which a joint closes a loop, which is cut there.

    Raises `InputError` for types that cannot close loops, for a motor without a rotor, and for a compliant gear.
    """
    if key := joint.asks_for_coordinate:
        raise InputError(
            f"{scene.path}: {joint.label}: expected a loop with a joint that has neither a motor without"
            " rotor_inertia nor a compliant gear, to be cut",
            f"{quoted(key)} here and one of them in each of the others. Such loops are not available in 3D",
        )
    if joint.loop_equations is None:
        raise InputError(
            f"{scene.path}: {joint.label}: expected another type of joint where a loop closes",
            f"a {joint.type} joint: list it before the other joints of its loop",
        )
    a, b = tree.sides(joint)
    for kind, *at in joint.loop_equations:
        axes = ((e, e) for e in AXES) if kind == "point" else [AXES[at]]
        # in axes of the joint: which equations depend on others does not change as the mechanism turns
        along = "slide" if kind == "point" and not scene.is_planar else kind
        yield from (ConstraintRow(joint.name, along, a, b, f, g, is_trajectory=False) for f, g in axes)


class CutMotion(NamedTuple):
    """Motion of a coordinate of a cut joint."""

    coordinate: Array  # (T,) rad or m, with full turns
    rate: Array  # (T,) rad/s or m/s
    is_counted: bool  # whether times are close enough together to count turns


class AlongCut:
    """Coordinates γ of joints at which loops are cut, measured by the core; SI units."""

    def __init__(self, tree: KinematicTree, cut: Sequence[CutCoordinate]) -> None:
        self._n_v, self._all = tree.n_v, cut
        self._rough = [k for k, one in enumerate(cut) if one.friction is not None]
        self._kinematics = Kinematics(tree.nodes, rows=[one.row for one in cut]) if cut else None

    def measured(self, q: Array) -> tuple[Array, Array]:
        """γ (T, cut), rad or m, at q (T, n_q), angles within ±π, and G = ∂γ̇/∂v (T, cut, n_v); SI."""
        if self._kinematics is None:
            return np.zeros((len(q), 0)), np.zeros((len(q), 0, self._n_v))
        return self._kinematics.values(q, np.zeros(len(q)))

    def resistance(self, q: Array, v: Array) -> Array:
        """Negative generalized forces (T, n_v), N, N·m, N/√kg, of friction at q (T, n_q), v (T, n_v), SI."""
        force = np.zeros_like(v)
        gradients = self.measured(q)[1] if self._rough else force
        for k in self._rough:
            G = gradients[:, k]
            force += self._all[k].resistance(np.einsum("tj,tj->t", G, v))[:, None] * G
        return force

    def damping(self, q: Array, *, is_at_rest: bool) -> Array:
        """The damping matrix (n_v, n_v) at q (n_q,), SI: viscous friction, at rest also dry friction."""
        D = np.zeros((self._n_v, self._n_v))
        gradients = self.measured(q[None])[1][0] if self._rough else D
        for k in self._rough:
            friction, G = self._all[k].friction, gradients[k]
            assert friction is not None
            D += friction.damping(is_at_rest=is_at_rest) * np.outer(G, G)
        return D

    def motions(self, q: Array, v: Array, times: Array) -> list[CutMotion]:
        """Motions at q (T, n_q), v (T, n_v), SI, and `times` (T,), s; angles start nearest to their guesses."""
        motions = list[CutMotion]()
        if self._kinematics is None:
            return motions
        values, rates = self.measured(q)[0], self._kinematics.rates(q, v, np.zeros(len(q)))
        for one, value, rate in zip(self._all, values.T, rates.T, strict=True):
            turns = one.row.kind == "turn"
            coordinate, is_counted = _unwound(value, rate, times, one.guess) if turns else (value, True)
            motions.append(CutMotion(coordinate, rate, is_counted))
        return motions


def _unwound(angle: Array, rate: Array, times: Array, guess: float) -> tuple[Array, bool]:
    """The angle (T,) with full turns: each the nearest to where the rates lead from the one before.

    Rates lead there by cubics with the slopes of their differences. Turns are counted where these are near the
    trapezoidal rule and the angle found; of two outputs, up to a quarter turn.
    """
    if len(times) < 2:
        return angle + 2 * np.pi * np.round((guess - angle) / (2 * np.pi)), True
    h, slope = np.diff(times), np.gradient(rate, times, edge_order=2 if len(times) > 2 else 1)
    rough = h * (rate[1:] + rate[:-1]) / 2
    way = rough - h**2 * np.diff(slope) / 12
    turns = np.round((np.append(guess, way) - np.append(angle[0], np.diff(angle))) / (2 * np.pi))
    whole = angle + 2 * np.pi * np.cumsum(turns)
    known = rough if len(times) > 2 else 0.0 * rough  # two outputs tell nothing of rates between them
    off = np.abs(way - np.array([known, np.diff(whole)])).max()
    return whole, bool(off < np.pi / 2)
