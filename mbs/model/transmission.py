"""What sits in joints as they are built: friction along coordinates, and geared rotors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from ..joints.revolute import RevoluteJoint
from ..joints.twist_spring import TwistSpring
from .cut import cut_resistance
from .model import Model
from .tree import KinematicTree, Motion, Node


def rotor(node: Node) -> tuple[float, float]:
    """Inertia J (kg·m²) of the rotor in the joint that carries a body, 0 without one, and its ratio N."""
    return float(getattr(node.joint, "rotor_inertia", 0.0)), float(getattr(node.joint, "gear_ratio", 1.0))


def compliance(node: Node) -> tuple[TwistSpring, float] | None:
    """Spring and damping (N·m·s/rad) of the gear in the joint that carries a body; None of a rigid one."""
    joint = node.joint
    if not isinstance(joint, RevoluteJoint) or joint.stiffness is None:
        return None
    return TwistSpring.of(joint.stiffness), joint.damping


def resistance(model: Model, q: Array, v: Array, frames: Sequence[Motion] | None = None) -> Array:
    """Generalized forces (T, n_v) by which friction in all joints resists; what it dissipates is v times that.

    `frames` of q where known.
    """
    return tree_resistance(model.tree, v) + cut_resistance(model.tree, model.cut, q, v, frames)


def tree_resistance(tree: KinematicTree, v: Array) -> Array:
    """The same of the joints that have coordinates, along these."""
    found = np.zeros_like(v)
    for node in tree.nodes:
        for column, friction in zip(range(node.v.start, node.v.stop), node.joint.frictions, strict=False):
            found[:, column] = friction.resistance(v[:, column])
    return found


def tree_resistance_slope(tree: KinematicTree, v: Array) -> Array:
    """Its derivative (T, n_v) by v, coordinate by coordinate."""
    found = np.zeros_like(v)
    for node in tree.nodes:
        for column, friction in zip(range(node.v.start, node.v.stop), node.joint.frictions, strict=False):
            found[:, column] = friction.slope(v[:, column])
    return found


def gear_matrices(tree: KinematicTree, q: Array) -> tuple[Array, Array]:
    """K and D (n_v, n_v) of compliant gears, along v, at q (n_q,)."""
    K, D = np.zeros((2, tree.n_v, tree.n_v))
    for gear in tree.gears:
        twist = np.zeros(tree.n_v)
        twist[gear.motor.v.start], twist[gear.joint.v.start] = 1.0, -gear.sign
        K += gear.spring.slope(gear.twist(q, np.zeros(tree.n_v))[0]) * np.outer(twist, twist)
        D += gear.damping * np.outer(twist, twist)
    return K, D


def gear_forces(tree: KinematicTree, q: Array, v: Array) -> Array:
    """Of compliant gears (T, n_v): k(δ) + c δ̇ on the second side of the joint, the opposite on the motor."""
    found = np.zeros_like(v)
    for gear in tree.gears:
        way, rate = gear.twist(q, v)
        moment = gear.spring.moment(way) + gear.damping * rate
        found[:, gear.motor.v.start] -= moment
        found[:, gear.joint.v.start] += gear.sign * moment
    return found
