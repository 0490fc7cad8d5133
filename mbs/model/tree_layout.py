"""The bodies of a planar mechanism on the joints of its spanning forest, as the core's recursion takes them.

q and v of a tree have the same layout: of each body the coordinates of the joint that carries it, then those of its
modes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from .. import _core
from ..joints.joint import JointRecord
from ..joints.measure import FRAME, GROUND_FRAME, Marker, Measure
from ..joints.transmission import ElasticGear
from ..scene.bodies import RigidBody
from ..scene.topology import Carrier, Edge, Topology, spanning_forest
from .model import Model
from .planar_body import PlanarBody, core_arguments, from_rigid_body


class JointInTree(NamedTuple):
    """What a joint is to the core, and its number of coordinates."""

    kind: _core.JointKind
    coordinates: int


JOINTS = {
    "revolute": JointInTree(_core.JointKind.revolute, 1),
    "prismatic": JointInTree(_core.JointKind.prismatic, 1),
    "weld": JointInTree(_core.JointKind.weld, 0),
}
"""By type of joint; those of other types are cut: what they hold are rows, and no body hangs on them."""

FREE = JointInTree(_core.JointKind.free, 3)
"""Of a body that nothing carries: (R, θ) of its frame."""


class NotInTreeError(Exception):
    """Says what of a mechanism cannot be told in joint coordinates."""


class Coordinate(NamedTuple):
    """Of a joint of the tree: its number in q and v, and the sign with which the tree counts it."""

    number: int
    sign: float


class Node(NamedTuple):
    """A body, the joint that carries it from section `inner` to `outer`, first indices of both in v.

    `joint`: None of one that nothing carries, and of bodies of no inertia that turn with a rotor: the output of a
    `gear` that gives, whose `body` is the rotor of the system, and what a rotor `beside` the tree turns, the angle
    between two markers that no coordinate is. `backwards`: `inner` is the second side of the joint.
    """

    body: PlanarBody
    kind: _core.JointKind
    inner: _core.MarkerAt
    outer: _core.MarkerAt
    first: int
    modes: int
    joint: JointRecord | None = None
    backwards: bool = False
    gear: ElasticGear | None = None
    beside: Measure | None = None

    @property
    def is_weightless(self) -> bool:
        """Whether it has no inertia but that of a rotor."""
        return self.gear is not None or self.beside is not None


class Layout:
    """The tree of a model, and the markers on its bodies, which are made where they are asked for.

    Attributes:
        nodes: each after the one that carries it; after them outputs of gears that give, then rotors beside the tree,
            which are no bodies of the system.
        cut: names of the joints that carry nothing: those that close loops, and of types that the core does not know.
        size: of q and of v.
    """

    def __init__(self, model: Model) -> None:
        topology = _forest(model)
        names = [*topology.carriers, *(gear.rotor for gear in model.gears)]
        self._index = {name: number for number, name in enumerate(names)}
        self._bodies = [model.body(name) for name in names]
        self._markers: list[dict[tuple[Marker, float], int]] = [{} for _ in (None, *self._bodies)]  # the ground's first
        self._coordinates: dict[tuple[object, ...], Coordinate] = {}
        self._kept = {c.owner: c.measure.offset for c in model.joints if c.measure.kind == _core.MeasureKind.angle}
        self.cut = {model.scene.joint[number].name for number in topology.loop_joints}
        self.nodes: list[Node] = []
        self.size = 0
        for body, carrier in zip(self._bodies, topology.carriers.values(), strict=False):
            joint = None if carrier is None else model.scene.joint[carrier.joint]
            self.nodes.append(self._node(body, joint, carrier))
        self.nodes += [self._output(gear) for gear in model.gears]
        self.nodes += [self._beside(*rotor) for rotor in model.rotors if self._is_beside(rotor[0])]

    def place(self, marker: Marker, turn: float = 0.0) -> _core.MarkerAt:
        """A marker, its axes turned by `turn` (rad) against its section or the ground."""
        number = -1 if marker.body is None else self._index[marker.body]
        known = self._markers[number + 1]
        return _core.MarkerAt(number, known.setdefault((marker, turn), len(known)))

    def coordinate(self, measure: Measure) -> Coordinate | None:
        """The coordinate of the tree that a measure is; None of others."""
        return self._coordinates.get(_key(measure))

    def motor(self, measure: Measure) -> tuple[int, float, bool] | None:
        """Number and sign of the coordinate along which a motor acts, and whether it turns frames in place of sections.

        None of those at joints where loops are cut.
        """
        if (coordinate := self.coordinate(measure)) is not None:
            return *coordinate, False
        for node in self.nodes:
            if node.joint is not None and node.joint.coordinate("frame") == measure:
                of_sections = node.joint.coordinate("section")
                assert of_sections is not None
                return *self._coordinates[_key(of_sections)], True
        return None

    def section_angle(self, marker: Marker) -> Array:
        """How the angle of a section, or of a frame, follows the coordinates of the tree: linear, by this row (size,).

        Joint by joint, θ of the outer section is that of the inner one and the coordinate of a revolute joint.
        Raises `NotInTreeError` where geometric stiffening turns a section on the way.
        """
        if marker.body is None:
            return np.zeros(self.size)
        number = self._index[marker.body]
        node = self.nodes[number]
        if node.joint is None:
            of_frame = np.eye(self.size)[node.first + 2]
        else:
            inner, outer = node.joint.markers[::-1] if node.backwards else node.joint.markers
            of_frame = self.section_angle(inner) - self._on_modes(number, outer)
            if node.joint.type == "revolute":
                of_frame[node.first] += 1.0
        of_section: Array = of_frame + self._on_modes(number, marker)
        return of_section

    def _on_modes(self, number: int, marker: Marker) -> Array:
        """(size,) Φ_r of a section at the modes of its body."""
        found, turning = np.zeros(self.size), self._turning(marker)
        first = self.nodes[number].modes
        found[first : first + len(turning)] = turning
        return found

    def ground_markers(self) -> list[_core.PlanarMarker]:
        """All that were placed."""
        return [_marker(np.array(at.position), np.zeros((3, 0)), turn) for at, turn in self._markers[0]]

    def data(self, number: int) -> _core.PlanarData:
        """Constants of a body with all markers that were placed on it; terms that vanish are left empty."""
        body, found = self._bodies[number], _core.PlanarData()
        of_core = core_arguments(body, [], [])
        if not self.nodes[number].is_weightless:
            for key in ("mass", "inertia", "first_moment"):
                setattr(found, key, of_core[key])
        if body.n_modes:
            for key in ("stiffness", "damping", "j", "S_tilde", "m_xy"):
                setattr(found, key, of_core[key])
            found.S_bar, found.h = body.S_bar, body.h
        if body.stiffening is not None:
            found.K = body.stiffening.by_affine_fields
        found.markers = [self._section_marker(body, at.point, turn) for at, turn in self._markers[number + 1]]
        return found

    @staticmethod
    def _section_marker(body: PlanarBody, point: str, turn: float) -> _core.PlanarMarker:
        marker = _marker(*_section(body, point), turn)
        if body.stiffening is not None and point in body.stiffening.K_points:
            marker.K = list(body.stiffening.K_points[point])
        return marker

    def _node(self, body: PlanarBody, joint: JointRecord | None, carrier: Carrier | None) -> Node:
        first = self.size
        kind, count = FREE if joint is None else JOINTS[joint.type]
        backwards = joint is not None and carrier is not None and joint.between[0] == carrier.own
        sides = [self.place(at, turn) for at, turn in self._sides(body, joint)]
        inner, outer = sides[::-1] if backwards else sides
        if joint is not None and count:
            self._add_coordinate(joint, Coordinate(first, -1.0 if backwards else 1.0))
        self.size = first + count + body.n_modes
        return Node(body, kind, inner, outer, first, first + count, joint, backwards)

    def _output(self, gear: ElasticGear) -> Node:
        """It turns on the first side of the gear's joint by θ_m, the rotor N times as fast."""
        first, (a, b) = self.size, (gear.motor.a, gear.motor.b)
        self._coordinates[_key(gear.motor)] = Coordinate(first, 1.0)
        kind, count = JOINTS["revolute"]
        self.size += count
        body = self._bodies[self._index[gear.rotor]]
        return Node(body, kind, self.place(a), self.place(b), first, first + count, gear=gear)

    def _is_beside(self, rotor: Measure) -> bool:
        return self.coordinate(turned_by(rotor)) is None

    def _beside(self, measure: Measure, inertia: float) -> Node:
        """It turns on the first side of the measure as the second does, which a row says.

        One that feels the relative motion alone, and not the turn of the first side, does so on the ground.
        """
        first, turned = self.size, turned_by(measure)
        J = inertia * measure.angle_ratios[0] ** 2
        body = from_rigid_body(measure.label, RigidBody(mass=J, inertia=J, center=(0.0, 0.0)))  # at 1 m: of no effect
        self._index[body.name] = len(self._bodies)
        self._bodies.append(body)
        self._markers.append({})
        self._coordinates[_key(turned)] = Coordinate(first, 1.0)
        kind, count = JOINTS["revolute" if measure.carries_moment else "prismatic"]
        self.size += count
        on = measure.a if measure.kind == _core.MeasureKind.gear else GROUND_FRAME
        sides = self.place(on), self.place(Marker(body.name))
        return Node(body, kind, *sides, first, first + count, beside=turned)

    def _sides(self, body: PlanarBody, joint: JointRecord | None) -> list[tuple[Marker, float]]:
        """Markers of a joint on its first and second side, and how their axes are turned: alike where it keeps these.

        Prismatic joints slide along the axis x of both.
        """
        if joint is None:
            return [(GROUND_FRAME, 0.0), (Marker(body.name), 0.0)]
        (a, b), coordinate = joint.markers, joint.coordinate("section")
        if joint.type == "revolute" or coordinate is None:
            turn = 0.0
        else:
            x, y = coordinate.direction
            turn = float(np.arctan2(y, x))
        return [(a, turn), (b, turn - self._kept.get(joint.name, 0.0))]

    def _add_coordinate(self, joint: JointRecord, coordinate: Coordinate) -> None:
        """Of sections; and of frames where modes turn neither section against its frame."""
        of_sections, of_frames = joint.coordinate("section"), joint.coordinate("frame")
        assert of_sections is not None
        assert of_frames is not None
        self._coordinates[_key(of_sections)] = coordinate
        if not any(self._turns_more(marker) or np.any(self._turning(marker)) for marker in joint.markers):
            self._coordinates[_key(of_frames)] = coordinate

    def _turning(self, marker: Marker) -> Array:
        """Φ_r (n,) of a section; () of the ground and of frames. Raises `NotInTreeError` where it changes with p."""
        if marker.body is None or marker.point == FRAME:
            return np.zeros(0)
        if self._turns_more(marker):
            raise NotInTreeError(f"an angle of {marker.body}.{marker.point}, which geometric stiffening turns")
        return self._bodies[self._index[marker.body]].points[marker.point].rotation

    def _turns_more(self, marker: Marker) -> bool:
        """Whether geometric stiffening turns a section."""
        if marker.body is None or marker.point == FRAME:
            return False
        stiffening = self._bodies[self._index[marker.body]].stiffening
        return stiffening is not None and stiffening.turns(marker.point)


def _forest(model: Model) -> Topology:
    """Loops are cut at joints of types that the core does not know, which carry nothing in open chains either.

    Else at revolute joints, whose angles are linear in coordinates of the tree, where nothing acts, if any. Else where
    friction does; where a motor, a rotor or a path is only if all of a loop have one.
    """
    scene = model.scene
    unknown = {number for number, joint in enumerate(scene.joint) if joint.type not in JOINTS}
    if scene.topology.is_open_chain and not unknown:
        return scene.topology
    needed = {joint.name for joint in (*scene.motor_joints, *(j for j in scene.joint if j.rotor("section")))}
    needed |= {trajectory.joint for trajectory in scene.trajectory if trajectory.joint is not None}

    def rank(joint: JointRecord) -> int:
        if joint.type not in JOINTS:
            return 4
        if joint.type != "revolute":
            return 0
        if joint.name in needed:
            return 1
        return 2 if joint.friction else 3

    edges = [Edge(joint.between, rank(joint)) for joint in scene.joint]
    topology = spanning_forest([body.name for body in scene.body], edges)
    carriers = {body: None if by is None or by.joint in unknown else by for body, by in topology.carriers.items()}
    carrying = {by.joint for by in carriers.values() if by is not None}
    return Topology(carriers, tuple(number for number in range(len(edges)) if number not in carrying))


def turned_by(rotor: Measure) -> Measure:
    """What a rotor turns with: the angle of the second side of its measure on the first where there is a gear."""
    if rotor.kind != _core.MeasureKind.gear:
        return rotor
    return Measure(rotor.label, _core.MeasureKind.angle, rotor.a, rotor.b)


def _key(measure: Measure) -> tuple[object, ...]:
    return measure.kind, measure.a, measure.b, measure.direction


def _section(body: PlanarBody, point: str) -> tuple[Array, Array]:
    """Position (2,) and Φ over Φ_r (3, n) of a point, or of the frame."""
    if point == FRAME:
        return np.zeros(2), np.zeros((3, body.n_modes))
    at = body.points[point]
    return at.position, np.vstack([at.translation, at.rotation])


def _marker(position: Array, Phi: Array, turn: float) -> _core.PlanarMarker:
    marker = _core.PlanarMarker()
    marker.position, marker.Phi, marker.angle = np.array(position), Phi, turn
    return marker
