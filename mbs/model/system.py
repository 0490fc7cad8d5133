"""The equations of motion under constraints in the core, and the split of forces to motors and modes. SI units."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array, Booleans, Integers
from ...common.errors import InputError
from ...common.rotations import left_jacobian, left_jacobian_slope
from ...common.structs import struct
from .. import _core
from ..joints.joint import Friction
from ..scene.loads import OF_POINT
from .drives import NO_DRIVES, Command, Drive, Drives, PointDrive
from .kinematics import CutPlace, Markers, ModelParts, Placed, rows_of
from .model import Model
from .nodes import Section
from .projection import Plane, in_plane


class Integrated(NamedTuple):
    """Mechanism of the core, its loads and targets (`scene`); indices `rows` (k,) of its equations in the model."""

    core: _core.PlanarModel | _core.SpatialModel
    scene: _core.TreeScene
    rows: Integers


class MultibodySystem:
    """A tree with its constraint equations (rows) in the core; states (q, v) are those of the tree. SI units.

    In the core, coordinates, targets and multipliers of reversed joints are `ConstraintRow.sign` times the scene's.

    Attributes:
        model: the model from which it is made.
        replayed: inputs that an earlier analysis found; None without any.
    """

    def __init__(self, model: Model, drives: Drives = NO_DRIVES, commands: Sequence[Command] = ()) -> None:
        """`drives` act beside the loads of the scene, and `commands` will, held."""
        self.model, tree, self.replayed = model, model.tree, drives.replayed
        self._markers = Markers(tree.nodes)
        rows = [self._markers.row(row) for row in model.rows]
        self._wrenches: list[Placed] = []
        loads = [load for load in model.scene.load if load.point is not None]
        at_points = [*(PointDrive(str(load.point), load.components) for load in loads), *drives.at_points]
        self._at_points = [(self._wrench(tree.section(drive.point)), drive.components) for drive in at_points]
        at_loads = zip(self._at_points, loads, strict=False)
        self._of_motion = [(wrench, load.force) for (wrench, _), load in at_loads if load.force is not None]
        replayed = drives.replayed.at_points if drives.replayed else {}
        self._numbers_at = [(self._wrench(tree.section(at)), of) for at, of in replayed.items()]
        self._cut = [one for one in model.cut if one.friction is not None or one.loads]
        measures = (one.row for one in self._cut)
        cut = tuple(CutPlace(self._wrench(row.a), self._wrench(row.b), row.kind == "turn", row.f) for row in measures)
        self._check()
        moments = [
            Drive(direction, moment)
            for load in model.scene.load
            if load.joint in tree.carried
            for direction, moment in zip(model.along(load.joint), load.moments, strict=True)
        ]
        self._along = [*moments, *model.modal_loads]
        driven = self._driven((*commands, *(drives.replayed.commands if drives.replayed else ())))
        bodies, ground = self._markers.bodies(driven), self._markers.standing()
        wrenches = [_core.MarkerAt(*at) for at in self._wrenches]
        # Where none acts, pins in the plane pass no moment on
        with_moments = {number for number, of in (*self._at_points, *self._numbers_at) if not set("xyz").issuperset(of)}
        with_moments.update(number for number, _ in self._of_motion)
        with_moments.update(number for place in cut for number in (place.a, place.b))
        for number, at in enumerate(wrenches):
            at.only_forces = number not in with_moments
        self._parts = ModelParts(bodies, ground, rows, wrenches, np.array(model.scene.gravity), cut)

    @cached_property
    def core(self) -> _core.SpatialModel:
        """The 3D model of the core."""
        return _core.SpatialModel(*self._parts[:-1])

    @cached_property
    def scene(self) -> _core.TreeScene:
        """Targets of the constraint equations of `core`, and given loads."""
        return self._follow(None)

    @cached_property
    def plane(self) -> Plane | None:
        """The plane that contains all motion, with the same q and v; None without one.

        Forces that depend on the motion of points may lead out of it, except in planar scenes.
        """
        if not all(function.is_planar for _, function in self._of_motion):
            return None
        return in_plane(self._parts, ~self.model.loop_rows)

    @cached_property
    def integrated(self) -> Integrated:
        """The model for integrators: planar if all motion is in one plane."""
        if self.plane is None:
            return Integrated(self.core, self.scene, np.arange(len(self.model.rows)))
        return Integrated(self.plane.model, self._follow(self.plane), self.plane.followed)

    @cached_property
    def replay(self) -> _core.Replay | None:
        """Replayed inputs for integrators; None without any."""
        if self.replayed is None:
            return None
        size = len(OF_POINT) if self.plane is None else 3
        at_points = [
            (number, size * wrench + along, share)
            for wrench, numbers in self._numbers_at
            for name, number in numbers.items()
            for along, share in _shares(OF_POINT.index(name), self.plane)
        ]
        return _core.Replay(self.replayed.source, zero_order_hold(self.model, self.replayed.commands), at_points)

    def multipliers(self, of_core: Array) -> Array:
        """Multipliers (T, rows), N, N·m, of the model from those of `integrated`; 0 if omitted or dependent."""
        of_rows = of_core if self.plane is None else of_core @ self.plane.spread.T
        return of_rows * self.model.row_signs

    @property
    def sections(self) -> list[Section]:
        """Sections of the core's model, in its order."""
        return [self._markers.of_bodies[body][marker] for body, marker in self.core.sections]

    def point_number(self, point: str) -> int:
        """The index among the core's wrenches of "BODY.POINT", on which a load or drive acts."""
        return self._wrenches.index(self._markers.place(self.model.tree.section(point)))

    def forward_model(self) -> _core.ForwardModel:
        """Return the model for motions under constant inputs, without loads; it must have no trajectories."""
        return _core.ForwardModel(*self._parts[:-1], self.scene)

    def _driven(self, commands: Sequence[Command]) -> Booleans:
        """(n_v,) along which coordinates given forces act, of which inverse analyses have none."""
        tree = self.model.tree
        is_driven: Booleans = np.zeros(tree.n_v, dtype=bool)
        for direction in (*(drive.direction for drive in self._along), *(command.direction for command in commands)):
            is_driven |= direction != 0
        resisting = [node for node in tree.nodes if node.joint.frictions]
        for node in (*resisting, *(side for gear in tree.gears for side in (gear.motor, gear.joint))):
            is_driven[node.v] = True
        for body in (c.frame[0] for c in commands if c.frame):
            is_driven[tree.nodes[body].v] = True
        return is_driven

    def _check(self) -> None:
        loaded = {load.joint for load in self.model.scene.load}
        for joint in (node.joint for node in self.model.tree.nodes if node.joint.type == "planar" and node.backwards):
            if joint.frictions or joint.name in loaded:
                where = "a planar joint has friction" if joint.frictions else "a load acts along a planar joint"
                raise InputError(
                    f"{self.model.scene.path}: {joint.label}: between: expected the side nearer to the ground first"
                    f" where {where}",
                    "it second",
                )

    def _follow(self, plane: Plane | None) -> _core.TreeScene:
        """Targets of the rows, and given forces along joints and at points; in the plane where it is given."""
        rows = self.model.rows if plane is None else [self.model.rows[k] for k in plane.followed]
        scene = self._markers.followed(rows)
        for direction, magnitude in self._along:
            scene.add_load(direction, magnitude)
        for wrench, components in self._at_points:
            for name, magnitude in components.items():
                for along, share in _shares(OF_POINT.index(name), plane):
                    scene.add_point_load(wrench, along, magnitude, share)
        for wrench, function in self._of_motion:
            scene.add_point_force(wrench, function)
        for node in self.model.tree.nodes:
            for number, friction in enumerate(node.joint.frictions):  # the same along all of a joint's coordinates
                at = node.q.start + number, node.v.start + number
                scene.add_joint_force(*at, 0.0, 0.0, friction.viscous, friction.coulomb, friction.speed)
        for gear in self.model.tree.gears:
            motor, joint = ((node.q.start, node.v.start) for node in (gear.motor, gear.joint))
            scene.add_gear(motor, joint, gear.sign, gear.spring.slopes, gear.spring.knots, gear.damping)
        places = self._parts.cut if plane is None else plane.cut
        for number, (one, place) in enumerate(zip(self._cut, places, strict=True)):
            friction = one.friction or Friction(0.0, 0.0, 1.0)
            scene.add_cut_joint(*place, friction.viscous, friction.coulomb, friction.speed)
            for load in one.loads:
                scene.add_cut_load(number, load, one.row.sign)
        scene.modal_amplitude_limits = [node.body.largest_moment for node in self.model.tree.nodes]
        scene.has_loops = bool(self.model.loop_rows.any())  # else `check_path` refuses rows that depend on each other
        return scene

    def _wrench(self, section: Section) -> int:
        """Number of a wrench on a section, made for it."""
        self._wrenches.append(self._markers.place(section))
        return len(self._wrenches) - 1


def _shares(component: int, plane: Plane | None) -> list[tuple[int, float]]:
    """Of a component of a wrench: those of the core, with shares; see `Plane.shares`."""
    return [(component, 1.0)] if plane is None else plane.shares(component)


def zero_order_hold(model: Model, commands: Sequence[Command]) -> _core.ZeroOrderHold:
    """The core's forces of `commands`, in this order, which are constant between samples."""
    hold = _core.ZeroOrderHold(np.reshape([c.direction for c in commands], (len(commands), model.tree.n_v)).T)
    for number, command in enumerate(commands):
        if command.frame is None:
            continue
        node = model.tree.nodes[command.frame[0]]
        for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
            if section.body >= 0 and (of := model.tree.nodes[section.body]).body.n_modes:
                Phi_r, axis = rows_of(of.body, section)[0][3:], command.frame[1] * side * section.triad[:, 2]
                hold.add_frame_motor(number, of.p_q.start, of.p_v.start, Phi_r, axis)
    return hold


@struct
class MotorForces:
    """Motor torques and modal forces of patches."""

    moments: Mapping[str, Array]  # τ (T, k), N·m or N, by joint, on its second side
    modal: Mapping[str, Array]  # F_p (T, n), N/√kg, by body, on the modes of its file


def driven_system(model: Model) -> MultibodySystem:
    """The model in the core, with forces along the coordinates of its motors."""
    return MultibodySystem(model, commands=[Command(along) for joint in model.motors for along in model.along(joint)])


def driven_mechanism(model: Model, *, has_motors: bool = True) -> _core.SpatialDriven:
    """Build the core's mechanism under the loads of its scene, with its motors unless `has_motors` is false."""
    system = driven_system(model)
    driven = _core.SpatialDriven(system.core, system.scene, (~model.loop_rows).tolist())
    if has_motors:
        _add_motors(driven, model)
    return driven


def fastest_mechanism(model: Model, *, has_motors: bool = True) -> _core.PlanarDriven | _core.SpatialDriven:
    """The core's mechanism with the model's equations, planar for open chains that move in a plane, else spatial."""
    system = driven_system(model)
    if model.loop_rows.any() or system.plane is None:
        return driven_mechanism(model, has_motors=has_motors)
    return integrated_mechanism(system, has_motors=has_motors)


def integrated_mechanism(
    system: MultibodySystem, *, has_motors: bool = True
) -> _core.PlanarDriven | _core.SpatialDriven:
    """The mechanism for integrators: planar if all motion is in one plane."""
    (core, scene, rows), model = system.integrated, system.model
    is_path = [model.rows[k].is_trajectory for k in rows]
    driven: _core.PlanarDriven | _core.SpatialDriven
    if isinstance(core, _core.PlanarModel):
        driven = _core.PlanarDriven(core, scene, is_path)
    else:
        driven = _core.SpatialDriven(core, scene, is_path)
    if has_motors:
        _add_motors(driven, model)
    return driven


def _add_motors(driven: _core.PlanarDriven | _core.SpatialDriven, model: Model) -> None:
    turning = turning_motors(model)
    for joint, coordinates in model.motors.items():
        for coordinate in coordinates.tolist():
            driven.add_motor(coordinate, model.sign(joint), joint in turning)


def path_forces(model: Model, times: Array, q: Array, multipliers: Array) -> Array:
    """Generalized forces −C_sᵀλ_s (T, n_v) of paths by multipliers (T, rows) at q (T, n_q), `times` (T,); SI."""
    return driven_mechanism(model).path_forces(times.tolist(), q, multipliers * model.row_signs)


def frames_in_core(model: Model, q: Array) -> list[tuple[Array, Array]]:
    """Axes (3, 3) and origin (3,), m, of each body's frame in the core's frame of this body, at q (n_q,), SI."""
    places, frames = model.tree.places(q[None]), driven_system(model).core.frames(q, np.zeros(model.tree.n_v))
    own = [places.frame(number) for number in range(len(frames))]
    return [(of.R.T @ at.F[0], of.R.T @ (at.r[0] - of.r)) for of, at in zip(frames, own, strict=True)]


def path_forces_on_bodies(model: Model, times: Array, q: Array, multipliers: Array) -> dict[str, Array]:
    """Return, by body, path forces (T, 6 + n) on it: N, N·m on its frame in its axes, N/√kg on its modes.

    By `multipliers` (T, rows), N or N·m, at `times` (T,), s, and q (T, n_q), SI.
    """
    driven = driven_mechanism(model, has_motors=False)
    on_bodies = driven.path_forces_on_bodies(times.tolist(), q, multipliers * model.row_signs)
    by_body = {}
    for node, (axes, origin), forces in zip(model.tree.nodes, frames_in_core(model, q[0]), on_bodies, strict=True):
        force, moment = forces[:, :3], forces[:, 3:6]
        on_frame = [force @ axes, (moment - np.cross(origin, force)) @ axes]
        by_body[node.body.name] = np.hstack([*on_frame, forces[:, 6:]])
    return by_body


class SplitForces(NamedTuple):
    """Motor torques, modal forces and multipliers of loops that supply wanted generalized forces."""

    moments: dict[str, Array]  # τ (T, k), N·m or N, by joint
    left: Array  # modal forces (T, n_v), N/√kg, along modes
    loops: Array  # multipliers (T, constraint equations of loops), N or N·m


def split_forces(model: Model, q: Array, wanted: Array) -> SplitForces:
    """Find motor torques, modal and loop forces that together are `wanted` (T, n_v), at q (T, n_q), SI."""
    tau, left, multipliers = driven_mechanism(model).split(q, wanted)
    return SplitForces(model.by_motor(tau), left, multipliers)


def motor_forces(model: Model, q: Array, wanted: Array) -> MotorForces:
    """Motor torques and modal forces that make `wanted` (T, n_v), N, N·m, N/√kg, at q (T, n_q), SI."""
    moments, left, _ = split_forces(model, q, wanted)
    stored = {node.body.name: left[:, node.p_v] @ node.body.on_file for node in model.tree.nodes}
    return MotorForces(moments, stored)


class FrameShare(NamedTuple):
    """Modal forces of a unit torque, 1 N·m, of a motor that turns frames, in addition to its torque along the joint.

    `direction` (n_v,), SI, and `slope` (n_v, n_v), its derivative along v, as the axis turns with the section.
    """

    direction: Array
    slope: Array


def frame_share(model: Model, joint: str, q: Array) -> FrameShare:
    """Modal forces per torque of a revolute joint's motor on its outer body at q (n_q,), SI: theory.md, Eq. 30."""
    tree = model.tree
    direction, slope = np.zeros(tree.n_v), np.zeros((tree.n_v, tree.n_v))
    node = tree.nodes[tree.carried[joint]]
    for section, side in ((node.outer, 1.0), (node.inner, -1.0)):
        if section.body >= 0 and section.point:
            of = tree.nodes[section.body]
            Phi_r, axis = of.body.points[section.point].rotation, side * section.triad[:, 2]
            phi = Phi_r @ q[of.p_q]
            direction[of.p_v] -= Phi_r.T @ left_jacobian(phi) @ axis
            slope[of.p_v, of.p_v] -= Phi_r.T @ left_jacobian_slope(phi, axis) @ Phi_r
    return FrameShare(direction, slope)


def turning_motors(model: Model) -> list[str]:
    """Names of joints whose one angle is between sections, but whose motors turn the frames of bodies."""
    if model.scene.motors != "frame":
        return []
    tree = model.tree
    return [
        joint.name
        for joint in model.scene.motor_joints
        if joint.units == ("rad",) and not tree.nodes[tree.carried[joint.name]].inner.still
    ]


def motor_commands(model: Model) -> Iterator[Command]:
    """Yield the effect of a unit command of each motor on the second side of its joint, in order of `Model.motors`."""
    turning = turning_motors(model)
    for joint, columns in model.motors.items():
        frame = (model.tree.carried[joint], model.sign(joint)) if joint in turning else None
        yield from (Command(direction, frame) for direction in model.sign(joint) * np.eye(model.tree.n_v)[columns])
