"""The equations of motion of a scene in space under its constraints, as the core's recursion evaluates them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ...common.errors import InputError
from ...common.rotations import exponential
from .. import _core
from .._core import TimeFunction
from ..fields.orientations import OrientationLaw
from ..scene.spatial.loads import OF_POINT, SpatialLoad
from .spatial_body import SpatialBody
from .spatial_drives import NO_DRIVES, Command, Drive, Drives, FrameDrive, PointDrive
from .spatial_model import SpatialModel, SpatialRow
from .spatial_transmission import resistance, resistance_slope, rotor
from .spatial_tree import Node, Section

ZERO = _core.TimeFunction.constant(0.0)
MOST_ROWS = 15  # of the core: most_rows in mbs/core/recursion/workspace.h


def _moves(node: Node) -> bool:
    """Whether modes move the section of the body at its joint."""
    Phi, _, K = _rows_of(node.body, node.outer)
    return bool(np.any(Phi)) or any(bool(np.any(of_row)) for of_row in K)


class Derivatives(NamedTuple):
    """By increments δ of q, by v and by generalized forces, all along v (n_v).

    Attributes:
        a_q, a_v, a_f: (n_v, n_v) of accelerations; joints with friction resist more the faster they are.
        value_q: (rows, n_v) of the values of rows, and of their rates by v.
        rate_q: (rows, n_v) of their rates.
    """

    a_q: Array
    a_v: Array
    a_f: Array
    value_q: Array
    rate_q: Array


class SpatialSystem:
    """A core model of a tree with the rows of its constraints; states (q, v) are those of the tree.

    Rows of coordinates are those of the tree in the core, `sign` times the scene's: they follow `sign` times the
    target, and their multipliers are `sign` times those of `SpatialModel.rows`.

    Attributes:
        model: what it was made from.
        core: `_core.SpatialModel`.
        scene: what its rows follow, and what acts on it.
    """

    def __init__(self, model: SpatialModel, drives: Drives = NO_DRIVES) -> None:
        """`drives` act beside the loads of the scene."""
        self.model, tree = model, model.tree
        self._markers: list[list[Section]] = [[] for _ in tree.nodes]
        self._ground: list[Section] = []
        self._turning: list[tuple[int, OrientationLaw]] = []
        sides = [(self._place(node.inner), self._place(node.outer)) for node in tree.nodes]
        rows = [self._row(row) for row in model.rows]
        driven = {name for name in model.motors} | {load.joint for load in model.scene.load}
        driven |= {trajectory.coordinate_of for trajectory in model.scene.trajectory}
        driven |= {node.joint.name for node in tree.nodes if node.joint.frictions}
        driven |= {gear.joint.joint.name for gear in tree.gears}
        self._wrenches: list[tuple[int, int]] = []
        loads = [PointDrive(load.point, load.components) for load in model.scene.load if load.point is not None]
        self._at_points = [self._point_drive(drive) for drive in (*loads, *drives.at_points)]
        self._check()
        bodies = []
        for number, (node, (inner, outer)) in enumerate(zip(tree.nodes, sides, strict=True)):
            body = _core.SpatialBody()
            body.name, (body.parent, body.parent_marker), body.inboard_marker = node.body.name, inner, outer[1]
            body.joint = getattr(_core.JointKind, node.joint.type)
            body.lead = float(getattr(node.joint, "rise", 0.0))
            # Else the core may take the frame's coordinates where modes turn the section: same motion, other numbers.
            body.driven = node.joint.name in driven or _moves(node)
            body.rotor_inertia, body.gear_ratio = _rotor(node)
            body.data = _data(node.body, self._markers[number])
            bodies.append(body)
        ground = [_marker(section, np.zeros((6, 0)), section.position, []) for section in self._ground]
        for number, _ in self._turning:
            ground[number].turns = True
        wrenches = [_core.MarkerAt(*at) for at in self._wrenches]
        self._parts = bodies, ground, rows
        self.core = _core.SpatialModel(bodies, ground, rows, wrenches, np.array(model.scene.gravity))
        moments = [self._load(load) for load in model.scene.load if load.joint is not None]
        self._along = [*moments, *model.modal_loads, *drives.along]
        self._on_frames = drives.on_frames
        self.scene = self._follow()

    def held_model(self) -> _core.HeldModel:
        """The model for motions under held inputs, without loads of the scene; rows must follow nothing."""
        return _core.HeldModel(*self._parts, np.array(self.model.scene.gravity), self.scene)

    def _check(self) -> None:
        """Raise `InputError` for what the core does not take."""
        path, rows = self.model.scene.path, self.model.rows
        for node in self.model.tree.nodes:
            if node.joint.type == "planar" and node.joint.frictions and node.backwards:
                raise InputError(
                    f"{path}: {node.joint.label}: between: expected the side nearer to the ground first where a planar"
                    " joint has friction, found it second"
                )
            if node.joint.type == "free" and _moves(node):
                raise InputError(
                    f"{path}: {node.joint.label}: expected a point that modes do not move, found"
                    f' "{node.outer.point}" of "{node.body.name}": leave the joint out (a body without one is free from'
                    " the origin on)"
                )
        if len(rows) > MOST_ROWS:
            raise InputError(
                f"{path}: expected at most {MOST_ROWS} rows of paths and cut loops in all, found {len(rows)}: scenes in"
                " space with more of them are not available yet"
            )

    def turn_markers(self, t: float) -> None:
        """Put the orientations that rows follow where they are at time t, for `core`'s next evaluations."""
        for number, law in self._turning:
            at = np.array([t])
            omega, alpha = law.rates(at)
            self.core.turn_marker(number, law.sample(at)[0], omega[0], alpha[0])

    @property
    def row_signs(self) -> Array:
        """(rows,) −1 where the core's row, target and multiplier count the tree's coordinate, not the joint's."""
        return np.array([row.sign for row in self.model.rows])

    def target(self, t: float) -> Array:
        """Second derivatives that the core's rows follow at time t (rows,)."""
        return self.row_signs * [0.0 if row.target is None else row.target(t)[2] for row in self.model.rows]

    def force(self, t: float) -> Array | None:
        """Given forces along v (n_v,) at time t; None where there are none."""
        if not self._along:
            return None
        return sum((function(t)[0] * direction for direction, function in self._along), np.zeros(self.model.tree.n_v))

    def derivatives(self, t: float, q: Array, v: Array, supplied: Array) -> Derivatives:
        """How accelerations and rows answer to small changes of q, v and forces, at time t under the scene's loads.

        `supplied` (n_v,) acts beside loads and friction. Rows that depend on others at q, v are left out.
        """
        self.turn_markers(t)
        self.core.keep_independent_rows(q, v)
        rest = -resistance(self.model.tree, v[None])[0]
        loads = self.force(t)
        force = supplied + rest + (0.0 if loads is None else loads)
        wrench = np.zeros((len(self._wrenches), len(OF_POINT)))
        for number, components in self._at_points:
            for name, magnitude in components.items():
                wrench[number, OF_POINT.index(name)] += magnitude(t)[0]
        found = self.core.derivatives(q, v, self.target(t), force, wrench.ravel())
        slope = resistance_slope(self.model.tree, v[None])[0]
        signs = self.row_signs[:, None]
        by_v = found.a_v - found.a_f * slope
        return Derivatives(found.a_q, by_v, found.a_f, signs * found.value_q, signs * found.rate_q)

    def _follow(self) -> _core.TreeScene:
        """Targets of the rows, and given forces along joints."""
        scene = _core.TreeScene()
        for row in self.model.rows:
            scene.add_target(ZERO if row.target is None else row.target, row.sign)
        for direction, magnitude in self._along:
            scene.add_load(direction, magnitude)
        for wrench, components in self._at_points:
            for name, magnitude in components.items():
                scene.add_point_load(wrench, OF_POINT.index(name), magnitude)
        for drive in self._on_frames:
            self._turn_frames(scene, drive)
        for node in self.model.tree.nodes:
            for number, friction in enumerate(node.joint.frictions):  # the same along all of a joint's coordinates
                at = node.q.start + number, node.v.start + number
                scene.add_joint_force(*at, 0.0, 0.0, friction.viscous, friction.coulomb, friction.speed)
        for gear in self.model.tree.gears:
            motor, joint = ((node.q.start, node.v.start) for node in (gear.motor, gear.joint))
            scene.add_gear(motor, joint, gear.sign, gear.stiffness, gear.damping)
        for number, law in self._turning:
            scene.turn_marker(number, _turning_law(law))
        return scene

    def _turn_frames(self, scene: _core.TreeScene, drive: FrameDrive) -> None:
        """A moment along the joint, less what the sections at it would do on the modes of its two bodies."""
        node, direction = self.model.tree.nodes[drive.body], np.zeros(self.model.tree.n_v)
        direction[node.v] = drive.sign
        scene.add_load(direction, drive.size)
        for share in self._frame_shares(drive.body, drive.sign):
            scene.add_frame_motor(*share, drive.size)

    def _frame_shares(self, body: int, sign: float) -> Iterator[tuple[int, int, Array, Array]]:
        """Of the motor on frames along the joint that carries a body, for each side with modes.

        Where the modes are in q and in v, Φ_r (3, n) of the section and the joint's axis there.
        """
        node = self.model.tree.nodes[body]
        for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
            if section.body >= 0 and (of := self.model.tree.nodes[section.body]).body.n_modes:
                axis = sign * side * section.triad[:, 2]
                yield of.p_q.start, of.p_v.start, _rows_of(of.body, section)[0][3:], axis

    def held_forces(self, commands: Sequence[Command]) -> _core.HeldForces:
        """Forces of commands that are held, in their order."""
        found = _core.HeldForces(np.reshape([c.direction for c in commands], (len(commands), self.model.tree.n_v)).T)
        for number, command in enumerate(commands):
            for share in self._frame_shares(*command.frame) if command.frame is not None else ():
                found.add_frame_motor(number, *share)
        return found

    def _load(self, load: SpatialLoad) -> Drive:
        """Direction (n_v,) and size of the moment of a joint."""
        assert load.joint is not None
        direction = np.zeros(self.model.tree.n_v)
        direction[self.model.driven(load.joint).v] = self.model.sign(load.joint)
        return Drive(direction, load.components["moment"])

    def _point_drive(self, drive: PointDrive) -> tuple[int, Mapping[str, TimeFunction]]:
        """Number of the wrench, and its components over time."""
        self._wrenches.append(self._place(self.model.tree.section(drive.point, np.eye(3))))
        return len(self._wrenches) - 1, drive.components

    def _turning_marker(self, law: OrientationLaw) -> int:
        """Number of the ground's marker that turns as `law` says; made where it is new."""
        for number, known in self._turning:
            if known is law:
                return number
        self._ground.append(Section(-1, f"turning {len(self._turning)}", np.eye(3), np.zeros(3)))
        self._turning.append((len(self._ground) - 1, law))
        return len(self._ground) - 1

    def _place(self, section: Section) -> tuple[int, int]:
        """Body (−1: the ground) and number of the marker of a section there; made where it is new."""
        known = self._ground if section.body < 0 else self._markers[section.body]
        for number, other in enumerate(known):
            same = other.point == section.point and np.array_equal(other.triad, section.triad)
            if same and np.array_equal(other.position, section.position):
                return section.body, number
        known.append(section)
        return section.body, len(known) - 1

    def _row(self, row: SpatialRow) -> _core.RowModel:
        found = _core.RowModel()
        found.name, found.kind = row.owner, getattr(_core.RowKind, row.kind)
        if row.kind == "coordinate":
            found.coordinate = row.coordinate
            return found
        a, b = self._place(row.a), self._place(row.b)
        if row.law is not None:  # see SpatialRow: of "dot" rows it is that of b
            turning = (-1, self._turning_marker(row.law))
            a, b = (a, turning) if row.kind == "dot" else (turning, b)
        found.a, found.b = _core.MarkerAt(*a), _core.MarkerAt(*b)
        found.f, found.g = np.array(row.f), np.array(row.g)
        return found


def _rotor(node: Node) -> tuple[float, float]:
    """Inertia of the rotor in a joint and its ratio on the inner section.

    It sits on the first side and spins with N Ω_second − (N − 1) Ω_first; where that side is the outer one, with
    N' Ω_outer − (N' − 1) Ω_inner and N' = 1 − N.
    """
    inertia, ratio = rotor(node)
    return inertia, 1.0 - ratio if node.backwards else ratio


def _turning_law(law: OrientationLaw) -> _core.TurningLaw:
    kind = getattr(_core.OrientationKind, law.kind)
    return _core.TurningLaw(kind, list(law.functions), exponential(np.array(law.reference)))


def _data(body: SpatialBody, markers: list[Section]) -> _core.SpatialData:
    """The constants of a body; those of modes are left empty of a rigid one."""
    data = _core.SpatialData()
    data.mass, data.first_moment, data.J2 = body.mass, np.array(body.first_moment), np.array(body.second_moment)
    if body.n_modes:
        diagonal = np.array_equal(body.damping, np.diag(np.diag(body.damping)))
        data.stiffness = np.array(body.stiffness)
        data.damping = np.array(np.diag(body.damping)[:, None] if diagonal else body.damping)
        data.S_bar, data.I_bar = np.array(body.S_bar), np.array(body.I_bar.reshape(9, -1))
        booked = body.S_bar_kl.copy()
        booked[2, 2] += body.S_spin
        data.S_bar_kl = [np.array(booked[k, l]) for k in range(3) for l in range(3)]  # noqa: E741
        data.h_spin, data.S_spin = np.array(body.h_spin), np.array(body.S_spin)
    if body.stiffening is not None:
        data.K_s = list(body.stiffening.K_s)
        data.K_x = list(body.stiffening.K_x.reshape(9, body.n_modes, body.n_modes))
    data.J_spin = body.J_spin
    data.markers = [_marker(section, *_rows_of(body, section)) for section in markers]
    return data


def _rows_of(body: SpatialBody, section: Section) -> tuple[Array, Array, list[Array]]:
    """Φ over Φ_r (6, n) and the position (3,) of a section; six K (n, n) where it moves to second order."""
    if not section.point:
        return np.zeros((6, body.n_modes)), np.zeros(3), []
    at = body.points[section.point]
    K = [] if body.stiffening is None else list(body.stiffening.K_points.get(section.point, []))
    return np.vstack([at.translation, at.rotation]), at.position, K


def _marker(section: Section, Phi: Array, position: Array, K: list[Array]) -> _core.SpatialMarker:
    marker = _core.SpatialMarker()
    marker.position, marker.triad, marker.Phi, marker.K = np.array(position), np.array(section.triad), Phi, K
    return marker
