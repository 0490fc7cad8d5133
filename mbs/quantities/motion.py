"""What is read off a motion: places of bodies and points, joint coordinates, forces of paths and motors, energies.

All arrays are over the output times (T, …), SI units, global axes unless a name says otherwise.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ...common.arrays import Array, as_floats
from ...common.rotations import quaternions
from ...common.structs import struct
from ..model.body import bent_section
from ..model.drives import Drives, PointDrive
from ..model.gears import compliance, with_compliance
from ..model.kinematics import Motion, Places
from ..model.known_motion import MotionForces, motion_forces, row_accelerations
from ..model.masses import turns_as_a_body
from ..model.model import Model, constraint_rates, constraint_values
from ..model.motors import MotorForces, path_forces
from ..model.nodes import Node, Section
from ..model.system import MultibodySystem
from ..model.tree import CutCoordinate, CutMotion
from ..posture.posture import mobility
from ..run.gears import Supplied, supplied_through_gears, with_motors
from ..run.outcome import GearMotion
from ..scene.space import SPACES, Space
from ..scene.trajectories import Trajectory

if TYPE_CHECKING:
    from scipy.interpolate import BSpline


@struct
class BodyMotion:
    """Motion of a body's frame and modes, one row per output, in global axes."""

    position: Array  # (T, d) R, m
    orientation: Array  # in the plane (T,) θ, rad; in 3D (T, 4) quaternions of continuous sign
    velocity: Array  # (T, d) m/s
    angular_velocity: Array  # in the plane (T,), in 3D (T, 3), rad/s
    # modal, modal_velocity: (T, n), in the modes of the modal body file; of planar bodies with fewer modes in the
    # coordinates of the equations
    modal: Array
    modal_velocity: Array

    @property
    def datasets(self) -> dict[str, Array]:
        """By their names in results files."""
        return _named(vars(self))

    def within(self, space: Space, angle: Array) -> BodyMotion:
        """Of a motion in 3D what `space` has of it; in the plane `angle` (T,) stands for the quaternions."""
        return replace(
            self,
            position=space.along(self.position),
            orientation=angle if space.is_plane else self.orientation,
            velocity=space.along(self.velocity),
            angular_velocity=space.about(self.angular_velocity),
        )


@struct
class PointMotion:
    """Motion of a point of a body: position (T, d) m, deflection Φ p (T, d) m in body axes.

    `orientation` (T, 4) of the section there in 3D, quaternions of continuous sign; None in the plane.
    """

    position: Array
    deflection: Array
    orientation: Array | None = None

    @property
    def datasets(self) -> dict[str, Array]:
        """By their names in results files."""
        return _named({key: values for key, values in vars(self).items() if values is not None})

    def within(self, space: Space) -> PointMotion:
        """Of a motion in 3D what `space` has of it."""
        turned = None if space.is_plane else self.orientation
        return PointMotion(space.along(self.position), space.along(self.deflection), turned)


def _named(found: dict[str, Array]) -> dict[str, Array]:
    """With an orientation as angle or quaternion."""
    kinds = {1: "angle", 2: "quaternion"}
    return {kinds[values.ndim] if key == "orientation" else key: values for key, values in found.items()}


@struct
class RobotMotion:
    """States q (T, n_q), v and a (T, n_v) of a model's tree, and multipliers (T, rows) of its rows, at `time` (T,).

    `required` (T, n_v): generalized forces that prescribed motion takes, of links that are held to a shape as well.
    `is_at_rest`: targets stand still, as in an equilibrium. `applied`: forces on points beside the scene's loads.
    `commanded`: moments (T, k) by joint that act along joints beside the scene's loads, N·m or N. `twists`: of
    compliant gears, by joint, where they are known.
    """

    model: Model
    time: Array
    q: Array
    v: Array
    a: Array
    multipliers: Array
    required: Array | None = None
    is_at_rest: bool = False
    applied: tuple[PointDrive, ...] = ()
    commanded: Mapping[str, Array] = field(default_factory=dict)
    twists: Mapping[str, BSpline] = field(default_factory=dict)

    @cached_property
    def places(self) -> Places:
        """Of frames and sections, and their velocities."""
        return self.model.tree.places(self.q, self.v)

    def frame(self, body: str) -> Motion:
        """Of the frame of a body."""
        return self.places.frame(self.model.tree.index[body])

    @cached_property
    def system(self) -> MultibodySystem:
        """Its equations, with drives on all points where payloads sit."""
        scene = self.model.scene
        payloads = (PointDrive(load.point, {}) for load in scene.payload if not turns_as_a_body(scene, load))
        return MultibodySystem(self.model, Drives(at_points=(*self.applied, *payloads)))

    @cached_property
    def forces(self) -> MotionForces:
        """What bodies and joints do to each other in it."""
        return motion_forces(self.system, self, self.time, self.multipliers)

    @cached_property
    def rows(self) -> tuple[Array, Array]:
        """C (T, rows) and C_v (T, rows, n_v)."""
        return constraint_values(self.model, self.q, self.time)

    @cached_property
    def cut(self) -> list[tuple[CutCoordinate, CutMotion]]:
        """Coordinates of joints at which loops are cut."""
        motions = self.model.along_cut.motions(self.q, self.v, self.time)
        return list(zip(self.model.cut, motions, strict=True))

    @cached_property
    def violation(self) -> Array:
        """(T, 3) of C, Ċ, C̈: the largest of all rows over 1 + that of q, v, a; of an equilibrium, C alone."""
        levels = [(self.rows[0], self.q)]
        if not self.is_at_rest:
            C_dot = constraint_rates(self.model, self.q, self.v, self.time)
            levels += [(C_dot, self.v), (row_accelerations(self.system, self, self.time), self.a)]
        off = np.zeros((len(self.time), 3))
        for k, (values, size) in enumerate(levels):
            off[:, k] = np.abs(values).max(axis=1, initial=0.0) / (1 + np.abs(size).max(axis=1, initial=0.0))
        return off

    @property
    def space(self) -> Space:
        """That of the scene."""
        return SPACES[self.model.scene.space]

    @property
    def points(self) -> dict[str, tuple[str, ...]]:
        """By body that is reported, in the scene's order: names of its sections."""
        return {body.name: tuple(self.node(body.name).body.points) for body in self.model.scene.body}

    def node(self, body: str) -> Node:
        """The node of a body."""
        return self.model.tree.nodes[self.model.tree.index[body]]

    def body(self, name: str) -> BodyMotion:
        """Of a body's frame and modes."""
        node, frame = self.node(name), self.frame(name)
        return BodyMotion(
            frame.r, continuous(quaternions(frame.F)), frame.velocity, frame.omega,
            RobotMotion.modal(self, name), self.v[:, node.p_v] @ node.body.modal_transform.T,
        )  # fmt: skip

    def modal(self, body: str) -> Array:
        """P (T, n) of a body, in the modes of its modal body file."""
        node = self.node(body)
        return as_floats(self.q[:, node.p_q] @ node.body.modal_transform.T)

    def modal_velocity(self, body: str) -> Array:
        """Rates (T, n) of the modes that a body has in the equations."""
        return self.v[:, self.node(body).p_v]

    def angle(self, body: str) -> Array:
        """θ (T,) of the frame of a body that moves in the plane, rad; turns of the joints before it count."""
        e = self.body(body).orientation
        angle = 2 * np.arctan2(e[:, 3], e[:, 0])
        found: Array = angle + 2 * np.pi * np.round((self._turned(body) - angle) / (2 * np.pi))
        return found

    def _turned(self, body: str) -> Array:
        """θ (T,) of the frame of a body of the tree that moves in the plane, rad: turns of joints and bent links."""
        node = self.node(body)
        coordinate = self.joint(node.joint.name)
        if node.joint.freedoms and coordinate is None:
            A = self.frame(body).F
            return np.unwrap(np.arctan2(A[:, 1, 0], A[:, 0, 0]))
        turn = node.joint.rpy[2] + np.zeros(len(self.time))
        if coordinate is not None and node.joint.units == ("rad",):
            turn += coordinate[0][:, 0]
        turn = (-turn if node.backwards else turn) + self._bent(node.inner) - self._bent(node.outer)
        return turn + (self._turned(self.model.tree.nodes[node.inner.body].body.name) if node.inner.body >= 0 else 0.0)

    def _bent(self, section: Section) -> Array | float:
        """By how much (T,) a section turns about z on its body, rad."""
        if section.body < 0 or not section.point:
            return 0.0
        node = self.model.tree.nodes[section.body]
        phi = bent_section(node.body, section.point, self.q[:, node.p_q]).phi
        found: Array = section.turned(phi[..., None])[:, 2, 0]
        return found

    def section(self, point: str) -> Motion:
        """Of the section "BODY.POINT"."""
        return self.places.at(self.model.tree.section(point))

    def point(self, point: str) -> PointMotion:
        """Of the section "BODY.POINT"."""
        found = self.section(point)
        turned = None if self.space.is_plane else continuous(quaternions(found.F))
        return PointMotion(found.r, self.deflection(point), turned)

    def place_and_rate(self, point: str) -> tuple[Array, Array]:
        """R (T, 3), m, of the section "BODY.POINT", and its velocity (T, 3), m/s."""
        section = self.section(point)
        return section.r, section.velocity

    def deflection(self, point: str) -> Array:
        """Φ p (T, 3), m, of the section "BODY.POINT" in the axes of its body."""
        body, _, label = point.partition(".")
        node = self.node(body)
        moved: Array = bent_section(node.body, label, self.q[:, node.p_q]).u
        return moved - node.body.points[label].position

    def joint(self, name: str) -> tuple[Array, Array] | None:
        """Coordinates, unwrapped, and rates (T, k) of a joint; None where it has none."""
        if of_cut := [motion for one, motion in self.cut if one.joint.name == name]:
            return np.array([one.coordinate for one in of_cut]).T, np.array([one.rate for one in of_cut]).T
        number = self.model.tree.carried.get(name)
        if number is None or not self.model.tree.nodes[number].joint.units:
            return None
        node = self.model.tree.nodes[number]
        rate = node.joint.coordinates(self.v[:, node.v])
        if node.backwards:
            rate = node.joint.rate_turned_around(node.joint.coordinates(self.q[:, node.q]), rate)
        return node.coordinates(self.q), rate

    def path_force(self, trajectory: str) -> Array:
        """−λ (T, m) of its rows: forces on the point, then moments on the section about global axes."""
        chosen = [k for k, row in enumerate(self.model.rows) if row.is_trajectory and row.owner == trajectory]
        return -self.multipliers[:, chosen]

    @cached_property
    def supplied(self) -> Array:
        """(T, n_v) what actuators supply along v: see `mbs.model.motors.path_forces`."""
        return (
            self.required if self.required is not None else path_forces(self.model, self.time, self.q, self.multipliers)
        )

    @property
    def followed(self) -> list[Trajectory]:
        """The trajectories that hold in it: all, or none."""
        held = {row.owner for row in self.model.rows if row.is_trajectory}
        return [trajectory for trajectory in self.model.scene.trajectory if trajectory.name in held]

    @property
    def is_prescribed(self) -> bool:
        """Whether trajectories hold in it, motors their angles, or all is given with the forces that it takes."""
        return any(row.is_trajectory for row in self.model.rows) or self.required is not None

    @cached_property
    def motor_forces(self) -> MotorForces | None:
        """Of `supplied`, behind compliant gears what motors must do there; None where nothing is prescribed."""
        return self._found_motor_forces()

    def _found_motor_forces(self) -> MotorForces | None:
        return None if self._supplied is None else self._supplied.forces

    @property
    def motor_moments(self) -> Mapping[str, Array]:
        """By joint (T, k), N·m or N: what motors do, or have to do in place of what is prescribed."""
        return self.commanded if self.motor_forces is None else self.motor_forces.moments

    @cached_property
    def _supplied(self) -> Supplied | None:
        if not self.is_prescribed or (self.space.is_plane and not self.motors_fit):
            return None
        return supplied_through_gears(self.model, self, self.time, self.supplied, self.twists or None)

    @cached_property
    def motors_fit(self) -> bool:
        """Whether there are as many as the mechanism has degrees of freedom with rigid links."""
        count = sum(map(len, self.model.motors.values()))
        return len(self.time) > 0 and count == mobility(self.model, self.q[0]).freedom

    @property
    def gears(self) -> Mapping[str, GearMotion]:
        """By joint, of inverse analyses and equilibria with compliant gears."""
        are_rigid = all(compliance(node) is None for node in self.model.tree.nodes)
        return {} if are_rigid or self._supplied is None else self._supplied.gears

    @cached_property
    def behind_gears(self) -> RobotMotion:
        """The same with motors as far ahead of compliant gears as they have to be; itself where gears give in it."""
        if not self.gears:
            return self
        model = with_compliance(self.model)
        q, v, a = with_motors(model, (self.q, self.v, self.a), self.gears)
        return RobotMotion(model, self.time, q, v, a, self.multipliers, applied=self.applied)

    def gear_moment(self, joint: str) -> Array | None:
        """What a compliant gear transmits to the second side of its joint (T,), N·m; else None."""
        if joint in self.gears:
            return self.gears[joint].gear_moment
        for gear in self.model.tree.gears:
            if gear.joint.joint.name == joint:
                way, rate = gear.twist(self.q, self.v)
                return gear.spring.moment(way) + gear.damping * rate
        return None

    def motor_motion(self, joint: str) -> tuple[Array, Array] | None:
        """Angle and rate (T,), rad, rad/s, of the motor behind a compliant gear, reduced to its joint; else None."""
        if joint in self.gears:
            return self.gears[joint].angle, self.gears[joint].rate
        for gear in self.model.tree.gears:
            if gear.joint.joint.name == joint:
                return self.q[:, gear.motor.q.start], self.v[:, gear.motor.v.start]
        return None


def continuous(e: Array) -> Array:
    """Quaternions (T, 4) with signs that do not jump, the first e0 ≥ 0."""
    flips = np.sum(e[1:] * e[:-1], axis=1) < 0
    signs: Array = np.where(np.cumsum(np.append(False, flips)) % 2, -1.0, 1.0)
    return e * signs[:, None]


@struct
class Energies:
    """Kinetic, strain and gravitational energy (T,) J, and the power (T,) W that modes, gears, friction dissipate.

    Compliant gears store energy, too, and their motors turn as they have to.
    """

    kinetic: Array
    strain: Array
    gravitational: Array
    dissipated_power: Array


@struct
class Momentum:
    """Linear (T, 3) kg·m/s, and angular about the global origin (T, 3) kg·m²/s."""

    linear: Array
    angular: Array


def totals(motion: RobotMotion) -> tuple[Energies, Momentum]:
    """Of all bodies and rotors."""
    motion = motion.behind_gears
    found = motion.system.core.states_totals(motion.system.scene, motion.q, motion.v)
    return Energies(*found[:, :4].T), Momentum(found[:, 4:7], found[:, 7:])
