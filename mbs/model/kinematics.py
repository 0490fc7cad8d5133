"""A tree in the core: its bodies and sections, and their motion in global axes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans
from .. import _core
from ..fields.orientations import OrientationLaw
from .body import Body
from .nodes import ConstraintRow, Node, Section, rotor

ZERO = _core.TimeFunction.constant(0.0)

Placed = tuple[int, int]  # body, −1 the ground, and number of its marker


class CutPlace(NamedTuple):
    """Coordinate of a cut joint: the sections between which it is measured and forces along it act."""

    # a, b: indices of the sections among `ModelParts.wrenches`
    a: int
    b: int
    turns: bool  # whether the coordinate is an angle
    axis: Array  # (3,) unit vector along or about which it is measured, in axes of a


class ModelParts(NamedTuple):
    """Input of the core for a mechanism in space; SI units.

    Forces act on the markers `wrenches`, and along coordinates `cut` of cut joints. `gravity` (3,), m/s².
    """

    bodies: list[_core.SpatialBody]
    ground: list[_core.SpatialMarker]
    rows: list[_core.ConstraintModel]
    wrenches: list[_core.MarkerAt]
    gravity: Array
    cut: tuple[CutPlace, ...]


class Markers:
    """Markers on bodies of a tree and on the ground, created on request.

    Attributes:
        of_bodies: sections of each body, in the order of its markers.
        turning: index among markers of the ground, and law in time, of each that has one.
    """

    def __init__(self, nodes: Sequence[Node]) -> None:
        self._nodes = nodes
        self.of_bodies: list[list[Section]] = [[] for _ in nodes]
        self._ground: list[Section] = []
        self.turning: list[tuple[int, OrientationLaw]] = []
        self._sides = [(self.place(node.inner), self.place(node.outer)) for node in nodes]

    def place(self, section: Section) -> Placed:
        """Index of the body (−1: ground) and, on it, of the marker of a section, which is made if new."""
        known = self._ground if section.body < 0 else self.of_bodies[section.body]
        for number, other in enumerate(known):
            same = other.point == section.point and other.still == section.still
            if same and np.array_equal(other.triad, section.triad) and np.array_equal(other.position, section.position):
                return section.body, number
        known.append(section)
        return section.body, len(known) - 1

    def row(self, row: ConstraintRow) -> _core.ConstraintModel:
        """The core's record of a constraint equation between markers."""
        row_model = _core.ConstraintModel()
        row_model.name, row_model.kind = row.owner, getattr(_core.ConstraintKind, row.kind)
        if row.kind == "coordinate":
            row_model.coordinate = row.coordinate
            return row_model
        a, b = self.place(row.a), self.place(row.b)
        if row.law is not None:  # see ConstraintRow: of "dot" rows it is that of b
            number = next((number for number, known in self.turning if known is row.law), None)
            if number is None:
                self._ground.append(Section(-1, f"turning {len(self.turning)}", np.eye(3), np.zeros(3)))
                number = len(self._ground) - 1
                self.turning.append((number, row.law))
            a, b = (a, (-1, number)) if row.kind == "dot" else ((-1, number), b)
        row_model.a, row_model.b = _core.MarkerAt(*a), _core.MarkerAt(*b)
        row_model.f, row_model.g, row_model.coordinate = np.array(row.f), np.array(row.g), row.coordinate
        return row_model

    def bodies(self, driven: Booleans | None = None) -> list[_core.SpatialBody]:
        """The core's bodies with all markers; `driven` (n_v,): coordinates along which given forces act."""
        bodies = []
        for node, (inner, outer), markers in zip(self._nodes, self._sides, self.of_bodies, strict=True):
            body = _core.SpatialBody()
            body.name, (body.parent, body.parent_marker), body.inboard_marker = node.body.name, inner, outer[1]
            body.joint = getattr(_core.JointKind, node.joint.type)
            body.lead = float(getattr(node.joint, "rise", 0.0))
            body.driven = driven is not None and bool(driven[node.v].any())
            # else the core may take coordinates of the frame, where modes turn the section
            body.of_section = moves(node)
            # A rotor sits on the first side and spins with N Ω_second − (N − 1) Ω_first; where that side is the outer
            # one, with N' Ω_outer − (N' − 1) Ω_inner and N' = 1 − N. In prismatic joints it spins with the coordinate.
            body.rotor_inertia, ratio = rotor(node)
            body.gear_ratio = 1.0 - ratio if node.backwards and node.joint.type == "revolute" else ratio
            body.data = _data(node.body, markers)
            bodies.append(body)
        return bodies

    def standing(self) -> list[_core.SpatialMarker]:
        """The markers on the ground."""
        turning = [number for number, _ in self.turning]
        markers = [_marker(section, np.zeros((6, 0)), section.position, []) for section in self._ground]
        for number, marker in enumerate(markers):
            marker.turns = number in turning
        return markers

    def followed(self, rows: Sequence[ConstraintRow]) -> _core.TreeScene:
        """The functions that `rows` and markers of the ground follow."""
        scene = _core.TreeScene()
        for row in rows:
            scene.add_target(ZERO if row.target is None else row.target, row.sign)
        for number, law in self.turning:
            scene.turn_marker(number, law.in_core)
        return scene


def moves(node: Node) -> bool:
    """Whether modes move the section of the body at its joint."""
    Phi, _, K = rows_of(node.body, node.outer)
    return bool(np.any(Phi)) or any(bool(np.any(of_row)) for of_row in K)


def rows_of(body: Body, section: Section) -> tuple[Array, Array, list[Array]]:
    """Translations Φ over rotations Φ_r (6, n), 1/√kg, 1/(√kg·m), and the position (3,), m, of a section.

    Third are its six `Stiffening.K_points` (n, n), 1/(kg·m) and 1/(kg·m²), or none.
    """
    if not section.point:
        return np.zeros((6, body.n_modes)), np.zeros(3), []
    at = body.points[section.point]
    K = [] if body.stiffening is None else list(body.stiffening.K_points.get(section.point, []))
    if K and section.still:
        n = body.n_modes
        K[3:] = section.turned(np.reshape(K[3:], (3, n * n))).reshape(3, n, n)
    return np.vstack([at.translation, section.turned(at.rotation)]), at.position, K


def _data(body: Body, markers: list[Section]) -> _core.SpatialData:
    """Constants of a body; those of modes are empty of a rigid one."""
    data = _core.SpatialData()
    data.mass, data.first_moment, data.J2 = body.mass, np.array(body.first_moment), np.array(body.second_moment)
    if body.n_modes:
        diagonal = np.array_equal(body.damping, np.diag(np.diag(body.damping)))
        data.stiffness = np.array(body.stiffness)
        data.damping = np.array(np.diag(body.damping)[:, None] if diagonal else body.damping)
        data.S_bar, data.I_bar = np.array(body.S_bar), np.array(body.I_bar.reshape(9, -1))
        booked = body.S_bar_kl.copy()
        booked[2, 2] += body.S_spin
        if body.stiffening is not None:
            booked += body.stiffening.S_turned
        data.S_bar_kl = [np.array(booked[k, l]) for k in range(3) for l in range(3)]  # noqa: E741
        data.h_spin, data.S_spin = np.array(body.h_spin), np.array(body.S_spin)
    if body.stiffening is not None:
        data.K_s = list(body.stiffening.K_s)
        data.K_x = list(body.stiffening.K_x.reshape(9, body.n_modes, body.n_modes))
    data.J_spin = body.J_spin
    data.markers = [_marker(section, *rows_of(body, section)) for section in markers]
    return data


def _marker(section: Section, Phi: Array, position: Array, K: list[Array]) -> _core.SpatialMarker:
    marker = _core.SpatialMarker()
    marker.position, marker.triad, marker.Phi, marker.K = np.array(position), np.array(section.triad), Phi, K
    return marker


MOTION = 18  # numbers of one motion in the core: r, F, velocity, omega


class Motion(NamedTuple):
    """Motion of a triad, global axes: r (T, 3), m, axes F (T, 3, 3), no unit, velocity, m/s, `omega`, rad/s, (T, 3)."""

    r: Array
    F: Array
    velocity: Array
    omega: Array


class Kinematics:
    """Kinematic model of a tree in the core, without loads, with sections and constraint equations (rows). SI units."""

    def __init__(
        self, nodes: Sequence[Node], sections: Sequence[Section] = (), rows: Sequence[ConstraintRow] = ()
    ) -> None:
        sections = list({_key(section): section for section in sections}.values())  # joints may share one
        markers = Markers(nodes)
        measures = [markers.row(row) for row in rows]
        places = [_core.MarkerAt(*markers.place(section)) for section in sections]
        self.nodes, self._numbers = nodes, {_key(section): len(nodes) + k for k, section in enumerate(sections)}
        self.core = _core.SpatialModel(markers.bodies(), markers.standing(), measures, places, np.zeros(3))
        self.signs, self.scene = np.array([row.sign for row in rows]), markers.followed(rows)

    @classmethod
    def of_points(cls, nodes: Sequence[Node]) -> "Kinematics":
        """Make the kinematics of frames and points of all bodies of a tree, and of sections at joints.

        `nodes`: its bodies, each with the joint that carries it, from the ground outwards.
        """
        still = [side for node in nodes for side in (node.inner, node.outer) if side.still and side.body >= 0]
        points = [
            Section(number, point, np.eye(3), np.zeros(3))
            for number, node in enumerate(nodes)
            for point in (*(("",) if node.body.mass else ()), *node.body.points)
        ]
        return cls(nodes, [*points, *still])

    def places(self, q: Array, v: Array | None = None) -> "Places":
        """Positions (m) and motions (m/s, rad/s) at q (T, n_q) and v (T, n_v), SI, by default at rest."""
        rates = np.zeros((len(q), self.core.n_v)) if v is None else v
        return Places(
            self._numbers, self.core.motions(q, rates).reshape(len(q), len(self.nodes) + len(self._numbers), MOTION)
        )

    def values(self, q: Array, times: Array) -> tuple[Array, Array]:
        """Equations C (T, rows), m or rad, and C_v (T, rows, n_v), at q (T, n_q), SI, and `times` (T,), s."""
        values, gradients = self.core.constraints(self.scene, times.tolist(), q)
        return self.signs * values, self.signs[:, None] * gradients.reshape(len(q), len(self.signs), self.core.n_v)

    def rates(self, q: Array, v: Array, times: Array) -> Array:
        """Rates Ċ (T, rows), m/s or rad/s, of the equations at q (T, n_q), v (T, n_v), SI, `times` (T,), s."""
        return self.signs * self.core.constraint_rates(self.scene, times.tolist(), q, v)


class Places:
    """Positions and velocities of frames and sections over T states."""

    def __init__(self, numbers: dict[tuple[object, ...], int], motions: Array) -> None:
        """`numbers` of sections in `motions` (T, frames and sections, 18)."""
        self._numbers, self._motions = numbers, motions

    def frame(self, number: int) -> Motion:
        """The motion of the frame of body no. `number`."""
        return self._motion(self._numbers.get((number, "", None), number))

    def _motion(self, number: int) -> Motion:
        columns = self._motions[:, number]
        return Motion(columns[:, :3], columns[:, 3:12].reshape(-1, 3, 3), columns[:, 12:15], columns[:, 15:])

    def at(self, section: Section) -> Motion:
        """The motion of the triad of a section."""
        if section.body < 0:
            zero = np.zeros((len(self._motions), 3))
            return Motion(section.position + zero, np.tile(section.triad, (len(zero), 1, 1)), zero, zero)
        motion = self._motion(self._numbers[_key(section)]) if section.point else self.frame(section.body)
        return motion if section.still else motion._replace(F=motion.F @ section.triad)


def _key(section: Section) -> tuple[object, ...]:
    """One that is `still` turns by its own triad."""
    return (section.body, section.point, section.triad.tobytes() if section.still else None)
