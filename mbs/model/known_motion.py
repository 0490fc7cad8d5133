"""Forces of known motions in 3D by the core's recursive Newton–Euler algorithm. SI units."""

from typing import NamedTuple, Protocol

import numpy as np

from ...common.arrays import Array
from ...common.structs import struct
from .. import _core
from .nodes import Section, rotor
from .system import MultibodySystem


class Wrench(NamedTuple):
    """Force (T, 3), N, and moment (T, 3), N·m, global axes."""

    force: Array
    moment: Array

    def seen_from(self, arm: Array) -> "Wrench":
        """The wrench about another point, from which the present one is at `arm` (T, 3), m, global axes."""
        return Wrench(self.force, self.moment + np.cross(arm, self.force))

    def plus(self, other: "Wrench") -> "Wrench":
        """The sum of two wrenches about one point."""
        return Wrench(self.force + other.force, self.moment + other.moment)


@struct
class State:
    """Positions q (n_q,) and velocities v (n_v,) of the tree: m, rad, √kg·m and these per s."""

    q: Array
    v: Array


class States(Protocol):
    """Protocol of states of a tree at T times."""

    @property
    def q(self) -> Array:
        """Coordinates q (T, n_q), rad, m and m·√kg."""

    @property
    def v(self) -> Array:
        """Velocities v (T, n_v), rad/s, m/s and m·√kg/s."""

    @property
    def a(self) -> Array:
        """Accelerations a (T, n_v), rad/s², m/s² and m·√kg/s²."""


class KnownStates(NamedTuple):
    """`States` that are known as arrays: q (T, n_q), v and a (T, n_v), SI units."""

    q: Array
    v: Array
    a: Array


class SectionMotion(NamedTuple):
    """Motion of a triad, each (T, 3), global axes."""

    a: Array  # acceleration, m/s²
    alpha: Array  # angular acceleration, rad/s²
    omega: Array  # angular velocity, rad/s


@struct
class MotionForces:
    """Forces (N) and moments (N·m) between bodies and in joints over states (T, …), SI units, global axes.

    Moments are about the origins of the sections on which they act: mbs/core/recursion/inverse/motion_forces.h.
    """

    system: MultibodySystem
    found: _core.MotionForces

    def of_rotor(self, number: int) -> Array:
        """The rate (T, 3), N·m, of the angular momentum of the rotor in the joint that carries body `number`."""
        return self.found.rotors[:, 3 * number : 3 * number + 3]

    def carried(self, q: Array) -> list[Wrench]:
        """Reactions, N and N·m, of joints about their outer sides, (T, 3), at q (T, n_q), SI.

        Forces that do work are left out: of motors, loads and friction along joint coordinates.
        """
        nodes, of_joints = self.system.model.tree.nodes, self.found.joints.copy()
        for number, node in enumerate(nodes):
            if node.backwards:  # a rotor sits on the outer side
                of_joints[:, 6 * number + 3 : 6 * number + 6] += self.of_rotor(number)
        table = self.system.core.without_work(q, of_joints)
        return [_wrench(table, number) for number in range(len(nodes))]

    def of_row(self, number: int) -> Wrench:
        """The wrench of constraint equation `number` on its section b; 0 for joint coordinates."""
        return _wrench(self.found.constraints, number)

    def on_sections(self, body: int) -> tuple[list[Section], Array]:
        """The sections of body no. `body`, and (T, 2 sections, 3) force and moment on each, with its joints'."""
        sections = self.system.sections
        numbers = [number for number, section in enumerate(sections) if section.body == body]
        first, end = numbers[0], numbers[-1] + 1
        return sections[first:end], self.found.sections[:, 6 * first : 6 * end].reshape(-1, 2 * (end - first), 3)

    def of_body(self, number: int) -> SectionMotion:
        """The accelerations of the frame of body no. `number`."""
        return _motion(self.found.bodies, number)

    def axes(self, number: int) -> Array:
        """The axes (T, 3, 3) of the frame of body no. `number`."""
        return self.found.axes[:, 9 * number : 9 * number + 9].reshape(-1, 3, 3)

    def of_point(self, point: str) -> SectionMotion:
        """The accelerations of the section "BODY.POINT", on which a drive of the system must act."""
        return _motion(self.found.points, self.system.point_number(point))


def _wrench(table: Array, number: int) -> Wrench:
    return Wrench(table[:, 6 * number : 6 * number + 3], table[:, 6 * number + 3 : 6 * number + 6])


def _motion(table: Array, number: int) -> SectionMotion:
    return SectionMotion(*(table[:, k : k + 3] for k in range(9 * number, 9 * number + 9, 3)))


def motion_forces(system: MultibodySystem, states: States, times: Array, multipliers: Array) -> MotionForces:
    """Forces of a motion under multipliers (T, rows), N or N·m, and all given forces at `times` (T,), s."""
    of_core = multipliers * system.model.row_signs
    forces = system.core.motion_forces(system.scene, times.tolist(), states.q, states.v, states.a, of_core)
    return MotionForces(system, forces)


def multiplier_forces(system: MultibodySystem, q: Array, times: Array, multipliers: Array) -> MotionForces:
    """Forces in joints and constraints by multipliers (T, rows) alone, at q (T, n_q) and `times` (T,), SI units."""
    forces = system.core.multiplier_forces(system.scene, times.tolist(), q, multipliers * system.model.row_signs)
    return MotionForces(system, forces)


def rotor_torques(system: MultibodySystem, states: States, times: Array) -> Array:
    """J u̇ (T, bodies), N·m, of the rotor in each body's inboard joint, u its speed, else 0; `times` (T,), s."""
    tree = system.model.tree
    forces = motion_forces(system, states, times, np.zeros((len(times), len(system.model.rows))))
    places, torque = tree.places(states.q), np.zeros((len(times), len(tree.nodes)))
    for number, node in enumerate(tree.nodes):
        if node.joint.type == "revolute":
            axis = places.at(node.inner).F[:, :, 2]
            torque[:, number] = np.sum(axis * forces.of_rotor(number), axis=1)
        elif node.joint.type == "prismatic":  # whose rotors feel no turn of their section
            J, N = rotor(node)
            torque[:, number] = J * N * node.sign * states.a[:, node.v.start]
    return torque


def required_forces(system: MultibodySystem, state: States, times: Array) -> Array:
    """M v̇ − Q (T, n_v), N, N·m, N/√kg, at `times` (T,), s; Q: gravity, elasticity, friction, given loads."""
    return system.core.required_forces(system.scene, times.tolist(), state.q, state.v, state.a)


def row_accelerations(system: MultibodySystem, state: States, times: Array) -> Array:
    """C̈ (T, rows), m/s² or rad/s², of constraints against their targets at `times` (T,), s."""
    of_core = system.core.row_accelerations(system.scene, times.tolist(), state.q, state.v, state.a)
    return of_core * system.model.row_signs


def mass_matrices(system: MultibodySystem, q: Array, t: float = 0.0) -> Array:
    """Mass matrices (T, n_v, n_v) at q (T, n_q), SI units, by forces of unit accelerations."""
    T, n = len(q), system.model.tree.n_v
    a = np.tile(np.vstack([np.zeros(n), np.eye(n)]), (T, 1))
    states = np.repeat(q, n + 1, axis=0), np.zeros((T * (n + 1), n)), a
    f = system.core.required_forces(system.scene, [t] * len(a), *states).reshape(T, n + 1, n)
    return np.swapaxes(f[:, 1:] - f[:, :1], 1, 2)
