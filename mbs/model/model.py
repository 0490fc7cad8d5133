"""From a scene and its bodies to the systems of equations that the core evaluates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...common.arrays import Array, Indices
from ...common.errors import InputError
from ...common.validation import did_you_mean, quoted
from .. import _core
from .._core import StateFunction, TimeFunction
from ..fields.field_types import GROUND, split_point
from ..scene.mechanism_records import Load
from ..scene.scene import Scene
from .measures import FRAME, Marker, Measure, joint_coordinate, joint_rows, motor_joints, trajectory_rows
from .planar_body import PlanarBody, PlanarPoint, core_arguments
from .transmissions import Friction, Gear, joint_frictions, joint_rotors

ZERO = _core.TimeFunction.constant(0.0)


@dataclass(frozen=True)
class Constraint:
    """A row that is held at `target`(t): `component` of the joint or trajectory `owner`."""

    row: Measure
    target: TimeFunction
    owner: str
    component: str
    is_trajectory: bool


@dataclass(frozen=True)
class ModalLoad:
    """Modal forces `vector` (n,) times `size`(t) on one body, in the coordinates of its `PlanarBody`."""

    body: str
    vector: Array
    size: TimeFunction


@dataclass(frozen=True)
class Model:
    """A scene with its bodies: everything analyses share."""

    scene: Scene
    bodies: tuple[PlanarBody, ...]
    modal_loads: tuple[ModalLoad, ...]
    joints: tuple[Constraint, ...]
    trajectories: tuple[Constraint, ...]
    motors: dict[str, Measure]
    loads: tuple[tuple[Measure, TimeFunction], ...]
    rotors: tuple[tuple[Measure, float], ...] = ()
    frictions: tuple[tuple[Measure, Friction], ...] = ()
    state_forces: tuple[tuple[Marker, StateFunction], ...] = ()
    gears: tuple[Gear, ...] = ()  # that give; empty where they are taken for rigid (see `compliant_joints`)

    def body(self, name: str) -> PlanarBody:
        """The body of that name."""
        return next(body for body in self.bodies if body.name == name)

    @property
    def links(self) -> tuple[PlanarBody, ...]:
        """The bodies of the scene, without rotors."""
        return self.bodies[: len(self.bodies) - len(self.gears)]

    @property
    def degrees_of_freedom(self) -> int:
        """Degrees of freedom with rigid links and gears, counted: coordinates less joint constraints."""
        return 3 * len(self.bodies) - len(self.joints) - len(self.gears)


def build_model(scene: Scene, bodies: Sequence[PlanarBody], modal_loads: Sequence[ModalLoad] = ()) -> Model:
    """Check every reference of the scene to points of its bodies and lay out rows.

    Raises `InputError` when a point does not exist, or named motors do not fit the mechanism.
    """
    _check_points(scene, {body.name: body for body in bodies})
    joints = tuple(
        Constraint(row, ZERO, joint.name, row.label.rpartition(", ")[2], is_trajectory=False)
        for joint in scene.joint
        for row in joint_rows(scene, joint)
    )
    trajectories = tuple(
        Constraint(row, trajectory.components[component], trajectory.name, component, is_trajectory=True)
        for trajectory in scene.trajectory
        for component, row in trajectory_rows(scene, trajectory).items()
    )
    motors = {joint.name: joint_coordinate(scene, joint) for joint in motor_joints(scene)}
    model = Model(
        scene, tuple(bodies), tuple(modal_loads), joints, trajectories, motors, tuple(load_rows(scene, scene.load)),
        tuple(joint_rotors(scene)), tuple(joint_frictions(scene)),
        tuple(_state_forces(scene)),
    )  # fmt: skip
    named = any(joint.motor for joint in scene.joint)
    if named and trajectories and len(motors) != model.degrees_of_freedom:
        raise InputError(
            f"{scene.path}: joint: expected as many motors as the mechanism has degrees of freedom"
            f" ({model.degrees_of_freedom}), found {len(motors)} ({quoted(motors)})"
        )
    return model


def load_rows(scene: Scene, loads: Sequence[Load]) -> Iterator[tuple[Measure, TimeFunction]]:
    """Directions of given loads and their sizes."""
    kinds = {"x": _core.MeasureKind.x, "y": _core.MeasureKind.y, "moment": _core.MeasureKind.angle}
    joints = {joint.name: joint for joint in scene.joint}
    for load in loads:
        if load.joint is not None:
            yield joint_coordinate(scene, joints[load.joint]), load.components["moment"]
        elif load.point is not None:
            for component, size in load.components.items():
                yield (
                    Measure(
                        f'load on "{load.point}"', kinds[component], Marker(None), Marker(*split_point(load.point))
                    ),
                    size,
                )


def _state_forces(scene: Scene) -> Iterator[tuple[Marker, StateFunction]]:
    for load in scene.load:
        if load.point is not None and load.force is not None:
            yield Marker(*split_point(load.point)), load.force


def _check_points(scene: Scene, bodies: dict[str, PlanarBody]) -> None:
    """Raise `InputError` for a reference to a point that its body has not."""
    references = [(f'joint "{joint.name}": between', side) for joint in scene.joint for side in joint.between]
    references += [(f'trajectory "{t.name}": point', t.point) for t in scene.trajectory if t.point]
    references += [(f'trajectory "{t.name}": angle', t.angle) for t in scene.trajectory if t.angle and "." in t.angle]
    references += [("load: point", load.point) for load in scene.load if load.point]
    for analysis in scene.analysis:
        key = f'analysis "{analysis.name}"'
        references += [(f"{key}: sensor: point", sensor.point) for sensor in analysis.sensor if sensor.point]
        references += [(f"{key}: disturbance: point", load.point) for load in analysis.disturbance if load.point]
        references += [(f"{key}: tip", analysis.tip)] if analysis.tip else []
    references += [(f'analysis "{a.name}": points', point) for a in scene.analysis for point in a.points or ()]
    for key, reference in references:
        if reference == GROUND:
            continue
        body, point = split_point(reference)
        known = bodies[body].points
        if point not in known:
            raise InputError(
                f'{scene.path}: {key}: expected a point of "{body}" ({quoted(known)}), found "{reference}"'
                + did_you_mean(point, known)
            )
        stiffening = bodies[body].stiffening
        if stiffening is not None and point not in stiffening.K_points:
            raise InputError(
                f"{scene.path}: {key}: expected, with geometric_stiffening, a point whose loads' geometric stiffness is"
                f' in the modal body file ({quoted(stiffening.K_points)}), found "{reference}"'
            )


class MechanismSystem:
    """A core `System` with the numbering that leads back from its rows to the scene.

    `constraints` are in the core's order: joints and trajectories sorted for a small envelope of C M⁻¹ Cᵀ. Rotors of
    joints come after them in the core, where they are rows, too, and friction after the drives.
    """

    def __init__(
        self,
        model: Model,
        constraints: Sequence[Constraint],
        drives: Sequence[tuple[Measure, TimeFunction]] = (),
        motors: Sequence[Measure] = (),
    ) -> None:
        self.model = model
        self.index = {body.name: i for i, body in enumerate(model.bodies)}
        self._markers: list[list[str]] = [[] for _ in model.bodies]
        self.constraints = tuple(constraints[i] for i in envelope_order([c.row for c in constraints]))
        self.constraint_rows = [self._core_row(c.row) for c in self.constraints]
        drive_rows = [(self._core_row(row), size) for row, size in drives]
        rotor_rows = [(self._core_row(row), inertia) for row, inertia in model.rotors]
        friction_rows = [(self._core_row(row), friction) for row, friction in model.frictions]
        state_forces = [(self._marker(end), function) for end, function in model.state_forces]
        self.motor_rows = [self._core_row(row) for row in motors]
        spring_rows = [(self._core_row(gear.motor), self._core_row(gear.coordinate)) for gear in model.gears]
        self.system = _core.System(np.array(model.scene.gravity))
        for body, markers in zip(model.bodies, self._markers, strict=True):
            self.system.add_body(**core_arguments(body, [_point(body, name) for name in markers], markers))
        for constraint, row in zip(self.constraints, self.constraint_rows, strict=True):
            self.system.add_constraint(row, constraint.target)
        for row, inertia in rotor_rows:
            self.system.add_rotor(row, inertia)
        for row, size in drive_rows:
            self.system.add_drive(row, size)
        for row, friction in friction_rows:
            self.system.add_friction(row, friction.viscous, friction.coulomb, friction.speed)
        for marker, function in state_forces:
            self.system.add_state_force(marker, function)
        for gear, (motor, joint) in zip(model.gears, spring_rows, strict=True):
            self.system.add_spring(motor, joint, gear.stiffness, gear.damping)
        for load in model.modal_loads:
            self.system.add_modal_drive(self.index[load.body], load.vector, load.size)
        self.system.finish()
        self.first = np.array(self.system.first_coordinate, dtype=int)

    @property
    def frame_coordinates(self) -> Indices:
        """Indices of (R, θ) of all bodies in q (3 bodies,)."""
        indices: Indices = (self.first[:, None] + np.arange(3)).ravel()
        return indices

    @property
    def sizes(self) -> Array:
        """Natural size of each coordinate: a length for R, 1 rad for θ, √I for p (a link bent as much as it is long).

        What is small, or a step that is long, is judged by them: units of length and mass are the user's.
        """
        sizes = np.empty(self.system.coordinates)
        for first, body in zip(self.first, self.model.bodies, strict=True):
            sizes[first : first + 3] = self.system.length, self.system.length, 1.0
            sizes[first + 3 : first + 3 + body.n_modes] = np.sqrt(body.inertia)
        return sizes

    @property
    def row_sizes(self) -> Array:
        """Natural size of each constraint's value: a length, or 1 rad."""
        return np.where(self.moments, 1.0, self.system.length)

    @property
    def is_trajectory(self) -> list[bool]:
        """For each constraint, whether it belongs to C_s."""
        return [c.is_trajectory for c in self.constraints]

    @property
    def moments(self) -> list[bool]:
        """For each constraint, whether its multiplier is a moment."""
        return [c.row.carries_moment for c in self.constraints]

    @property
    def groups(self) -> list[int]:
        """For each constraint, the number of the force or moment it is a component of."""
        keys = [(c.is_trajectory, c.owner, c.row.carries_moment) for c in self.constraints]
        numbers = {key: i for i, key in enumerate(dict.fromkeys(keys))}
        return [numbers[key] for key in keys]

    def constraint_wrenches(self, q: Array, lambda_: Array) -> dict[str, dict[str, Array]]:
        """Force (global axes) and moment (T, 3) of the constraints on every point of every body; multipliers (T, m).

        Moments of slides about their markers are left out.
        """
        wrenches: dict[str, dict[str, Array]] = {}
        for constraint, multiplier in zip(self.constraints, lambda_.T, strict=True):
            row = constraint.row
            for end, sign in ((row.b, -1.0), (row.a, 1.0)):
                if end.body is None or end.point == FRAME:
                    continue
                wrench = wrenches.setdefault(end.body, {}).setdefault(end.point, np.zeros((len(lambda_), 3)))
                if row.kind == _core.MeasureKind.slide:
                    wrench[:, :2] += (sign * multiplier)[:, None] * self._slide_direction(row, q)
                else:
                    column = (_core.MeasureKind.x, _core.MeasureKind.y, _core.MeasureKind.angle).index(row.kind)
                    wrench[:, column] += sign * multiplier
        return wrenches

    def _slide_direction(self, row: Measure, q: Array) -> Array:
        """The direction (T, 2) of a slide in global axes; the rotation of its section is small against the frame's."""
        theta = q[:, self.first[self.index[row.a.body]] + 2] if row.a.body is not None else np.zeros(len(q))
        x, y = row.direction
        return np.column_stack([np.cos(theta) * x - np.sin(theta) * y, np.sin(theta) * x + np.cos(theta) * y])

    def _core_row(self, row: Measure) -> _core.Measure:
        a, b = self._marker(row.a), self._marker(row.b)
        return _core.Measure(row.kind, a, b, np.array(row.direction), np.array(row.gear_ratios), row.offset)

    def _marker(self, end: Marker) -> _core.Marker:
        if end.body is None:
            return _core.Marker(-1, 0, np.array(end.position))
        body = self.index[end.body]
        markers = self._markers[body]
        if end.point not in markers:
            markers.append(end.point)
        return _core.Marker(body, markers.index(end.point), np.zeros(2))


def _point(body: PlanarBody, name: str) -> PlanarPoint:
    if name != FRAME:
        return body.points[name]
    return PlanarPoint(np.zeros(2), np.zeros((2, body.n_modes)), np.zeros(body.n_modes))


def envelope_order(rows: Sequence[Measure]) -> list[int]:
    """Order of constraint rows that keeps the envelope of C M⁻¹ Cᵀ small: reverse Cuthill–McKee on shared bodies."""
    touched = [{end.body for end in (row.a, row.b)} - {None} for row in rows]
    if len({body for bodies in touched for body in bodies}) <= 2:
        return list(range(len(rows)))
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import reverse_cuthill_mckee

    graph = np.array([[not a.isdisjoint(b) for b in touched] for a in touched], dtype=float)
    return [int(i) for i in reverse_cuthill_mckee(csr_array(graph), symmetric_mode=True)]
