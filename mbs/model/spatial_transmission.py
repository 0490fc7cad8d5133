"""What sits in joints in space as they are built: friction along coordinates, and geared rotors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...common.arrays import Array
from ..joints.spatial.revolute import SpatialRevolute
from .spatial_accelerations import Accelerated
from .spatial_cut import cut_resistance
from .spatial_model import SpatialModel
from .spatial_tree import Motion, Node, Section, SpatialTree


class RotorMotion(NamedTuple):
    """Of a rotor with inertia J on the first side of a joint, behind a gear of ratio N, over states (T, …).

    Attributes:
        first, second: the joint's sides, the first of which carries it.
        ratio: N.
        inertia: J in kg·m².
        axis: z (T, 3) of both, global axes.
        spin: u = z·(N Ω_second − (N − 1) Ω_first), rad/s, (T,).
        torque: J u̇ (T,), N·m.
        gyroscopic: J u Ω_first × z (T, 3), N·m: with J u̇ z the rate of its angular momentum.
    """

    first: Section
    second: Section
    ratio: float
    inertia: float
    axis: Array
    spin: Array
    torque: Array
    gyroscopic: Array


def rotor(node: Node) -> tuple[float, float]:
    """Inertia J (kg·m²) of the rotor in the joint that carries a body, 0 without one, and its ratio N."""
    return float(getattr(node.joint, "rotor_inertia", 0.0)), float(getattr(node.joint, "gear_ratio", 1.0))


def compliance(node: Node) -> tuple[float, float] | None:
    """Stiffness (N·m/rad) and damping (N·m·s/rad) of the gear in the joint that carries a body; None of a firm one."""
    joint = node.joint
    return (joint.stiffness, joint.damping) if isinstance(joint, SpatialRevolute) and joint.stiffness else None


def rotor_mass(node: Node) -> float:
    """J N² in kg of the rotor in a prismatic joint, 0 without one; that the side it sits on turns is left out."""
    inertia, ratio = rotor(node)
    return inertia * ratio**2 if node.joint.type == "prismatic" else 0.0


def rotors(state: Accelerated) -> Iterator[RotorMotion]:
    """Of all rotors of a tree in revolute joints."""
    of_frames = None
    for node in state.tree.nodes:
        inertia, ratio = rotor(node)
        if not inertia or node.joint.type == "prismatic":
            continue
        of_frames = state.of_frames() if of_frames is None else of_frames
        first, second = (node.outer, node.inner) if node.backwards else (node.inner, node.outer)
        at = [state.tree.motion(section, state.q, state.frames) for section in (first, second)]
        Omega, Omega_dot = (
            [state.velocity(motion)[1] for motion in at],
            [state.of_section(section, of_frames).Omega for section in (first, second)],
        )
        z = at[0].F[:, :, 2]
        spin, rate = (np.sum(z * (ratio * x[1] - (ratio - 1) * x[0]), axis=1) for x in (Omega, Omega_dot))
        turning = inertia * spin[:, None] * np.cross(Omega[0], z)
        yield RotorMotion(first, second, ratio, inertia, z, spin, inertia * rate, turning)


def rotor_forces(state: Accelerated) -> Array:
    """Generalized forces (T, n_v) that the motion of all rotors takes."""
    found = np.zeros_like(state.v)
    for node in state.tree.nodes:
        if mass := rotor_mass(node):
            found[:, node.v] += mass * state.a[:, node.v]
    for one in rotors(state):
        on_second = one.ratio * one.torque[:, None] * one.axis
        on_first = one.gyroscopic - (one.ratio - 1) * one.torque[:, None] * one.axis
        for section, moment in ((one.first, on_first), (one.second, on_second)):
            L = state.tree.motion(section, state.q, state.frames).L
            found += np.einsum("tij,ti->tj", L[:, 3:], moment)
    return found


def resistance(model: SpatialModel, q: Array, v: Array, frames: Sequence[Motion] | None = None) -> Array:
    """Generalized forces (T, n_v) by which friction in all joints resists; what it dissipates is v times that.

    `frames` of q where known.
    """
    return tree_resistance(model.tree, v) + cut_resistance(model.tree, model.cut, q, v, frames)


def tree_resistance(tree: SpatialTree, v: Array) -> Array:
    """The same of the joints that have coordinates, along these."""
    found = np.zeros_like(v)
    for node in tree.nodes:
        for column, friction in zip(range(node.v.start, node.v.stop), node.joint.frictions, strict=False):
            found[:, column] = friction.resistance(v[:, column])
    return found


def tree_resistance_slope(tree: SpatialTree, v: Array) -> Array:
    """Its derivative (T, n_v) by v, coordinate by coordinate."""
    found = np.zeros_like(v)
    for node in tree.nodes:
        for column, friction in zip(range(node.v.start, node.v.stop), node.joint.frictions, strict=False):
            found[:, column] = friction.slope(v[:, column])
    return found


def gear_matrices(tree: SpatialTree) -> tuple[Array, Array]:
    """K and D (n_v, n_v) of gears that give, along v."""
    K, D = np.zeros((2, tree.n_v, tree.n_v))
    for gear in tree.gears:
        twist = np.zeros(tree.n_v)
        twist[gear.motor.v.start], twist[gear.joint.v.start] = 1.0, -gear.sign
        K += gear.stiffness * np.outer(twist, twist)
        D += gear.damping * np.outer(twist, twist)
    return K, D


def gear_forces(tree: SpatialTree, q: Array, v: Array) -> Array:
    """Of gears that give (T, n_v): k δ + c δ̇ on the second side of the joint, the opposite on the motor."""
    found = np.zeros_like(v)
    for gear in tree.gears:
        way, rate = gear.twist(q, v)
        moment = gear.stiffness * way + gear.damping * rate
        found[:, gear.motor.v.start] -= moment
        found[:, gear.joint.v.start] += gear.sign * moment
    return found


def gear_energy(tree: SpatialTree, q: Array, v: Array) -> tuple[Array, Array]:
    """½ k δ² (T,) J of all gears that give, and c δ̇² (T,) W that they dissipate."""
    strain, dissipated = np.zeros((2, len(q)))
    for gear in tree.gears:
        way, rate = gear.twist(q, v)
        strain += 0.5 * gear.stiffness * way**2
        dissipated += gear.damping * rate**2
    return strain, dissipated
